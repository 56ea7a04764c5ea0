"""Memory: what doesn't fit is refused with an estimate, and contacts without end stop where half of
what is free is used.
"""

import tracemalloc

import numpy as np
import pytest

import saltus as sl
from saltus.errors import SaltusWarning
from saltus.flow import room
from saltus.study.read import parse
from saltus.study.run.running import Resources
from saltus.study.run.study import run_study

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


MANY = 10**7
AXIS = {"x": (-1e-3, 1e-3, MANY), "v": 0.0}
BOX = {"x": (-1e-3, 1e-3), "v": (-1.0, 1.0)}
WIDE = ("2 Hz", "30 Hz", MANY)


@pytest.mark.parametrize(
    "call",
    [
        lambda: sl.basins(rig, x=(-1e-3, 1e-3, MANY), v=(-1.0, 1.0, MANY)),
        lambda: sl.basins(rig, x=(1e-4, 1e-3, MANY, "log"), v=(-1.0, 1.0, 2)),
        lambda: sl.basin_fractions(rig, **BOX, samples=MANY),
        lambda: sl.frequency_response(rig, WIDE),
        lambda: sl.frequency_response(rig, [12.0, 13.0], f"random {MANY}", box=BOX),
        lambda: sl.bifurcation_diagram(rig, {"frequency": WIDE, "force": ("1 N", "2 N", MANY)}),
        lambda: sl.bifurcation_diagram(rig, {"frequency": ("2 Hz", "30 Hz", 10)}, AXIS),
        lambda: sl.branches(rig, {"frequency": (12.0, 18.0)}, at=MANY),
        lambda: sl.branches(rig, {"frequency": (12.0, 18.0)}, f"random {MANY}", box=BOX),
        lambda: sl.periodic_orbits(rig, f"random {MANY}", box=BOX),
        lambda: sl.periodic_orbits(rig, AXIS),
        lambda: sl.simulate(rig, AXIS, periods=1, samples=1),
        lambda: sl.simulate(rig, (0, 0), t_end=1, values={"frequency": WIDE}),
        lambda: sl.simulate(rig, (0, 0), periods=1, samples=MANY),
        lambda: sl.simulate(sl.models.falling_ball(), (1, 0), t_end=1, samples=MANY),
        lambda: sl.stroboscope(rig, AXIS, 1),
        lambda: sl.stroboscope(rig, (0, 0), MANY),
        lambda: sl.poincare(rig, AXIS, periods=1, surface="v turns"),
        lambda: sl.impact_statistics(rig, AXIS, periods=1),
        lambda: sl.impact_statistics(rig, periods=1, bins=MANY),
        lambda: sl.energy_balance(rig, AXIS, periods=1, **sl.models.energy("delangre")),
        lambda: sl.attractors(rig, AXIS),
        lambda: sl.lyapunov(rig, AXIS),
        lambda: sl.lyapunov(rig, (0, 0), method="wolf", periods=MANY),
    ],
)
def test_what_is_refused_is_counted_before_there_is_an_array_of_it(small, call):
    """An array of ten million numbers is one of 80 MB."""
    tracemalloc.start()
    try:
        with pytest.raises(sl.SaltusError, match="more than fits here"):
            call()
        assert tracemalloc.get_traced_memory()[1] < 2**23
    finally:
        tracemalloc.stop()


QUESTIONS = {
    "basins": f"""
        [basins]
        axes.x = {{first = "-1 mm", last = "1 mm", count = {MANY}}}
        axes.v = {{first = "-1 m/s", last = "1 m/s", count = {MANY}}}
    """,
    "responses": f"""
        [frequency_response]
        frequency = {{first = "5 Hz", last = "9 Hz", count = {MANY}}}
    """,
}


@pytest.mark.parametrize("question", QUESTIONS)
def test_a_study_is_counted_before_there_is_an_array_of_it(small, tmp_path, question):
    text = '[study]\nname = "wide"\n[system]\nmodel = "delangre"\n' + QUESTIONS[question]
    study, resources = parse(text), Resources(threads=1)
    tracemalloc.start()
    try:
        with pytest.raises(sl.SaltusError, match="more than fits here"):
            run_study(study, text, tmp_path, None, resources, lambda _: None, [].append, False)
        assert tracemalloc.get_traced_memory()[1] < 2**24
    finally:
        tracemalloc.stop()


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
    with (
        pytest.warns(SaltusWarning, match="12 of 12 trajectories: budget_events"),
        pytest.warns(SaltusWarning, match="filled half of the free memory.*keep="),
    ):
        part = sl.simulate(rig, START, periods=1500, **options)
    assert 20_000 <= part.sizes["contact"] < whole.sizes["contact"]
    assert set(part.status.values.tolist()) <= {"ok", "budget_events"}
    assert "budget_events" in part.status.values
    for row in range(len(START["x"])):
        mine = part.contact_time.values[part.contact_trajectory.values == row]
        np.testing.assert_array_equal(
            mine, whole.contact_time.values[whole.contact_trajectory.values == row][: len(mine)]
        )
