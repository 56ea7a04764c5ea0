"""Orbits that errors of a map blur: scatter with a known size, what counts as one attractor, and
what errors leave without a type.
"""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import saltus as sl
from function_maps import FunctionMap, orbit_near
from saltus.analysis.attractors.attractor_set import AttractorSet
from saltus.analysis.attractors.find_attractors import find_attractors
from saltus.analysis.attractors.noisy import NARROW, ROOM, Noisy, apart, blurred
from saltus.analysis.basins.labels import OPEN, Settling, complete, settle
from saltus.analysis.basins.serial import found_data, found_from
from saltus.analysis.closed.capture import Neighbourhoods

WIDE = np.array([1.0])
SCALE = np.array([3.0, 1.0])


def bounded(z):
    """Numbers within [-1, 1] that the place decides as a generator would: no two places of a motion
    have related ones. Variance 1/2.
    """
    return np.sin(1e9 * z + 1.0)


def linear(slope, error, noise=1e-5) -> FunctionMap:
    """x -> slope x with errors of a given size at every iterate."""
    derivative = lambda z: np.full((len(z), 1, 1), slope)  # noqa: E731
    exact = FunctionMap(lambda z: slope * z, "x", derivative)
    return FunctionMap(lambda z: slope * z + error * bounded(z), "x", derivative, noise, exact)


def henon(error, noise=1e-5) -> FunctionMap:
    """(x, y) -> (1 - x^2 + y, 0.3 x), which has a 4-cycle, with errors in both states."""

    def image(z):
        return np.clip(np.stack([1 - z[:, 0] ** 2 + z[:, 1], 0.3 * z[:, 0]], axis=1), -1e3, 1e3)

    def derivative(z):
        one = np.ones(len(z))
        return np.stack(
            [np.stack([-2 * z[:, 0], one], axis=1), np.stack([0.3 * one, 0 * one], axis=1)], axis=1
        )

    exact = FunctionMap(image, "x y", derivative)
    return FunctionMap(
        lambda z: image(z) + error * bounded(z + z[:, ::-1]) * SCALE,
        "x y",
        derivative,
        noise,
        exact,
    )


def starts(count=12, size=1):
    return np.random.default_rng(2).uniform(-0.1, 0.1, (count, size))


@pytest.fixture(scope="module")
def cycle():
    """The exact 4-cycle."""
    exact = henon(0.0).exact_map
    found, _, _ = find_attractors(exact, starts(size=2), SCALE, 256)
    assert [orbit.period for orbit in found.orbits] == [4]
    return found.orbits[0]


@pytest.fixture(scope="module")
def searched():
    """A blurred map, what was found on it, and where the starts lead."""
    map_ = henon(1e-3)
    found, label, _ = find_attractors(map_, starts(size=2), SCALE, 256)
    return map_, found, label


# -- scatter ---------------------------------------------------------------------------------------
@pytest.mark.parametrize("slope", [0.0, 0.8, -0.9])
def test_the_scatter_of_a_linear_map_is_that_of_its_errors_added_up(slope):
    """x' = a x + e u with independent u of variance 1/2: the variance of x is e^2/2 / (1 - a^2)."""
    scatter = []
    for error in (1e-3, 4e-3):
        found, label, _ = find_attractors(linear(slope, error), starts(), WIDE, 256)
        assert [(one.kind, one.orbit.period) for one in found.sampled] == [("noisy_periodic", 1)]
        assert not found.orbits
        assert not found.astray
        assert set(label) == {0}
        scatter.append(found.sampled[0].scatter.item())
        assert scatter[-1] == pytest.approx(error * math.sqrt(0.5 / (1 - slope**2)), rel=0.1)
        assert scatter[-1] < found.sampled[0].stray <= error / (1 - abs(slope)) * (1 + 1e-9)
    assert scatter[1] / scatter[0] == pytest.approx(4.0, rel=0.15)


def test_a_blurred_cycle_has_the_period_and_the_points_of_the_exact_one(cycle, searched):
    _, found, label = searched
    (noisy,) = found.sampled
    assert not found.orbits
    assert set(label) == {0}
    np.testing.assert_allclose(noisy.points, cycle.points, atol=1e-13)
    assert noisy.orbit.multipliers == pytest.approx(cycle.multipliers, abs=1e-10)
    assert noisy.exponent == pytest.approx(math.log(abs(cycle.multipliers[0])) / 4)
    assert 1e-3 < noisy.stray < NARROW


def test_starts_are_labelled_by_it(cycle, searched):
    map_, found, _ = searched
    result = settle(map_, starts(200, 2), found, 512)
    assert set(result.label) == {0}
    # the check by an exact method knows it too
    exact = settle(map_.exact_map, starts(200, 2), found, 512)
    assert set(exact.label) == {0}
    assert np.abs(exact.end[:, None] - cycle.points).max(axis=2).min(axis=1).max() < 1e-4


def test_what_scouts_miss_is_found_by_the_post_pass():
    map_ = henon(1e-3)
    nothing = AttractorSet(Neighbourhoods.none(2))
    result = settle(map_, starts(40, 2), nothing, 256)
    assert set(result.label) == {OPEN}
    found = complete(map_, result, nothing, SCALE, 256, 1)
    assert [one.kind for one in found.sampled] == ["noisy_periodic"]
    assert set(result.label) == {0}


def test_the_starts_do_not_decide_the_scatter(searched):
    """But for the last bits of the orbit, which errors of this kind amplify: 4 runs of 4096 points
    tell the scatter to some per cent.
    """
    few, many = (
        find_attractors(henon(1e-3), starts(2, 2), SCALE, 256)[0].sampled[0],
        searched[1].sampled[0],
    )
    np.testing.assert_allclose(few.scatter, many.scatter, rtol=0.05)


def test_an_exact_map_is_never_noisy():
    """The same function, taken for exact: its motion is no orbit, and nothing is told of it."""
    blurred_ = henon(1e-3)
    plain = FunctionMap(blurred_._function, "x y", blurred_._derivative)
    found, label, _ = find_attractors(plain, starts(size=2), SCALE, 256)
    assert "noisy_periodic" not in [one.kind for one in found.sampled]
    assert not found.astray
    assert set(label) == {-1}


# -- phases ----------------------------------------------------------------------------------------
def noisy_cycle(orbit) -> Noisy:
    one = blurred(henon(1e-3), orbit, SCALE)
    assert one is not None
    return one


def test_only_the_right_order_of_the_points_is_on_it(cycle):
    one = noisy_cycle(cycle)
    iterates = np.tile(cycle.points, (16, 1))
    slip = np.concatenate([iterates[:30], iterates[31:]])
    backwards, jitter = (
        iterates[::-1],
        np.random.default_rng(1).uniform(-1, 1, iterates.shape) * one.size * one.stray,
    )
    shares = [
        one.share(each[None])[0]
        for each in (iterates, np.roll(iterates, 1, axis=0), iterates + jitter, slip, backwards)
    ]
    assert shares[:3] == [1.0, 1.0, 1.0]
    assert 0.4 < shares[3] < 0.6
    assert shares[4] < 0.6
    beside = iterates + 1.01 * ROOM * one.stray * one.size
    assert one.share(beside[None])[0] == 0.0
    assert one.share(np.full((1, 8, 2), np.nan))[0] == 0.0


def test_distances_are_those_at_the_best_of_all_shifts(cycle):
    runs = np.random.default_rng(3).normal(size=(5, 11, 2))
    slow = []
    for iterates in runs:
        shifts = [
            [(iterates[j] - cycle.points[(j + shift) % 4]) / SCALE for j in range(11)]
            for shift in range(4)
        ]
        slow.append(min(shifts, key=lambda rows: np.sum(np.square(rows))))
    np.testing.assert_allclose(apart(runs, cycle.points, SCALE), slow, rtol=1e-12)


# -- one attractor, or none ------------------------------------------------------------------------
def test_loops_that_errors_make_are_scatter_about_the_exact_orbit():
    """x' = -x/2 - e sign(x) goes between 2e and -2e for ever: an orbit of period 2, closed to
    rounding, where the exact one has 1.
    """
    error, derivative = 1e-3, lambda z: np.full((len(z), 1, 1), -0.5)
    exact = FunctionMap(lambda z: -0.5 * z, "x", derivative)
    map_ = FunctionMap(
        lambda z: -0.5 * z - error * np.where(z < 0, -1.0, 1.0), "x", derivative, 1e-5, exact
    )
    assert orbit_near(map_, np.array([2.1 * error]), 2, WIDE).period == 2
    found, label, _ = find_attractors(map_, starts(), WIDE, 256)
    assert [(one.kind, one.orbit.period) for one in found.sampled] == [("noisy_periodic", 1)]
    assert found.sampled[0].scatter.item() == pytest.approx(2 * error, rel=1e-3)
    assert not found.orbits
    assert set(label) == {0}


def test_an_orbit_that_errors_only_shift_stays_periodic():
    derivative = lambda z: np.full((len(z), 1, 1), 0.5)  # noqa: E731
    map_ = FunctionMap(
        lambda z: 0.5 * z + 1e-3,
        "x",
        derivative,
        1e-5,
        FunctionMap(lambda z: 0.5 * z, "x", derivative),
    )
    found, label, _ = find_attractors(map_, starts(), WIDE, 256)
    assert [orbit.period for orbit in found.orbits] == [1]
    assert not found.sampled
    assert found.orbits[0].points.item() == pytest.approx(2e-3)
    assert set(label) == {0}


def test_orbits_beside_a_noisy_one_become_it(cycle):
    """Labels that were given before follow."""
    elsewhere = FunctionMap(
        lambda z: 0.5 * z + 5.0, "x y", lambda z: np.tile(0.5 * np.eye(2), (len(z), 1, 1))
    )
    found = AttractorSet(Neighbourhoods.none(2))
    far = orbit_near(elsewhere, np.full(2, 9.9), 1, SCALE)
    found.add(henon(0.0).exact_map, cycle, SCALE)
    found.add(elsewhere, far, SCALE)
    found.add_sampled(noisy_cycle(cycle))
    assert found.orbits == [far]
    assert set(found.near.owners) == {0}
    assert [found.index(one) for one in (far, cycle, found.sampled[0])] == [0, 1, 1]
    found.add_sampled(noisy_cycle(cycle))
    assert len(found.sampled) == 1


def test_cells_that_have_a_label_keep_their_attractor_when_it_turns_out_to_be_noisy(cycle):
    far = replace(cycle, points=cycle.points + 9.0)
    before = AttractorSet(Neighbourhoods.none(2), [cycle, far])
    result = Settling.empty(4, 2)
    result.label[:], result.end[:] = [0, 1, OPEN, OPEN], [[0, 0], [0, 0], *starts(2, 2)]
    after = complete(henon(1e-3), result, before, SCALE, 256, 1)
    assert after.orbits == [far]
    assert result.label.tolist() == [1, 0, 1, 1]


def test_errors_that_carry_the_motion_too_far_leave_it_without_a_type():
    """0.02/(1 - 0.9) is a fifth of the range: no scatter about a point. What it would be, and how
    far it strays, is told.
    """
    found, label, _ = find_attractors(linear(0.9, 0.02), starts(), WIDE, 256)
    assert len(found) == 0
    assert set(label) == {-1}
    assert {stray.period for stray in found.astray} == {1}
    for stray in found.astray:
        assert NARROW < stray.distance <= 0.2


def test_a_store_keeps_it_to_the_last_bit(cycle):
    found = AttractorSet(Neighbourhoods.none(2))
    found.add_sampled(noisy_cycle(cycle))
    data = json.loads(json.dumps(found_data(found)))
    (again,), (one,) = found_from(data, 2).sampled, found.sampled
    assert isinstance(again, Noisy)
    for name in ("points", "scale", "size", "scatter"):
        assert getattr(again, name).tobytes() == getattr(one, name).tobytes(), name
    assert (again.kind, again.exponent, again.stray) == (one.kind, one.exponent, one.stray)
    assert again.orbit.multipliers.tobytes() == one.orbit.multipliers.tobytes()
    assert json.dumps(found_data(found_from(data, 2))) == json.dumps(data)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-8, 1e-10])
def test_loose_series_settle_to_the_orbits_of_the_exact_ones(tolerance):
    rig = sl.models.delangre(case="b", frequency="15 Hz")
    exact = sl.attractors(rig, [[1e-3, 0.0], [-1e-3, 0.1]])
    first = exact.isel(phase=0)
    near = np.column_stack([first.attractor_x, first.attractor_v]) * (1.0 + 1e-3)
    loose = sl.attractors(rig, near, method=sl.Taylor(tolerance=tolerance))
    assert (loose.basin >= 0).all()
    peak = loose.attractor_peak.values[loose.basin.values]
    assert peak == pytest.approx(exact.attractor_peak.values, rel=1e-2)
