"""Shots end where the engine's runs do, to the bit, whatever was run in their arrays before."""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from conformance.systems import latch, slider, walls
from saltus.flow import engine
from saltus.flow.maps import Stroboscope
from saltus.flow.request import Request
from saltus.flow.shots import Shots
from saltus.kernels import status as st

TAYLOR = sl.Taylor(lanes=2)
CASES = {
    "walls": (walls.with_values(moving_stiffness=30.0, stiffness=5.0), 1.0, TAYLOR),
    "latch": (latch.with_values(gain=0.4), 2.0, TAYLOR),
    "sticks": (slider.with_values(force=2.0), 2.0, TAYLOR),
    "impacts": (sl.models.impact_oscillator(), 0.1, TAYLOR),
    "few steps": (walls.with_values(stiffness=5.0), 1.0, sl.Taylor(lanes=2, max_steps=5)),
    "ode45": (walls.with_values(stiffness=5.0), 1.0, sl.ODE45(1e-5, 1e-8)),
}


@pytest.mark.parametrize("case", CASES)
def test_ends_are_those_of_a_run(case):
    system, spread, method = CASES[case]
    rng, k = np.random.default_rng(3), 7
    values = np.array([list(system.values.values())])
    period = np.full(k, system.period() or 1.0)
    shots = Shots(system, method, values, period, 3)
    for count in (3, np.array([1, 2, 3, 0, 1, 2, 3])):
        start = rng.uniform(-spread, spread, (k, len(system.states)))
        start[2, 0] = np.nan
        outcome = engine.run(system, method, Request.periods(start, values, period, count), 1)
        state, status = shots.run(start, count)
        np.testing.assert_array_equal(state, outcome.state)
        np.testing.assert_array_equal(status, outcome.status)
        np.testing.assert_array_equal(shots.counters, outcome.counters)
        assert status[2] == st.INVALID
    assert case != "few steps" or st.BUDGET_STEPS in status


def test_a_map_keeps_the_shots_of_each_number_of_starts():
    map_ = Stroboscope(*CASES["walls"][::2])
    start = np.random.default_rng(4).uniform(-1.0, 1.0, (5, 2))
    for rows in (slice(0, 5), slice(1, 3), slice(0, 5), slice(4, 5)):
        ends, matrices = map_.tangent(start[rows], 2)
        whole, derivatives = map_.tangent(start, 2)
        np.testing.assert_array_equal(ends, whole[rows])
        np.testing.assert_array_equal(matrices, derivatives[rows])
    held = whole.copy()
    map_.tangent(start[::-1], 2)
    np.testing.assert_array_equal(whole, held)  # not overwritten by the next call
