"""A few trajectories in one call: the lanes that they get, no thread of their own, and nothing kept
that belongs to another system.
"""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.motion import time_errors
from saltus.codegen.module import lane_width
from saltus.flow import engine
from saltus.flow.maps import Stroboscope
from saltus.flow.request import Request, Schedule
from saltus.flow.taylor import SMALL_BATCH
from saltus.interrupt import Interrupted
from saltus.kernels import status as st
from saltus.system import gap_units

RIG = sl.models.delangre("b", force="4 N", frequency="15 Hz")


def falling(length: str) -> sl.System:
    @sl.system(states="y vy", units={"y": length, "vy": f"{length}/s"})
    def falling(t, y, vy, *, level=0.1, stiffness=1e3):
        return vy, -sl.piecewise((stiffness * (y - level), 2 * y > 2 * level), otherwise=0)

    return falling


def test_few_trajectories_take_few_lanes_unless_the_user_chose():
    for count in (1, SMALL_BATCH, 2 * SMALL_BATCH):  # twice four cost less than half of sixteen
        assert sl.Taylor().suited_to(count) == sl.Taylor(lanes=min(SMALL_BATCH, lane_width()))
    assert sl.Taylor().suited_to(2 * SMALL_BATCH + 1) == sl.Taylor()
    assert sl.Taylor(lanes=16).suited_to(1) == sl.Taylor(lanes=16)
    assert sl.ODE45().suited_to(1) == sl.ODE45()


@pytest.mark.parametrize("method", [sl.Taylor(), sl.ODE45()], ids=["Taylor", "ODE45"])
def test_one_trajectory_is_the_first_of_many_with_every_estimate(method):
    # whose copies are calls of their own
    many = {"x": np.linspace(1e-3, 3e-3, time_errors.FEW + 1), "v": 0.0}
    alone, among = (
        sl.simulate(RIG, start, periods=12, method=method) for start in (("1 mm", 0.0), many)
    )
    mine = among.isel(trajectory=0, contact=among["contact_trajectory"].values == 0)
    assert alone.sizes["contact"] > 20
    for name in (
        "x",
        "v",
        "mode",
        "contact_time",
        "contact_time_error",
        "contact_velocity",
        "contact_steps",
        "end_x",
        "steps",
    ):
        np.testing.assert_array_equal(alone[name].values, mine[name].values, err_msg=name)
    assert alone.attrs["method_options"] == among.attrs["method_options"]


def test_a_trajectory_and_its_copies_are_one_call(monkeypatch):
    calls, run = [], time_errors.engine.run

    def counted(system, method, request, *rest):
        calls.append((len(request.start), request.checks, method.lanes))
        return run(system, method, request, *rest)

    monkeypatch.setattr(time_errors.engine, "run", counted)
    sl.simulate(RIG, (0.0, 0.0), periods=3)
    assert calls == [(1 + time_errors.COPIES, time_errors.COPIES, min(SMALL_BATCH, lane_width()))]


@pytest.mark.parametrize(
    "method", [sl.Taylor(lanes=4), sl.Taylor(lanes=2, tolerance=2.0**-40)], ids=["default", "loose"]
)
def test_checks_move_as_the_companion_moves_them_and_are_not_sampled(method):
    """Two tolerances in one call: each trajectory comes out as in a call of its own method, to the
    bit; the loose steps are longer.
    """
    start = np.array([[1e-3, 0.0], [2e-3, 0.0], [-1e-3, 0.5]])
    schedule = Schedule(np.arange(8), np.full(8, 0.25))
    values, period, count = (
        np.array([list(RIG.values.values())]),
        np.full(3, RIG.period()),
        np.full(3, 8),
    )
    request = Request.periods(
        start, values, period, count, schedule=schedule, record_from=0, checks=2
    )
    whole = engine.run(RIG, method, request)
    for first, last, mover in ((0, 1, method), (1, 3, method.companion())):
        n = last - first
        one = replace(
            request,
            start=start[first:last],
            period=period[:n],
            end_count=count[:n],
            end_phase=np.zeros(n),
            checks=0,
        )
        alone, part = engine.run(RIG, mover, one), whole.of(first, last)
        for name in ("state", "time", "status", "mode", "counters", "minima"):
            np.testing.assert_array_equal(getattr(part, name), getattr(alone, name), err_msg=name)
        for ours, theirs in zip(part.contacts.arrays, alone.contacts.arrays, strict=True):
            np.testing.assert_array_equal(ours, theirs)
        assert len(part.samples) == (1 if first == 0 else 0)
        np.testing.assert_array_equal(part.samples, alone.samples[: len(part.samples)])
    assert (
        whole.counters[0, st.STEPS]
        != engine.run(RIG, method.companion(), replace(request, checks=0)).counters[0, st.STEPS]
    )


def test_an_interrupted_run_shows_its_trajectories_and_no_copy(monkeypatch):
    def stopped(system, method, request, *rest):
        outcome = run(system, method, request, *rest)
        raise engine.RunInterrupted(lambda: outcome)

    run = time_errors.engine.run
    monkeypatch.setattr(time_errors.engine, "run", stopped)
    with pytest.raises(Interrupted) as caught:
        sl.simulate(RIG, {"x": [0.0, 1e-3], "v": 0.0}, periods=3)
    assert caught.value.partial.sizes["trajectory"] == 2
    assert set(caught.value.partial.contact_trajectory.values.tolist()) == {0, 1}


def test_a_single_run_starts_no_thread_and_reports_its_progress(monkeypatch):
    shares = []
    sl.simulate(RIG, (0.0, 0.0), periods=3)  # compiles
    monkeypatch.setattr(threading.Thread, "start", lambda _: pytest.fail("a thread was started"))
    sl.simulate(RIG, (0.0, 0.0), periods=3, progress=shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def test_what_is_kept_of_a_system_is_its_own():
    """Two systems of one name and one text, in different units, asked in turns; copies with other
    values share.
    """
    metres, radians = (falling(unit) for unit in ("m", "rad"))
    for _ in range(2):
        assert gap_units(metres) == ["m"]
        assert gap_units(radians) == ["rad"]
        assert gap_units(metres.with_values(level=0.2)) == ["m"]
    gap_units(metres).append("mine")
    assert gap_units(metres) == ["m"]


def test_nudges_leave_what_moves_a_boundary_or_time():
    fixed = time_errors._fixed(RIG.origin)
    assert {name for name, stays in zip(RIG.values, fixed, strict=True) if stays} == {
        "lower_gap",
        "upper_gap",
        "frequency",
    }
    other = falling("m")
    assert {
        name for name, stays in zip(other.values, time_errors._fixed(other), strict=True) if stays
    } == {"level"}


def test_rows_of_a_family_are_a_family_of_these_rows():
    """For a forced system and for one that is looked at; by numbers with repeats, and by a mask;
    nothing is shared.
    """
    values = np.array([list(RIG.values.values())] * 3)
    values[:, list(RIG.values).index("frequency")] = [10.0, 15.0, 20.0]
    other = falling("m")
    looked = Stroboscope(
        other,
        sl.Taylor(),
        np.array([[0.1, 1e3], [0.2, 1e3], [0.3, 2e3]]),
        np.array([0.1, 0.2, 0.3]),
    )
    for family, every in ((Stroboscope(RIG, sl.Taylor(), values), None), (looked, looked.period)):
        for which in (np.array([2, 0, 2]), np.array([True, False, True])):
            rows = family.rows(which)
            truth = Stroboscope(
                family.system,
                sl.Taylor(),
                family.parameters[which],
                every if every is None else every[which],
            )
            np.testing.assert_array_equal(rows.parameters, truth.parameters)
            np.testing.assert_array_equal(rows.period, truth.period)
            assert len(rows) == len(truth)
            assert not np.shares_memory(rows.period, family.period)
