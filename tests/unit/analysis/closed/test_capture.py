"""Neighbourhoods that capture: what they hold really goes where they say, on maps whose basins are
known.
"""

import warnings

import numpy as np
import pytest

from function_maps import FunctionMap, orbit_near
from saltus.analysis.attractors.attractor_set import AttractorSet
from saltus.analysis.attractors.find_attractors import find_attractors
from saltus.analysis.basins.labels import settle
from saltus.analysis.closed.capture import (
    FEWEST,
    WORK,
    Neighbourhoods,
    _alike,
    neighbourhoods,
    sphere,
)
from saltus.analysis.closed.motions import ClosedMotion


def linear(matrix) -> FunctionMap:
    """x -> A x."""
    matrix = np.array(matrix, float)
    return FunctionMap(
        lambda z: z @ matrix.T,
        " ".join(f"x{i}" for i in range(len(matrix))),
        lambda z: np.broadcast_to(matrix, (len(z), *matrix.shape)),
    )


def cubic(a: float) -> FunctionMap:
    """x -> a x - x^3: odd, so its attractors come in twins."""
    return FunctionMap(lambda z: a * z - z**3, "x", lambda z: (a - 3 * z**2)[:, :, None])


def newton() -> FunctionMap:
    """Newton's method for z^3 = 1 in the plane: three superstable points whose basins
    are fractal.
    """

    def image(z):
        w = z[:, 0] + 1j * z[:, 1]
        w = w - (w**3 - 1) / (3 * w**2)
        return np.stack([w.real, w.imag], axis=1)

    def derivative(z):
        d = 2 * ((z[:, 0] + 1j * z[:, 1]) ** 3 - 1) / (3 * (z[:, 0] + 1j * z[:, 1]) ** 3)
        return np.stack(
            [np.stack([d.real, -d.imag], axis=1), np.stack([d.imag, d.real], axis=1)], axis=1
        )

    return FunctionMap(image, "x y", derivative)


def inside(near: Neighbourhoods, i: int, count: int, seed: int = 3) -> np.ndarray:
    """Random points of the i-th ellipsoid, uniform in it, float64[count, D]."""
    rng = np.random.default_rng(seed)
    size = near.centres.shape[1]
    ball = rng.standard_normal((count, size))
    ball *= (rng.random(count) ** (1 / size) / np.linalg.norm(ball, axis=1))[:, None]
    return near.centres[i] + ball @ np.linalg.inv(near.weights[i]).T


# -- the kernel ------------------------------------------------------------------------------------
@pytest.mark.parametrize("size", [1, 2, 3])
def test_kernel_against_a_plain_search(size):
    """Disjoint ellipsoids, 400 trajectories of 5 points: the first point inside any, and its owner;
    NaN lies in none.
    """
    rng = np.random.default_rng(size)
    centres = rng.uniform(-1, 1, (12, size))
    apart = np.abs(centres[:, None] - centres[None]).max(axis=2) + 9 * np.eye(12)
    weights = np.stack(
        [
            np.diag(rng.uniform(2, 9, size)) / apart.min() + 0.1 * rng.standard_normal((size, size))
            for _ in centres
        ]
    )
    near = Neighbourhoods.none(size).joined(Neighbourhoods(centres, weights, np.arange(12)))
    points = rng.uniform(-1.2, 1.2, (400, 5, size))
    points[::2, 3] = centres[rng.integers(0, 12, 200)] + 1e-4
    points[7, 2:] = np.nan
    distance = np.linalg.norm(
        np.einsum("mij,knmj->knmi", near.weights, points[:, :, None] - near.centres), axis=3
    )
    hit = (distance <= 1).any(axis=2)
    first = hit.argmax(axis=1)
    owner = near.owners[(distance[np.arange(400), first] <= 1).argmax(axis=1)]
    label, when = near.capture(points)
    assert hit.any(axis=1).sum() > 150
    np.testing.assert_array_equal(label, np.where(hit.any(axis=1), owner, -1))
    np.testing.assert_array_equal(when[label >= 0], first[label >= 0])


def test_the_edge_of_an_ellipsoid_is_where_its_weights_say():
    """A long ellipsoid across the first coordinate: points just inside and just
    outside its tips.
    """
    angle = 0.3
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    near = Neighbourhoods(
        np.array([[1.0, 2.0]]), (np.diag([1 / 5, 1 / 0.01]) @ turn.T)[None], np.array([4])
    )
    tip = np.array([1.0, 2.0]) + 5 * turn[:, 0] * np.array([1 - 1e-9, 1 + 1e-9])[:, None]
    label, _ = near.capture(tip[:, None, :])
    assert label.tolist() == [4, -1]


def test_nothing_captures_nothing():
    label, _ = Neighbourhoods.none(2).capture(np.zeros((3, 4, 2)))
    assert label.tolist() == [-1, -1, -1]


# -- what is verified ------------------------------------------------------------------------------
def test_a_linear_contraction_is_verified_at_the_largest_radius():
    map_ = linear([[0.5, 0.4], [-0.4, 0.5]])
    orbit = orbit_near(map_, np.array([0.1, 0.1]), 1, np.ones(2))
    near = neighbourhoods(map_, orbit, 0, np.ones(2))
    assert near.capture(np.array([[[0.15, 0.15]]]))[0].tolist() == [0]


@pytest.mark.parametrize("multiplier", [0.95, 0.99, 0.999, -0.9995])
def test_a_slow_attractor_has_a_neighbourhood_too(multiplier):
    """A linear map contracts everywhere, however slowly: its neighbourhood is limited by what is
    tried, not by the rate.
    """
    map_ = linear([[multiplier, 0.0], [0.0, 0.5]])
    orbit = orbit_near(map_, np.array([0.1, 0.1]), 1, np.ones(2))
    assert neighbourhoods(map_, orbit, 0, np.ones(2)).capture(np.array([[[1e-3, 1e-3]]]))[
        0
    ].tolist() == [0]


def test_a_strongly_sheared_contraction_is_verified():
    """It stretches by 20 before it contracts: the norm must be its own."""
    map_ = linear([[0.6, 20.0], [0.0, 0.6]])
    orbit = orbit_near(map_, np.array([0.1, 0.0]), 1, np.ones(2))
    near = neighbourhoods(map_, orbit, 0, np.ones(2))
    points = inside(near, 0, 500)
    assert np.ptp(points[:, 0]) > 1e-2
    for _ in range(200):
        points = points @ np.array([[0.6, 0.0], [20.0, 0.6]])
    assert np.abs(points).max() < 1e-12


@pytest.mark.parametrize(("size", "period"), [(20, 1), (20, 16), (40, 5)])
def test_of_many_states_a_neighbourhood_is_verified_within_a_budget(size, period):
    """Blocks that turn and contract, next to the unit circle: all returns, directions and points of
    the orbit would take 10 to 1000 times as many iterates.
    """
    rng = np.random.default_rng(2611)
    turn = 2 * np.pi / period
    block = 0.99 * np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    axes = np.linalg.qr(rng.normal(size=(size, size)))[0]
    matrix = axes @ np.kron(np.eye(size // 2), block) @ axes.T
    map_, most, sequences = linear(matrix), max(WORK / size**3, 4 * FEWEST * size * period), []
    plain = map_.sequences
    map_.sequences = lambda start, count: (
        sequences.append(len(start) * count),
        plain(start, count),
    )[1]
    orbit = ClosedMotion(np.zeros((period, size)), np.full(size, 0.99**period + 0j), 0.0)
    near = neighbourhoods(map_, orbit, 0, np.ones(size))
    assert max(sequences) <= most
    assert near.capture(1e-3 * axes[None, :1])[0].tolist() == [0]


class Touching(FunctionMap):
    """x -> A x, with a contact where |x| > 0.01: it changes nothing but the sequence."""

    def sequences(self, start, count):
        """See Map."""
        end, _ = super().sequences(start, count)
        return end, [np.full(int(abs(row[0]) > 0.01), 3) for row in start]


def test_a_neighbourhood_ends_where_the_contacts_change():
    plain = linear([[0.5, 0.0], [0.0, 0.5]])
    map_ = Touching(plain._function, "x y", plain._derivative)
    orbit = orbit_near(map_, np.array([0.1, 0.1]), 1, np.ones(2))
    edge = inside(neighbourhoods(map_, orbit, 0, np.ones(2)), 0, 2000)[:, 0]
    assert 0.002 < np.abs(edge).max() <= 0.01
    assert np.abs(inside(neighbourhoods(plain, orbit, 0, np.ones(2)), 0, 2000)[:, 0]).max() > 0.1


class TouchingInAWedge(FunctionMap):
    """x -> A x, with a contact farther than 0.01 from (0, 0) within 0.1 of one direction."""

    direction = 0.0

    def sequences(self, start, count):
        """See Map."""
        end, _ = super().sequences(start, count)
        turned = start @ np.array(
            [
                [np.cos(self.direction), -np.sin(self.direction)],
                [np.sin(self.direction), np.cos(self.direction)],
            ]
        )
        touches = (np.abs(np.arctan2(turned[:, 1], turned[:, 0])) < 0.1) & (
            np.linalg.norm(start, axis=1) > 0.01
        )
        return end, [np.full(int(touch), 3) for touch in touches]


@pytest.mark.parametrize("point", range(32))
def test_every_point_of_the_shell_is_followed(point):
    plain = linear([[0.5, 0.0], [0.0, 0.5]])
    map_ = TouchingInAWedge(plain._function, "x y", plain._derivative)
    map_.direction = point * np.pi / 16
    orbit = orbit_near(plain, np.array([0.1, 0.1]), 1, np.ones(2))
    edge = inside(neighbourhoods(map_, orbit, 0, np.ones(2)), 0, 500)
    assert 0.002 < np.linalg.norm(edge, axis=1).max() <= 0.01


def test_newton_s_map_every_point_of_a_neighbourhood_ends_on_its_root():
    map_, scale = newton(), np.array([4.0, 4.0])
    starts = np.random.default_rng(1).uniform(-2, 2, (100, 2))
    found, _, _ = find_attractors(map_, starts, scale, 500)
    assert len(found) == 3
    for i, owner in enumerate(found.near.owners):
        points = inside(found.near, i, 2000)
        assert np.ptp(points[:, 0]) > 0.1
        end = map_.launch(points, 60).advance(60)[:, -1]
        assert np.abs(end - found.orbits[owner].points[0]).max() < 1e-12


@pytest.mark.parametrize("a", [1.5, 2.1, 2.25, 2.29])
def test_twins_of_the_cubic_map_are_told_apart_point_by_point(a):
    """Periods 1, 2, 4, 8; the basins are laced into each other. Labels equal those of uncaptured
    runs, twins mirror each other.
    """
    map_, scale = cubic(a), np.array([3.0])
    starts = np.linspace(-1.49, 1.49, 2001)[:, None]
    starts = starts[np.abs(starts[:, 0]) > 1e-3]
    found, label, _ = find_attractors(map_, starts, scale, 2000)
    assert len(found) == 2
    assert found.orbits[0].period == found.orbits[1].period == {1.5: 1, 2.1: 2, 2.25: 4, 2.29: 8}[a]
    end = map_.launch(starts, 4000).advance(4000)[:, -1]
    distance = np.stack(
        [np.abs(orbit.points[:, 0] - end).min(axis=1) for orbit in found.orbits], axis=1
    )
    assert distance.min(axis=1).max() < 1e-9
    np.testing.assert_array_equal(label, distance.argmin(axis=1))
    np.testing.assert_array_equal(label, 1 - label[::-1])


def test_neighbourhoods_of_different_attractors_do_not_overlap():
    found, _, _ = find_attractors(
        cubic(2.29), np.random.default_rng(1).uniform(-1.5, 1.5, (200, 1)), np.array([3.0]), 2000
    )
    for i, owner in enumerate(found.near.owners):
        label, _ = Neighbourhoods(
            found.near.centres, found.near.weights, found.near.owners
        ).capture(inside(found.near, i, 500)[:, None, :])
        assert (label == owner).all()


# -- its parts -------------------------------------------------------------------------------------
def test_neighbourhoods_join_in_ascending_order_and_are_renumbered():
    one = Neighbourhoods(
        np.array([[3.0, 0.0], [5.0, 0.0]]), np.stack([np.eye(2)] * 2), np.array([0, 0])
    )
    both = one.joined(Neighbourhoods(np.array([[4.0, 1.0]]), 2 * np.eye(2)[None], np.array([1])))
    assert both.centres[:, 0].tolist() == [3.0, 4.0, 5.0]
    assert both.owners.tolist() == [0, 1, 0]
    assert both.weights[1, 0, 0] == 2.0
    assert both.renumbered(np.array([7, 6])).owners.tolist() == [7, 6, 7]


def test_alike_allows_a_contact_at_the_very_start_or_end_and_nothing_else():
    own = np.array([5, 3, 5, 7])
    assert _alike(
        [own, own[1:], own[:-1], np.array([7, 5, 3, 5, 7]), np.array([5, 3, 5, 7, 5])], own
    )
    assert not _alike([own, np.array([5, 5, 3, 7])], own)
    assert not _alike([np.array([5, 3, 5, 7, 3])], own)
    assert not _alike([np.array([5, 3, 5])[:2]], own)
    assert not _alike([np.zeros(0, int)], own)
    assert _alike([np.zeros(0, int)], np.zeros(0, int))
    assert not _alike([np.array([5])], np.zeros(0, int))


@pytest.mark.parametrize("size", [1, 2, 3, 4, 5, 6])
def test_shells_lie_on_the_unit_sphere_all_round_and_without_warnings(size):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        points = sphere(size)
    assert np.linalg.norm(points, axis=1) == pytest.approx(np.ones(len(points)), abs=1e-15)
    assert (points.min(axis=0) < -0.7).all()
    assert (points.max(axis=0) > 0.7).all()


def test_starts_that_escape_are_told_and_no_warning_is_given():
    """x -> 2.25 x - x^3: beyond sqrt(3.25) it runs away."""
    map_, scale = cubic(2.25), np.array([3.0])
    starts = np.array([[0.4], [-0.4], [1.9], [-5.0], [1e200]])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found, label, _ = find_attractors(map_, starts, scale, 500)
        result = settle(map_, starts, found, 500)
    assert label.tolist() == [1, 0, -1, -1, -1] or label.tolist() == [0, 1, -1, -1, -1]
    np.testing.assert_array_equal(result.label[:2], label[:2])
    assert result.label[2:].tolist() == [-1, -1, -1]
    assert result.periods[2:].tolist() == [-1, -1, -1]


def test_settling_takes_the_first_visit():
    """x -> x/2 from 1024: captured at the first iterate inside, whatever the size of the blocks."""
    map_ = linear([[0.5]])
    orbit = orbit_near(map_, np.array([0.1]), 1, np.array([1.0]))
    found = AttractorSet(
        Neighbourhoods(np.zeros((1, 1)), np.array([[[1.0]]]), np.array([0])), [orbit]
    )
    result = settle(map_, np.array([[1024.0], [1.5], [0.1], [-(2.0**20)]]), found, 100)
    assert result.label.tolist() == [0, 0, 0, 0]
    assert result.periods.tolist() == [10, 1, 1, 20]
    late = settle(map_, np.array([[1024.0], [2.0**20]]), found, 10)
    assert late.label.tolist() == [0, -5]  # -5: still open
    assert late.end[1, 0] == 1024.0


@pytest.mark.parametrize("factor", [1e-3, 1.0, 1e3])
def test_radii_of_other_values_are_tried_first_and_verified_too(factor):
    """Whatever radius is handed over, a start inside comes to the orbit; one that was right is
    found again, and one that was far too large is cut down.
    """
    scale = np.array([2.0])
    old, new = cubic(1.35), cubic(1.4)
    before, orbit = (orbit_near(map_, np.array([0.6]), 1, scale) for map_ in (old, new))
    like = neighbourhoods(old, before, 0, scale)
    given = Neighbourhoods(like.centres, like.weights / factor, like.owners)
    near = neighbourhoods(new, orbit, 0, scale, given)
    plain = neighbourhoods(new, orbit, 0, scale)
    ratio = float((plain.weights / near.weights).item())
    assert 0.45 * min(factor, 1.0) < ratio < 2.0 * min(factor, 1.0)
    inside = orbit.points[0] + np.linspace(-1.0, 1.0, 41)[:, None] / near.weights[0]
    ends = new.launch(inside, 400).advance(400)[:, -1]
    np.testing.assert_allclose(ends, np.broadcast_to(orbit.points[0], ends.shape), atol=1e-12)
