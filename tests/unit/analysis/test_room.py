"""Memory: what doesn't fit is refused with an estimate, and contacts without end stop where half of
what is free is used.
"""

import numpy as np
import pytest

import saltus as sl
from saltus.errors import SaltusWarning
from saltus.flow import room

rig = sl.models.delangre("b", force="4 N", frequency="15 Hz")
START = {"x": np.linspace(-4e-3, 4e-3, 12), "v": np.linspace(-0.5, 0.5, 12)}


@pytest.fixture
def small(monkeypatch):
    """A machine with 100 MB of free memory."""
    monkeypatch.setattr(room, "free", lambda: 100_000_000)


@pytest.mark.parametrize(
    ("call", "teaches"),
    [
        (
            lambda: sl.simulate(rig, START, periods=1000),
            r"12 trajectories with 200001 samples each "
            r".* need about 0\.115 GB .* keep=",
        ),
        (
            lambda: sl.stroboscope(rig, START, 10**6),
            r"12 trajectories with 1000001 periods each .* "
            r"need about 0\.576 GB .* keep=",
        ),
        (
            lambda: sl.basins(rig, x=(-1e-3, 1e-3, 1000), v=(-1.0, 1.0, 1000)),
            "1000 x 1000 cells are more than .* 0.418 GB .* coarser grid",
        ),
        (
            lambda: sl.basin_fractions(rig, x=(-1e-3, 1e-3), samples=10**10),
            r"10000000000 random "
            r"starts .* 1\.68e\+03 GB .* samples=",
        ),
        (
            lambda: sl.frequency_response(rig, (2.0, 30.0, 100_000)),
            "100000 values with 1 starts each .* coarser grid",
        ),
    ],
)
def test_what_does_not_fit_is_refused_with_its_size(small, call, teaches):
    with pytest.raises(sl.SaltusError, match=teaches) as refused:
        call()
    assert "half of the free memory is 0.05 GB" in str(refused.value)


def test_free_memory_is_told_and_sensible():
    assert 10**7 < room.free() < 10**15


def test_states_count(small):
    """What fits with two states doesn't with many."""
    room.check_room(2.5e7, "things", "Less.")
    from saltus.analysis.basins.pipeline import memory

    assert memory(10**6, 12) > 2 * memory(10**6, 2) - 2.5e8


def test_contacts_without_end_stop_in_time_with_what_came_before(monkeypatch):
    """Status budget_events, a sentence, and the first contacts of the whole run."""
    options = {"samples": 1, "time_errors": "local", "threads": 2}
    whole = sl.simulate(rig, START, periods=1500, **options)
    assert whole.sizes["contact"] > 30_000
    monkeypatch.setattr(
        room, "free", lambda: 2 * 20_000 * (room.CONTACT + 2 * room.CONTACT_OF_A_STATE)
    )
    with pytest.warns(SaltusWarning, match="filled half of the free memory.*keep="):
        part = sl.simulate(rig, START, periods=1500, **options)
    assert 20_000 <= part.sizes["contact"] < whole.sizes["contact"]
    assert set(part.status.values.tolist()) <= {"ok", "budget_events"}
    assert "budget_events" in part.status.values
    for row in range(len(START["x"])):
        mine = part.contact_time.values[part.contact_trajectory.values == row]
        np.testing.assert_array_equal(
            mine, whole.contact_time.values[whole.contact_trajectory.values == row][: len(mine)]
        )
