"""Contact states of the modal flow that a set of parameter values has from the nearest one: to the
bit those that it makes by itself, so that no result depends on what was asked before.
"""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from saltus.flow.maps import Stroboscope
from saltus.flow.modal import modal_flow
from saltus.flow.modal_tables import HANDED
from saltus.kernels.modal import layout

MASS = np.diag([1.0, 2.0, 1.5])
STIFFNESS = np.array([[30.0, -12, 0], [-12, 25, -7], [0, -7, 20]])
#: A stop that is damped makes a mode that doesn't vibrate, where it touches.
CHAIN = sl.structure(
    MASS, STIFFNESS, damping_ratio=0.01, names="a b c", frequency=0.6, forces=[sl.Force("a", 3.0)],
    contacts=[
        sl.Contact("a", stiffness=90.0, gap=0.05, name="left"),
        sl.Contact("c", stiffness=40.0, damping=60.0, gap=0.02, side="both", name="right"),
    ],
)  # fmt: skip
#: Near to one another, so that most contact states are the same.
FREQUENCIES = (0.61, 0.611, 0.62, 0.609)


def _tangents(frequencies):
    """Ends and derivatives by the frequency and by the force, one set of values after the other."""
    found = []
    for frequency in frequencies:
        row = np.array([list(CHAIN.with_values(frequency=frequency).values.values())])
        map_ = Stroboscope(CHAIN, sl.Modal(), row)
        found.append(map_.tangent_by(np.full((1, 6), 0.03), 2, ("frequency", "force")))
    return found


@pytest.mark.nojit
def test_they_are_those_that_a_set_makes_by_itself():
    tables = modal_flow(CHAIN).tables
    tables.clear()
    together = _tangents(FREQUENCIES)
    made = len(tables.made)
    asked = sum(times == 0 for one in tables._handed for times in one.values())
    assert asked < made / 2, "most were handed on"
    for frequency, (end, matrix) in zip(FREQUENCIES, together, strict=True):
        tables.clear()
        ((own_end, own_matrix),) = _tangents([frequency])
        assert np.isfinite(own_matrix).all()
        assert np.array_equal(end, own_end)
        assert np.array_equal(matrix, own_matrix)


@pytest.mark.nojit
def test_derivatives_are_made_of_those_that_a_motion_comes_to():
    """A longer motion has left others at the values nearby, which this one doesn't ask for."""
    tables, names = modal_flow(CHAIN).tables, ("frequency",)
    tables.clear()
    rows = [list(CHAIN.with_values(frequency=one).values.values()) for one in FREQUENCIES[:2]]
    longer, short = (Stroboscope(CHAIN, sl.Modal(), np.array([row]), threads=1) for row in rows)
    longer.ends(np.full((1, 6), 0.03), 12)
    outcome = short.run(np.zeros((1, 6)), 1, record=0)
    met = {int(outcome.contacts.mode_before[0]), *outcome.contacts.mode_after.tolist()}
    for _ in range(2):
        short.tangent_by(np.zeros((1, 6)), 1, names)
    links = tables.by(names).links
    assert (links.table[: links.used, layout.SLOPES] >= 0).sum() == len(met)
    assert len(tables._handed[tables.set_of(np.array(rows[1]))]) > len(met)


def test_those_that_a_motion_comes_to_are_handed_on_for_ever():
    """Others, which no motion has come to since, only so many times."""
    tables, every = modal_flow(CHAIN).tables, 2**3 - 1
    tables.clear()
    rows = [
        np.array(list(CHAIN.with_values(frequency=0.6 + 1e-4 * k).values.values()))
        for k in range(HANDED + 3)
    ]
    tables.state_of(tables.set_of(rows[0]), every)
    tables.state_of(tables.set_of(rows[0]), 0)
    first = tables.made[tables.state_of(tables.set_of(rows[0]), every)][0]
    for row in rows[1:]:
        assert tables.made[tables.state_of(tables.set_of(row), every)][0] is first
    last = tables._handed[tables.set_of(rows[-1])]
    assert last == {every: 0}
    assert len(tables._handed[tables.set_of(rows[-3])]) == 2
