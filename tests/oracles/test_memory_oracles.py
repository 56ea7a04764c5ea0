"""The judges of systems with a memory: held to closed forms and to each other."""

from __future__ import annotations

import csv
import math

import numpy as np
import pytest

from oracles import memory_check, memory_textbook, written_equations

CASES = memory_textbook.cases()
with memory_textbook.TABLE.open(newline="") as _file:
    ROWS = [row for row in csv.DictReader(_file) if not row["case"].endswith("60_periods")]


@pytest.mark.parametrize("name", sorted({row["case"] for row in ROWS}))
def test_the_machine_gives_its_rows(name):
    found = memory_textbook.quantities(name, CASES[name])
    for row in ROWS:
        if row["case"] == name:
            assert abs(found[row["quantity"]] - float(row["value"])) < 3 * float(row["error"])


def test_closed_form_of_a_motion_that_is_held_and_released():
    """x = -1 + 2t - t^2/2 until 2 - sqrt 2, 0 until 2, then -(t - 2)^2 / 2."""
    x, c, y = CASES["held"].exact()
    assert abs(x + 2) < 1e-14
    assert abs(c + 2) < 1e-14
    assert abs(y - math.sqrt(2)) < 1e-14


def test_a_slider_is_the_same_by_its_place_and_by_its_force():
    place, force = CASES["prandtl"].exact(), CASES["jenkins"].exact()
    assert np.abs(place[:2] - force[:2]).max() < 1e-12
    assert abs(2 * (place[0] - place[2]) - force[2]) < 1e-12


def test_the_drifting_oscillator_is_met_where_other_solvers_meet_it():
    """Checked from outside: scipy mode by mode with terminal events, six digits."""
    found = memory_textbook.touches(CASES["drift_pieces_100"])
    assert np.round(found[:5], 6).tolist() == [0.316238, 5.800793, 6.970981, 11.719788, 15.397322]


@pytest.mark.parametrize("seed", [f"3.{i}" for i in range(12)])
@pytest.mark.slow
def test_machines_and_rk4_agree(seed):
    assert memory_check.judge(memory_check.case(seed)).apart < 1.0


@pytest.mark.slow
def test_rk4_of_a_text_has_order_four():
    tape = written_equations.read("def f(t, x, v, *, k=4.0):\n    return v, -k*x + sl.cos(t)\n")
    exact = (math.cos(1) - math.cos(2)) / 3
    off = [abs(written_equations.run(tape, (0, 0), 1.0, n)[0] - exact) for n in (50, 100)]
    assert abs(math.log2(off[0] / off[1]) - 4) < 0.1


@pytest.mark.slow
def test_a_jump_of_a_text_happens_where_its_condition_becomes_true():
    source = "def f(t, x, n):\n    return sl.cos(t), 0.0, sl.jump(x > 0.5, n=n + 1)\n"
    tape = written_equations.read(source)
    assert written_equations.run(tape, (0, 0), 20.0, 4000)[1] == 4
    assert written_equations.run(tape, (0.9, 0), 1.0, 4000)[1] == 0
