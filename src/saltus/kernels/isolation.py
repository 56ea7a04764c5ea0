"""The first crossing of a gap inside a step, with certainty: every root is isolated by Bernstein
coefficients, and tangencies are told apart.

The fast path of the flow settles nine steps in ten with a quadratic bound, in all lanes at once.
What it can't settle comes here, one lane at a time. The gap is a polynomial ``q(x) = sum(q[k] *
x**k)`` on [0, 1], positive where the mode says it should be.

Descartes' rule for Bernstein coefficients: the number of roots in (0, 1) is the number V of sign
variations, or less by an even number; V = 0 and V = 1 are proofs. Else the extremum decides: above
the noise no crossing, below it two, within it a graze. (Lane & Riesenfeld, BIT 21 (1981); Farouki,
Computer Aided Geometric Design 29 (2012), section 4.)
"""

from __future__ import annotations

import numpy as np

from saltus.kernels.marks import kernel
from saltus.kernels.trigonometry import two_product

# Columns of the output of `first_crossing`: place of the crossing, the smallest minimum that was no
# crossing.
AT, MARGIN = range(2)
# Columns of a touch: place, guard.
TOUCH_AT, TOUCH_GUARD = range(2)
#: Rounding error of a sum of terms, in units of their sizes.
ROUNDING = 4.0 * 2.220446049250313e-16
#: Touches closer than this are one: a minimum within rounding is flat over about 1e-8 of the step.
SAME_TOUCH = 1.0e-6
#: A gap that is wider than this many rounding errors where a motion begins isn't there at zero.
BESIDE = 64.0
#: Most touches recorded in one step.
MOST_TOUCHES = 16
#: Halvings after which an interval counts as a touch: 2**-48 of a step is below its rounding error.
DEEPEST = 48


@kernel
def polynomial(q, degree, x):
    """Value of a polynomial (Horner)."""
    value = q[degree]
    for k in range(degree - 1, -1, -1):
        value = value * x + q[k]
    return value


@kernel
def slope(q, degree, x):
    """Derivative of a polynomial (Horner)."""
    value = degree * q[degree] if degree > 0 else 0.0
    for k in range(degree - 1, 0, -1):
        value = value * x + k * q[k]
    return value


@kernel
def is_exact_zero(q, degree, x):
    """True if q(x) = 0 and no operation of Horner's rule rounded: the only zero that a sum of
    doubles can prove (Dekker 1971).
    """
    value, exact = q[degree], True
    for k in range(degree - 1, -1, -1):
        product, rounded = two_product(value, x)
        total = product + q[k]
        part = total - product
        exact = exact and rounded == 0.0 and (product - (total - part)) + (q[k] - part) == 0.0
        value = total
    return exact and value == 0.0


@kernel
def variations(b, degree):
    """Sign variations of ``b[0..degree]``, zeros left out."""
    count, last = 0, 0.0
    for i in range(degree + 1):
        if b[i] != 0.0:
            if last * b[i] < 0.0:
                count += 1
            last = 1.0 if b[i] > 0.0 else -1.0
    return count


@kernel
def to_bernstein(q, degree, b):
    """Bernstein coefficients on [0, 1]: ``b_i = sum_k C(i,k)/C(n,k) q_k``, by repeated sums of
    scaled coefficients.
    """
    binomial = 1.0
    for k in range(degree + 1):
        b[k] = q[k] / binomial
        binomial = binomial * (degree - k) / (k + 1.0)
    for level in range(1, degree + 1):
        for i in range(degree, level - 1, -1):
            b[i] += b[i - 1]
    # the value at the end of the step, without the rounding of the sums
    b[degree] = polynomial(q, degree, 1.0)


@kernel
def halve(b, bounds, row, degree):
    """Split the interval of a row of Bernstein coefficients (de Casteljau): its right half is kept,
    its left half goes to the next row.
    """
    b[row + 1, 0] = b[row, 0]
    for level in range(1, degree + 1):
        for i in range(degree - level + 1):
            b[row, i] = 0.5 * (b[row, i] + b[row, i + 1])
        b[row + 1, level] = b[row, 0]
    middle = 0.5 * (bounds[row, 0] + bounds[row, 1])
    bounds[row + 1, 0], bounds[row + 1, 1] = bounds[row, 0], middle
    bounds[row, 0] = middle


@kernel
def refine(q, degree, low, high, falling):
    """The one root in [low, high] by Newton's method inside a shrinking bracket; ``falling``: q
    goes from + to -.
    """
    x = 0.5 * (low + high)
    for _ in range(100):
        value = polynomial(q, degree, x)
        if value == 0.0:
            return x
        if (value > 0.0) == falling:
            low = x
        else:
            high = x
        rate = slope(q, degree, x)
        new = x - value / rate if rate != 0.0 else low - 1.0
        if not (low < new < high):
            new = 0.5 * (low + high)
        if new == x or high - low <= 2.0e-16 * high:
            return new
        x = new
    return x


@kernel
def leading_sign(q, degree):
    """Sign of the first non-zero coefficient: the side to which a gap leaves its boundary (0: it
    stays).
    """
    for k in range(degree + 1):
        if q[k] != 0.0:
            return 1 if q[k] > 0.0 else -1
    return 0


@kernel
def is_rounding(q, degree, noise):
    """True if all terms together are noise: on [0, 1] the gap can't be told from zero."""
    total = 0.0
    for k in range(degree + 1):
        total += abs(q[k])
    return total <= noise


@kernel
def side_of_leaving(q, degree, known, noise):
    """Sign of a gap, ``x**known * q(x)``, where it can first be told from zero on [0, 1] (0:
    nowhere). Leading terms of the other sign are rounding, and made zero; of a gap that begins at
    zero so are those that are no more than noise.
    """
    side, x = 0, 2.0**-DEEPEST
    while side == 0 and x <= 1.0:
        value = polynomial(q, degree, x)
        for _ in range(known):
            value *= x
        if abs(value) > noise:
            side = 1 if value > 0.0 else -1
        x *= 2.0
    least = noise if known > 0 else 0.0
    for k in range(degree + 1):
        if side == 0 or q[k] * side > least:
            break
        q[k] = 0.0
    return side


@kernel
def turning_place(q, degree, low, high, rates):
    """The place in (low, high) where q' changes from - to +; leaves the coefficients of q' in
    `rates`.
    """
    for k in range(degree):
        rates[k] = (k + 1) * q[k + 1]
    return refine(rates, degree - 1, low, high, False)


@kernel
def rounding(q, degree, shifted, noise, x):
    """Rounding error of the gap at x: that at 0, and that of its Taylor terms."""
    total = 0.0
    for k in range(degree, -1, -1):
        total = total * x + abs(q[k])
    return noise + ROUNDING * total * (x if shifted else 1.0)


@kernel
def sign_beyond(b, degree, noise):
    """Sign of the first of ``b[0..degree]`` that is larger than the noise."""
    for i in range(degree + 1):
        if abs(b[i]) > noise:
            return 1 if b[i] > 0.0 else -1
    return 0


@kernel
def _note_touch(place, guard, touches, count):
    """Add a touch to the list, unless the neighbouring interval has just added it; return the new
    count.
    """
    again = (
        count > 0
        and touches[count - 1, TOUCH_GUARD] == guard
        and abs(touches[count - 1, TOUCH_AT] - place) < SAME_TOUCH
    )
    if count < MOST_TOUCHES and not again:
        touches[count, TOUCH_AT], touches[count, TOUCH_GUARD] = place, guard
        count += 1
    return count


@kernel
def without_start(q, degree, noise, touches, before, count):
    """Drop the first touch of a gap behind the first `before` ones on the list if the gap begins
    within rounding and doesn't leave it before: that is how a motion begins. Returns the touches
    left.
    """
    near = BESIDE * noise
    if count == before or abs(q[0]) > near:
        return count
    if abs(polynomial(q, degree, 0.5 * touches[before, TOUCH_AT])) > near:
        return count
    for j in range(before, count - 1):
        touches[j, TOUCH_AT], touches[j, TOUCH_GUARD] = (
            touches[j + 1, TOUCH_AT],
            touches[j + 1, TOUCH_GUARD],
        )
    return count - 1


@kernel
def lowest(b, degree):
    """The smallest of ``b[0..degree]``: a lower bound of the polynomial on its interval."""
    least = b[0]
    for i in range(1, degree + 1):
        least = min(least, b[i])
    return least


@kernel
def first_crossing(q, degree, shifted, noise, guard, b, bounds, rates, out, touches, count):
    """Isolate the first place in (0, 1) where q goes below zero.

    Parameters
    ----------
    q : float64[degree + 1]
        Coefficients; the first non-zero one is positive.
    degree : int
        Degree of q.
    shifted : bool
        Whether a root at 0 was divided out: the gap is then ``x * q(x)``, which matters for its
        depth.
    noise : float
        Rounding error of the gap's terms at 0. That of its Taylor terms is added; minima within
        both are undecided.
    guard : int
        Number that touches are noted under.
    b : float64[DEEPEST + 2, degree + 1]
        Work.
    bounds : float64[DEEPEST + 2, 2]
        Work.
    rates : float64[degree + 1]
        Work.
    out : float64[2]
        Receives AT and lowers MARGIN.
    touches : float64[MOST_TOUCHES, 2]
        Receives the minima within the noise that lie before the crossing, in order.
    count : int
        Touches that it holds already.

    Returns
    -------
    (bool, int)
        Whether q crosses, and the touches now held.
    """
    to_bernstein(q, degree, b[0])
    bounds[0, 0], bounds[0, 1] = 0.0, 1.0
    top = 0
    while top >= 0:
        low, high = bounds[top, 0], bounds[top, 1]
        changes = variations(b[top], degree)
        if changes == 1:
            out[AT] = refine(q, degree, low, high, True)
            return True, count
        for i in range(degree):
            rates[i] = b[top, i + 1] - b[top, i]
        turns, falls = variations(rates, degree - 1), leading_sign(rates, degree - 1) < 0
        if turns > 1 and lowest(b[top], degree) <= rounding(q, degree, shifted, noise, high):
            if top < DEEPEST:
                halve(b, bounds, top, degree)
                top += 1
                continue
            out[MARGIN] = 0.0
            count = _note_touch(low, guard, touches, count)
        elif turns == 1 and falls:
            place = turning_place(q, degree, low, high, rates)
            depth = polynomial(q, degree, place) * (place if shifted else 1.0)
            undecided = rounding(q, degree, shifted, noise, place)
            if depth < -undecided:
                out[AT] = refine(q, degree, low, place, True)
                return True, count
            out[MARGIN] = min(out[MARGIN], abs(depth))
            if depth <= undecided:
                count = _note_touch(place, guard, touches, count)
        # zero exactly where an interval was halved
        if high < 1.0 and abs(b[top, degree]) <= rounding(q, degree, shifted, noise, high):
            following = sign_beyond(b[top - 1], degree, rounding(q, degree, shifted, noise, high))
            if b[top, degree] == 0.0 and following < 0:
                out[AT] = high
                return True, count
            if following > 0:
                out[MARGIN] = min(out[MARGIN], abs(b[top, degree]))
                count = _note_touch(high, guard, touches, count)
        top -= 1
    return False, count


def work_arrays(degree):
    """Work arrays of :func:`first_crossing` for polynomials up to ``degree``: b, bounds, rates (in
    plain Python; kernels bring their own).
    """
    n = degree + 1
    return np.empty((DEEPEST + 2, n)), np.empty((DEEPEST + 2, 2)), np.empty(n)
