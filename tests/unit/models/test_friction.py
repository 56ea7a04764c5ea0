"""Published systems with dry friction and sliding against closed forms
(tests/reference/laws_friction.csv) and printed numbers.
"""

import csv
import math
from pathlib import Path

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.closed.orbits import find_orbits
from saltus.flow.maps import Stroboscope
from saltus.models import (
    belt_stribeck,
    belt_two_values,
    chattering_pair,
    den_hartog,
    dry_friction,
    pulled_pair,
    shaken_belt,
    two_blocks,
)

brentq = pytest.importorskip("scipy.optimize").brentq

with (Path(__file__).parents[2] / "reference" / "laws_friction.csv").open() as file:
    ROWS = {row["id"]: row["value"] for row in csv.DictReader(file)}


def known(row):
    return float(ROWS[row])


def late(system, start=(0.0, 0.0), periods=4, transient=400):
    """The last periods of a run."""
    end = sl.simulate(system, start, periods=transient, samples=1)
    return sl.simulate(system, (end.end_x.item(), end.end_v.item()), periods=periods)


# -- den Hartog's oscillator -----------------------------------------------------------------------
@pytest.mark.parametrize(("row", "frequency"), [("D01", 0.4), ("D03", 0.8), ("D05", 2.0)])
@pytest.mark.parametrize("stops", [False, True])
def test_the_largest_friction_without_stops(row, frequency, stops):
    friction = known(row) * (1 + (1e-6 if stops else -1e-6))
    run = late(den_hartog(frequency=frequency, friction_force=friction))
    assert ("hold" in run.contact_kind.values) == stops


@pytest.mark.parametrize(("row", "frequency"), [("D01", 0.4), ("D03", 0.8), ("D05", 2.0)])
def test_how_far_the_motion_is_from_a_stop(row, frequency):
    """The friction at which nothing is left, from motions a little below. At 0.4 the velocity comes
    near zero on the way, at the others what moves the mass at a turn is hardly more than friction.
    """
    frictions = known(row) * (1 - 1e-4 * np.arange(1, 5))
    settled = late(den_hartog(frequency=frequency, friction_force=frictions[0]), periods=1)
    start = np.array([[settled.end_x.item(), settled.end_v.item()]])
    left = []
    for friction in frictions:
        system = den_hartog(frequency=frequency, friction_force=friction)
        map_ = Stroboscope(system, sl.Taylor())
        found = find_orbits(map_, start, np.array([1]), 1 + abs(start), np.array([map_.noise]))
        run = sl.simulate(system, found.points[0, 0], periods=1)
        t, x = run.contact_time.values[0], run.contact_x.values[0]
        at_the_turn = abs(math.cos(frequency * t) - x) - friction
        left.append(run.smallest_gap_margin.item() if frequency < 0.5 else at_the_turn)
    assert min(left) > 0
    at_none = np.polynomial.polynomial.polyfit(left, frictions, 3)[0]
    assert at_none == pytest.approx(known(row), rel=1e-12)


@pytest.mark.parametrize("model", [den_hartog, dry_friction])
def test_what_moves_the_mass_at_a_turn_at_half_the_natural_frequency(model):
    """D07: F - 4/3 there, friction or not."""
    turn = 0.0 if model is den_hartog else math.pi
    system = model(frequency=0.5, friction_force=0.3)
    run = sl.simulate(system, (4 / 3, 0.0), t_start=turn, t_end=turn + 7.0)
    (x,), (t,) = run.contact_x.values, run.contact_time.values
    assert abs(math.cos((t - turn) / 2) - x) == pytest.approx(known("D07"), rel=1e-13)


@pytest.mark.parametrize("stops", [False, True])
@pytest.mark.parametrize("model", [den_hartog, dry_friction])
def test_the_point_of_codimension_two(model, stops):
    """D07: at half the natural frequency the symmetric response turns at x = 4/3 as the force does;
    its velocity is sin(t/2) (2f cos(t/2) - 2/3).
    """
    friction = known("D07") + (1e-9 if stops else -1e-9)
    system = model(frequency=0.5, friction_force=friction)
    turn = 0.0 if model is den_hartog else math.pi
    run = sl.simulate(system, (4 / 3, 0.0), t_start=turn, t_end=turn + 25.0, samples=500)
    assert ("hold" in run.contact_kind.values) == stops
    t = run.time.values - turn
    down = t < 2 * math.pi
    exact = np.sin(t / 2) * (2 * friction * np.cos(t / 2) - 2 / 3)
    np.testing.assert_allclose(run.v.values[down], exact[down], atol=1e-8 if stops else 1e-14)


def test_responses_without_stops_are_not_isolated_at_half_the_natural_frequency():
    """The free motion has come back at the next turning point: a deviation of x remains."""
    system = den_hartog(frequency=0.5, friction_force=0.3)
    for x in (4 / 3, 4 / 3 + 1e-3):
        run = sl.simulate(system, (x, 0.0), periods=1)
        assert "hold" not in run.contact_kind.values
        assert run.end_x.item() == pytest.approx(x, abs=2e-6)


def test_the_resonance_that_friction_does_not_bound():
    """D08: from one turning point to the next the amplitude X grows by pi/2 - 2f, as X grows."""
    frictions, turns = np.array([0.70, 0.75]), 200
    run = sl.simulate(
        den_hartog(frequency=1.0), (1e4, 0.0), t_start=math.pi / 2, t_end=(turns + 1) * math.pi,
        samples=1, values={"friction_force": frictions},
    )  # fmt: skip
    x, who = abs(run.contact_x.values), run.contact_trajectory.values
    growth = np.array([(x[who == i][turns - 1] - x[who == i][0]) / (turns - 1) for i in range(2)])
    np.testing.assert_allclose(growth, math.pi / 2 - 2 * frictions, rtol=1e-11)
    at_none = frictions[0] - growth[0] * np.diff(frictions)[0] / np.diff(growth)[0]
    assert at_none == pytest.approx(known("D08"), rel=1e-11)


def test_motion_without_stops():
    """D10, D10p."""
    found = sl.attractors(den_hartog(), (0.0, 0.0))
    assert found.attractor_period.values.tolist() == [1]
    assert found.attractor_peak.values == pytest.approx([known("D10")], rel=1e-12)
    run = late(den_hartog(), periods=1)
    upper = run.contact_x.values > 0
    phase = 0.6 * run.contact_time.values[upper] % (2 * math.pi)
    assert phase == pytest.approx([known("D10p")], rel=1e-11)


def map_of_stops(x):
    """From a stop at x > 0 to minus the x of the next: r = f = 0.5, arcs in closed form."""
    begin = 2 * math.acos(x - 0.5)  # where the spring and the force overcome the friction
    forced = np.array([4 / 3 * math.cos(begin / 2), -2 / 3 * math.sin(begin / 2)])
    free = np.array([x - 0.5, 0.0]) - forced

    def velocity(t):
        s = t - begin
        return -free[0] * math.sin(s) + free[1] * math.cos(s) - 2 / 3 * math.sin(t / 2)

    end = brentq(velocity, begin + 2.0, begin + 2 * math.pi, xtol=1e-15)
    s = end - begin
    return -(free[0] * math.cos(s) + free[1] * math.sin(s) + 4 / 3 * math.cos(end / 2) + 0.5)


def test_motion_with_two_stops_a_cycle():
    """D20, D20s, D20t."""
    system = den_hartog(frequency=0.5, friction_force=0.5)
    found = sl.attractors(system, (0.0, 0.0))
    assert found.attractor_peak.values == pytest.approx([known("D20")], rel=1e-13)
    # a stop forgets the velocity; what it remembers of x is the slope of the map of stops, twice
    slope = (map_of_stops(known("D20") + 1e-4) - map_of_stops(known("D20") - 1e-4)) / 2e-4
    multipliers = np.sort(found.attractor_multiplier_real.values[0])
    np.testing.assert_allclose(multipliers, [0.0, slope**2], atol=1e-6)
    assert map_of_stops(known("D20")) == pytest.approx(known("D20"), rel=1e-13)
    run = late(system, periods=3)
    kinds, times = run.contact_kind.values, run.contact_time.values
    releases = np.flatnonzero(kinds == "release")
    stops = [times[i] - times[i - 1] for i in releases if i and kinds[i - 1] == "hold"]
    np.testing.assert_allclose(stops, known("D20s"), rtol=1e-12)
    upper = releases[run.contact_x.values[releases] > 0]
    np.testing.assert_allclose(times[upper] % (4 * math.pi), known("D20t"), rtol=1e-12)


# -- belts -----------------------------------------------------------------------------------------
def slips(run):
    """Durations of slips and sticks, the first left out, and x where sticking begins."""
    kinds, times = run.contact_kind.values, run.contact_time.values
    assert kinds[2:6].tolist() in (["hold", "release"] * 2, ["release", "hold"] * 2)
    spans, ends = np.diff(times)[2:], kinds[3:]
    return (
        spans[ends == "hold"],
        spans[ends == "release"],
        run.contact_x.values[kinds == "hold"][2:],
    )


def test_stick_and_slip_with_two_values():
    """A slip is an arc about x = 0.5, from x = 1 at the speed of the belt back to that speed."""
    run = sl.simulate(belt_two_values(), (0.0, 0.0), t_end=60.0, samples=20000)
    slip, stick, _ = slips(run)
    radius = math.hypot(0.5, 0.2)
    np.testing.assert_allclose(stick, 5.0, rtol=1e-13)
    np.testing.assert_allclose(slip, 2 * (math.pi - math.atan(0.5 / 0.2)), rtol=1e-13)
    assert float(run.x.max()) == pytest.approx(0.5 + radius, abs=1e-5)
    assert 0.5 + radius == pytest.approx(1.0385164807134504, rel=1e-15)


def test_stick_and_slip_with_falling_friction():
    """L01a to L01c."""
    run = sl.simulate(belt_stribeck(), (0.0, 0.0), t_end=80.0)
    slip, stick, x = slips(run)
    np.testing.assert_allclose(slip, known("L01a"), rtol=1e-13)
    np.testing.assert_allclose(x, known("L01b"), rtol=1e-13)
    np.testing.assert_allclose(slip[1:3] + stick[1:3], known("L01c"), rtol=1e-13)


@pytest.mark.parametrize(
    ("model", "period"), [(belt_two_values, 8.902605407814523), (belt_stribeck, known("L01c"))]
)
def test_stick_and_slip_is_a_limit_cycle_that_forgets(model, period):
    """Wherever it slips, all of a deviation across the flow is gone after one stick."""
    found = sl.attractors(model(), (0.0, 0.0), every=1.0)
    assert found.attractor_type.values.tolist() == ["limit_cycle"]
    assert found.attractor_cycle.values == pytest.approx([period], rel=1e-12)
    multipliers = np.sort(found.attractor_multiplier_real.values[0])
    np.testing.assert_allclose(multipliers, [0.0, 1.0], atol=1e-12)


def test_the_belt_that_changes_its_speed():
    """DISODE45, example 2; in the second contact it sticks."""
    run = sl.simulate(shaken_belt(), (3.0, 0.0), t_end=30.0)
    exact = [
        7.6055699647458, 9.4833785788648, 9.7652587544591, 14.805105689085, 17.458939643915,
        26.13168182465, 27.291156893477,
    ]  # fmt: skip
    np.testing.assert_allclose(run.contact_time.values, exact, rtol=1e-13)
    assert run.contact_kind.values[1] == "hold"


def test_friction_alone():
    """DISODE45, example 0: x'' = -x - 0.4 sgn x'; turns at k pi, the last time for good."""
    system = shaken_belt(damping=0.0, force=0.0, speed=0.0, shake=0.0)
    run = sl.simulate(system, (3.0, 0.0), t_end=20.0)
    np.testing.assert_allclose(run.contact_time.values, math.pi * np.arange(1, 5), rtol=1e-14)
    np.testing.assert_allclose(run.contact_x.values, [-2.2, 1.4, -0.6, -0.2], atol=1e-14)
    assert run.contact_kind.values.tolist() == ["crossing"] * 3 + ["hold"]
    assert run.end_x.item() == pytest.approx(-0.2, abs=1e-14)


# -- several contacts ------------------------------------------------------------------------------
def test_two_blocks():
    """DISODE45, example 1, prints 18 switches; the exact last one, by arcs of solve_ivp at a
    tolerance of 1e-13, is 10.819728308710651, where it prints 10.82038526.
    """
    run = sl.simulate(two_blocks(), (-2.0, 3.0, 0.0, 0.0), t_end=12.0)
    times = run.contact_time.values
    assert len(times) == 18
    assert times[0] == pytest.approx(1.0524788191283, abs=5e-14)
    assert times[-1] == pytest.approx(10.819728308710651, abs=1e-10)
    assert times[-1] == pytest.approx(10.82038526, abs=1e-3)


def test_the_pulled_pair():
    """code_aster prints x1(.15) = 1.35332, x2(.15) = 1.80751, x2(.34) = 3.96813, t1 = 0.03512 and
    t3 = 0.31492.
    """
    run = sl.simulate(pulled_pair(), (0.0, 0.0, 0.0, 0.0), t_end=0.34)
    assert run.contact_kind.values.tolist() == ["release", "hold"]
    first, last = run.contact_time.values
    assert first == pytest.approx(math.pi / 2 * math.sqrt(5 / 1e4), rel=1e-13)
    assert last == pytest.approx(0.31492, abs=5e-6)
    assert run.end_x2.item() == pytest.approx(3.96813, abs=1e-5)
    middle = sl.simulate(pulled_pair(), (0.0, 0.0, 0.0, 0.0), t_end=0.15)
    assert middle.end_x1.item() == pytest.approx(1.35332, abs=2e-5)
    assert middle.end_x2.item() == pytest.approx(1.80751, abs=3e-5)


def test_the_chattering_pair():
    """M10: OpenModelica, issue 12190, where it chatters for ever."""
    run = sl.simulate(chattering_pair(), (1.5, 1.0), t_end=1.0)
    assert run.contact_time.values == pytest.approx([1 / 7], rel=1e-15)
    meet = 1.5 - 2 / 7
    assert run.end_x.item() == pytest.approx(meet - 3 / 8.5 * (1 - 1 / 7), rel=1e-14)
    assert run.end_y.item() == pytest.approx(run.end_x.item(), rel=1e-15)


@sl.system(states="x")
def chattering(t, x, *, level=0.5):
    """OpenModelica, issue 9711: the rate is 1 below the level, -1 above it."""
    return sl.piecewise((-1.0, x > level), otherwise=1.0)


def test_a_state_that_both_sides_push_back_stays():
    """M12."""
    run = sl.simulate(chattering, [0.0], t_end=1.0)
    assert run.contact_kind.values.tolist() == ["hold"]
    assert run.contact_time.values == pytest.approx([0.5], rel=1e-15)
    assert run.end_x.item() == 0.5


# -- sliding in the plane --------------------------------------------------------------------------
@sl.system(states="x y")
def invisible(t, x, y, *, across=1.0):
    """Filippov: y falls above the line, below it y' = 1 - x."""
    above = y > 0
    return (
        sl.piecewise((across, above), otherwise=1.0),
        sl.piecewise((-1.0, above), otherwise=1 - x),
    )


def test_sliding_begins_and_ends():
    """F01, F02: from (-1, 1) it slides from t = 1, x = 0, to t = 2, x = 1."""
    run = sl.simulate(invisible, (-1.0, 1.0), t_end=3.0)
    assert run.contact_kind.values[:2].tolist() == ["hold", "release"]
    for number, row in enumerate(("F01", "F02")):
        exact = [float(text) for text in ROWS[row].split(";")]
        found = [run.contact_time.values[number], run.contact_x.values[number]]
        np.testing.assert_allclose(found, exact, atol=1e-14)


def test_the_time_of_sliding_with_two_speeds():
    """F04: along the line x' is Filippov's convex combination (3 - 2x)/(2 - x)."""
    run = sl.simulate(invisible.with_values(across=2.0), (-2.0, 1.0), t_end=3.0)
    assert run.contact_kind.values[:2].tolist() == ["hold", "release"]
    assert np.diff(run.contact_time.values[:2]) == pytest.approx([known("F04")], rel=1e-13)
