"""Bifurcations between two points of curves that are known."""

from __future__ import annotations

import numpy as np
import pytest

from saltus.analysis.branches import special_points
from saltus.analysis.branches.arclength import CLOSED


class EllipsesAsOrbits:
    """(x/a)**2 + (y/b)**2 = 1 over y, with folds at (0, b), as orbits with the multiplier x - 1:
    period doublings are there too.
    """

    def __init__(self, axes):
        self.axes, self.scale = axes, np.ones((len(axes), 2))
        self.evaluated = 0

    def near(self, z, rows):
        self.axes, self.scale = self.axes[rows], self.scale[rows]
        return self

    def evaluate(self, z, rows):
        self.evaluated += len(z)
        shares = z / self.axes[rows]
        return (shares**2).sum(axis=1)[:, None] - 1, (2 * shares / self.axes[rows])[:, None]

    def multipliers(self, z, derivative, rows):
        return z[:, :1] - 1 + 0j


@pytest.mark.parametrize(("kind", "most"), [("fold", 7), ("period_doubling", 15)])
def test_bifurcations_are_located_to_rounding_by_few_evaluations(kind, most):
    random, number = np.random.default_rng(3111), special_points.KINDS.index(kind)
    axes, rows = random.uniform(0.5, 2.0, (30, 2)), np.arange(30)
    angle = 0.5 * np.pi + random.uniform(0.01, 0.08, (30, 2)) * [-1, 1]
    cosine, sine = np.cos(angle)[..., None], np.sin(angle)[..., None]
    z = axes[:, None] * np.concatenate([cosine, sine], axis=2)
    tangent = axes[:, None] * np.concatenate([-sine, cosine], axis=2)
    tangent /= np.linalg.norm(tangent, axis=2)[..., None]
    curves = EllipsesAsOrbits(axes)
    flat = z.reshape(-1, 2)
    values = special_points.tests(
        tangent.reshape(-1, 2), curves.evaluate(flat, np.repeat(rows, 2))[1],
        curves.multipliers(flat, None, None), 1,
    )[number].reshape(-1, 2)  # fmt: skip
    curves.evaluated = 0
    found = special_points.locate(curves, rows, z, tangent, np.full(30, number), values)
    assert curves.evaluated / 30 < most
    for event, (_, height) in zip(found, axes, strict=True):
        np.testing.assert_allclose(event.z, [0.0, height], rtol=0, atol=CLOSED)
        assert abs(event.tangent[1]) < 1e-14


class CrossingAsOrbits:
    """x arctan(slope (p - 0.0123)) = 0 over p: along x = 0 another branch crosses at 0.0123."""

    scale = np.ones((1, 2))

    def __init__(self, slope):
        self.slope = slope

    def near(self, z, rows):
        return self

    def evaluate(self, z, rows):
        x, p = z[:, 0], self.slope * (z[:, 1] - 0.0123)
        by_p = x * self.slope / (1.0 + p**2)
        return (x * np.arctan(p))[:, None], np.stack([np.arctan(p), by_p], axis=1)[:, None]

    def multipliers(self, z, derivative, rows):
        return derivative[:, 0, :1] + 10.0 + 0j


@pytest.mark.parametrize(("slope", "tries"), [(1.0, 1), (3e4, 2)])
def test_a_branch_point_is_looked_for_from_nearer_where_newtons_method_fails(
    monkeypatch, slope, tries
):
    """The arctangent throws Newton's method off from 1.4 over its slope on."""
    guesses, find = [], special_points._branch_point

    def branch_point(orbits, row, start, along):
        guesses.append(abs(start[1] - 0.0123))
        return find(orbits, row, start, along)

    monkeypatch.setattr(special_points, "_branch_point", branch_point)
    curves, z = CrossingAsOrbits(slope), np.array([[[0.0, -0.03], [0.0, 0.05]]])
    tangent = np.array([[[0.0, 1.0], [0.0, 1.0]]])
    number = np.array([special_points.KINDS.index("branch_point")])
    values = np.arctan(slope * (z[:, :, 1] - 0.0123))
    (event,) = special_points.locate(curves, np.zeros(1, int), z, tangent, number, values)
    np.testing.assert_allclose(event.z, [0.0, 0.0123], atol=1e-13)
    assert len(guesses) == tries


class MixedCrossings:
    """n equations A g(B z) = 0 whose first factor vanishes on two branches, which cross at a point
    that isn't a start: g_1 = y_1 (y_n - 0.02 - y_1 + y_1 y_2), g_i = y_i (2 + sin y_n) + y_1 y_i.
    """

    def __init__(self, random, n):
        self.left, self.right = random.normal(size=(n, n)), random.normal(size=(n + 1, n + 1))
        self.scale, self.evaluated = random.uniform(0.5, 2.0, (1, n + 1)), 0
        self.crossing = np.linalg.solve(self.right, np.append(np.zeros(n), 0.02))

    def evaluate(self, z, rows):
        self.evaluated += len(z)
        found, by = [], []
        for y in z @ self.right.T:
            first, second, last, n = y[0], y[1], y[-1], len(self.left)
            g, slopes = y[:-1] * (2.0 + np.sin(last) + first), np.zeros((n, n + 1))
            slopes[:, :n] = (2.0 + np.sin(last) + first) * np.eye(n)
            slopes[:, 0] += y[:-1]
            slopes[:, -1] = y[:-1] * np.cos(last)
            g[0] = first * (last - 0.02 - first + first * second)
            slopes[0] = 0.0
            slopes[0, [0, 1, -1]] = last - 0.02 - 2 * first * (1 - second), first**2, first
            found.append(self.left @ g)
            by.append(self.left @ slopes @ self.right * self.scale)
        return np.array(found), np.array(by)

    def multipliers(self, z, derivative, rows):
        return np.zeros((len(z), 1), complex)


@pytest.mark.parametrize("seed", range(5))
def test_a_branch_point_takes_few_evaluations_however_many_the_unknowns(seed):
    random = np.random.default_rng(seed)
    curves = MixedCrossings(random, 30)
    start = curves.crossing + 1e-3 * random.normal(size=31) * curves.scale[0]
    event = special_points._branch_point(curves, 0, start, random.normal(size=31))
    np.testing.assert_allclose(event.z, curves.crossing, atol=1e-11)
    assert curves.evaluated < 31
