"""Contacts with a memory at large: random plays, sliders, ratchets, relays, tanks and followers, in
many spellings, against exact motions found mode by mode (oracles/memory_automaton.py).

The machines' modes and exits are their textbooks', written by hand; nothing is shared with the
flow.
``python -m oracles.memory_check COUNT SEED`` runs as many as one likes, with RK4 as second judge.
"""

from __future__ import annotations

import pytest

from oracles import memory_check

SYSTEMS = 25


def _agrees(seed, conditions=False):
    case = memory_check.case(seed, conditions)
    judged = memory_check.judge(case, rk4=conditions)
    ours = memory_check.answer(case, judged)
    assert ours.verdict in ("same", "undecidable"), (
        f"{seed}, {case.name}: {ours}, judge {judged}\n{case.reproduction()}"
    )


@pytest.mark.parametrize("seed", [f"1.{i}" for i in range(SYSTEMS)])
def test_elements_with_a_memory_end_where_their_machines_end(seed):
    _agrees(seed)


@pytest.mark.parametrize("seed", [f"1.{i}" for i in range(3)])
def test_joined_and_nested_conditions_end_where_rk4_ends(seed):
    _agrees(seed, conditions=True)


@pytest.mark.nightly
@pytest.mark.parametrize("conditions", [False, True])
def test_a_thousand_systems(conditions):
    for i in range(1000):
        _agrees(f"2.{i}", conditions)
