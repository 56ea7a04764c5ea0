"""Rule 10: impacts that accumulate, rest, sticking and sliding are modes. Each case has a closed
form, or an invariant.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import saltus as sl
from conformance.systems import ball_of_clay, cradle, pinched, thermostat, two_balls
from saltus.errors import ParameterError, SaltusWarning


@sl.system(states="x v")
def ball(t, x, v, *, gravity=9.81, restitution=0.5, floor=0.0):
    return v, -gravity, sl.impact(x > floor, -v, restitution=restitution)


@sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
def stop(t, x, v, *, gap=0.2, restitution=0.6, damping=0.1, force=1.0, w=0.3):
    push = force * sl.cos(w * t)
    return v, push - damping * v - x, sl.impact(x < gap, v, restitution=restitution)


@sl.system(states="x v")
def belt(t, x, v, *, speed=0.2, slip=0.5, stick=1.0):
    return v, -x - sl.friction(v - speed, slip=slip, stick=stick)


def times(run, kind):
    return run["contact_time"].values[run["contact_kind"].values == kind]


# -- impacts, chatter, rest ------------------------------------------------------------------------
@pytest.mark.parametrize("restitution", [0.0, 0.1, 0.5, 0.8, 0.9, 0.99])
@pytest.mark.parametrize("floor", [0.0, 3.0])
def test_a_ball_comes_to_rest_at_the_exact_time(restitution, floor):
    fall = math.sqrt(2 * 10 / 9.81)
    end = fall * (1 + 2 * restitution / (1 - restitution))
    system = ball.with_values(restitution=restitution, floor=floor)
    run = sl.simulate(system, (10.0 + floor, 0.0), t_end=1.5 * end, samples=3)
    (rests,) = times(run, "hold")
    assert rests == pytest.approx(end, rel=1e-13)
    assert times(run, "impact")[0] == pytest.approx(fall, rel=1e-15)
    assert (float(run.end_x), float(run.end_v), str(run.status.values)) == (floor, 0.0, "ok")


def test_an_elastic_ball_keeps_its_energy_over_ten_thousand_bounces():
    period = 2 * math.sqrt(2 / 9.81)
    run = sl.simulate(ball.with_values(restitution=1.0), (1.0, 0.0), t_end=1e4 * period, samples=1)
    energy = 9.81 * float(run.end_x) + float(run.end_v) ** 2 / 2
    assert energy == pytest.approx(9.81, rel=1e-12)
    assert int(run.events) == 10_000


@pytest.mark.parametrize("restitution", [1.1, -0.1])
def test_a_restitution_that_is_none_is_refused(restitution):
    with pytest.raises(ParameterError, match=r"outside \[0, 1\]"):
        ball.with_values(restitution=restitution)


def test_chatter_rest_and_release_of_a_driven_stop():
    """x'' + 0.1 x' + x = cos 0.3 t, x <= 0.2, e = 0.6: the contact force vanishes at acos(0.2)/0.3;
    times of the first impact and of the end of the chatter from exact arcs.
    """
    run = sl.simulate(stop, (0.2, 0.0), periods=3, samples=50)
    released, rests = times(run, "release"), times(run, "hold")
    period = 2 * math.pi / 0.3
    assert released == pytest.approx(
        [math.acos(0.2) / 0.3 + k * period for k in range(3)], rel=1e-14
    )
    first = run["contact_kind"].values == "impact"
    assert run["contact_time"].values[first][0] == pytest.approx(16.731266435103816, rel=1e-14)
    assert run["contact_velocity"].values[first][0] == pytest.approx(0.46824636412950312, rel=1e-13)
    assert rests[:2] == pytest.approx([20.0978528953867, 20.0978528953867 + period], rel=1e-13)
    assert run["x"].values.max() <= 0.2, "never through the stop"


def test_a_ball_that_rests_is_thrown_by_its_table():
    """Gravity 1 on a table G sin t: it takes off where the table's acceleration is -1."""

    @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
    def bounced(t, x, v, *, amplitude=1.2, restitution=0.5, w=1.0):
        rate = amplitude * w * sl.cos(w * t)
        return v, -1.0, sl.impact(x > amplitude * sl.sin(w * t), rate - v, restitution=restitution)

    run = sl.simulate(bounced, (0.0, 1.2), t_end=12.0, samples=10)
    takes_off, rests = times(run, "release"), times(run, "hold")
    assert takes_off[0] == pytest.approx(math.asin(1 / 1.2), rel=1e-14)
    assert times(run, "impact")[0] == pytest.approx(3.3874157078481649, rel=1e-13)
    assert rests[0] == pytest.approx(4.13360620053988, rel=1e-13)
    assert takes_off[1] - rests[0] == pytest.approx(3.13468988997746, rel=1e-13)


@pytest.mark.parametrize("amplitude", [0.7, 1.7, 2.6, 4.0, 5.5])
def test_a_ball_without_rebound_is_followed_whether_its_table_presses_or_not(amplitude):
    """e = 0, gravity 1: where the table falls away faster than the ball it leaves at once."""

    @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
    def bounced(t, x, v, *, amplitude=1.2, w=1.0):
        rate = amplitude * w * sl.cos(w * t)
        return v, -1.0, sl.impact(x > amplitude * sl.sin(w * t), rate - v, restitution=0.0)

    start = {"x": np.linspace(6.0, 9.0, 12), "v": np.zeros(12)}
    run = sl.simulate(bounced.with_values(amplitude=amplitude), start, periods=20, samples=32)
    assert (run["status"].values == "ok").all()
    table = amplitude * np.sin(run["time"].values)
    assert (run["x"].values - table).min() > -1e-12


@sl.system(states="x v")
def lifted(t, x, v, *, restitution=0.5, turn=1.0):
    """What presses onto the floor fades, and lifts from the turn on."""
    return v, 6 * (t - turn), sl.impact(x > 0, -v, restitution=restitution)


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_an_impact_at_the_instant_at_which_the_force_turns(restitution):
    """From 3 at -1 it strikes at -4 at t = 1, and leaves: 4 e (t - 1) + (t - 1)^3."""
    run = sl.simulate(lifted.with_values(restitution=restitution), (3.0, -1.0), t_end=2.0)
    assert (str(run.status.values), times(run, "impact").tolist()) == ("ok", [1.0])
    assert float(run.end_x) == pytest.approx(4 * restitution + 1, rel=1e-15)


@pytest.mark.parametrize("restitution", [0.8, 0.9, 0.95])
def test_a_chatter_that_a_force_ends_before_rest(restitution):
    """Each flight is v s + 3 (t - turn) s^2 + s^3; once that has no root the ball is gone."""
    t, v, turn, exact = 0.0, 1.0, 1.5, []
    while (under := 9 * (t - turn) ** 2 - 4 * v) > 0:
        flight = (3 * (turn - t) - math.sqrt(under)) / 2
        v = -restitution * (v + 6 * (t - turn) * flight + 3 * flight**2)
        t += flight
        exact.append(t)
    system = lifted.with_values(restitution=restitution, turn=turn)
    run = sl.simulate(system, (0.0, 1.0), t_end=3.0, samples=4)
    assert run["contact_kind"].values.tolist() == ["impact"] * len(exact)
    assert run["contact_time"].values == pytest.approx(exact, rel=1e-14)
    last = 3.0 - t
    end = v * last + 3 * (t - turn) * last**2 + last**3
    assert float(run.end_x) == pytest.approx(end, rel=1e-14)


def test_an_impact_at_the_very_end_is_reported_once():
    run = sl.simulate(ball.with_values(gravity=1.0), (0.5, 0.0), t_end=1.0, samples=2)
    assert times(run, "impact").tolist() == [1.0]
    assert (str(run.status.values), float(run.end_v)) == ("ok", 0.5)


def test_speeds_whose_square_is_no_number():
    run = sl.simulate(ball.with_values(gravity=0.0), (1e-160, -1e-160), t_end=2.0, samples=2)
    assert times(run, "impact").tolist() == [1.0]
    assert (float(run.end_x), float(run.end_v)) == pytest.approx((5e-161, 5e-161), rel=1e-15, abs=0)
    run = sl.simulate(ball, (0.0, 1e-160), t_end=1.0, samples=2)
    assert (str(run.status.values), float(run.end_x), float(run.end_v)) == ("ok", 0.0, 0.0)


def test_a_ball_never_falls_through_and_a_contact_that_lasts_is_kept():
    """On a floor for 1e6 s; for a thousand periods on a table that never throws it off."""
    run = sl.simulate(ball, (1.0, 0.0), t_end=1e6, samples=100)
    assert run["x"].values[1:].tolist() == [0.0] * 100
    table = sl.models.bouncing_ball(amplitude=0.9)
    run = sl.simulate(table, (1.5, 0.0), periods=1000, samples=4)
    assert (str(run.status.values), run["contact_kind"].values[-1]) == ("ok", "hold")
    assert float(run["contact_time"][-1]) < 40 * math.pi
    x = run["x"].values[1:].reshape(1000, 4)[20:]
    roundings = 4 * int(run.steps) * 2.0**-52
    assert x == pytest.approx(np.tile([0.9, 0.0, -0.9, 0.0], (980, 1)), abs=roundings)


def test_three_bodies_share_their_momentum():
    """An elastic row: the first body's velocity goes to the last; energy and momentum stay."""

    @sl.system(states="a b c u v w")
    def row(t, a, b, c, u, v, w, *, m=1.0, n=1.0, restitution=1.0):
        return (
            u, v, w, 0.0, 0.0, 0.0,
            sl.impact(a < b, u - v, restitution=restitution, inertia=(m, m)),
            sl.impact(b < c, v - w, restitution=restitution, inertia=(m, n)),
        )  # fmt: skip

    run = sl.simulate(row, (0.0, 1.0, 3.0, 2.0, 0.0, 0.0), t_end=4.0, samples=1)
    assert [float(run[f"end_{name}"]) for name in "uvw"] == [0.0, 0.0, 2.0]
    assert times(run, "impact") == pytest.approx([0.5, 1.5], abs=1e-15)
    run = sl.simulate(
        row.with_values(n=3.0, restitution=0.4), (0.0, 1.0, 3.0, 2.0, 0.0, 0.0), t_end=2.5
    )
    u, v, w = (float(run[f"end_{name}"]) for name in "uvw")
    assert u + v + 3 * w == pytest.approx(2.0, rel=1e-15)


def test_a_row_of_balls_that_touch_hands_its_momentum_on():
    run = sl.simulate(cradle, (-1.0, 0.0, 0.0, 1.0, 0.0, 0.0), t_end=3.0, samples=4)
    assert times(run, "impact").tolist() == [1.0, 1.0]
    assert [float(run[f"end_{name}"]) for name in "uvw"] == [0.0, 0.0, 1.0]
    assert str(run.status.values) == "ok"


def test_balls_that_strike_one_from_both_sides_at_once():
    """Equal elastic ones exchange velocities, in any order; three of masses 1, 3, 1 end as -0.5,
    -0.25, 1.25 or as the mirror of it, and with e = 0.5 the orders differ too.
    """
    start = (-1.0, 0.0, 1.0, 1.0, 0.0, -1.0)
    run = sl.simulate(pinched, start, t_end=2.0, samples=1)
    assert [float(run[f"end_{name}"]) for name in "uvw"] == [-1.0, 0.0, 1.0]
    for values in ({"middle": 3.0}, {"restitution": 0.5}):
        with pytest.warns(SaltusWarning, match="depends on which is taken first"):
            run = sl.simulate(pinched.with_values(**values), start, t_end=2.0, samples=1)
        assert str(run.status.values) == "ambiguous_impact"
        assert (float(run.end_time), float(run.end_u)) == (1.0, 1.0), "as they meet"
    # one of them a little later: no question
    for sign in (-1, 1):
        moved = (-1.0 + 1e-9 * sign, *start[1:])
        run = sl.simulate(pinched.with_values(middle=3.0), moved, t_end=2.0, samples=1)
        ends = [float(run[f"end_{name}"]) for name in "uvw"]
        first = [-0.5, -0.25, 1.25] if sign > 0 else [-1.25, 0.25, 0.5]
        assert ends == pytest.approx(first, abs=1e-14)


@pytest.mark.parametrize("middle", [0.01, 1.0, 3.0])
def test_three_bodies_that_meet_without_rebound_go_on_as_one(middle):
    """All orders lead to the common velocity that keeps the momentum."""
    system = pinched.with_values(middle=middle, restitution=0.0)
    run = sl.simulate(system, (-1.0, 0.0, 1.0, 1.0, 0.0, -1.0), t_end=2.0, samples=4)
    assert str(run.status.values) == "ok"
    assert [float(run[f"end_{name}"]) for name in "uvw"] == pytest.approx([0.0] * 3, abs=1e-13)
    assert [float(run[f"end_{name}"]) for name in "abc"] == pytest.approx([0.0] * 3, abs=1e-13)
    four = row_of_four.with_values(restitution=0.0)
    run = sl.simulate(four, (-1.0, 0.0, 1.0, 2.0, 1.0, 0.0, -1.0, -2.0), t_end=2.0, samples=1)
    assert [float(run[f"end_{n}"]) for n in "uvwz"] == pytest.approx([-0.5] * 4, abs=1e-13)


@sl.system(states="a b c u v w", forced_at="beat", units={"beat": "rad/s"})
def pinched_by_the_beat(t, a, b, c, u, v, w, *, middle=0.01, beat=2 * math.pi):
    return (
        u, v, w, 0.0, 0.0, 0.0,
        sl.impact(a < b, u - v, restitution=0.0, inertia=(1.0, middle)),
        sl.impact(b < c, v - w, restitution=0.0, inertia=(middle, 1.0)),
    )  # fmt: skip


def test_bodies_that_meet_without_rebound_stay_together():
    """What is left of their velocities is the rounding of those before; a body of one hundredth of
    the others' mass hands it on slowly. Each beat ends a step.
    """
    start = (-1.0, 0.0, 1.0, 1.0, 0.0, -1.0)
    run = sl.simulate(pinched_by_the_beat, start, t_end=10.0, samples=1)
    assert str(run.status.values) == "ok"
    assert [float(run[f"end_{name}"]) for name in "abcuvw"] == pytest.approx([0.0] * 6, abs=1e-14)


@sl.system(states="a b c d u v w z")
def row_of_four(t, a, b, c, d, u, v, w, z, *, restitution=1.0):
    return (
        u, v, w, z, 0.0, 0.0, 0.0, 0.0,
        sl.impact(a < b, u - v, restitution=restitution, inertia=(1.0, 1.0)),
        sl.impact(b < c, v - w, restitution=restitution, inertia=(1.0, 1.0)),
        sl.impact(c < d, w - z, restitution=restitution, inertia=(1.0, 1.0)),
    )  # fmt: skip


def test_impacts_that_have_nothing_to_do_with_each_other_may_coincide():
    run = sl.simulate(two_balls, (0.5, 0.5, 0.0, 0.0), t_end=1.5, samples=1)
    assert times(run, "impact").tolist() == [1.0, 1.0]
    assert float(run.end_v) == pytest.approx(0.0, abs=1e-15)
    assert float(run.end_w) == pytest.approx(0.4, rel=1e-15)


def test_impacts_at_the_very_end_have_an_order_too():
    with pytest.warns(SaltusWarning, match="depends on which is taken first"):
        run = sl.simulate(
            pinched.with_values(middle=3.0), (-1.0, 0.0, 1.0, 1.0, 0.0, -1.0), t_end=1.0
        )
    assert str(run.status.values) == "ambiguous_impact"


def test_a_restitution_that_leaves_its_bounds_on_the_way():
    """Of 0.5 + v: at -sqrt(2) it is negative; at -0.1 it is 0.4."""
    for slope in (1.0, -1.0):
        with pytest.warns(SaltusWarning, match=r"outside \[0, 1\]"):
            run = sl.simulate(ball_of_clay.with_values(slope=slope), (1.0, 0.0), t_end=3.0)
        assert str(run.status.values) == "invalid_restitution"
        assert float(run.end_v) == pytest.approx(-math.sqrt(2.0), rel=1e-14)
    run = sl.simulate(ball_of_clay, (0.005, 0.0), t_end=0.14, samples=1)
    assert float(run["contact_v"][0]) == pytest.approx(0.04, rel=1e-14)


def test_a_start_on_a_boundary_that_both_sides_leave_has_no_one_motion():
    @sl.system(states="x y")
    def ridge(t, x, y, *, tilt=0.0):
        return sl.sign(x) + tilt, 1.0

    starts = {"x": np.array([0.0, 1e-300, -1e-300, 0.5]), "y": np.zeros(4)}
    with pytest.warns(SaltusWarning, match="more than one motion"):
        run = sl.simulate(ridge, starts, t_end=1.0, samples=3)
    assert run["status"].values.tolist() == ["nonunique", "ok", "ok", "ok"]
    assert run["end_x"].values.tolist() == [0.0, 1.0, -1.0, 1.5]
    run = sl.simulate(ridge.with_values(tilt=2.0), (0.0, 0.0), t_end=1.0, samples=1)
    assert (str(run.status.values), float(run.end_x)) == ("ok", 3.0), "both sides lead one way"


def test_a_block_that_sticks_is_struck_loose():
    """Equal masses, e = 0.5: the blow at t = 1 leaves velocities 1/4 and 3/4; the block stops after
    3/4/0.3 = 2.5 s.
    """

    @sl.system(states="a b u v")
    def struck(t, a, b, u, v, *, friction=0.3):
        blow = sl.impact(a < b, u - v, restitution=0.5, inertia=(1.0, 1.0))
        return u, v, 0.0, -sl.friction(v, slip=friction), blow

    run = sl.simulate(struck, (-1.0, 0.0, 1.0, 0.0), t_end=3.6, samples=4)
    assert run["contact_kind"].values.tolist()[:3] == ["impact", "release", "hold"]
    assert run["contact_time"].values[:3] == pytest.approx([1.0, 1.0, 3.5], abs=1e-14)
    assert (float(run.end_b), float(run.end_v)) == pytest.approx((0.9375, 0.0), abs=1e-14)


def test_a_start_beyond_a_stop_is_invalid():
    with pytest.warns(SaltusWarning, match="beyond a stop"):
        run = sl.simulate(ball, (-1.0, 0.0), t_end=1.0)
    assert str(run.status.values) == "invalid"


def test_a_jump_happens_once_each_time_its_condition_becomes_true():
    """A heater with hysteresis: off at 23.5, on at 22."""
    run = sl.simulate(thermostat, (15.0, 1.0), t_end=30.0, samples=5)
    heat = 10 * math.log((38 - 15) / (38 - 23.5))
    cool, again = 10 * math.log(5.5 / 4.0), 10 * math.log((38 - 22) / (38 - 23.5))
    switched = times(run, "impact")
    exact = heat + np.cumsum([0.0, *([cool, again] * 10)])
    assert switched == pytest.approx(exact[: len(switched)], rel=1e-13)
    assert len(switched) == np.count_nonzero(exact <= 30.0)


# -- sticking and sliding --------------------------------------------------------------------------
def test_a_block_on_a_belt_sticks_and_slips():
    """Static friction 1, kinetic 0.5: stick lasts 5, slip 3.902605407814523."""
    run = sl.simulate(belt, (0.0, 0.0), t_end=60.0, samples=10)
    stuck, free = times(run, "hold"), times(run, "release")
    assert np.diff(stuck)[2:] == pytest.approx(8.902605407814523, rel=1e-13)
    assert free[2:] - stuck[2 : len(free)] == pytest.approx(5.0, rel=1e-13)


def test_two_surfaces_on_which_both_sides_push():
    """x' = -2 or 2, y' = 1.5 or -3: x reaches y at 1/7, then both move at -3/8.5."""

    @sl.system(states="x y")
    def pair(t, x, y):
        return (
            sl.piecewise((-2.0, x > y), otherwise=2.0),
            sl.piecewise((1.5, x > y), otherwise=-3.0),
        )

    run = sl.simulate(pair, (1.5, 1.0), t_end=1.0, samples=1)
    assert times(run, "hold") == pytest.approx([1 / 7], rel=1e-15)
    assert float(run.end_x) == pytest.approx(1.5 - 2 / 7 - 3 / 8.5 * (6 / 7), rel=1e-15)
    assert float(run.end_x) == float(run.end_y)


def test_two_friction_elements_stick_together_and_alone():
    """A driver held to a follower by friction, the follower to the ground: both stuck, then the
    lower slips alone; forces by hand.
    """

    @sl.system(states="v w")
    def stacked(t, v, w, *, upper=1.0, lower=0.5, ramp=0.5):
        between, below = sl.friction(v - w, slip=upper), sl.friction(w, slip=lower)
        return ramp * t - between, between - below

    run = sl.simulate(stacked, (0.0, 0.0), t_end=6.0, samples=20)
    # both at rest until ramp*t = lower; then together at (ramp*t - lower)/2 until the force
    # between them, (ramp*t + lower)/2, is upper
    free = times(run, "release")
    assert free == pytest.approx([1.0, 3.0], rel=1e-13)
    assert float(run.end_w) == pytest.approx(0.5 + (1.0 - 0.5) * 3.0, rel=1e-13)
    t = 6.0
    assert float(run.end_v) == pytest.approx(0.5 + 0.25 * (t**2 - 9) - (t - 3), rel=1e-13)


def test_filippov_slides_with_the_convex_combination_and_leaves():
    """y > 0: (2, -1), y < 0: (1, 1 - x): from x = 0 to the exit at x = 1 in 1/2 + ln(3)/4."""

    @sl.system(states="x y")
    def plane(t, x, y):
        return sl.piecewise((2.0, y > 0), otherwise=1.0), sl.piecewise(
            (-1.0, y > 0), otherwise=1 - x
        )

    run = sl.simulate(plane, (-2.0, 1.0), t_end=3.0, samples=5)
    (begins,), (ends,) = times(run, "hold"), times(run, "release")
    assert (begins, ends - begins) == pytest.approx((1.0, 0.5 + math.log(3) / 4), rel=1e-14)


# -- one lane, one life; tangents ------------------------------------------------------------------
CASES = {
    "chatter": (stop, [(0.2, 0.0), (-1.0, 0.3), (0.1, 0.2), (-0.4, -0.9), (0.2, -0.5)], 40.0),
    "stick": (belt, [(0.0, 0.0), (1.0, 0.2), (2.0, -1.0), (-1.0, 0.5), (0.3, 0.2)], 40.0),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("lanes", [2, 8])
def test_lanes_and_neighbours_change_no_bit(case, lanes):
    system, starts, t_end = CASES[case]
    many = sl.simulate(
        system, np.array(starts), t_end=t_end, samples=7, method=sl.Taylor(lanes=lanes)
    )
    for i, one in enumerate(starts):
        alone = sl.simulate(system, one, t_end=t_end, samples=7)
        for name in system.states:
            assert np.array_equal(many[name].values[i], alone[name].values)
        mine = many["contact_trajectory"].values == i
        assert np.array_equal(many["contact_time"].values[mine], alone["contact_time"].values)


def test_exponents_of_an_impact_oscillator_sum_to_what_impacts_take():
    """Without damping volume shrinks at impacts only, by e**2 each."""
    system = stop.with_values(gap=0.0, damping=0.0, restitution=0.8, w=2.6)
    found = sl.lyapunov(system, (-0.5, 0.0), periods=400, transient=400)
    counted = sl.impact_statistics(system, (-0.5, 0.0), periods=400, transient=400)
    rate = float(counted["contacts_per_second"][0])
    assert found["exponent_sum"].item() == pytest.approx(2 * math.log(0.8) * rate, rel=1e-10)


def test_a_stick_phase_makes_a_multiplier_zero():
    """Of a driven block that sticks once a period the derivative of the return map is singular."""

    @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
    def hartog(t, x, v, *, force=1.0, slip=0.5, w=0.5):
        return v, force * sl.cos(w * t) - x - sl.friction(v, slip=slip)

    orbit = sl.attractors(hartog, (0.0, 0.0))
    assert abs(float(orbit["attractor_multiplier_real"].values.ravel()[-1])) < 1e-12


def test_multipliers_where_an_impact_carries_the_motion_over_another_boundary():
    """The impact turns the velocity round, and with it the friction: the derivative of the return
    map, against differences of it.
    """

    @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
    def rubbed(t, x, v, *, slip=0.1, w=1.3):
        push = sl.cos(w * t) - x - 0.1 * v - sl.friction(v, slip=slip)
        return v, push, sl.impact(x < 0.3, v, restitution=0.7)

    for slip in (0.0, 0.1):
        system = rubbed.with_values(slip=slip)
        orbit = sl.attractors(system, (0.1, 0.1), periods=1500)
        place = np.array([orbit[f"attractor_{name}"].values.ravel()[0] for name in "xv"])
        starts = place + 1e-6 * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
        end = sl.simulate(system, {"x": starts[:, 0], "v": starts[:, 1]}, periods=1, samples=1)
        ends = np.stack([end["end_x"].values, end["end_v"].values])
        slopes = (ends[:, ::2] - ends[:, 1::2]) / 2e-6
        real, imaginary = (
            orbit[f"attractor_multiplier_{part}"].values.ravel() for part in ("real", "imag")
        )
        assert real.sum() == pytest.approx(np.trace(slopes), abs=1e-7)
        assert np.prod(real + 1j * imaginary).real == pytest.approx(np.linalg.det(slopes), abs=1e-7)


@pytest.mark.parametrize("restitution", [0.0, 0.5])
@pytest.mark.parametrize("gap", [0.4, 0.5, -0.2])
def test_a_block_with_friction_leaves_its_stop_where_the_pull_exceeds_the_friction(
    restitution, gap
):
    """At rest on a stop, friction helps to press: released where force cos wt - gap = -slip."""

    @sl.system(states="x v")
    def rubbed(t, x, v, *, slip=0.3, gap=0.4, restitution=0.5):
        push = 1.2 * sl.cos(0.5 * t) - x - sl.friction(v, slip=slip)
        return v, push, sl.impact(x < gap, v, restitution=restitution)

    system = rubbed.with_values(gap=gap, restitution=restitution)
    run = sl.simulate(system, (gap, 0.0), t_end=30.0, samples=20)
    leaves = math.acos((gap - 0.3) / 1.2) / 0.5
    assert times(run, "release")[0] == pytest.approx(leaves, rel=1e-14)
    assert str(run.status.values) == "ok"
    assert run["x"].values.max() <= gap
    after = sl.simulate(system, (gap, 0.0), t_end=leaves + 0.2)
    force = [(math.cos(0.5 * t) * 1.2 - gap + 0.3) for t in (leaves + 0.1,)]
    assert force[0] < 0.0
    assert float(after.end_v) < 0.0


def test_a_section_at_an_impact_is_that_of_impacts():
    run = sl.poincare(stop, (-0.5, 0.0), "gap", periods=5)
    hits = times(sl.simulate(stop, (-0.5, 0.0), periods=5), "impact")
    assert run["crossing_time"].values.tolist() == hits.tolist()


def test_volumes_shrink_at_impacts_by_what_the_exponents_sum_to():
    """The mean divergence is found without the tangent: impacts with friction turned round, and a
    restitution that falls with the speed.
    """

    @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
    def rubbed(t, x, v, *, slip=0.05, w=1.3):
        push = sl.cos(w * t) - x - 0.1 * v - sl.friction(v, slip=slip)
        return v, push, sl.impact(x < 0.3, v, restitution=0.8 / (1 + 0.1 * v * v))

    found = sl.lyapunov(rubbed, (0.1, 0.1), periods=100, transient=1500)
    assert found["exponent_sum"].item() == pytest.approx(found["mean_divergence"].item(), rel=1e-9)
    assert found["exponent_sum"].item() < -0.2, "more than the damping"


def test_of_directions_off_a_contact_that_is_held_nothing_is_left():
    """Exponents of -inf, without an error: one of a block that sticks, one of a switch."""
    stick = sl.lyapunov(belt, (0.0, 0.0), periods=200, every=2.0)
    heater = sl.models.thermostat()
    switch = sl.lyapunov(heater, (15.0, 1.0), periods=200, every=1.0)
    for found in (stick, switch):
        first, last = found["lyapunov_exponent"].values[0]
        assert abs(first) < 5 * found["lyapunov_error"].values[0, 0], "along the flow"
        assert last == found["mean_divergence"].item() == -math.inf
        assert found["lyapunov_error"].values[0, 1] == 0.0
        assert "nothing is left" in sl.describe(found)


@pytest.mark.parametrize("start", [(15.0, 1.0), (22.5, 0.0), (23.4, 1.0)])
def test_a_cycle_of_jumps_has_its_period(start):
    """The thermostat: heated for 10 ln(16/14.5), cooled for 10 ln(5.5/4)."""
    heater = sl.models.thermostat()
    found = sl.attractors(heater, start, every=1.0)
    period = 10 * math.log(16 / 14.5) + 10 * math.log(5.5 / 4)
    assert found["attractor_cycle"].values == pytest.approx([period], rel=1e-13)
    assert abs(found["attractor_multiplier_real"].values.ravel()[-1]) < 1e-12


def test_a_jump_over_another_jumps_boundary_leaves_the_state_where_it_is():
    """Both resets happen at one instant; the second doesn't put the state on its own boundary."""

    @sl.system(states="x v n")
    def carried(t, x, v, n):
        spring = sl.piecewise((5.0 * x, x < -1.0), otherwise=0.0)
        return (
            v, -1.0 - spring, 0.0, sl.jump(x < 0.5, x=x - 3.0), sl.jump(x < 0.0, n=n + 1.0)
        )  # fmt: skip

    run = sl.simulate(carried, (2.0, 0.0, 0.0), t_end=2.6, samples=1, progress=False)
    fall = np.sqrt(3.0)  # from 2 to 0.5 at unit gravity; its speed then
    w = np.sqrt(5.0)

    def swing(t):  # x'' = -1 - 5x from -2.5
        return -0.2 - 2.3 * np.cos(w * t) - fall / w * np.sin(w * t)

    leaves = brentq(lambda t: swing(t) + 1.0, 0.5, 0.8, xtol=1e-15)
    speed = 2.3 * w * np.sin(w * leaves) - fall * np.cos(w * leaves)
    rest = 2.6 - fall - leaves
    assert run.end_x.item() == pytest.approx(-1.0 + speed * rest - rest**2 / 2, abs=1e-12)
    assert run.end_n.item() == 1.0


def test_an_impact_with_a_tangential_part_keeps_the_angular_momentum_about_its_point():
    """A ball of m*gyration*radius**2: u - gyration*radius*spin stays, the slip u + radius*spin
    becomes -tangential times itself each time, the normal velocity -normal times.
    """

    @sl.system(states="x y u v spin")
    def superball(t, x, y, u, v, spin, *, radius=0.02, normal=0.8, tangential=0.6, gyration=0.4):
        kick = -(1 + tangential) * (u + radius * spin) * gyration / (1 + gyration)
        after = {"v": -normal * v, "u": u + kick, "spin": spin + kick / (gyration * radius)}
        return u, v, 0.0, -9.81, 0.0, sl.jump(y < radius, **after)

    run = sl.simulate(superball, (0.0, 1.02, 1.0, 0.0, 30.0), t_end=2.0)
    fall = math.sqrt(2 / 9.81)
    count = len(run["contact_time"])
    assert run["contact_time"].values[:2] == pytest.approx([fall, fall * 2.6], rel=1e-13)
    u, spin = float(run.end_u), float(run.end_spin)
    assert u - 0.4 * 0.02 * spin == pytest.approx(1.0 - 0.4 * 0.02 * 30.0, rel=1e-14)
    assert u + 0.02 * spin == pytest.approx((-0.6) ** count * 1.6, rel=1e-13)
