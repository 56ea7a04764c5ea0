"""Rigid stops in the modal flow: closed forms, matrix exponentials, energy, and Taylor's method."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

import saltus as sl
from saltus.errors import SaltusWarning
from two_flows import FOLLOWS, runs, same_rows, structure, times


# -- beside Taylor's method ------------------------------------------------------------------------
@pytest.mark.parametrize("seed", range(20))
@pytest.mark.slow
def test_random_structures_meet_their_stops_as_by_taylor(seed):
    """Every row: impacts, rests, releases. Errors grow from contact to contact; by the tolerance it
    is asked that they grow no faster than by a third at each.
    """
    rng = np.random.default_rng(20261126 + seed)
    degrees, stops = int(rng.integers(1, 7)), int(rng.integers(1, 4))
    system = structure(rng, degrees, stops, soft=seed % 4 == 3, moving=seed % 3 == 2)
    modal, taylor = runs(system, np.zeros(2 * degrees), periods=10)
    assert str(modal.status.values) == str(taylor.status.values) == "ok"
    same = same_rows(modal, taylor, 2 * math.pi / system.values["w"])
    if same < 40:
        assert same == modal.sizes["contact"] == taylor.sizes["contact"]
        for name in system.states:
            assert float(modal[f"end_{name}"]) == pytest.approx(
                float(taylor[f"end_{name}"]), abs=1e-8
            )
        assert int(modal.events) == int(taylor.events)


@pytest.mark.parametrize("seed", range(8))
def test_bodies_that_strike_each_other_meet_as_by_taylor(seed):
    """Two bodies at a time; the velocities of both jump. Where two contacts cause each other's
    impacts at one instant rounding decides how many rows there are; those of a velocity that can be
    told are the same, before and after.
    """
    rng = np.random.default_rng(seed)
    system = structure(rng, 3, 2, pairs=True)
    period = 2 * math.pi / system.values["w"]
    strong = []
    for run in runs(system, np.zeros(6), periods=8):
        told = (run.contact_kind.values == "impact") & (np.abs(run.contact_velocity.values) > 1e-5)
        strong.append([run[f"contact_{name}"].values[told] for name in ("guard", "time")])
    count = min(len(strong[0][1]), 60)
    assert len(strong[0][1]) == len(strong[1][1]) or count == 60
    assert strong[0][0][:count].tolist() == strong[1][0][:count].tolist()
    apart = np.abs(strong[0][1][:count] - strong[1][1][:count]) / period
    assert (apart < 1e-11 * 1.3 ** np.arange(count)).all()


def test_starts_in_a_batch_give_the_bits_of_single_runs():
    system = structure(np.random.default_rng(5), 3, 2)
    starts = np.random.default_rng(6).normal(0, 0.001, (5, 6))
    many = sl.stroboscope(system, starts, 20, keep=1, progress=False, method=sl.Modal(), threads=2)
    for i in (0, 4):
        one = sl.stroboscope(system, starts[i], 20, keep=1, progress=False, method=sl.Modal())
        for name in system.states:
            assert many[name].values[i].tolist() == one[name].values.ravel().tolist()


def test_a_velocity_that_jumps_changes_the_side_of_a_damper():
    """A damper that acts in one direction only: at each impact its boundary, v = 0, is jumped.
    That boundary is a node in each flight, so flights below the rounding of the gap aren't told.
    """

    @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
    def damped(t, x, v, *, gap=0.2, restitution=0.7, w=0.4, c=0.4):
        pull = sl.cos(w * t) - x - c * sl.max(v, 0.0)
        return v, pull, sl.impact(x < gap, v, restitution=restitution)

    modal, taylor = runs(damped, (0.0, 0.0), periods=4)
    assert same_rows(modal, taylor, 2 * math.pi / 0.4) > 100
    crossings = times(modal, "crossing")
    assert set(times(modal, "impact")[:20]) <= set(crossings)
    for kind in ("hold", "release"):
        found, known = times(modal, kind), times(taylor, kind)
        assert len(found) == len(known) >= 3
        assert found == pytest.approx(known, abs=1e-6)


def test_impacts_from_both_sides_at_once_have_no_order():
    """Three equal masses on equal springs, thrown at each other: elastic ones may, others don't say
    what happens.
    """

    @sl.system(states="a b c u v w")
    def pinched(t, a, b, c, u, v, w, *, restitution=1.0, k=0.01):
        return (
            u, v, w, -k * a, -k * b, -k * c,
            sl.impact(a < b, u - v, restitution=restitution, inertia=(1.0, 1.0)),
            sl.impact(b < c, v - w, restitution=restitution, inertia=(1.0, 1.0)),
        )  # fmt: skip

    start = (-1.0, 0.0, 1.0, 1.0, 0.0, -1.0)
    modal, taylor = runs(pinched, start, t_end=2.0)
    assert str(modal.status.values) == "ok"
    assert same_rows(modal, taylor, 1.0) == taylor.sizes["contact"] == modal.sizes["contact"]
    assert float(modal.end_u) == pytest.approx(float(taylor.end_u), abs=1e-13)
    with pytest.warns(SaltusWarning, match="depends on which is taken first"):
        modal, taylor = runs(pinched.with_values(restitution=0.5), start, t_end=2.0)
    assert str(modal.status.values) == str(taylor.status.values) == "ambiguous_impact"
    clay = pinched.with_values(restitution=0.0)
    run = sl.simulate(clay, start, t_end=2.0, method=sl.Modal(), **FOLLOWS)
    assert str(run.status.values) == "ok"
    ends = [float(run[f"end_{name}"]) for name in clay.states]
    assert ends == pytest.approx([0.0] * 6, abs=1e-13), "they go on as one, at rest"


# -- closed forms ----------------------------------------------------------------------------------
@sl.system(states="x v")
def ball(t, x, v, *, gravity=9.81, restitution=0.5, floor=0.0, spring=0.3):
    return v, -gravity - spring * (x - floor), sl.impact(x > floor, -v, restitution=restitution)


@pytest.mark.parametrize("restitution", [0.0, 0.1, 0.5, 0.8, 0.9, 0.99])
@pytest.mark.parametrize("floor", [0.0, 3.0])
def test_a_ball_on_a_spring_comes_to_rest_at_the_exact_time(restitution, floor):
    """A flight that begins at v lasts 2/w atan(v w/g); the next one begins at e v."""
    w, g = math.sqrt(0.3), 9.81
    fall = math.acos(1 / (1 + 10 * w**2 / g)) / w
    speed = (10 + g / w**2) * w * math.sin(w * fall)
    flights = [2 / w * math.atan(speed * restitution**n * w / g) for n in range(1, 4000)]
    end = fall + math.fsum(flights)
    system = ball.with_values(restitution=restitution, floor=floor)
    run = sl.simulate(system, (10.0 + floor, 0.0), t_end=1.2 * end, method=sl.Modal(), **FOLLOWS)
    assert times(run, "impact")[0] == pytest.approx(fall, rel=1e-14)
    assert run.contact_velocity.values[0] == pytest.approx(-speed, rel=1e-14)
    assert times(run, "hold") == pytest.approx([end], rel=1e-13)
    assert (float(run.end_x), float(run.end_v), str(run.status.values)) == (floor, 0.0, "ok")


@sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
def stop(t, x, v, *, gap=0.2, restitution=0.6, damping=0.1, force=1.0, w=0.3):
    push = force * sl.cos(w * t)
    return v, push - damping * v - x, sl.impact(x < gap, v, restitution=restitution)


@pytest.mark.nojit
def test_chatter_rest_and_release_of_a_driven_stop():
    """x'' + 0.1 x' + x = cos 0.3 t, x <= 0.2, e = 0.6: the contact force vanishes at acos(0.2)/0.3;
    the other times by exact arcs (tests/conformance/test_laws.py). It rests at the start.
    """
    run = sl.simulate(stop, (0.2, 0.0), periods=2, samples=50, method=sl.Modal(), **FOLLOWS)
    period = 2 * math.pi / 0.3
    assert times(run, "release") == pytest.approx(
        [math.acos(0.2) / 0.3 + k * period for k in range(2)], rel=1e-14
    )
    assert times(run, "impact")[0] == pytest.approx(16.731266435103816, rel=1e-14)
    assert times(run, "hold")[0] == pytest.approx(20.0978528953867, rel=1e-13)
    assert run["x"].values.max() <= 0.2 + 1e-15
    held = (run["time"].values > 20.1) & (run["time"].values < times(run, "release")[1])
    assert set(run["x"].values.ravel()[held.ravel()]) == {0.2}


def test_a_stop_from_either_side_is_one_law():
    """The mirror image of a motion: the same times to the bit, the other stop."""
    both = [("x < gap", 1.0), ("x > -gap", -1.0)]

    def sided(sign):
        @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
        def one(t, x, v, *, gap=0.2, w=0.7):
            law = sl.impact(x < gap, v, restitution=0.7) if sign > 0 else sl.impact(
                x > -gap, -v, restitution=0.7
            )  # fmt: skip
            return v, sign * sl.cos(w * t) - x, law

        return sl.simulate(one, (0.0, 0.0), periods=20, method=sl.Modal(), **FOLLOWS)

    upper, lower = (sided(sign) for _, sign in both)
    assert upper.sizes["contact"] > 20
    assert upper.contact_time.values.tolist() == lower.contact_time.values.tolist()
    assert upper.contact_velocity.values.tolist() == (-lower.contact_velocity.values).tolist()


def test_an_elastic_structure_keeps_its_energy_over_ten_thousand_impacts():
    stiffness = np.array([[3.0, -1.0], [-1.0, 2.0]])

    @sl.system(states="x y v w")
    def pair(t, x, y, v, w, *, gap=0.3):
        return (
            v, w, -3.0 * x + y, x - 2.0 * y,
            sl.impact(x < gap, v, restitution=1.0), sl.impact(y > -gap, -w, restitution=1.0),
        )  # fmt: skip

    start = np.array([0.2, 0.1, 0.9, -0.7])
    run = sl.simulate(pair, start, t_end=14000.0, method=sl.Modal(), **FOLLOWS)

    def energy(z):
        return 0.5 * z[2:] @ z[2:] + 0.5 * z[:2] @ stiffness @ z[:2]

    assert int(run.events) > 10_000
    end = np.array([float(run[f"end_{name}"]) for name in pair.states])
    assert energy(end) == pytest.approx(energy(start), rel=1e-11)


def test_a_body_that_rests_is_a_constraint_to_the_others():
    """Three masses in a row, the first pressed onto its stop: the others move by the exponential of
    their own matrix, until the force of the stop vanishes.
    """
    stiffness = np.array([[300.0, -100.0, 0], [-100.0, 250.0, -80.0], [0, -80.0, 120.0]])

    @sl.system(states="x y z u v w")
    def row(t, x, y, z, u, v, w, *, press=2.0, c=0.05):
        rates = [
            -sum(float(stiffness[i, k]) * one for k, one in enumerate((x, y, z))) - c * rate
            for i, rate in enumerate((u, v, w))
        ]
        law = sl.impact(x > 0.01, -u, restitution=0.5)
        return u, v, w, rates[0] - press, rates[1], rates[2], law

    matrix = np.zeros((4, 4))
    matrix[:2, 2:], matrix[2:, 2:] = np.eye(2), -0.05 * np.eye(2)
    matrix[2:, :2] = -stiffness[1:, 1:]
    steady = np.linalg.solve(stiffness[1:, 1:], -stiffness[1:, 0] * 0.01)
    begun = np.array([0.01, -0.02, 1.5, 0.1])

    def moved(t):
        shift = np.array([*steady, 0.0, 0.0])
        return shift + expm(matrix * t) @ (begun - shift)

    def force(t):
        return 2.0 + stiffness[0] @ np.array([0.01, *moved(t)[:2]])

    grid = np.linspace(0.0, 1.0, 2001)
    first = int(np.flatnonzero([force(t) < 0 for t in grid])[0])
    leaves = brentq(force, grid[first - 1], grid[first], xtol=1e-15)
    start = (0.01, begun[0], begun[1], 0.0, begun[2], begun[3])
    run = sl.simulate(row, start, t_end=leaves + 1e-3, samples=40, method=sl.Modal(), **FOLLOWS)
    assert times(run, "release")[0] == pytest.approx(leaves, abs=1e-13)
    for k, t in enumerate(run["time"].values.ravel()):
        if t < leaves:
            seen = [float(run[name].values.ravel()[k]) for name in "yzvw"]
            assert seen == pytest.approx(moved(t).tolist(), abs=1e-13)
            assert float(run["x"].values.ravel()[k]) == 0.01


def test_what_modes_do_not_carry_is_moved_by_taylor():
    """Friction beside a stop."""

    @sl.system(states="x v")
    def rubbed(t, x, v, *, k=3.0):
        return v, -k * x - sl.friction(v, slip=0.1), sl.impact(x < 1, v, restitution=0.5)

    assert isinstance(sl.Modal().serving(rubbed), sl.Taylor)
    one, other = (
        sl.simulate(rubbed, (0.9, 0.0), t_end=3.0, method=method, **FOLLOWS)
        for method in (sl.Modal(), sl.Taylor())
    )
    assert float(one.end_x) == float(other.end_x)


@pytest.mark.parametrize("method", [pytest.param(sl.Modal(), marks=pytest.mark.nojit), sl.Taylor()])
@pytest.mark.parametrize("lack", [1e-5, 1e-7, 1e-9, 1e-11])
def test_a_flight_lower_than_rounding_where_a_stop_is_hardly_not_pressed(method, lack):
    """What presses a mass on a stop, c s^2 - lack near its least, is negative over 2 s0: the mass
    leaves there and is back after 4 s0, s0^2 = lack / c, up to a height of 27 lack^2 / (64 c).
    """
    rate = 2 * np.pi * 1.5
    system = sl.structure(
        np.eye(2), np.diag([1.0, 900.0]), damping_ratio=0.01, modes=2, frequency=1.5,
        contacts=[sl.Contact("x1", gap=1.0, restitution=0.3, name="stop")],
        forces=[
            sl.Force("x1", 2.0, name="drive"), sl.Force("x1", 3.0 - lack, harmonic=0, name="dead")
        ],
    )  # fmt: skip
    run = sl.simulate(
        system, [1.0, 0.0, 0.0, 0.0], t_end=0.6, progress=False, method=method,
        time_errors="local",
    )  # fmt: skip
    curve = 0.5 * 2.0 * rate**2
    assert run.status.item() == "ok"
    kinds = list(run.contact_kind.values)
    assert kinds[0] == "release"
    assert kinds[1] == "impact" or lack == 1e-11  # too low to be told by modes: at rest at once
    away = run.contact_time.values[1] - run.contact_time.values[0]
    assert away == pytest.approx(4 * np.sqrt(lack / curve), rel=0.01) or kinds[1] == "hold"
    assert kinds[-1] == "hold"
