"""Impacts and jumps of the state by every method but the default: closed forms, orders of
convergence, and how impacts that accumulate end.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import saltus as sl
from conformance.systems import ball_of_clay, cradle, pinched, thermostat, two_balls
from saltus.errors import ParameterError, SaltusWarning
from saltus.flow import engine
from saltus.flow.maps import Stroboscope

WAYS = ("henon", "inverse", "bisect")
MATLAB = (
    sl.ODE23(1e-8, 1e-11), sl.ODE45(1e-9, 1e-12), sl.ODE113(1e-9, 1e-12), sl.ODE15s(1e-8, 1e-11),
)  # fmt: skip
LOCATED = (*MATLAB, *(sl.RK4(2e-3, way) for way in WAYS))
NOT_LOCATED = (sl.RK4(2e-3, "ignore"), sl.ODE45(1e-9, 1e-12, events="ignore"))
located = pytest.mark.parametrize("method", LOCATED, ids=lambda one: one.label)
every = pytest.mark.parametrize("method", [*LOCATED, *NOT_LOCATED], ids=lambda one: one.label)


@sl.system(states="x v")
def ball(t, x, v, *, gravity=9.81, restitution=0.5):
    return v, -gravity, sl.impact(x > 0.0, -v, restitution=restitution)


def run(system, start, method, t_end, **more):
    return sl.simulate(system, start, t_end=t_end, method=method, time_errors="local", **more)


def times(found, kind):
    return found["contact_time"].values[found["contact_kind"].values == kind]


# -- both sides of an impact -----------------------------------------------------------------------
@pytest.mark.parametrize("method", [sl.Taylor(), *LOCATED, *NOT_LOCATED], ids=lambda one: one.label)
def test_a_contact_has_both_sides_of_a_jump(method):
    """The velocity behind an impact is that before it, times -0.5 to the last bit; the first is met
    at 2 m/s.
    """
    found = run(ball, (2.0 / 9.81, 0.0), method, 0.45)
    before, behind = found["contact_v_before"].values, found["contact_v"].values
    assert len(before) >= 2
    assert behind.tolist() == (-0.5 * before).tolist()
    off = 0.03 if method in NOT_LOCATED else 1e-6
    assert before[0] == pytest.approx(-2.0, abs=off)
    assert (found["contact_x_before"].values == found["contact_x"].values).all()


def test_a_jump_that_forgets_what_was_before_it():
    """x'' + x = 0 from (0, 2) meets x = 1 with the velocity sqrt(3), and again behind each turn."""

    @sl.system(states="x v hits")
    def thrown(t, x, v, hits):
        return v, -x, 0.0, sl.jump(x > 1, v=0.25, hits=hits + 1)

    found = run(thrown, (0.0, 2.0, 0.0), sl.Taylor(), 5.0)
    jumped = found["contact_kind"].values == "impact"
    assert found["contact_v_before"].values[jumped] == pytest.approx([3**0.5], rel=1e-14)
    assert found["contact_v"].values[jumped].tolist() == [0.25]
    assert found["contact_hits_before"].values[jumped].tolist() == [0.0]
    assert found["contact_hits"].values[jumped].tolist() == [1.0]


# -- orders ----------------------------------------------------------------------------------------
#: The oscillator's solution is no polynomial, so steps err; the ball's is a parabola.
STOP = sl.models.impact_oscillator()
TABLE = sl.models.bouncing_ball(amplitude=0.4, restitution=0.9, gravity=2.0)
RNG = np.random.default_rng(3)
STARTS = {
    STOP: RNG.uniform((-1.0, -1.0), (0.9, 1.0), (16, 2)),
    TABLE: RNG.uniform((3.0, -1.0), (6.0, 1.0), (16, 2)),
}


def ends(system, method):
    found = run(system, STARTS[system], method, 16.0, samples=1)
    assert (found["status"].values == "ok").all()
    assert found["events"].values.min() >= 2
    return np.stack([found["end_x"].values, found["end_v"].values], axis=1)


def errors(system, events, steps):
    """Geometric means over the starts."""
    exact = ends(system, sl.Taylor())
    return [
        np.exp(np.log(np.linalg.norm(ends(system, sl.RK4(h, events)) - exact, axis=1)).mean())
        for h in steps
    ]


@pytest.mark.parametrize(("events", "order"), [("ignore", 1.0), *((way, 4.0) for way in WAYS)])
def test_located_impacts_keep_order_4_and_others_fall_to_1(events, order):
    steps = 0.04 / 2.0 ** np.arange(5)
    off = errors(STOP, events, steps)
    assert abs(np.polyfit(np.log(steps), np.log(off), 1)[0] - order) < 0.2


def test_a_moving_table_is_met_where_it_is():
    """The parabola costs no error, so what is left is that of locating: the inverse cubic and
    bisection land on the table, a node is up to a step late.
    """
    steps = 0.02 / 2.0 ** np.arange(4)
    assert abs(np.polyfit(np.log(steps), np.log(errors(TABLE, "ignore", steps)), 1)[0] - 1) < 0.4
    for way in ("inverse", "bisect"):
        assert errors(TABLE, way, [0.01])[0] < 1e-11


def test_multipliers_come_to_the_exact_ones_with_order_4():
    """The tangent at an impact holds that of the jump and that of the time at which it happens."""

    def tangent(method):
        return Stroboscope(STOP, method).tangent(STARTS[STOP][:8], 1)[1]

    exact = tangent(sl.Taylor())
    for way in WAYS:
        off = [np.abs(tangent(sl.RK4(h, way)) - exact).max() for h in (0.02, 0.01)]
        assert 3.5 < np.log2(off[0] / off[1]) < 4.5
    assert np.abs(tangent(sl.ODE45(1e-9, 1e-12)) - exact).max() < 1e-5


@pytest.mark.nojit
@pytest.mark.parametrize(
    "method", [sl.RK4(0.01), sl.ODE45(1e-10, 1e-13)], ids=lambda one: one.label
)
def test_the_tangent_of_a_jump_into_another_law_is_the_slope_of_the_map(method):
    """Central differences of the ends: the force behind the jump isn't that before it."""

    @sl.system(states="x v")
    def carried(t, x, v):
        spring = sl.piecewise((5.0 * x, x < -1.0), otherwise=0.0)
        return v, -1.0 - spring, sl.jump(x < 0.5, x=x - 3.0, v=0.5 * v)

    start, step = np.array([2.0, 0.1]), 1e-4
    tangent = Stroboscope(carried, method, every=2.1).tangent(start[None], 1)[1][0]
    near = start + step * np.concatenate([np.eye(2), -np.eye(2)])
    found = run(carried, near, method, 2.1, samples=1)
    ends_near = np.stack([found["end_x"].values, found["end_v"].values], axis=1)
    slopes = (ends_near[:2] - ends_near[2:]).T / (2 * step)
    np.testing.assert_allclose(tangent, slopes, rtol=1e-5)


# -- closed forms ----------------------------------------------------------------------------------
@located
def test_the_flights_of_a_ball_are_those_of_its_closed_form(method):
    """From a height of 10 with e = 0.5: each flight takes half the time of the one before, so does
    the velocity.
    """
    found = run(ball, (10.0, 0.0), method, 3.9, samples=4)
    fall = math.sqrt(20 / 9.81)
    exact = fall * (1 + 2 * np.array([0.0, 0.5, 0.75]))
    assert found["contact_kind"].values.tolist() == ["impact"] * 3
    assert found["contact_direction"].values.tolist() == [-1] * 3
    np.testing.assert_allclose(found["contact_time"].values, exact, rtol=1e-6)
    np.testing.assert_allclose(
        found["contact_velocity"].values, -9.81 * fall * 0.5 ** np.arange(3), rtol=1e-6
    )
    np.testing.assert_allclose(
        found["contact_v"].values, 9.81 * fall * 0.5 ** np.arange(1, 4), rtol=1e-6
    )


def test_the_table_of_contacts_is_that_of_the_default_method():
    exact = run(STOP, (0.0, 0.0), None, 40.0, samples=9)
    same = ("guard", "direction", "kind", "mode_before", "mode_after")
    for method in LOCATED:
        found = run(STOP, (0.0, 0.0), method, 40.0, samples=9)
        for name in same:
            assert (
                found[f"contact_{name}"].values.tolist() == exact[f"contact_{name}"].values.tolist()
            )
        np.testing.assert_allclose(
            found["contact_velocity"].values, exact["contact_velocity"].values, rtol=1e-4
        )
        np.testing.assert_array_equal(found["mode"].values, exact["mode"].values)


@pytest.mark.nojit
@every
def test_a_start_on_the_stop_with_the_velocity_into_it_rebounds(method):
    """As an initial condition: up with 1.5, no event."""
    found = run(ball, (0.0, -3.0), method, 0.25, samples=2)
    assert float(found.end_x) == pytest.approx(1.5 * 0.25 - 9.81 * 0.25**2 / 2, rel=1e-6)
    assert int(found.events) == 0


@every
def test_a_heater_with_hysteresis_switches_at_its_times(method):
    """A jump that leads back: off at 23.5, on at 22."""
    rough = method in NOT_LOCATED
    found = run(thermostat, (15.0, 1.0), method, 25.0, samples=2)
    exact = 10 * math.log((38 - 15) / (38 - 23.5))
    exact += np.cumsum([0.0, *([10 * math.log(5.5 / 4.0), 10 * math.log(16.0 / 14.5)] * 2)])
    switched = times(found, "impact")[: len(exact)]
    if method == NOT_LOCATED[1]:  # its steps are long: late, but by the error that is told
        return
    np.testing.assert_allclose(switched, exact, rtol=0, atol=0.05 if rough else 1e-4)


@pytest.mark.nojit
@located
def test_a_jump_that_leads_on_happens_once(method):
    """From 0 at 1: a count; at 2.5 back by 4, over the boundary of the count, met anew."""

    @sl.system(states="x n")
    def count(t, x, n):
        return (
            1.0 + sl.piecewise((0.5, x > 1.0), otherwise=0.0), 0.0,
            sl.jump(x > 1.0, n=n + 1.0), sl.jump(x > 2.5, x=x - 4.0),
        )  # fmt: skip

    found = run(count, (0.0, 0.0), method, 6.0, samples=3)
    np.testing.assert_allclose(times(found, "impact"), [1.0, 2.0, 4.5, 5.5], atol=1e-6)
    assert float(found.end_n) == 2.0
    assert float(found.end_x) == pytest.approx(-1.5 + 0.5, abs=1e-6)


@located
def test_an_angle_is_wrapped_again_and_again(method):
    """Each jump ends on the boundary of the other one, from where it moves on. The eleventh falls
    on the end, where no step may be too short for the clock.
    """

    @sl.system(states="angle")
    def wheel(t, angle, *, speed=1.0):
        back = sl.jump(angle > 1.0, angle=angle - 2.0)
        return speed, back, sl.jump(angle < -1.0, angle=angle + 2.0)

    for speed in (0.7, -0.7):
        found = run(wheel.with_values(speed=speed), (0.0,), method, 30.0, samples=3)
        assert str(found.status.values) == "ok"
        np.testing.assert_allclose(
            times(found, "impact")[:10], np.arange(1.0, 21.0, 2.0) / 0.7, atol=1e-8
        )


@pytest.mark.nojit
@pytest.mark.parametrize("method", MATLAB, ids=lambda one: one.label)
def test_a_stop_in_the_step_that_leaves_another_boundary_is_seen(method):
    """From x = 0, where the force bends, with the speed 1: the stop at 1e-7 lies in the first step,
    in which MATLAB's rule would look no further than the start.
    """

    @sl.system(states="x v")
    def near(t, x, v):
        return (
            v,
            -sl.piecewise((x, x > 0.0), otherwise=0.0),
            sl.impact(x < 1e-7, v, restitution=1.0),
        )

    found = run(near, (0.0, 1.0), method, 0.01, samples=1)
    assert times(found, "impact") == pytest.approx([1e-7], rel=1e-9)
    assert float(found.end_x) == pytest.approx(2e-7 - 0.01, rel=1e-9)


@located
def test_a_jump_may_carry_the_state_over_other_boundaries(method):
    """From 2 with x'' = -1: at 1/2 to -5/2, over the boundary of a count and that of a spring, of
    which it then feels x'' = -1 - 5 x until it is back at -1.
    """

    @sl.system(states="x v n")
    def carried(t, x, v, n):
        spring = sl.piecewise((5.0 * x, x < -1.0), otherwise=0.0)
        return v, -1.0 - spring, 0.0, sl.jump(x < 0.5, x=x - 3.0), sl.jump(x < 0.0, n=n + 1.0)

    found = run(carried, (2.0, 0.0, 0.0), method, 2.6, samples=3)
    first, turn = math.sqrt(3.0), math.sqrt(5.0)
    # x = -0.2 - 2.3 cos(turn s) - first / turn sin(turn s) until -0.2 - 0.8
    size, angle = math.hypot(2.3, first / turn), math.atan2(first / turn, 2.3)
    leaves = (math.acos(0.8 / size) + angle) / turn
    speed, rest = size * turn * math.sin(turn * leaves - angle), 2.6 - first - leaves
    assert found["contact_kind"].values.tolist()[:3] == ["impact", "crossing", "impact"]
    assert float(found.end_n) == 1.0
    assert float(found.end_x) == pytest.approx(-1.0 + speed * rest - rest**2 / 2, rel=1e-5)


@pytest.mark.nojit
@located
def test_a_row_of_balls_that_touch_hands_its_momentum_on(method):
    found = run(cradle, (-1.0, 0.0, 0.0, 1.0, 0.0, 0.0), method, 3.0, samples=4)
    np.testing.assert_allclose(times(found, "impact"), [1.0, 1.0], rtol=0, atol=1e-12)
    assert [float(found[f"end_{name}"]) for name in "uvw"] == [0.0, 0.0, 1.0]
    assert str(found.status.values) == "ok"


# -- several at one instant, and restitutions that the equation gives -----------------------------
@pytest.mark.nojit
@every
def test_impacts_at_one_instant_have_an_order_or_end_the_trajectory(method):
    """Of masses 1, 1, 1 all orders exchange the velocities; of 1, 3, 1 and with e = 0.5 they lead
    to different states. Met on the way, and as an initial condition.
    """
    for apart, meets in ((0.01, 0.01), (0.0, 0.0)):
        start = (-apart, 0.0, apart, 1.0, 0.0, -1.0)
        found = run(pinched, start, method, 0.015, samples=1)
        assert [float(found[f"end_{name}"]) for name in "uvw"] == [-1.0, 0.0, 1.0]
        for values in ({"middle": 3.0}, {"restitution": 0.5}):
            with pytest.warns(SaltusWarning, match="depends on which is taken first"):
                found = run(pinched.with_values(**values), start, method, 0.015, samples=1)
            assert str(found.status.values) == "ambiguous_impact"
            assert [float(found[f"end_{name}"]) for name in "uvw"] == [1.0, 0.0, -1.0]
            assert int(found.events) == 0
            late = 0.0021 if method in NOT_LOCATED else 1e-12
            assert float(found.end_time) == pytest.approx(meets, abs=late)


@located
def test_one_of_two_impacts_a_little_later_has_its_own_outcome(method):
    """Masses 1, 3, 1; the third comes 1e-9 s behind the first, or before it."""
    for later, exact in ((1e-9, [-0.5, -0.25, 1.25]), (-1e-9, [-1.25, 0.25, 0.5])):
        start = (-0.01, 0.0, 0.01 + later, 1.0, 0.0, -1.0)
        found = run(pinched.with_values(middle=3.0), start, method, 0.02, samples=1)
        assert str(found.status.values) == "ok"
        assert [float(found[f"end_{n}"]) for n in "uvw"] == pytest.approx(exact, abs=1e-12)


@every
def test_impacts_that_have_nothing_to_do_with_each_other_may_coincide(method):
    found = run(two_balls, (0.5, 0.5, 0.0, 0.0), method, 1.25, samples=1)
    assert str(found.status.values) == "ok"
    late = 0.1 if method in NOT_LOCATED else 1e-6
    assert times(found, "impact") == pytest.approx([1.0, 1.0], abs=late)
    assert float(found.end_v) == pytest.approx(0.5 - 0.25, abs=2 * late)
    assert float(found.end_w) == pytest.approx(0.9 - 0.25, abs=2 * late)


@pytest.mark.nojit
@every
def test_an_impossible_restitution_is_named_at_the_impact(method):
    """Of 0.5 + v: at -1 it is -0.5, at -0.1 it is 0.4. On the way and as an initial condition."""
    start = {"x": [0.01, 0.0], "v": [-1.0, -1.0]}
    with pytest.warns(SaltusWarning, match=r"outside \[0, 1\]"):
        found = run(ball_of_clay, start, method, 0.03, samples=1)
    assert found["status"].values.tolist() == ["invalid_restitution"] * 2
    assert found["events"].values.tolist() == [0, 0]
    late = 0.004 if method in NOT_LOCATED else 1e-6
    assert found["end_time"].values == pytest.approx([math.sqrt(1.02) - 1.0, 0.0], abs=late)
    assert found["end_x"].values == pytest.approx([0.0, 0.0], abs=late)
    found = run(ball_of_clay, (0.0, -0.1), method, 0.03, samples=1)
    assert float(found.end_v) == pytest.approx(0.04 - 0.03, abs=1e-6)


@pytest.mark.filterwarnings("ignore::saltus.errors.SaltusWarning")
@every
def test_what_ends_a_trajectory_is_the_same_in_any_pieces(method, monkeypatch):
    start = {"x": np.array([0.02, 0.005, 0.3, 0.0]), "v": np.array([-0.1, -0.2, 0.5, -1.0])}
    whole = run(ball_of_clay, start, method, 2.0, samples=7)
    assert whole["status"].values.tolist()[2:] == ["invalid_restitution"] * 2
    monkeypatch.setattr(engine, "SLICE", 7)
    assert whole.equals(run(ball_of_clay, start, method, 2.0, samples=7, threads=1))


# -- impacts that accumulate -----------------------------------------------------------------------
@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.9])
@every
def test_impacts_that_accumulate_end_with_a_status(method, restitution):
    """The flights add up to fall (1 + 2 e / (1 - e)); there only the default method goes on. Steps
    in the gap and inverse cubics give up where a flight isn't much longer than a step.
    """
    fall = math.sqrt(20 / 9.81)
    zeno = fall * (1 + 2 * restitution / (1 - restitution))
    system = ball.with_values(restitution=restitution)
    with pytest.warns(SaltusWarning, match="sl.Taylor"):
        found = run(system, (10.0, 0.0), method, 2 * zeno, samples=3)
    gives_up = getattr(method, "events", "") in ("henon", "inverse")
    assert str(found.status.values) == ("turned" if gives_up else "budget_events")
    if method not in NOT_LOCATED:
        early = 1e-3 if isinstance(method, sl.ODE15s) else 1e-6
        if gives_up:  # the flights that are left, the first of four steps at most
            early = 4 * method.step / (1 - restitution)
        assert zeno - early < float(found.end_time) < zeno + 1e-6
        assert found["x"].values[np.isfinite(found["x"].values)].min() >= -1e-12


@pytest.mark.parametrize("name", ["thompson", "table"])
@pytest.mark.parametrize(
    "method",
    [sl.ODE45(1e-8, 1e-11), sl.ODE113(1e-8, 1e-11), sl.RK4(0.01)],
    ids=lambda one: one.label,
)
def test_just_the_motions_that_come_to_rest_are_named(method, name):
    """On a stop at zero, and on a table whose place has rounding errors: these must not keep a ball
    bouncing. All other motions are the exact ones.
    """
    system = sl.models.impact_oscillator(case="thompson")
    start = np.random.default_rng(1).uniform((-0.9, -0.4), (-0.25, 0.25), (80, 2))
    if name == "table":
        system = sl.models.bouncing_ball(amplitude=1.5)
        start = np.random.default_rng(2).uniform((2.0, -1.0), (9.0, 1.0), (80, 2))
    exact = run(system, start, None, 14.0, samples=1)
    rests = np.zeros(len(start), bool)
    rests[exact["contact_trajectory"].values[exact["contact_kind"].values == "hold"]] = True
    assert rests.sum() > 0
    with pytest.warns(SaltusWarning, match="sl.Taylor"):
        found = run(system, start, method, 14.0, samples=1)
    np.testing.assert_array_equal(found["status"].values == "budget_events", rests)
    assert (found["status"].values[~rests] == "ok").all()
    assert found["steps"].values.max() < 5000
    for end in ("end_x", "end_v"):
        off = np.abs(found[end].values - exact[end].values)[~rests]
        assert off.max(initial=0.0) < 1e-4


@pytest.mark.nojit
@every
def test_a_stop_that_is_pressed_from_the_start_is_named(method):
    with pytest.warns(SaltusWarning, match="sl.Taylor"):
        found = run(ball, (0.0, 0.0), method, 1.0, samples=1)
    assert str(found.status.values) in ("budget_events", "turned")


def test_static_friction_is_still_refused():
    @sl.system(states="x v")
    def belt(t, x, v):
        return v, -x - sl.friction(v - 0.2, slip=0.5, stick=1.0)

    for method in (*LOCATED, *NOT_LOCATED):
        with pytest.raises(ParameterError, match=r"static friction.*Leave method= out"):
            run(belt, (0.0, 0.0), method, 1.0)


# -- not located -----------------------------------------------------------------------------------
def test_an_impact_that_is_not_located_is_dated_at_the_node_behind_it():
    """h = 1/16, so nodes are exact; the ball has fallen through by less than a step, and leaves
    from there.
    """
    found = run(ball, (10.0, 0.0), sl.RK4(0.0625, "ignore"), 3.0, samples=1)
    fall = math.sqrt(20 / 9.81)
    first = math.ceil(fall / 0.0625) * 0.0625
    assert found["contact_time"].values[0] == first
    assert found["contact_time_error"].values[0] >= first - fall
    assert found["contact_x"].values[0] == pytest.approx(10 - 9.81 * first**2 / 2, rel=1e-12)
    assert found["contact_v"].values[0] == pytest.approx(0.5 * 9.81 * first, rel=1e-12)


# -- one trajectory and many -----------------------------------------------------------------------
@every
def test_impacts_are_the_same_in_any_pieces(method, monkeypatch):
    start = STARTS[STOP][:5]
    whole = run(STOP, start, method, 12.0, samples=7)
    monkeypatch.setattr(engine, "SLICE", 7)
    assert whole.equals(run(STOP, start, method, 12.0, samples=7, threads=1))
