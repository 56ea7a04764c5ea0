"""Budgets, overflow, invalid numbers: a name for each, never a silent NaN, and the neighbours in
the batch don't notice.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import saltus as sl
from conformance.systems import bent, bits, contacts, lab

# these tests look at the status themselves
pytestmark = pytest.mark.filterwarnings("ignore::saltus.errors.SaltusWarning")

# x'' = x^3: x = sqrt(2) / (1 - t) from (sqrt 2, sqrt 2)
BLOW_UP = bent.with_values(cubic=-1.0, boundary=0.5)
HEALTHY = {"x": [0.1, -0.2, 0.0, 0.3, 0.45, -0.4], "v": [0.01, 0.3, 0.0, -0.1, -0.4, 0.2]}


def test_blow_up_is_named():
    """The end: a finite state, a time just before the pole at t = 1, status nonfinite; samples
    beyond it are missing.
    """
    run = sl.simulate(BLOW_UP, (math.sqrt(2), math.sqrt(2)), t_end=3.0, samples=1000)
    assert str(run.status.values) == "nonfinite"
    assert 0.999 < float(run.end_time) <= 1.0 + 1e-9
    assert np.isfinite([float(run.end_x), float(run.end_v)]).all()
    assert int(run.steps) < 100_000
    before = run.time.values < 0.999
    assert run.x.values[before] == pytest.approx(
        math.sqrt(2) / (1 - run.time.values[before]), rel=1e-9
    )
    assert np.isnan(run.x.values[run.time.values > 1.001]).all()
    assert (run.mode.values[run.time.values > 1.001] == -1).all()


@pytest.mark.parametrize("place", [0, 3, 6])
def test_blow_up_stays_in_its_lane(place):
    """Six healthy neighbours, with contacts, are bitwise what they are without the one that blows
    up.
    """
    alone = sl.simulate(BLOW_UP, HEALTHY, t_end=2.0, samples=300)
    mixed = {"x": np.insert(HEALTHY["x"], place, 1e5), "v": np.insert(HEALTHY["v"], place, 1e9)}
    run = sl.simulate(BLOW_UP, mixed, t_end=2.0, samples=300)
    assert str(run.status[place].values) == "nonfinite"
    others = [i for i in range(7) if i != place]
    assert set(run.status.values[others].tolist()) == {"ok"}
    assert [bits(run, i) for i in others] == [bits(alone, i) for i in range(6)]


def test_numbers_near_the_end_of_the_range():
    """Starts of 1e200 overflow at once in x^3: nonfinite, at t0 or in the first step; 1e-200 is a
    number like any other.
    """
    run = sl.simulate(
        BLOW_UP, {"x": [1e200, -1e200, 1e-200], "v": [0.0, 0.0, 1e-200]}, t_end=1.0, samples=2
    )
    assert run.status.values.tolist() == ["nonfinite", "nonfinite", "ok"]
    assert np.isfinite(run.end_x.values).all()
    assert np.isfinite(run.end_time.values).all()
    assert float(run.end_x[2]) == pytest.approx(2e-200, rel=1e-12)


@sl.system(states="x")
def pole(t, x, *, gain=-1.0):
    """x' = gain / x: x = sqrt(x0^2 + 2 gain t), a pole of the right-hand side at x = 0; a guard
    that isn't a number below x = 0.
    """
    return (gain / x + sl.piecewise((1.0, sl.log(x) > 9.0), otherwise=0),)


def test_a_step_that_was_never_valid_takes_no_time():
    """A start in a pole ends at the start; one that runs into it, at the last node before it; so
    does one whose gap isn't a number.
    """
    run = sl.simulate(
        pole, {"x": [0.0, 0.5, -0.5]}, t_end=2.0, samples=4, method=sl.Taylor(lanes=2)
    )
    assert run.status.values.tolist() == ["nonfinite"] * 3
    assert run.end_time.values[[0, 2]].tolist() == [0.0, 0.0]
    assert run.end_x.values[[0, 2]].tolist() == [0.0, -0.5]
    assert run.steps.values[[0, 2]].tolist() == [0, 0]
    assert float(run.end_time[1]) == pytest.approx(0.125, abs=1e-12)
    assert float(run.end_x[1]) ** 2 == pytest.approx(0.25 - 2 * float(run.end_time[1]), abs=1e-14)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_start_that_is_no_number_is_refused(bad):
    """Refused before anything runs, with the place of the bad number."""
    for function in (
        lambda start: sl.simulate(lab, start, periods=1),
        lambda start: sl.stroboscope(lab, start, 1),
    ):
        with pytest.raises(ValueError, match="finite"):
            function((bad, 0.0))
        with pytest.raises(ValueError, match="index 2"):
            function({"x": [0.0, 1.0, bad], "v": [0.0, 0.0, 0.0]})


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_value_or_time_that_is_no_number_is_refused(bad):
    with pytest.raises(ValueError, match="lift"):
        sl.simulate(lab, (0.0, 0.0), periods=1, values={"lift": [0.0, bad]})
    with pytest.raises(ValueError, match="lift"):
        lab.with_values(lift=bad)
    with pytest.raises(ValueError, match="t_end"):
        sl.simulate(lab, (0.0, 0.0), t_end=bad)
    with pytest.raises(ValueError, match="t_start"):
        sl.simulate(lab, (0.0, 0.0), t_start=bad, t_end=1.0)


@pytest.mark.parametrize("most", [1, 2, 7, 50])
def test_budget_of_steps(most):
    """Stops once the budget is spent, by name, with the state and time where it stood; a neighbour
    that needs fewer goes on.
    """
    rig = sl.models.delangre("b")
    run = sl.simulate(rig, (1e-3, 0.0), periods=50, samples=4, method=sl.Taylor(max_steps=most))
    assert str(run.status.values) == "budget_steps"
    assert most <= int(run.steps) <= most + 1
    assert 0 < float(run.end_time) < 50 / 15
    whole = sl.simulate(rig, (1e-3, 0.0), t_end=float(run.end_time), samples=4)
    assert float(run.end_x) == pytest.approx(float(whole.end_x), abs=1e-16)


@pytest.mark.parametrize("most", [1, 2, 7, 50])
def test_budget_of_events(most):
    """Stops at the event that spends the budget, by name; the events before are those of an
    unlimited run.
    """
    rig = sl.models.delangre("b")
    run = sl.simulate(rig, (1e-3, 0.0), periods=50, samples=4, method=sl.Taylor(max_events=most))
    free = sl.simulate(rig, (1e-3, 0.0), periods=50, samples=4)
    assert str(run.status.values) == "budget_events"
    assert int(run.events) == most
    assert [c.time for c in contacts(run)] == [c.time for c in contacts(free)][:most]
    assert float(run.end_time) == contacts(free)[most - 1].time


SLOW = lab.with_values(spring=1e6, damping=0.02, force=1e6, frequency=2.5e-4, boundary=9.0)


def test_a_slow_drive_takes_the_steps_it_needs():
    """A drive 640 000 times slower than the oscillator: millions of steps in a period, and the
    steady motion of the closed form.
    """
    run = sl.simulate(SLOW, (2.0, 0.0), periods=1, samples=1, time_errors="local")
    assert str(run.status.values) == "ok"
    assert int(run.steps) > 1_000_000
    w = 2 * math.pi * 2.5e-4
    exact = 1e6 * (1e6 - w**2) / ((1e6 - w**2) ** 2 + (0.02 * w) ** 2)
    assert float(run.end_x) == pytest.approx(exact, rel=1e-9)  # e^-40 is left of the start


def test_a_run_that_would_never_end_says_how_long_it_takes():
    """A drive of 1e-6 Hz on the rig, whose force is then 2e12 N: stopped soon, with what the whole
    would take.
    """
    rig = sl.models.delangre("b", frequency=1e-6)
    with pytest.warns(
        sl.errors.SaltusWarning,
        match=r"of 1e\+06 s far in \d+ steps: at this pace "
        r".* steps \(some .* days\)",
    ):
        run = sl.simulate(rig, (0.0, 0.0), periods=1, samples=1, time_errors="local")
    assert str(run.status.values) == "budget_steps"


def test_budgets_are_those_of_each_trajectory():
    """A batch in which one meets its budget: the others reach the end."""
    run = sl.simulate(
        lab.with_values(spring=1.0, boundary=0.5),
        {"x": [0.1, 2.0, 0.2], "v": 0.0},
        t_end=90.0,
        samples=2,
        method=sl.Taylor(max_events=5),
    )
    assert run.status.values.tolist() == ["ok", "budget_events", "ok"]
    assert run.events.values.tolist() == [0, 5, 0]
