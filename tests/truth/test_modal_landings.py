"""Gaps that a landing has left behind their boundary, within what it rounds."""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from saltus.errors import SaltusWarning
from saltus.flow.modal import ModalFlow
from saltus.kernels.modal import layout

pytestmark = pytest.mark.nojit

GAP = 1e-3


def four_masses():
    """Four masses on springs, the first before a rigid stop."""
    stiffness = np.diag([1.0e4, 2.0e4, 3.0e4, 5.0e4])
    stop = sl.Contact("x1", restitution=0.5, gap=GAP, name="stop")
    return sl.structure(np.eye(4), stiffness, modes=4, contacts=[stop])


def left_behind(monkeypatch, by):
    """The run of a mass that other landings have left ``by`` behind its stop, from which it
    leaves: nothing is known of its gap any more.
    """
    begin = ModalFlow._begin

    def later(self, batch):
        new = batch.mode < 0
        begin(self, batch)
        batch.state[new, 0] += by
        batch.fresh[new] = 0
        for known in (layout.TWICE, layout.THRICE, layout.STARTS):
            batch.carry[new, known] = 0.0

    monkeypatch.setattr(ModalFlow, "_begin", later)
    return sl.simulate(
        four_masses(), (GAP, 0, 0, 0, -1e-3, 0, 0, 0), t_end=0.01, samples=2,
        method=sl.Modal(), time_errors="local", progress=False,
    )  # fmt: skip


#: Rounding of the gap: the sizes of the deflection and of the clearance.
NOISE = layout.ROUNDED * 2 * GAP


@pytest.mark.parametrize("times", [-0.5, 0.0, 0.5, 2.0, 3.5])
def test_a_gap_within_the_rounding_of_landings_leaves_its_stop(monkeypatch, times):
    run = left_behind(monkeypatch, times * NOISE)
    assert run.status.item() == "ok"
    assert run.sizes["contact"] == 0
    turn = 100.0 * 0.01
    exact = GAP * np.cos(turn) - 1e-3 / 100.0 * np.sin(turn)
    assert abs(run.end_q1.item() - exact) < 4 * NOISE


def test_a_gap_farther_behind_is_told_as_a_fault(monkeypatch):
    with pytest.warns(SaltusWarning, match="mode_violation"):
        run = left_behind(monkeypatch, 20 * NOISE)
    assert run.status.item() == "mode_violation"
