"""Delay embedding: delays and dimensions of series whose states are known."""

import math

import numpy as np
import pytest

from saltus.analysis.recorded.embedding import (
    _nearest_allowed,
    cells_of,
    embed,
    false_neighbours,
    first_minimum,
    hardly_correlated,
    least_dimension,
    mutual_information,
)
from saltus.analysis.recorded.neighbours import NeighbourSearch, crowd_distance, follow

NOISE = np.random.default_rng(0).standard_normal(20_000)


def test_embedding():
    assert embed(np.arange(7.0), 3, 2).tolist() == [[0, 2, 4], [1, 3, 5], [2, 4, 6]]


def test_mutual_information_of_known_series():
    """A pair of normal variables of correlation r shares -ln(1 - r^2) / 2; cells lose a little of
    it, and find a little where none is.
    """
    smooth = np.empty_like(NOISE)
    smooth[0] = NOISE[0]
    for i in range(1, len(NOISE)):
        smooth[i] = 0.8 * smooth[i - 1] + 0.6 * NOISE[i]
    for lag in (1, 2, 3):
        exact = -0.5 * math.log(1 - 0.8 ** (2 * lag))
        assert mutual_information(*cells_of(smooth), lag) == pytest.approx(exact, abs=0.04)
    assert mutual_information(*cells_of(NOISE), 1) < 0.02


def test_the_delay_of_a_noisy_oscillation_is_a_quarter_of_a_turn():
    series = np.sin(2 * math.pi * np.arange(20_000) / 101.3) + 0.2 * NOISE
    assert 20 <= first_minimum(series) <= 31
    assert not hardly_correlated(series)
    assert hardly_correlated(NOISE)


@pytest.mark.parametrize(("frequencies", "least"), [((1.0,), 2), ((1.0, math.sqrt(2)), 4)])
def test_a_torus_needs_so_many_coordinates(frequencies, least):
    time = 0.1 * np.arange(8000)
    series = sum(np.sin(f * time + 0.3 * i) for i, f in enumerate(frequencies))
    assert least_dimension(series, 12, 60) == least


def test_noise_has_no_dimension():
    assert least_dimension(NOISE[:3000], 1, 10) == 10
    assert false_neighbours(NOISE[:3000], 3, 1, 10) > 0.2


def test_neighbours_that_part_at_a_known_rate():
    """x -> 2 x mod 1, unfolded on a circle: every distance doubles, but for the curvature of the
    circle.
    """
    x, angles = 0.1234567, []
    rng = np.random.default_rng(3)
    for _ in range(4000):
        x = (2 * x + 1e-14 * rng.random()) % 1.0
        angles.append(2 * math.pi * x)
    points = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    evolutions = follow(points, NeighbourSearch(1, 1e-6, 0.01, 5))
    assert np.abs(evolutions.growth - math.log(2)).max() < 1e-3
    assert len(evolutions.growth) == 3999
    # five times as far where nobody near is in the right direction
    assert 0.01 < evolutions.distance.max() <= 0.05
    assert evolutions.distance.min() >= 1e-6


def test_excluded_neighbours_and_those_too_close_are_not_taken():
    line = np.arange(200.0)[:, None]
    assert not len(follow(line, NeighbourSearch(1, 0.5, 3.0, 20)).growth)
    assert len(follow(line, NeighbourSearch(1, 0.5, 30.0, 20)).growth)
    twice = np.tile(np.arange(50.0), 4)[:, None]
    # copies of a point lie at distance 0
    assert follow(twice, NeighbourSearch(1, 0.5, 1.0, 5)).distance.min() == 1.0
    assert crowd_distance(NOISE[:2000, None], 1e-9, 5) < 0.1
    assert crowd_distance(line[:10], 1e-9, 5) == math.inf


@pytest.mark.parametrize("exclude", [0, 3, 40, 400])
def test_the_nearest_point_that_is_not_too_near_in_time(exclude):
    """Against all distances, on a slow walk: neighbours in time are nearer than any other."""
    points = np.random.default_rng(1).normal(size=(700, 2)).cumsum(axis=0)
    asked = np.arange(0, 700, 7)
    distance, place = _nearest_allowed(points, asked, exclude)
    every = np.linalg.norm(points[asked, None] - points, axis=2)
    every[np.abs(asked[:, None] - np.arange(700)) <= exclude] = np.inf
    np.testing.assert_allclose(distance, every.min(axis=1), rtol=1e-14)
    np.testing.assert_array_equal(place, np.where(np.isfinite(distance), every.argmin(axis=1), -1))
    assert np.isfinite(distance).all() == (exclude < 350)
