"""Periodic orbits by Newton's method, on maps whose orbits and multipliers have closed forms."""

import math

import numpy as np
import pytest

from function_maps import FunctionMap, attracts, orbit_near
from saltus.analysis.closed.motions import (
    ClosedMotion,
    from_smallest,
    least_period,
    orbit_distance,
    phase_distances,
    same,
)
from saltus.analysis.closed.orbits import find_orbits

UNIT = np.array([1.0, 1.0])


def henon(a: float, b: float = 0.3) -> FunctionMap:
    """(x, y) -> (1 - a x^2 + y, b x)."""

    def image(z):
        return np.stack([1 - a * z[:, 0] ** 2 + z[:, 1], b * z[:, 0]], axis=1)

    def derivative(z):
        one = np.ones(len(z))
        return np.stack(
            [np.stack([-2 * a * z[:, 0], one], axis=1), np.stack([b * one, 0 * one], axis=1)],
            axis=1,
        )

    return FunctionMap(image, "x y", derivative)


def logistic(r: float) -> FunctionMap:
    """x -> r x (1 - x)."""
    return FunctionMap(lambda z: r * z * (1 - z), "x", lambda z: (r * (1 - 2 * z))[:, :, None])


def affine(matrix, shift=(0.0, 0.0)) -> FunctionMap:
    """x -> A x + s."""
    matrix = np.array(matrix)
    return FunctionMap(
        lambda z: z @ matrix.T + shift,
        "x y",
        lambda z: np.broadcast_to(matrix, (len(z), *matrix.shape)),
    )


def test_fixed_point_and_multipliers_of_a_linear_contraction():
    """Eigenvalues of [[.5, .2], [-.1, .3]] are .4 +- .1j; the fixed point solves (1 - A) x = s."""
    matrix, shift = np.array([[0.5, 0.2], [-0.1, 0.3]]), np.array([1.0, 2.0])
    orbit = orbit_near(affine(matrix, shift), np.array([0.8, 0.3]), 1, 10 * UNIT)
    assert orbit.period == 1
    assert np.abs(orbit.points[0] - np.linalg.solve(np.eye(2) - matrix, shift)).max() < 1e-14
    # of a pair the upper one first
    assert orbit.multipliers == pytest.approx([0.4 + 0.1j, 0.4 - 0.1j], abs=1e-15)
    assert attracts(orbit)
    assert orbit.mismatch < 1e-15


def test_the_largest_multiplier_comes_first():
    orbit = orbit_near(affine(np.diag([0.2, -0.9])), np.array([0.1, 0.1]), 1, UNIT)
    assert orbit.multipliers == pytest.approx([-0.9, 0.2])


def test_a_saddle_is_not_stable():
    orbit = orbit_near(affine(np.diag([0.5, 1.1])), np.array([0.1, 0.1]), 1, UNIT)
    assert not attracts(orbit)
    assert np.abs(orbit.points).max() < 1e-15


def test_henon_two_cycle_in_closed_form():
    """x of the 2-cycle solves a^2 x^2 - a (1-b) x + (1-b)^2 - a = 0; the product of its multipliers
    is b^2.
    """
    a, b = 0.9, 0.3
    x = np.sort(np.roots([a * a, -a * (1 - b), (1 - b) ** 2 - a]).real)
    orbit = orbit_near(henon(a, b), np.array([x[1] + 0.01, b * x[0] - 0.01]), 2, UNIT)
    assert orbit.period == 2
    # the smallest x first, then as visited
    assert np.abs(orbit.points - np.stack([x, b * x[::-1]], axis=1)).max() < 1e-14
    trace = 4 * a * a * x[0] * x[1] + 2 * b
    assert sorted(orbit.multipliers.real) == pytest.approx(
        sorted(np.roots([1, -trace, b * b]).real), abs=1e-14
    )
    assert attracts(orbit)


def test_the_smallest_period_is_found_where_a_multiple_is_asked_for():
    two = orbit_near(henon(0.9), np.array([0.98, -0.06]), 2, UNIT)
    eight = orbit_near(henon(0.9), np.array([0.98, -0.06]), 8, UNIT)
    assert eight.period == 2
    assert same(two, eight, UNIT, 1e-12)


@pytest.mark.parametrize("r", [3.05, 3.2, 3.4])
def test_logistic_two_cycle_has_the_multiplier_of_the_textbook(r):
    """4 + 2 r - r^2."""
    root = math.sqrt((r - 3) * (r + 1))
    x = np.array([r + 1 - root, r + 1 + root]) / (2 * r)
    orbit = orbit_near(logistic(r), x[1:] + 1e-3, 2, np.array([1.0]))
    assert np.abs(orbit.points[:, 0] - x).max() < 1e-14
    assert orbit.multipliers[0] == pytest.approx(4 + 2 * r - r * r, abs=1e-12)


def test_superstable_point():
    orbit = orbit_near(logistic(2.0), np.array([0.51]), 1, np.array([1.0]))
    assert orbit.points[0, 0] == pytest.approx(0.5, abs=1e-12)
    assert abs(orbit.multipliers[0]) < 1e-11


def test_no_orbit_is_none():
    # a translation: 1 - M is singular
    assert orbit_near(affine(np.eye(2), (1.0, 0.0)), np.zeros(2), 1, UNIT) is None
    assert orbit_near(affine(np.diag([0.5, np.nan])), np.zeros(2), 1, UNIT) is None
    far = affine(0.5 * np.eye(2), (100.0, 0.0))
    assert orbit_near(far, np.zeros(2), 1, UNIT) is None  # its fixed point lies 200 ranges away


def test_same_orbits_whatever_their_first_point_and_twins_that_are_not():
    points = np.array([[-1.0, 0.2], [0.5, 0.1], [1.0, 0.0]])
    a, shifted, twin = (
        ClosedMotion(p, np.zeros(2) + 0j, 0.0)
        for p in (points, np.roll(points, 1, axis=0), -points)
    )
    assert same(a, shifted, UNIT, 1e-9)
    assert not same(a, twin, UNIT, 1e-9)  # of equal amplitude
    assert not same(a, ClosedMotion(points[:1], np.zeros(2) + 0j, 0.0), UNIT, 1e-9)


def test_an_orbit_of_an_inexact_map_does_not_depend_on_the_others_of_its_batch():
    """Errors that the place decides: means over other iterates would be others."""
    exact = FunctionMap(lambda z: 0.5 * z, "x", lambda z: np.full((len(z), 1, 1), 0.5))
    map_ = FunctionMap(
        lambda z: 0.5 * z + 1e-6 * np.sin(1e9 * z),
        "x",
        lambda z: np.full((len(z), 1, 1), 0.5),
        1e-5,
        exact,
    )
    start, scale = np.full((2, 1), 0.1), np.ones((2, 1))
    both = find_orbits(map_, start, np.array([1, 48]), scale, np.full(2, map_.noise))
    alone = find_orbits(map_, start[:1], np.array([1]), scale[:1], np.full(1, map_.noise))
    assert both.period[0] == alone.period[0] == 1
    assert both.points[0, 0] == alone.points[0, 0]


@pytest.mark.parametrize(("n", "least"), [(12, 1), (12, 3), (12, 4), (12, 12), (7, 7), (1, 1)])
def test_the_least_period_is_that_of_all_points(n, least):
    loop = np.random.default_rng(n + least).normal(size=(least, 2))
    points = np.tile(loop, (n // least, 1)) + 1e-9 * np.random.default_rng(1).normal(size=(n, 2))
    assert least_period(points[None], UNIT).tolist() == [least]
    assert from_smallest(points)[0, 0] == points[:, 0].min()


def test_one_point_that_comes_back_is_no_period():
    figure = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 0.0], [-1.0, 0.0]])
    assert least_period(figure[None], UNIT).tolist() == [4]


def test_the_distance_of_two_orbits_is_that_at_the_best_phase():
    p, scale = np.random.default_rng(5).normal(size=(5, 2)), np.array([2.0, 0.5])
    q = p + 0.01 * scale * np.array([[1, -1], [-1, 1], [1, 1], [0, 0], [-1, -1]])
    for shift in range(5):
        assert orbit_distance(p, np.roll(q, shift, axis=0), scale) == pytest.approx(0.01, rel=1e-12)
        assert phase_distances(p, np.roll(q, shift, axis=0), scale).argmin() == shift
    assert orbit_distance(p, q[::-1], scale) > 0.1
    assert orbit_distance(p, q[:4], scale) == np.inf
