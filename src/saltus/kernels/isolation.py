"""The first crossing of a gap inside a step, with certainty: every root isolated by Bernstein coefficients, tangencies told apart.

The fast path of the flow settles nine steps in ten with a quadratic bound, in all lanes at once. What it can't settle comes here, one
lane at a time. The gap is a polynomial ``q(x) = sum(q[k] * x**k)`` on [0, 1], positive where the mode says it should be.

Descartes' rule for Bernstein coefficients: the number of roots in (0, 1) is the number V of sign variations, or less by an even number;
V = 0 and V = 1 are proofs. Else the extremum decides: above the noise no crossing, below it two, within it a graze.
(Lane & Riesenfeld, BIT 21 (1981); Farouki, Computer Aided Geometric Design 29 (2012), section 4.)
"""

from __future__ import annotations

import numpy as np
from numba import njit

kernel = njit(nogil=True, error_model="numpy", _nrt=False)

# What `first_crossing` decides.
NO_CROSSING, CROSSES, TOUCHES, TOUCHES_WITHIN_NOISE, ALL_ZERO = range(5)
# Columns of its output: place of the crossing, of the touch, the smallest extremum that was no crossing.
AT, TOUCH_AT, MARGIN = range(3)
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
    """Bernstein coefficients on [0, 1]: ``b_i = sum_k C(i,k)/C(n,k) q_k``, by repeated sums of scaled coefficients."""
    binomial = 1.0
    for k in range(degree + 1):
        b[k] = q[k] / binomial
        binomial = binomial * (degree - k) / (k + 1.0)
    for level in range(1, degree + 1):
        for i in range(degree, level - 1, -1):
            b[i] += b[i - 1]


@kernel
def halve(b, row, degree):
    """Split the interval of one row of Bernstein coefficients (de Casteljau): its right half stays, its left half goes to the next row."""
    b[row + 1, 0] = b[row, 0]
    for level in range(1, degree + 1):
        for i in range(degree - level + 1):
            b[row, i] = 0.5 * (b[row, i] + b[row, i + 1])
        b[row + 1, level] = b[row, 0]


@kernel
def refine(q, degree, low, high, falling):
    """The one root in [low, high] by Newton's method inside a shrinking bracket; ``falling``: q goes from + to -."""
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
    """Sign of the first non-zero coefficient: the side to which a gap leaves its boundary (0: it stays)."""
    for k in range(degree + 1):
        if q[k] != 0.0:
            return 1 if q[k] > 0.0 else -1
    return 0


@kernel
def _touch(place, depth, out, outer):
    """Keep a touch that is no crossing; the first one wins."""
    if outer == NO_CROSSING:
        out[TOUCH_AT] = place
        outer = TOUCHES if depth == 0.0 else TOUCHES_WITHIN_NOISE
    out[MARGIN] = min(out[MARGIN], abs(depth))
    return outer


@kernel
def first_crossing(q, degree, shifted, noise, b, bounds, rates, out):
    """Isolate the first place in (0, 1) where q goes below zero.

    Parameters
    ----------
    q : float64[degree + 1]
        Coefficients; the first non-zero one is positive. Its last entry past ``degree`` isn't read.
    degree : int
        Degree of q.
    shifted : bool
        Whether a root at 0 was divided out: the gap is then ``x * q(x)``, which matters for its depth.
    noise : float
        Rounding error of the gap: extrema within it are undecided.
    b : float64[DEEPEST + 2, degree + 1]
        Work.
    bounds : float64[DEEPEST + 2, 2]
        Work.
    rates : float64[degree + 1]
        Work.
    out : float64[3]
        Receives AT, TOUCH_AT and lowers MARGIN.

    Returns
    -------
    (int, int)
        NO_CROSSING or CROSSES, and NO_CROSSING, TOUCHES or TOUCHES_WITHIN_NOISE for a touch before it.
    """
    touched = NO_CROSSING
    least = q[0]
    for k in range(1, degree + 1):
        least += min(q[k], 0.0)
    if least > noise:
        return NO_CROSSING, touched
    to_bernstein(q, degree, b[0])
    bounds[0, 0], bounds[0, 1] = 0.0, 1.0
    top = 0
    while top >= 0:
        low, high = bounds[top, 0], bounds[top, 1]
        changes = variations(b[top], degree)
        if changes == 1:
            out[AT] = refine(q, degree, low, high, True)
            return CROSSES, touched
        if changes >= 2:
            for i in range(degree):
                rates[i] = b[top, i + 1] - b[top, i]
            turns = variations(rates, degree - 1)
            if turns == 1:
                for k in range(degree):
                    rates[k] = (k + 1) * q[k + 1]
                rising = polynomial(rates, degree - 1, high) > 0.0
                place = refine(rates, degree - 1, low, high, not rising)
                depth = polynomial(q, degree, place) * (place if shifted else 1.0)
                if depth < -noise:
                    out[AT] = refine(q, degree, low, place, True)
                    return CROSSES, touched
                if depth <= noise:
                    touched = _touch(place, depth, out, touched)
                else:
                    out[MARGIN] = min(out[MARGIN], depth)
            elif top >= DEEPEST:
                touched = _touch(low, noise, out, touched)
            else:
                halve(b, top, degree)
                middle = 0.5 * (low + high)
                bounds[top, 0] = middle
                top += 1
                bounds[top, 0], bounds[top, 1] = low, middle
                continue
        if b[top, degree] == 0.0 and high < 1.0:  # a root exactly where an interval was halved
            if top > 0 and leading_sign(b[top - 1], degree) < 0:
                out[AT] = high
                return CROSSES, touched
            touched = _touch(high, 0.0, out, touched)
        top -= 1
    return NO_CROSSING, touched


def work_arrays(degree):
    """The work of :func:`first_crossing` for polynomials up to ``degree`` (plain Python; kernels allocate their own)."""
    n = degree + 1
    return np.empty((DEEPEST + 2, n)), np.empty((DEEPEST + 2, 2)), np.empty(n)
