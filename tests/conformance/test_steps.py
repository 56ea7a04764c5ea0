"""The answer doesn't depend on how it is stepped: orders, tolerances, the cutting into periods; and
no step is longer than its series.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

import saltus as sl
from conformance.systems import EPS, lab

RIG = sl.models.delangre("b")
STARTS = {"x": np.linspace(-5e-3, 5e-3, 16), "v": np.linspace(1, -1, 16)}


def _ends(method, periods=5):
    run = sl.simulate(RIG, STARTS, periods=periods, samples=1, method=method, time_errors="local")
    return (
        run.end_x.values,
        run.end_v.values,
        int(run.steps.sum()),
        run.contact_guard.values.tolist(),
    )


def test_tolerances_agree_to_their_tolerance():
    """From 2^-10 to 2^-46: errors fall with the tolerance, down to rounding, at a cost that rises
    with its logarithm; contacts stay.
    """
    exact_x, _, most, guards = _ends(sl.Taylor(tolerance=2.0**-52))
    errors, steps = [], []
    for power in (10, 16, 22, 28, 34, 40, 46):
        x, _, count, same = _ends(sl.Taylor(tolerance=2.0**-power))
        errors.append(float(np.abs(x - exact_x).max()))
        steps.append(count)
        assert same == guards
        assert errors[-1] < 500 * 2.0**-power * 5e-3 + 2e-14
    assert all(
        later < earlier / 4 or later < 2e-14 for earlier, later in itertools.pairwise(errors)
    )
    assert errors[-1] < 1e-14
    # of 12 bits: a coarse step that proves nothing is tried shorter, so 6 may cost nothing
    assert steps[::2] == sorted(steps[::2])
    assert steps[-1] < most < 3 * steps[0] * 5


def test_orders_agree():
    """Order 9 and order 20: the same motion to rounding; the higher order takes fewer steps."""
    high, low = (_ends(sl.Taylor(order=order, tolerance=2.0**-50, lanes=4)) for order in (20, 9))
    assert np.abs(high[0] - low[0]).max() < 2e-14
    assert np.abs(high[1] - low[1]).max() < 2e-12
    assert high[2] < low[2]
    assert high[3] == low[3]


def test_cutting_the_span_changes_nothing_but_rounding():
    """An undamped oscillator with a boundary, forced at zero force with periods from a thousandth
    of its own to a hundred of its own.
    """
    ends = []
    for frequency in (0.0015, 0.011, 0.3, 7.0, 150.0):
        system = lab.with_values(spring=1.0, stiffness=8.0, boundary=0.3, frequency=frequency)
        run = sl.simulate(system, (1.0, 0.0), t_end=60.0, samples=1)
        ends.append((float(run.end_x), float(run.end_v), int(run.events)))
    ends = np.array(ends)
    assert np.ptp(ends[:, :2], axis=0).max() < 1e-12
    assert np.ptp(ends[:, 2]) == 0


@sl.system(states="x v a j")
def lacunary(t, x, v, a, j):
    return v, a, j, -(t**4) * x


def test_a_series_with_gaps_does_not_let_the_step_run_away():
    """x'''' = -t^4 x from t = 0: only every eighth coefficient of x isn't zero, the last two of
    every state are.
    """
    t, term, exact, k = 4.0, 1.0, 0.0, 0
    for _ in range(60):
        exact += term
        k += 8
        term *= -(t**8) / (k * (k - 1) * (k - 2) * (k - 3))
    run = sl.simulate(lacunary, (1.0, 0.0, 0.0, 0.0), t_end=t, samples=1)
    assert float(run.end_x) == pytest.approx(exact, rel=1e-11)


def test_a_start_at_rest_with_a_jerk_takes_few_steps():
    """Displacement, velocity and acceleration are zero, the jerk isn't: a step must not shrink to
    nothing.
    """
    # x'' = cos(pi t) - 1 - x
    system = lab.with_values(force=1.0, lift=-1.0, spring=1.0, boundary=9.0, frequency=0.5)
    run = sl.simulate(system, (0.0, 0.0), t_end=1.0, samples=1)
    w = math.pi
    exact = (math.cos(w) - math.cos(1.0)) / (1 - w**2) - 1 + math.cos(1.0)
    assert float(run.end_x) == pytest.approx(exact, abs=8 * EPS)
    assert int(run.steps) < 8


@pytest.mark.parametrize("scale", [1e-12, 1e-3, 1.0, 1e6])
def test_slow_and_fast_neighbours_in_one_state(scale):
    """A displacement far from zero with a tiny oscillation on it: the oscillation keeps its digits
    relative to the whole.
    """
    system = lab.with_values(spring=1.0, lift=1.0, boundary=1e9)  # rest at x = 1
    run = sl.simulate(system, (1.0 + scale, 0.0), t_end=50.0, samples=1)
    begun = (1.0 + scale) - 1.0
    assert float(run.end_x) == pytest.approx(
        1 + begun * math.cos(50.0), abs=200 * EPS * max(1, scale)
    )
