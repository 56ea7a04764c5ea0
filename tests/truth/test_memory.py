"""Contacts with a memory: plays, sliders, ratchets, integrators with limits, followers, against
ends found mode by mode (reference/memory.csv; the equations are in oracles/memory_textbook.py).
"""

from __future__ import annotations

import csv

import pytest

import saltus as sl
from oracles import memory_textbook

CASES = memory_textbook.cases()
with memory_textbook.TABLE.open(newline="") as _file:
    ROWS = list(csv.DictReader(_file))


@pytest.mark.parametrize("name", CASES)
def test_ends_are_exact(name):
    case = CASES[name]
    run = sl.simulate(case.system(), case.start, t_end=case.t_end, samples=2)
    assert run.status.item() == "ok"
    assert run.mode_violations.item() == 0
    rows = [r for r in ROWS if r["case"] == name and not r["quantity"].startswith("touch")]
    for row in rows:
        value = float(row["value"])
        allowed = 3 * float(row["error"]) + 1e-11 * (1 + abs(value))
        assert abs(run[f"end_{row['quantity']}"].item() - value) < allowed, row


def test_a_follower_is_met_and_left_when_other_solvers_say():
    case = CASES["drift_pieces_100"]
    run = sl.simulate(case.system(), case.start, t_end=case.t_end, samples=2)
    rows = [r for r in ROWS if r["case"] == "drift_pieces_100"]
    touches = [float(r["value"]) for r in rows if r["quantity"].startswith("touch")]
    times = run.contact_time.values
    assert max(min(abs(times - t)) for t in touches) < 1e-10
