"""Structures at the edges of what is served, leg by leg by matrix exponentials."""

from __future__ import annotations

import numpy as np
import pytest

from oracles.structure_legs import asked, check

SEED = 20261127
# damping beyond critical, motions whose budget is used up, bodies that rest
pytestmark = pytest.mark.filterwarnings("ignore::saltus.errors.SaltusWarning")


@pytest.mark.slow
def test_no_contact_is_missed_and_each_is_where_it_is():
    """In units of the motion; rounding of modes that nearly coincide may be multiplied by 2^10."""
    contacts = 0
    for number in range(25):
        status, found = asked(SEED, number)
        assert status in ("ok", "resting", "budget_events", "budget_steps")
        assert found.missed == [], number
        assert found.state < 1e-10, number
        contacts += found.contacts
    assert contacts > 1000


@pytest.mark.nightly
@pytest.mark.parametrize("seed", range(8))
def test_nor_are_those_of_hundreds_of_structures(seed):
    """States to 1e-7: where stops 1e9 times as stiff touch an overdamped structure, their rounding
    has been 1e-8.
    """
    for number in range(50):
        _, found = asked(SEED + 1 + seed, number)
        assert found.missed == [], number
        assert found.state < 1e-7, number


def test_a_contact_that_is_left_out_is_seen():
    import saltus as sl

    stiffness = np.array([[300.0, -100.0], [-100.0, 250.0]])
    made = sl.structure(
        np.eye(2), stiffness, modes=2, frequency=2.0, forces=[sl.Force("x1", 5.0)],
        contacts=[sl.Contact("x1", stiffness=2e3, gap=0.01, side="both")],
    )  # fmt: skip
    run = sl.simulate(
        made, np.zeros(4), periods=4, method=sl.Modal(), progress=False, time_errors="local"
    )
    assert check(made, run).missed == []
    few = run.isel(contact=np.arange(run.sizes["contact"]) % 6 < 4)
    assert check(made, few).missed
