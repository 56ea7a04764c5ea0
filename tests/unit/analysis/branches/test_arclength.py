"""Pseudo-arclength on curves that are known."""

from __future__ import annotations

import numpy as np
import pytest

from saltus.analysis.branches.arclength import Arc, _Fronts, correct, follow


class Ellipses:
    """x**2 + (y/b)**2 = 1: closed curves with two folds over y."""

    def __init__(self, heights):
        self.heights = np.array(heights)
        self.scale = np.ones((len(heights), 2))

    def evaluate(self, z, rows):
        b = self.heights[rows]
        x, y = z.T
        value = x**2 + (y / b) ** 2 - 1
        return value[:, None], np.stack([2 * x, 2 * y / b**2], axis=1)[:, None]

    def accepted(self, z, rows):
        pass

    def alike(self, z, rows):
        return z[:, None]


def test_closed_curves_are_closed_whatever_their_size():
    curves = follow(
        Ellipses([1.0, 3.0]), np.array([[1.0, 0.0]] * 2), np.array([[0.0, 1.0]] * 2),
        {1: (-10, 10)}, 2000,
    )  # fmt: skip
    for curve, b in zip(curves, (1.0, 3.0), strict=True):
        z = np.array(curve.z)
        assert curve.end == "closed"
        np.testing.assert_allclose(z[:, 0] ** 2 + (z[:, 1] / b) ** 2, 1.0, atol=1e-12)
        assert z[:, 1].min() < -0.99 * b  # both folds were passed
        assert z[:, 1].max() > 0.99 * b
        assert curve.length[-1] == pytest.approx(np.sum(np.hypot(*np.diff(z, axis=0).T)))


class Waves(Ellipses):
    """x = cos s, y = sin s, p = cos 2s, where (-x, -y) means what (x, y) does: the curve is back
    after half of the circle.
    """

    def __init__(self):
        self.scale = np.ones((1, 3))

    def evaluate(self, z, rows):
        x, y, p = z.T
        value = np.stack([x**2 + y**2 - 1, x**2 - y**2 - p], axis=1)
        first, one = np.stack([2 * x, 2 * y, 0 * x], axis=1), np.ones_like(x)
        return value, np.stack([first, np.stack([2 * x, -2 * y, -one], axis=1)], axis=1)

    def alike(self, z, rows):
        return np.stack([z, z * [-1, -1, 1]], axis=1)


def test_a_curve_is_closed_at_what_means_its_start():
    """Its last point lies where it came by, not at the start."""
    start, along = np.array([[0.6, 0.8, -0.28]]), np.array([[-0.8, 0.6, -1.92]])
    (curve,) = follow(Waves(), start, along, {2: (-10, 10)}, 2000)
    assert curve.end == "closed"
    np.testing.assert_allclose(curve.z[-1], [-0.6, -0.8, -0.28], atol=1e-12)
    np.testing.assert_allclose(curve.tangent[-1], curve.tangent[0] * [-1, -1, 1], atol=1e-12)
    null = np.array(curve.derivative) @ np.array(curve.tangent)[..., None]
    np.testing.assert_allclose(null, 0.0, atol=1e-12)
    assert max(np.diff(curve.length)) < 0.2


class Circles(Ellipses):
    """x**2 + y**2 = r**2 for r = 1 and 2: two curves of one equation."""

    def evaluate(self, z, rows):
        square = (z**2).sum(axis=1)
        value, slope = (square - 1) * (square - 4), 2 * square - 5
        return value[:, None], (2 * slope[:, None] * z)[:, None]


def test_of_curves_that_begin_on_the_same_one_the_first_goes_on():
    """Two groups on one circle, begun in opposite directions too, and one on the other."""
    starts = np.array([[1.0, 0.0], [1.0, 0.0], [0.6, 0.8], [0.6, 0.8], [2.0, 0.0]])
    along = np.array([[0.0, 1.0], [0.0, -1.0], [0.8, -0.6], [-0.8, 0.6], [0.0, 1.0]])
    curves = follow(
        Circles([1.0] * 5), starts, along, {1: (-10, 10)}, 2000, group=np.array([0, 0, 1, 1, 2])
    )
    ends = [curve.end for curve in curves]
    assert "closed" in ends[:2]
    assert ends[2:] == ["met", "met", "closed"]
    assert all(len(curve.z) < 20 for curve in curves[2:4])


def test_curves_that_cross_a_start_are_not_taken_for_one():
    """The ellipse x**2 + (y/3)**2 = 1 passes (1, 0) upright; the other curve leaves it aslant."""

    class Crossing(Ellipses):
        def evaluate(self, z, rows):
            value, derivative = super().evaluate(z, rows)
            slanted = np.flatnonzero(rows > 1)
            value[slanted, 0] = z[slanted, 1] - (z[slanted, 0] - 1.0)
            derivative[slanted, 0] = [-1.0, 1.0]
            return value, derivative

    curves = follow(
        Crossing([3.0] * 4), np.array([[0.8, -1.8], [0.8, -1.8], [1.0, 0.0], [1.0, 0.0]]),
        np.array([[1.0, 4.0], [-1.0, -4.0], [1.0, 1.0], [-1.0, -1.0]]), {1: (-2, 10)}, 2000,
        group=np.array([0, 0, 1, 1]),
    )  # fmt: skip
    assert "met" not in [curve.end for curve in curves]


def test_a_last_step_that_is_foreseen_is_as_exact_as_one_that_is_checked():
    guess = np.stack([np.linspace(1.01, 1.5, 40), np.full(40, 0.1)], axis=1)
    normal, rows = np.array([[0.0, 1.0]] * 40), np.arange(40)
    each = [
        correct(Ellipses([1.0] * 40), guess, normal, rows, foresee=foresee)
        for foresee in (False, True)
    ]
    assert all(one.found.all() for one in each)
    np.testing.assert_allclose(each[1].z, each[0].z, rtol=1e-15)
    np.testing.assert_array_equal(each[1].evaluations, each[0].evaluations)
    assert np.abs(each[1].derivative - each[0].derivative).max() > 0  # that of the step before


def test_a_curve_ends_exactly_at_the_end_of_the_range():
    (curve,) = follow(
        Ellipses([1.0]), np.array([[1.0, 0.0]]), np.array([[0.0, 1.0]]), {1: (-0.5, 0.5)}, 2000
    )
    assert curve.end == "range"
    assert curve.z[-1][1] == 0.5
    assert curve.z[-1][0] == pytest.approx(np.sqrt(0.75), abs=1e-13)


def test_where_no_step_leads_on_the_curve_says_so():
    class Ending(Ellipses):
        def evaluate(self, z, rows):
            value, derivative = super().evaluate(z, rows)
            value[z[:, 1] > 0.3] = np.nan
            return value, derivative

    (curve,) = follow(
        Ending([1.0]), np.array([[1.0, 0.0]]), np.array([[0.0, 1.0]]), {1: (-2, 2)}, 2000
    )
    assert curve.end == "lost"
    assert 0.299 < curve.z[-1][1] <= 0.3


def test_the_corrector_stays_in_its_plane():
    point = correct(Ellipses([1.0]), np.array([[1.2, 0.1]]), np.array([[0.0, 1.0]]), np.array([0]))
    assert point.found.all()
    assert point.z[0, 1] == 0.1
    assert point.z[0, 0] == pytest.approx(np.sqrt(0.99), abs=1e-14)


def test_a_step_follows_the_cubic_through_the_last_two_points():
    """What it misses falls by 2^4 where the step is halved."""
    missed = []
    for length in (0.1, 0.05):
        fronts = _Fronts(Ellipses([1.0]), {}, [Arc()], length)
        c, s = np.cos(length), np.sin(length)
        fronts.z, fronts.tangent = np.array([[1.0, 0.0]]), np.array([[0.0, 1.0]])
        fronts.before = np.array([[[c, -s]], [[s, c]]])
        guess = fronts._predicted(np.array([0]))[0][0]
        missed.append(abs(np.hypot(*guess) - 1.0))
    assert missed[0] < 1e-4
    assert missed[0] / missed[1] == pytest.approx(16, rel=0.1)


class Imperfect(Ellipses):
    """y (x - y**2) = e: two curves, which all but cross at the origin."""

    def __init__(self, e):
        self.e, self.scale = e, np.ones((1, 2))

    def evaluate(self, z, rows):
        y, x = z.T
        value = y * (x - y**2) - self.e
        return value[:, None], np.stack([x - 3 * y**2, y], axis=1)[:, None]


@pytest.mark.parametrize("e", [1e-3, 1e-4, 1e-5, -1e-4])
@pytest.mark.parametrize("x", [1.0, 0.83, 0.71])
def test_a_branch_stays_on_its_side_of_a_broken_pitchfork(e, x):
    """From large y, where x = y**2, towards the origin: for e > 0 back by the axis y = 0."""
    y = np.roots([1, 0, -x, e])
    start = np.array([[y.real.max(), x]])
    (curve,) = follow(Imperfect(e), start, np.array([[0.0, -1.0]]), {1: (-1.0, 1.0)}, 4000)
    y, x = np.array(curve.z).T
    np.testing.assert_allclose(y * (x - y**2), e, atol=1e-12)
    assert curve.end == "range"
    if e > 0:
        assert (y > 0).all()  # it turns back at a fold
        assert x[-1] == 1.0
        assert y[-1] < 0.01
    else:
        assert x[-1] == -1.0
        assert 0 < y[-1] < 0.01
