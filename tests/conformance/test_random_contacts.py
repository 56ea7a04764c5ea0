"""Rule 4 at large: random rigs, random starts, against the closed form of piecewise-linear arcs.
None missed, none invented.

The rig without its cubic term; every trajectory has its own damping, stiffness, gaps, force and
frequency. Ten periods each, about a hundred contacts. The oracle (oracles/piecewise_linear.py)
shares no code and no idea with the flow: it knows the arcs in closed form.
"""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from oracles import piecewise_linear, verdict

GUARD = {"lower_gap": piecewise_linear.LOWER, "upper_gap": piecewise_linear.UPPER}
RIG = sl.models.delangre("b", cubic=0.0)


def _compare(trajectories: int, seed: int, compiled: bool):
    parameters, x, v, t_end = piecewise_linear.random_cases(trajectories, seed)
    drive = {name: parameters[name] for name in piecewise_linear.PARAMETERS}
    truth = piecewise_linear.contacts(drive, x, v, t_end, compiled=compiled)
    ours = {name: column for name, column in parameters.items() if name != "drive"}
    run = sl.simulate(RIG, {"x": x, "v": v}, periods=10, values=ours, samples=1, keep=10)
    crossing = run.contact_mode_before.values != run.contact_mode_after.values
    guard = np.array([GUARD[str(name)] for name in run.contact_guard.values])
    table = [run[f"contact_{name}"].values[crossing] for name in ("trajectory", "time")]
    return truth, run, crossing, verdict.compare(truth, *table, guard[crossing])


def _check(trajectories, seed, compiled=False):
    truth, run, crossing, found = _compare(trajectories, seed, compiled)
    assert (found.missed, found.invented) == ([], [])
    assert found.worst < 1
    assert found.compared > 95 * trajectories
    assert found.left_out < 0.02 * found.compared
    assert not run.mode_violations.any()
    assert set(run.status.values.tolist()) <= {"ok", "graze_unresolved"}
    return truth, run, crossing


def test_ten_thousand_random_contacts():
    """10^4 contacts of 100 rigs: none missed, none invented, times within 1e-12 t and 20 deviations
    of the oracle's own rounding.
    """
    truth, run, crossing = _check(100, 2021)
    who = run.contact_trajectory.values[crossing]
    checked = 0
    for i in range(100):
        rows = truth.of(i)
        mine = np.flatnonzero(crossing)[who == i]
        n = min(len(rows), len(mine))
        off = np.abs(run.contact_time.values[mine[:n]] - truth.time[rows[:n]])
        allowed = run.contact_time_error.values[mine[:n]] + 20 * truth.time_error[rows[:n]] + 1e-15
        assert (
            off[truth.time_error[rows[:n]] < 1e-9] <= allowed[truth.time_error[rows[:n]] < 1e-9]
        ).all(), i
        checked += n
    assert checked > 9000


@pytest.mark.nightly
@pytest.mark.parametrize("seed", range(10))
def test_a_million_random_contacts(seed):
    """10^5 contacts of each of ten seeds: 10^6 in all."""
    _check(1000, seed, compiled=True)
