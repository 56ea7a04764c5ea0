"""Rule 6: events of several guards at one instant are one set, and lead to one fixed point of the
modes.
"""

from __future__ import annotations

import math

import pytest

import saltus as sl
from conformance.systems import contacts, latch, pair, walls

# these tests look at the status themselves
pytestmark = [
    pytest.mark.filterwarnings("ignore::saltus.errors.SaltusWarning"),
    pytest.mark.usefixtures("exact_method"),
]


def test_two_bodies_meet_their_stops_at_one_instant():
    """Twins: their stops at 0.5 are met at 0.5 and left at 0.5 + pi, together to the bit."""
    system = pair.with_values(stop1=0.5, stop2=0.5, gap=9.0, stiffness1=1.0, stiffness2=1.0)
    run = sl.simulate(system, (0.0, 1.0, 0.0, 1.0), t_end=6.0, samples=4)
    found = contacts(run)
    assert [(c.guard, c.direction) for c in found] == [
        ("stop1", 1),
        ("stop2", 1),
        ("stop1", -1),
        ("stop2", -1),
    ]
    assert found[0].time == found[1].time == 0.5
    assert found[2].time == found[3].time == pytest.approx(0.5 + math.pi, abs=1e-15)
    assert float(run.end_x1) == float(run.end_x2)
    modes = [(c.before, c.after) for c in found]
    assert (modes[0][0], modes[1][1], modes[2][0], modes[3][1]) == (0, 5, 5, 0)


def test_coincident_events_of_different_speed():
    """Stops at 0.5 and 1 met at speeds 1 and 2: both at t = 0.5."""
    system = pair.with_values(stop1=0.5, stop2=1.0, gap=9.0, stiffness1=1.0, stiffness2=1.0)
    found = contacts(sl.simulate(system, (0.0, 1.0, 0.0, 2.0), t_end=6.0, samples=4))
    assert [(c.guard, c.time) for c in found[:2]] == [("stop1", 0.5), ("stop2", 0.5)]
    assert found[2].time == found[3].time


@pytest.mark.parametrize("speed", [1.0, 0.3, 1 / 7, math.pi])
def test_coincident_to_rounding(speed):
    """Two stops and the distance, reached at one time that isn't a double: three events within 10
    ulp, all into contact, mode 7 after.
    """
    system = pair.with_values(stop1=1.0, stop2=-1.0, gap=2.0, stiffness1=1.0, stiffness=1.0)
    run = sl.simulate(system, (0.0, speed, 0.0, -speed), t_end=1.2 / speed, samples=4)
    found = contacts(run)
    assert sorted((c.guard, c.direction, c.kind) for c in found) == [
        ("gap", 1, "crossing"),
        ("stop1", 1, "crossing"),
        ("stop2", -1, "crossing"),
    ]
    times = [c.time for c in found]
    assert max(times) - min(times) <= 10 * math.ulp(max(times))
    assert (found[0].before, found[-1].after) == (4, 3)
    assert int(run.mode_violations) == 0


@pytest.mark.parametrize("separation", [1e-15, 1e-14, 1e-12, 1e-9])
def test_almost_coincident_events_keep_their_order(separation):
    """Stops met `separation` apart in time: two events, each at its own time, none
    lost, in order.
    """
    system = pair.with_values(
        stop1=0.5, stop2=0.5 + separation, gap=9.0, stiffness1=4.0, stiffness2=4.0
    )
    run = sl.simulate(system, (0.0, 1.0, 0.0, 1.0), t_end=0.6, samples=4)
    first, second = contacts(run)
    assert (first.guard, second.guard) == ("stop1", "stop2")
    assert second.time - first.time == pytest.approx(separation, abs=10 * math.ulp(0.5))


def test_nested_boundaries_cross_together():
    """|x| has its corner where the moving wall stands still at zero: x = 0 and the wall are crossed
    at one instant, |x| - width isn't.
    """
    run = sl.simulate(
        walls.with_values(amplitude=0.0, width=0.5), (-1.0, 1.0), t_end=2.0, samples=4
    )
    assert [(c.guard, c.time, c.direction) for c in contacts(run)] == [
        ("width", 0.5, -1),
        ("x = amplitude*cos(2*pi*frequency*t)", 1.0, 1),
        ("x = 0", 1.0, 1),
        ("width", 1.5, 1),
    ]


@pytest.mark.parametrize("width", [0.0, 1e-15, 1e-9])
def test_corner_of_a_gap_on_its_own_boundary(width):
    """|x| - width has a corner at x = 0 and is (almost) zero there. However that is recorded: the
    mode after is right, no side violated.
    """
    run = sl.simulate(
        walls.with_values(amplitude=9.0, width=width), (-1.0, 1.0), t_end=2.0, samples=8
    )
    after = run.mode.values[run.time.values > 1.01]
    assert (after & 0b0110 == 0b0110).all()
    assert (
        sum(c.direction for c in contacts(run) if c.guard == "width" and c.kind == "crossing") == 0
    )
    assert int(run.mode_violations) == 0


def test_boundary_that_jumps_past_the_state():
    """A switch with hysteresis: when the velocity turns, its threshold jumps from 0.5 to -0.5 past
    x = 0.4, and the switch follows at once.

    x = -0.4 cos t: starts above the lower threshold... v > 0 from the start, so the threshold is
    0.5 and the switch is off; at t = pi the velocity turns, the threshold becomes -0.5: on.
    """
    run = sl.simulate(latch, (-0.4, 0.0), t_end=2 * math.pi - 0.1, samples=50)
    assert run.mode.values[1:].tolist() == [1 if t < math.pi else 2 for t in run.time.values[1:]]
    assert {round(c.time, 9) for c in contacts(run)} == {round(math.pi, 9)}
    assert int(run.mode_violations) == 0
