"""Root isolation: the first place in (0, 1) where a polynomial goes below zero, against all roots
of its derivative.
"""

from __future__ import annotations

from math import comb

import numpy as np
import pytest
from mpmath import mp
from numpy.polynomial.polynomial import polyval
from scipy.optimize import brentq

from saltus.kernels import isolation as iso

pytestmark = pytest.mark.nojit
EPS = 2.0**-52
DEGREE = 20


def crossing(q, noise=0.0, shifted=False):
    """(whether it crosses, where, places of the touches before, smallest minimum that was no
    crossing).
    """
    q = np.array(q, float)
    out, touches = np.full(2, np.inf), np.zeros((iso.MOST_TOUCHES, 2))
    crosses, count = iso.first_crossing(
        q, q.size - 1, shifted, noise, 3, *iso.work_arrays(q.size - 1), out, touches, 0
    )
    assert set(touches[:count, iso.TOUCH_GUARD]) <= {3.0}
    return crosses, out[iso.AT], touches[:count, iso.TOUCH_AT].tolist(), out[iso.MARGIN]


def from_roots(roots, scale=1.0):
    """Coefficients, lowest first, of scale * product (x - r)."""
    return scale * np.poly(roots)[::-1]


def truth(q):
    """First place in (0, 1) where q changes sign, and how close the decision was: q is monotone
    between the roots of its derivative.
    """
    polynomial = np.polynomial.Polynomial(q)
    turns = polynomial.deriv().roots()
    places = np.sort(
        np.concatenate(
            [
                [0.0],
                turns.real[(np.abs(turns.imag) < 1e-7) & (turns.real > 0) & (turns.real < 1)],
                [1.0],
            ]
        )
    )
    values = polynomial(places)
    size = np.sum(np.abs(q))
    if np.any(values < 0):
        k = int(np.argmax(values < 0))
        low, high = places[k - 1], places[k]
        with mp.workdps(40):
            exact = [mp.mpf(float(c)) for c in q]
            root = brentq(lambda x: float(polyval(mp.mpf(x), exact)), low, high, xtol=1e-16)
    else:
        root = None
    return root, np.min(np.abs(values)) / size


@pytest.mark.parametrize("seed", range(4))
def test_random_taylor_polynomials(seed):
    rng = np.random.default_rng(seed)
    found = {True: 0, False: 0}
    for _ in range(250):
        decay = rng.uniform(0.5, 1.6)
        q = rng.normal(size=DEGREE + 1) * decay ** np.arange(DEGREE + 1)
        q[0] = abs(q[0])
        root, clear = truth(q)
        if clear < 1e-10:
            continue
        crosses, at, touches, _ = crossing(q)
        assert crosses == (root is not None), q
        assert touches == []
        found[crosses] += 1
        if crosses:
            slope = abs(np.polynomial.Polynomial(q).deriv()(root))
            assert abs(at - root) < 8 * EPS * (np.sum(np.abs(q)) / slope + root)
    assert min(found.values()) > 30


def test_random_clusters_of_roots():
    rng = np.random.default_rng(11)
    for _ in range(300):
        roots = np.sort(rng.uniform(0.02, 1.0, rng.integers(1, 7)))
        q = from_roots(roots, scale=(-1.0) ** roots.size)
        if np.min(np.diff(np.append(roots, 2.0))) < 1e-3:
            continue
        crosses, at, _, _ = crossing(q)
        assert crosses
        slope = abs(np.polynomial.Polynomial(q).deriv()(roots[0]))
        assert abs(at - roots[0]) < 50 * EPS * np.sum(np.abs(q)) / slope


@pytest.mark.parametrize("place", [0.5, 0.25, 0.75, 0.375, 0.3, 0.1, 0.9999, 1e-3])
@pytest.mark.parametrize("depth", [1e-3, 1e-6, 1e-9, 1e-12])
def test_shallow_dips_are_crossings_and_near_misses_are_none(place, depth):
    """(x - place)^2 -/+ depth, also where an interval is halved."""
    half = np.sqrt(depth)
    if place > half:
        crosses, at, touches, _ = crossing([place**2 - depth, -2 * place, 1.0])
        assert (crosses, touches) == (True, [])
        assert abs(at - (place - half)) < 8 * EPS * place**2 / half
    crosses, _, touches, margin = crossing([place**2 + depth, -2 * place, 1.0])
    assert (crosses, touches) == (False, [])
    # larger ones may be cleared without a look at the extremum
    if depth < 0.01 * place * (1 - place):
        assert abs(margin - depth) < 8 * EPS


@pytest.mark.parametrize("degree", [3, 6, DEGREE])
def test_a_dip_beside_a_maximum_exactly_at_a_halving(degree):
    """There the slope rounds to either sign: minimum and maximum mustn't be told apart by it."""
    rng = np.random.default_rng(1)
    for _ in range(500):
        summit = rng.choice([0.5, 0.25, 0.75])
        place, depth = rng.uniform(0.02, summit - 0.05), 10.0 ** rng.uniform(-9, -2)
        if place < np.sqrt(depth):
            continue
        # the third root that puts the maximum there
        beyond = summit + ((summit - place) ** 2 - depth) / (2 * (summit - place))
        q = np.zeros(degree + 1)
        q[:4] = (
            -rng.uniform(0.5, 2.0)
            * np.polymul([1, -2 * place, place**2 - depth], [1, -beyond])[::-1]
        )
        crosses, at, _, _ = crossing(q)
        assert crosses
        assert abs(at - (place - np.sqrt(depth))) < 1e-4 * np.sqrt(depth)


@pytest.mark.parametrize("place", [0.5, 0.25, 0.125, 0.75, 0.3, 0.1, 0.7])
@pytest.mark.parametrize("multiplicity", [2, 4])
@pytest.mark.parametrize("degree", [4, DEGREE])
def test_tangencies_are_touches(place, multiplicity, degree):
    q = np.zeros(degree + 1)
    q[: multiplicity + 1] = from_roots([place] * multiplicity)
    flat = (64 * EPS) ** (1 / multiplicity)  # width over which it is zero to rounding
    crosses, at, touches, margin = crossing(q)
    if crosses:
        assert abs(at - place) < flat
        # next to a halving it may round to a crossing, which the flow calls unresolved
        assert place * 8 % 1 == 0
    else:
        assert len(touches) == 1 or (multiplicity == 4 and len(touches) < 4)
        assert np.max(np.abs(np.array(touches) - place)) < flat
        assert margin < 16 * EPS


@pytest.mark.parametrize("place", [0.5, 0.25, 0.75, 0.3, 0.9])
@pytest.mark.parametrize("multiplicity", [1, 3])
def test_roots_of_odd_multiplicity_are_crossings(place, multiplicity):
    """Also exactly where an interval is halved."""
    crosses, at, _, _ = crossing(from_roots([place] * multiplicity, scale=-1.0))
    assert crosses
    assert abs(at - place) < (16 * EPS) ** (1 / multiplicity)


@pytest.mark.parametrize(
    "roots",
    [
        [0.3, 0.3, 0.9],
        [0.1, 0.1, 0.7],
        [0.65, 0.65, 0.85],
        [0.25, 0.25, 0.75],
        [0.5, 0.5, 0.8],
        [0.5, 0.5, 0.75],
    ],
)
@pytest.mark.parametrize("degree", [3, DEGREE])
@pytest.mark.parametrize("beside", [0.0, 1e-16, 1e-12, 1e-9])
def test_a_touch_before_a_crossing_is_kept(roots, degree, beside):
    """A minimum within the noise is a touch; next to a halving it may round to a crossing there,
    which the flow calls unresolved.
    """
    place = roots[0] + beside
    q = np.zeros(degree + 1)
    q[:4] = from_roots([place, place, roots[2]], scale=-1.0)
    crosses, at, touches, _ = crossing(q)
    assert crosses
    if abs(at - place) > 1e-6:
        assert abs(at - roots[-1]) < 1e-13
        assert len(touches) == 1
        assert abs(touches[0] - place) < 1e-7
    else:
        assert place * 8 % 1 < 1e-7  # a halving


@pytest.mark.parametrize(
    "roots",
    [[0.5, 0.6, 0.7], [0.25, 0.5, 0.75], [0.4, 0.5, 0.5], [0.5, 0.75, 0.75], [0.2, 0.5, 0.50001]],
)
def test_the_first_of_several(roots):
    crosses, at, touches, _ = crossing(from_roots(roots, scale=-1.0))
    assert (crosses, touches) == (True, [])
    assert abs(at - roots[0]) < 1e-14


def test_a_root_at_the_end_is_left_to_the_next_step():
    assert not crossing([1.0, -1.0])[0]
    assert crossing([1.0, -1.0 - 1e-12])[0]


@pytest.mark.parametrize("place", [1e-3, 1e-9, 1e-15, 1e-200])
def test_a_root_next_to_the_start(place):
    crosses, at, _, _ = crossing([place, -1.0, 0.3, 0.1])
    assert crosses
    assert np.isclose(at, place, rtol=1e-3 if place == 1e-3 else 1e-8)


def test_the_depth_of_a_gap_whose_root_at_zero_was_divided_out():
    """Gap x ((x - 0.3)^2 +/- 1e-4): the margin is that of the gap at the quotient's minimum, not of
    the quotient.
    """
    _, _, _, margin = crossing([0.09 + 1e-4, -0.6, 1.0], shifted=True)
    assert np.isclose(margin, 0.3e-4, rtol=1e-6)
    crosses, at, _, _ = crossing([0.09 - 1e-4, -0.6, 1.0], shifted=True)
    assert crosses
    assert abs(at - 0.29) < 1e-14


def test_the_noise_is_what_the_caller_says_and_the_rounding_of_the_terms():
    dip = [0.09 - 1e-6, -0.6, 1.0]
    assert crossing(dip)[0]
    crosses, _, touches, margin = crossing(dip, noise=1e-5)
    assert not crosses
    assert np.allclose(touches, [0.3])
    assert np.isclose(margin, 1e-6)


def test_a_margin_is_only_ever_lowered():
    q, out = np.array([0.09 + 1e-4, -0.6, 1.0]), np.array([0.0, 1e-7])
    iso.first_crossing(
        q, 2, False, 0.0, 0, *iso.work_arrays(2), out, np.zeros((iso.MOST_TOUCHES, 2)), 0
    )
    assert out[iso.MARGIN] == 1e-7


def test_touches_that_are_held_already_stay():
    touches = np.zeros((iso.MOST_TOUCHES, 2))
    touches[0] = 0.9, 1.0
    crosses, count = iso.first_crossing(
        from_roots([0.3, 0.3]),
        2,
        False,
        1e-15,
        2,
        *iso.work_arrays(2),
        np.full(2, np.inf),
        touches,
        1,
    )
    assert (crosses, count) == (False, 2)
    assert touches[0].tolist() == [0.9, 1.0]
    assert abs(touches[1, iso.TOUCH_AT] - 0.3) < 1e-7


# -- parts -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("roots", "left"),
    [([1e-8, 1e-8, -1.0], []), ([0.3, 0.3, -1e-15], [0.3]), ([1e-6, 1e-6, -1.0], [1e-6])],
)
def test_a_dip_that_rounding_has_put_behind_a_start_is_no_touch(roots, left):
    """One that the gap leaves before is, and one of a gap that begins beside zero."""
    q = from_roots(roots)
    touches, noise = np.zeros((iso.MOST_TOUCHES, 2)), 1.2e-16
    touches[0] = 0.9, 1.0
    _, count = iso.first_crossing(
        q, 3, False, noise, 2, *iso.work_arrays(3), np.full(2, np.inf), touches, 1
    )
    assert count == 2
    count = iso.without_start(q, 3, noise, touches, 1, count)
    assert touches[:count, iso.TOUCH_AT].tolist() == pytest.approx([0.9, *left], abs=1e-7)


def test_bernstein_coefficients_and_halving():
    rng = np.random.default_rng(2)
    q = rng.normal(size=DEGREE + 1)
    rows, _, _ = iso.work_arrays(DEGREE)
    iso.to_bernstein(q, DEGREE, rows[0])
    direct = [
        sum(comb(i, k) / comb(DEGREE, k) * q[k] for k in range(i + 1)) for i in range(DEGREE + 1)
    ]
    assert np.allclose(rows[0], direct, rtol=0, atol=1e-13)
    bounds = np.array([[0.0, 1.0], [np.nan, np.nan]])
    iso.halve(rows, bounds, 0, DEGREE)
    assert bounds.tolist() == [[0.5, 1.0], [0.0, 0.5]]
    for row, place in ((1, lambda x: x / 2), (0, lambda x: (1 + x) / 2)):
        for x in (0.0, 0.2, 0.7, 1.0):
            value = sum(
                comb(DEGREE, i) * x**i * (1 - x) ** (DEGREE - i) * rows[row, i]
                for i in range(DEGREE + 1)
            )
            assert np.isclose(value, iso.polynomial(q, DEGREE, place(x)), rtol=0, atol=1e-12)


def test_value_and_slope():
    rng = np.random.default_rng(5)
    for degree in (0, 1, 2, 7):
        q = rng.normal(size=degree + 1)
        reference = np.polynomial.Polynomial(q)
        for x in (0.0, 0.3, 1.0):
            assert np.isclose(iso.polynomial(q, degree, x), reference(x), rtol=1e-14, atol=1e-15)
            assert np.isclose(iso.slope(q, degree, x), reference.deriv()(x), rtol=1e-14, atol=1e-15)


@pytest.mark.parametrize(
    ("values", "count"),
    [
        ([1, 2, 3], 0),
        ([1, -1], 1),
        ([1, 0, 0, -1], 1),
        ([1, 0, 2, -1, 0, 3], 2),
        ([0, 0, 0], 0),
        ([-0.0, 1, -1e-300, 1], 2),
    ],
)
def test_sign_variations(values, count):
    assert iso.variations(np.array(values, float), len(values) - 1) == count


@pytest.mark.parametrize(
    ("q", "sign"),
    [([2, -1], 1), ([0, -1, 5], -1), ([0, 0, 3], 1), ([0, 0, 0], 0), ([-0.0, 1e-320], 1)],
)
def test_leading_sign(q, sign):
    assert iso.leading_sign(np.array(q, float), len(q) - 1) == sign


@pytest.mark.parametrize("falling", [True, False])
def test_refine_stays_in_its_bracket(falling):
    sign = -1.0 if falling else 1.0
    q = sign * from_roots([0.1, 0.35, 0.6, 2.0])
    q = q if (np.polynomial.Polynomial(q)(0.3) > 0) == falling else -q
    assert abs(iso.refine(q, 4, 0.2, 0.5, falling) - 0.35) < 1e-14
    flat = sign * from_roots([0.35] * 3)
    assert abs(iso.refine(flat, 3, 0.0, 1.0, falling) - 0.35) < 1e-5
