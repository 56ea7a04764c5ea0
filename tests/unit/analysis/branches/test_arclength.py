"""Pseudo-arclength on curves that are known."""

from __future__ import annotations

import numpy as np
import pytest

from saltus.analysis.branches.arclength import Curve, _Fronts, correct, follow


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
        fronts = _Fronts(Ellipses([1.0]), {}, [Curve()], length)
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
