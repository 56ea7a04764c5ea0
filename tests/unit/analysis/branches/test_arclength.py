"""Pseudo-arclength on curves that are known."""

from __future__ import annotations

import numpy as np
import pytest

from saltus.analysis.branches.arclength import correct, follow


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
