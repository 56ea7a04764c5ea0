"""Boundaries of every shape: of several states, curved, moving with time, with corners. Closed
forms for the flights between them.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import saltus as sl
from conformance.systems import EPS, contacts, pair, ring, walls

WALL = "x = amplitude*cos(2*pi*frequency*t)"


# -- a boundary of several states ------------------------------------------------------------------
def test_distance_of_two_bodies():
    """x1 - x2 = gap, approached at 2: a contact of half a period, omega^2 = 2 k; the relative
    velocity is turned round.
    """
    run = sl.simulate(
        pair.with_values(stop1=50.0, stop2=50.0, stiffness=1.0),
        (0.0, 1.0, 0.0, -1.0),
        t_end=6.0,
        samples=8,
    )
    into, out = contacts(run)
    assert (into.guard, into.time, into.velocity) == ("gap", 0.5, 2.0)
    assert out.time == pytest.approx(0.5 + math.pi / math.sqrt(2), abs=1e-15)
    assert out.velocity == pytest.approx(-2.0, abs=1e-14)
    end = 6.0 - out.time
    assert float(run.end_x1) == pytest.approx(0.5 - end, abs=1e-14)
    assert float(run.end_x1) == -float(run.end_x2)


@pytest.mark.parametrize("method", [sl.Taylor(), sl.Modal()], ids=repr)
def test_distance_of_two_bodies_over_many_contacts(method):
    """Bounded by springs, hundreds of contacts of three guards: energy is kept to rounding, no side
    is ever violated, and contacts lie on the levels of states to the bit.
    """
    values = dict(
        spring=4.0, stop1=0.3, stop2=0.4, gap=0.5, stiffness1=50.0, stiffness2=9.0, stiffness=20.0
    )
    run = sl.simulate(
        pair.with_values(**values), (0.0, 1.0, 0.1, -1.0), t_end=500.0, samples=4000, method=method
    )
    assert int(run.events) > 700
    energy = 0.5 * (run.v1**2 + run.v2**2) + 2.0 * (run.x1**2 + run.x2**2)
    for stretch, stiffness in (
        (run.x1 - 0.3, 50.0),
        (run.x2 - 0.4, 9.0),
        (run.x1 - run.x2 - 0.5, 20.0),
    ):
        energy = energy + 0.5 * stiffness * np.maximum(stretch, 0.0) ** 2
    assert float(np.abs(energy / energy[0] - 1).max()) < 1e-11
    assert int(run.mode_violations) == 0
    gaps = np.array(
        [run.contact_x1 - 0.3, run.contact_x1 - run.contact_x2 - 0.5, run.contact_x2 - 0.4]
    )
    rows = [["stop1", "gap", "stop2"].index(name) for name in run.contact_guard.values]
    residual = np.abs(gaps[rows, np.arange(len(rows))])
    assert residual[run.contact_guard.values != "gap"].max() == 0.0
    assert residual.max() < 8 * EPS


# -- a curved boundary -----------------------------------------------------------------------------
@pytest.mark.parametrize("offset", [0.0, 0.3, -0.9, 0.999, 1 - 1e-6, 1 - 1e-10])
def test_straight_through_a_circle(offset):
    """y = offset: in and out at x = -+ sqrt(1 - offset^2)."""
    run = sl.simulate(ring, (-2.0, offset, 1.0, 0.0), t_end=4.0, samples=4)
    into, out = contacts(run)
    half = math.sqrt((1 - offset) * (1 + offset))
    assert abs(into.time - (2 - half)) < 8 * EPS / half
    assert abs(out.time - (2 + half)) < 8 * EPS / half
    assert into.velocity == pytest.approx(-2 * half, rel=1e-14, abs=16 * EPS / half)


def test_wind_inside_a_circle():
    """A force that jumps at a curved boundary: from x = -1 at speed 1 with acceleration 1, x = 1 is
    reached after sqrt(5) - 1.
    """
    run = sl.simulate(ring.with_values(wind=1.0), (-2.0, 0.0, 1.0, 0.0), t_end=4.0, samples=4)
    assert [c.time for c in contacts(run)] == pytest.approx([1.0, math.sqrt(5.0)], abs=2e-15)
    assert float(run.end_x) == pytest.approx(1 + math.sqrt(5.0) * (4 - math.sqrt(5.0)), abs=4e-15)


def test_many_directions_through_a_circle():
    """500 straight flights from random points outside, some past the circle: in and out where a
    chord says, none for those that miss.
    """
    rng = np.random.default_rng(3)
    place, heading = rng.uniform(0, 2 * np.pi, 500), rng.uniform(-0.6, 0.6, 500)
    speed = 10.0 ** rng.uniform(-2, 3, 500)
    x, y = 2 * np.cos(place), 2 * np.sin(place)
    u, w = -speed * np.cos(place + heading), -speed * np.sin(place + heading)
    run = sl.simulate(ring, {"x": x, "y": y, "u": u, "w": w}, t_end=400.0, samples=2)
    for i in range(500):
        nearest, length = (
            -(x[i] * u[i] + y[i] * w[i]) / speed[i] ** 2,
            (x[i] * w[i] - y[i] * u[i]) / speed[i],
        )
        half = math.sqrt(max(1 - length**2, 0)) / speed[i]
        found = contacts(run, i)
        assert len(found) == (2 if half > 0 else 0), (i, length)
        if half:
            assert [c.time for c in found] == pytest.approx(
                [nearest - half, nearest + half], rel=1e-11
            )


# -- a moving boundary -----------------------------------------------------------------------------
@pytest.mark.parametrize("frequency", [1.0, 0.25, 3.0])
@pytest.mark.parametrize("place", [0.3, -0.1, 0.49])
def test_wall_that_moves_past_a_body_at_rest(place, frequency):
    """x = place meets amplitude cos(2 pi f t) at +- arccos(place / amplitude) in every period;
    nothing but the wall moves.
    """
    run = sl.simulate(walls.with_values(frequency=frequency), (place, 0.0), periods=5, samples=10)
    phase = math.acos(place / 0.5) / (2 * math.pi)
    wanted = np.sort([*(np.arange(5) + phase), *(np.arange(1, 6) - phase)]) / frequency
    found = [c for c in contacts(run) if c.guard == WALL]
    assert len(found) == 10
    worst = float(np.abs(np.array([c.time for c in found]) - wanted).max())
    assert worst < 1e-14 / frequency


def test_wall_that_moves_many_times_while_a_body_flies():
    """Flying at 0.05 through a wall that swings at 1 Hz: every meeting of line and cosine, counted
    on a fine grid, to rounding.
    """
    run = sl.simulate(walls, (-0.53, 0.05), t_end=22.0, samples=4)
    t = np.linspace(0, 22, 2_200_001)
    gap = -0.53 + 0.05 * t - 0.5 * np.cos(2 * np.pi * t)
    found = np.array([c.time for c in contacts(run) if c.guard == WALL])
    changes = np.flatnonzero(np.sign(gap[1:]) != np.sign(gap[:-1]))
    assert len(found) == len(changes)
    assert np.abs(found - t[changes]).max() < 1.1e-5
    worst = float(np.abs(-0.53 + 0.05 * found - 0.5 * np.cos(2 * np.pi * found)).max())
    assert worst < 1e-14


def _legs(system, start, t_end):
    """Meetings with the moving wall by an independent solver: DOP853 from leg to leg, each with its
    side fixed.
    """
    amplitude, stiffness, turn = (
        system.values["amplitude"],
        system.values["moving_stiffness"],
        2 * np.pi * system.values["frequency"],
    )
    t, y, side, times = 0.0, np.array(start), 1, []
    while t < t_end:

        def gap(s, z):
            return z[0] - amplitude * np.cos(turn * s)

        def field(s, z, side=side):
            return [z[1], -stiffness * gap(s, z) if side < 0 else 0.0]

        gap.terminal, gap.direction = True, side
        leg = solve_ivp(
            field, (t, t_end), y, method="DOP853", events=gap, rtol=1e-13, atol=1e-15, max_step=0.01
        )
        t, y, side = leg.t[-1], leg.y[:, -1], -side
        times += [t] if leg.status == 1 else []
    return times, y


def test_contact_with_a_moving_wall():
    """A spring behind the moving wall, several contacts: the same meetings and the same end as an
    independent solver's.
    """
    system = walls.with_values(moving_stiffness=400.0)
    run = sl.simulate(system, (-1.0, 1.0), t_end=1.5, samples=4)
    times, end = _legs(system, (-1.0, 1.0), 1.5)
    found = [c.time for c in contacts(run) if c.guard == WALL]
    assert len(found) == len(times) >= 2
    assert found == pytest.approx(times, abs=1e-10)
    assert (float(run.end_x), float(run.end_v)) == pytest.approx(tuple(end), abs=1e-9)


# -- boundaries with corners -----------------------------------------------------------------------
@pytest.mark.parametrize("speed", [1.0, -1.0, 0.37])
def test_abs_is_two_boundaries(speed):
    """|x| = width on either side, the corner at x = 0 in between: five crossings there and back,
    times as in the closed form.
    """
    values = dict(width=0.5, stiffness=0.0, amplitude=50.0, frequency=0.01)
    run = sl.simulate(
        walls.with_values(**values),
        (-math.copysign(1.0, speed), speed),
        t_end=2 / abs(speed),
        samples=4,
    )
    found = [(c.guard, c.direction, c.time) for c in contacts(run)]
    up = int(math.copysign(1, speed))
    wanted = [("width", -1, 0.5), ("x = 0", up, 1.0), ("width", 1, 1.5)]
    assert [(g, d) for g, d, _ in found] == [(g, d) for g, d, _ in wanted]
    assert [t for _, _, t in found] == pytest.approx(
        [t / abs(speed) for _, _, t in wanted], rel=4 * EPS
    )


def test_max_is_a_boundary():
    """A ceiling by max(x - ceiling, 0) with stiffness 9: met at 4, left pi / 3 later with the speed
    turned round.
    """
    run = sl.simulate(
        walls.with_values(ceiling_stiffness=9.0, amplitude=50.0, frequency=0.01),
        (3.0, 0.5),
        t_end=6.0,
        samples=4,
    )
    into, out = [c for c in contacts(run) if c.guard == "ceiling"]
    assert (into.time, into.velocity) == (2.0, 0.5)
    assert out.time == pytest.approx(2 + math.pi / 3, abs=2e-15)
    assert out.velocity == pytest.approx(-0.5, abs=4e-15)


@pytest.fixture(scope="module")
def three_deep():
    """Boundaries that ask about the side of the one before, a start, and where an independent
    solver with short steps gets in 2 s.
    """

    @sl.system(states="x v w u")
    def nested(t, x, v, w, u, *, k=3.0):
        a = sl.where(u > 0.1, 0.3, 0.2)
        b = sl.where(w > a * (1 + x), 0.25, 0.1)
        c = sl.where(v > b * (1 + w), 0.4, -0.3)
        return v, -k * x - sl.where(x > c * (1 + v), 2.0 * x, 0.0), v - w, x - u

    def plain(t, y):
        x, v, w, u = y.tolist()
        a = 0.3 if u > 0.1 else 0.2
        b = 0.25 if w > a * (1 + x) else 0.1
        c = 0.4 if v > b * (1 + w) else -0.3
        return v, -3.0 * x - (2.0 * x if x > c * (1 + v) else 0.0), v - w, x - u

    start = (0.1, 0.5, 0.3, -0.2)
    return (
        nested,
        start,
        solve_ivp(plain, (0, 2.0), start, method="DOP853", rtol=1e-10, atol=1e-12, max_step=2e-3).y[
            :, -1
        ],
    )


@pytest.mark.parametrize("method", [sl.Taylor(6), sl.ODE45(1e-9, 1e-11)])
def test_boundaries_that_depend_on_one_another_three_deep(three_deep, method):
    """The side of the last asks about the one before it, and so on."""
    nested, start, exact = three_deep
    run = sl.simulate(nested, start, t_end=2.0, method=method, samples=2)
    assert run.sizes["contact"] == 4
    np.testing.assert_allclose(
        [run[f"end_{name}"].item() for name in nested.states], exact, atol=1e-6
    )
