"""Ctrl-C while trajectories are computed: at whatever moment it comes, what is kept is the
beginning of the undisturbed answer.
"""

import _thread
import contextlib
import itertools
import os
import signal
import sys
import threading
import time
import weakref

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.basins import basins, labels, pipeline
from saltus.flow import engine
from saltus.flow.maps import Stroboscope
from saltus.flow.threads import on_threads
from saltus.interrupt import Stop, check_stop, ctrl_c_waits, no_ctrl_c_is_lost
from saltus.results.dataset.kinds import Kind

START = {"x": np.linspace(-4e-3, 4e-3, 24), "v": np.linspace(-0.5, 0.5, 24)}


class Interrupting(list):
    """A list on whose third addition Ctrl-C is pressed."""

    def append(self, item):
        super().append(item)
        if len(self) == 3:
            _thread.interrupt_main()
            time.sleep(0.2)


@pytest.fixture(autouse=True)
def ctrl_c():
    """Ctrl-C counts, also where the tests were started in the background, for which shells switch
    it off.
    """
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize(
    ("threads", "chunk", "progress"), [(1, 8, None), (2, 8, None), (2, 24, None), (2, 24, False)]
)
def test_contacts_of_an_interrupted_run_are_the_first_of_the_whole(
    threads, chunk, progress, monkeypatch
):
    """Pressed while a table of contacts is put away, and again and again while the run ends."""
    rig = sl.models.delangre("b", force="4 N", frequency="15 Hz")
    monkeypatch.setattr(engine, "CHUNK", chunk)
    monkeypatch.setattr(engine, "SLICE", 200)
    whole = sl.simulate(rig, START, periods=60, threads=threads)
    cut = engine._cut

    def interrupting(*args):
        chunk = cut(*args)
        chunk.contacts = Interrupting()
        return chunk

    monkeypatch.setattr(engine, "_cut", interrupting)
    with pytest.raises(sl.Interrupted) as stopped:
        sl.simulate(rig, START, periods=60, threads=threads, progress=progress)
    part = stopped.value.partial
    assert 0 < part.sizes["contact"] < whole.sizes["contact"]
    for row in range(len(START["x"])):
        mine = part.contact_time.values[part.contact_trajectory.values == row]
        theirs = whole.contact_time.values[whole.contact_trajectory.values == row]
        np.testing.assert_array_equal(mine, theirs[: len(mine)])


# -- a request from another thread -----------------------------------------------------------------
class Holding:
    """Holds work at a moment until another thread has asked it to stop."""

    def __init__(self):
        self.stop, self.begun, self._asked = sl.Stop(), threading.Event(), threading.Event()

    def here(self):
        """The moment."""
        self.begun.set()
        assert self._asked.wait(300)

    def partial(self, call, *ready):
        """What a call in another thread has finished when this one asks it to stop."""
        found = []

        def work():
            try:
                with self.stop:
                    call()
            except sl.Interrupted as stopped:
                found.append(stopped.partial)

        thread = threading.Thread(target=work)
        thread.start()
        for event in (self.begun, *ready):
            assert event.wait(300)
        self.stop.set()
        self._asked.set()
        thread.join(300)
        (partial,) = found
        return partial


def test_a_run_ends_on_request_as_it_does_on_ctrl_c(monkeypatch):
    rig, holding = sl.models.delangre("b", force="4 N", frequency="15 Hz"), Holding()
    monkeypatch.setattr(engine, "CHUNK", 8)
    monkeypatch.setattr(engine, "SLICE", 200)
    whole = sl.simulate(rig, START, periods=60, threads=1, progress=False)
    cut = engine._cut

    class Held(list):
        def append(self, item):
            super().append(item)
            if len(self) == 3:
                holding.here()

    def held(*args):
        chunk = cut(*args)
        chunk.contacts = Held()
        return chunk

    monkeypatch.setattr(engine, "_cut", held)
    part = holding.partial(lambda: sl.simulate(rig, START, periods=60, threads=1, progress=False))
    assert set(part.variables) == set(whole.variables)
    assert {"interrupted", "not_computed"} == set(part.status.values)
    assert 0 < part.sizes["contact"] < whole.sizes["contact"]
    for row in range(len(START["x"])):
        mine = part.contact_time.values[part.contact_trajectory.values == row]
        theirs = whole.contact_time.values[whole.contact_trajectory.values == row]
        np.testing.assert_array_equal(mine, theirs[: len(mine)])


def test_a_map_ends_on_request_as_it_does_on_ctrl_c(monkeypatch):
    rig, holding, labelled = (
        sl.models.delangre("b", force="4 N", frequency="16 Hz"),
        Holding(),
        threading.Event(),
    )
    axes = {"x": ("-5 mm", "5 mm", 12), "v": ("-1 m/s", "1 m/s", 12)}
    monkeypatch.setattr(labels, "PIECE", 24)
    monkeypatch.setattr(labels, "FEWEST", 1)
    monkeypatch.setattr(pipeline, "SCOUTS", 64)
    whole = sl.basins(rig, **axes, threads=1, progress=False)
    settle, pieces = basins.settle, itertools.count()

    def held(*given):
        if next(pieces) == 3:
            holding.here()
        return settle(*given)

    monkeypatch.setattr(basins, "settle", held)
    scouting = basins.LABELLED * 64 / (64 + 144)
    part = holding.partial(
        lambda: sl.basins(
            rig,
            **axes,
            threads=1,
            progress=lambda share: share > scouting and labelled.set(),
        ),
        labelled,
    )
    there = part.basin.values != Kind.NOT_COMPUTED
    assert 24 <= there.sum() <= 72
    np.testing.assert_array_equal(part.basin.values[there], whole.basin.values[there])
    assert set(part.data_vars) <= set(whole.data_vars)


def test_work_ends_at_once_where_it_was_asked_before():
    stop = sl.Stop()
    stop.set()
    with stop, pytest.raises(sl.Interrupted):
        sl.simulate(sl.models.delangre("b"), periods=10**9, keep=1, progress=False)
    sl.simulate(sl.models.delangre("b"), periods=1, progress=False)


def press_when(event):
    """Press Ctrl-C once the event is set."""

    def press():
        assert event.wait(300)
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=press)
    thread.start()
    return thread


@pytest.mark.parametrize("inner", ["a flight", "runs on threads of their own"])
def test_work_inside_a_piece_of_work_ends_too(inner):
    """A piece that would go on for ever: what it calls is asked to stop, at whatever depth."""
    rig = sl.models.delangre("b", force="4 N", frequency="15 Hz")
    begun, running, ended = threading.Event(), set(), []

    def endless(item):
        flight = Stroboscope(rig, sl.Taylor()).launch(np.array([[1e-3, 0.0]]), 1e9)
        while True:
            if inner == "a flight":
                flight.advance(1000)
            else:
                sl.stroboscope(rig, START, periods=200, keep=1, progress=False)
            running.add(item)
            if len(running) == 2:  # a piece that hasn't begun never does
                begun.set()

    def work(item):
        try:
            endless(item)
        except sl.Interrupted:
            ended.append(item)
            raise

    presser = press_when(begun)
    with pytest.raises(KeyboardInterrupt):
        on_threads(work, [0, 1], lambda *_: None, threads=2)
    presser.join()
    assert sorted(ended) == [0, 1]


def test_a_frequency_response_hands_out_what_it_has():
    rig = sl.models.delangre("b", force="4 N")
    seen = threading.Event()
    presser = press_when(seen)
    with pytest.raises(sl.Interrupted, match="stopped"):
        sl.frequency_response(
            rig,
            ("2 Hz", "30 Hz", 4000),
            periods=2000,
            progress=lambda share: share > 0 and seen.set(),
        )
    presser.join()


# -- a single piece is done by the thread that asks ------------------------------------------------
@pytest.mark.parametrize("around", [contextlib.nullcontext, sl.Stop])
def test_ctrl_c_waits_for_a_single_piece_and_asks_it_to_stop(around):
    """Within a request of the user's own too, which isn't a part of other work."""
    seen = []

    def piece(_):
        assert threading.current_thread() is threading.main_thread()
        _thread.interrupt_main()
        seen.extend(stop.is_set() for _ in range(100))
        return "whole"

    with around():
        stop = Stop()
        with pytest.raises(KeyboardInterrupt):
            on_threads(piece, [1], lambda *_: pytest.fail("it was told to stop"), stop=stop)
    assert seen[-1]
    assert len(seen) == 100
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_handler_of_the_caller_s_own_is_left_alone():
    pressed = []

    def own(*_):
        pressed.append(threading.current_thread())

    signal.signal(signal.SIGINT, own)
    done = []

    def piece(_):
        assert threading.current_thread() is not threading.main_thread()
        _thread.interrupt_main()
        time.sleep(0.3)
        return "whole"

    on_threads(piece, [1], lambda item, result: done.append(result))
    assert done == ["whole"]
    assert pressed == [threading.main_thread()]
    assert signal.getsignal(signal.SIGINT) is own


def test_a_piece_within_a_piece_is_stopped_with_it():
    """Whether in the main thread or in another, and what a piece raises is raised."""

    def inner(_):
        _thread.interrupt_main()
        time.sleep(0.05)
        check_stop()
        pytest.fail("it went on")

    def outer(_):
        on_threads(inner, [1], lambda *_: None)

    for pieces in ([1], [1, 2]):
        with pytest.raises(KeyboardInterrupt):
            on_threads(outer, pieces, lambda *_: None, threads=2)
    with pytest.raises(ZeroDivisionError):
        on_threads(lambda _: 1 / 0, [1], lambda *_: None)


# -- while modules are imported --------------------------------------------------------------------
_SWALLOWS = """
import _thread, time
try:
    _thread.interrupt_main()
    time.sleep(0.1)
except KeyboardInterrupt:  # as C code of NumPy and pandas does
    pass
function = 5
"""


@pytest.mark.parametrize("in_a_module", [True, False])
def test_an_import_does_not_swallow_ctrl_c(tmp_path, monkeypatch, in_a_module):
    (tmp_path / "swallowing.py").write_text(_SWALLOWS)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setitem(sl._HOMES, "function", "swallowing")
    monkeypatch.delitem(sys.modules, "swallowing", raising=False)
    if in_a_module:
        monkeypatch.setitem(sl._HOMES, "swallowing", "saltus")
        monkeypatch.setattr(sl.importlib, "import_module", lambda _: __import__("swallowing"))
    with pytest.raises(KeyboardInterrupt):
        _ = sl.swallowing if in_a_module else sl.function
    assert sys.modules["swallowing"].function == 5
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_where_nobody_listens_for_ctrl_c_nobody_is_told():
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with ctrl_c_waits():
        os.kill(os.getpid(), signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN


# -- where Python drops it -------------------------------------------------------------------------
class Pressing:
    """An object while whose end Ctrl-C comes."""

    def __del__(self):
        signal.raise_signal(signal.SIGINT)


@pytest.mark.parametrize("told", ["its finalizer", "a weak reference"])
def test_a_ctrl_c_that_python_drops_is_pressed_again(told):
    def goes():
        one = Pressing() if told == "its finalizer" else Stop()
        return (
            weakref.ref(one, lambda _: signal.raise_signal(signal.SIGINT))
            if told == "a weak reference"
            else None
        )

    def wait():
        kept = goes()
        end = time.monotonic() + 30
        while time.monotonic() < end:
            time.sleep(0.01)
        return kept

    with pytest.raises(KeyboardInterrupt), no_ctrl_c_is_lost():
        wait()


def test_other_things_that_python_drops_are_told_as_before(monkeypatch):
    seen = []
    monkeypatch.setattr(sys, "unraisablehook", seen.append)

    class Failing:
        def __del__(self):
            raise ValueError("at its end")

    with no_ctrl_c_is_lost():
        Failing()
    assert [str(one.exc_value) for one in seen] == ["at its end"]
    assert sys.unraisablehook == seen.append


# -- searches --------------------------------------------------------------------------------------
def pressed_after(share):
    """A progress function that is Ctrl-C once so much is done."""

    def progress(done):
        if done >= share:
            raise KeyboardInterrupt

    return progress


def test_attractors_that_were_found_are_handed_out():
    rig = sl.models.delangre("b", force="4 N", frequency="15 Hz")
    whole = sl.attractors(rig, START, progress=False)
    with pytest.raises(sl.Interrupted) as stopped:
        sl.attractors(rig, START, progress=pressed_after(0.1))
    part = stopped.value.partial
    assert set(part.variables) == set(whole.variables)
    done = part.basin.values >= 0
    assert 0 < done.sum() < done.size
    assert (part.basin.values[~done] == Kind.NOT_COMPUTED).all()
    mine, theirs = part.basin.values[done], whole.basin.values[done]
    for name in ("attractor_peak", "attractor_margin", "attractor_contacts"):
        np.testing.assert_allclose(part[name].values[mine], whole[name].values[theirs], rtol=1e-9)
    np.testing.assert_array_equal(
        part.periods_to_settle.values[done], whole.periods_to_settle.values[done]
    )
    assert f"missed   {done.sum()} starts" in sl.describe(part)


def test_orbits_of_searches_that_ended_are_handed_out():
    rig = sl.models.delangre("b", force="4 N", frequency="15 Hz")
    first = sl.periodic_orbits(rig, START, periods=1, progress=False)
    with pytest.raises(sl.Interrupted) as stopped:  # the search for period 1 is a third of the work
        sl.periodic_orbits(rig, START, periods=2, progress=pressed_after(0.3))
    part = stopped.value.partial
    assert set(part.variables) == set(first.variables)
    for name in ("orbit_peak", "orbit_found", "orbit_stability", "search_exhausted"):
        np.testing.assert_array_equal(part[name].values, first[name].values)


def test_limit_cycles_that_were_found_are_handed_out():
    start = np.random.default_rng(1).uniform(-2, 2, (80, 2))  # they are followed in two parts
    with pytest.raises(sl.Interrupted) as stopped:
        sl.periodic_orbits(sl.models.belt_stribeck(), start, progress=pressed_after(0.5))
    part = stopped.value.partial
    assert part.orbit_cycle.values == pytest.approx([12.0010312948306], rel=1e-12)
    assert not part.search_exhausted.any()
