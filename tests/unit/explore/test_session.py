"""A page's session: the newest question counts, work waits for the page, and ends with it."""

import json
import os
import platform
import threading

import numpy as np
import pytest

from saltus.explore import session as sessions
from saltus.explore.frames import unpacked
from saltus.explore.session import RATE, WINDOW, Outbox, Session
from saltus.interrupt import Interrupted, check_stop

#: Longest that a test waits for another thread [s]; none does when all is well.
PATIENCE = 30.0


class Page:
    """A page that keeps every frame, and says what it is told to."""

    def __init__(self, desk, **more):
        self.frames, self._came = [], threading.Condition()
        self.outbox = Outbox(self._ready)
        self.session = Session(desk, self.outbox, **more)
        self.desk, self._next = desk, 0

    def _ready(self):
        with self._came:
            while (frame := self.outbox.take()) is not None:
                self.frames.append(unpacked(frame)[0])
            self._came.notify_all()

    def ask(self, ask, **fields):
        self._next += 1
        self.session.hear(json.dumps({"ask": ask, "id": self._next, **fields}))
        return self._next

    def motion(self, **fields):
        return self.ask("motion", start=[0.0, 0.0], **fields)

    def map(self):
        return self.ask("map", axes={"x": [0, 1], "v": [0, 1]}, size=[16, 16])

    def wait(self, what):
        with self._came:
            assert self._came.wait_for(lambda: what(self.frames), PATIENCE), self.frames

    def answers(self, number):
        return [frame["kind"] for frame in self.frames if frame["id"] == number]


class Desk:
    """A desk whose work begins when a test lets it, a permit for each answer."""

    def __init__(self):
        self.begun, self.permits = [], threading.Semaphore(0)
        self.changed = threading.Condition()
        self.pieces = 0

    def answer(self, question, emit):
        with self.changed:
            self.begun.append(question.id)
            self.changed.notify_all()
        if question.ask == "map":
            while True:
                check_stop()
                emit({"kind": "map-piece"}, {})
                with self.changed:
                    self.pieces += 1
                    self.changed.notify_all()
        while not self.permits.acquire(timeout=0.01):
            check_stop()
        emit({"kind": question.ask}, {"x": np.zeros(3)})

    def wait(self, what):
        with self.changed:
            assert self.changed.wait_for(what, PATIENCE), self.begun


@pytest.fixture
def page():
    before = set(threading.enumerate())
    one = Page(Desk(), clock=lambda: 0.0)
    yield one
    one.session.close()
    assert set(threading.enumerate()) <= before


def test_of_a_thousand_questions_the_first_and_the_newest_are_answered(page, monkeypatch):
    monkeypatch.setattr(sessions, "RATE", 10**6)
    page.motion()
    page.desk.wait(lambda: page.desk.begun)
    numbers = [page.motion() for _ in range(999)]
    page.desk.permits.release(2)
    page.wait(lambda frames: len(frames) == 1000)
    assert page.desk.begun == [1, numbers[-1]]
    assert page.answers(1) == page.answers(numbers[-1]) == ["motion"]
    assert all(page.answers(number) == ["stopped"] for number in numbers[:-1])


def test_kinds_of_question_do_not_wait_for_each_other(page):
    page.motion()
    page.ask("about")
    page.desk.wait(lambda: len(page.desk.begun) == 2)


def test_a_newer_map_stops_the_older(page):
    first = page.map()
    page.desk.wait(lambda: page.desk.begun == [first])
    second = page.map()
    page.desk.wait(lambda: page.desk.begun == [first, second])
    page.wait(lambda _: page.answers(first)[-1:] == ["map-stopped"])
    assert "map-stopped" not in page.answers(second)


def test_a_page_that_never_says_seen_gets_a_window_of_pieces_and_no_more(page):
    number = page.map()
    page.desk.wait(lambda: page.desk.pieces == WINDOW)
    for _ in range(3):
        page.session.hear(json.dumps({"ask": "seen", "id": number}))
    page.desk.wait(lambda: page.desk.pieces == WINDOW + 3)
    page.session.hear(json.dumps({"ask": "seen", "id": number + 1}))  # of no map
    stopping = page.ask("stop")
    page.wait(lambda _: page.answers(number)[-1:] == ["map-stopped"])
    assert page.desk.pieces == WINDOW + 3
    assert page.answers(stopping) == []


def test_a_page_that_nobody_looks_at_gets_no_pieces(page):
    page.ask("pause", on=True)
    page.map()
    page.desk.wait(lambda: page.desk.begun)
    assert page.desk.pieces == 0
    page.ask("pause", on=False)
    page.desk.wait(lambda: page.desk.pieces == WINDOW)


def test_stop_ends_what_runs_and_what_waits(page):
    motion = page.motion()
    page.desk.wait(lambda: page.desk.begun == [motion])
    waiting, map_ = page.motion(), page.map()
    page.ask("stop", of="map")
    page.wait(lambda _: page.answers(map_)[-1:] == ["map-stopped"])
    assert page.answers(motion) == []
    page.ask("stop")
    page.wait(lambda _: page.answers(motion) == page.answers(waiting) == ["stopped"])


def test_a_page_that_goes_takes_its_work_along(page):
    page.motion()
    page.map()
    page.desk.wait(lambda: len(page.desk.begun) == 2)
    page.session.close()
    page.motion()
    assert len(page.desk.begun) == 2


def test_more_questions_than_a_page_can_mean_are_refused(page):
    numbers = [page.ask("stop") for _ in range(RATE + 2)]
    assert [page.answers(number) for number in numbers[:-2]] == [[]] * RATE
    assert [page.answers(number) for number in numbers[-2:]] == [["refused"]] * 2
    page.session.hear(json.dumps({"ask": "seen", "id": 3}))


def test_an_exception_has_a_number_that_the_terminal_knows(page, capsys):
    page.desk.answer = lambda question, emit: 1 / 0
    number = page.motion()
    page.wait(lambda frames: frames)
    (failed,) = page.frames
    assert (failed["kind"], failed["id"]) == ("failed", number)
    told = capsys.readouterr().err
    assert failed["number"] in told
    assert "ZeroDivisionError" in told
    assert "Traceback" not in failed["why"]
    page.desk.answer = lambda question, emit: emit({"kind": "motion"}, {})
    page.wait(lambda _: page.answers(page.motion()))  # the page goes on


def test_nobody_opens_a_model_where_a_system_was_chosen(page):
    number = page.ask("open", model="delangre")
    page.wait(lambda _: page.answers(number) == ["refused"])


def test_a_model_that_is_opened_answers_from_then_on():
    models = {"a": Desk()}
    page = Page(Desk(), opened=models.__getitem__)
    models["a"].permits.release(2)
    page.ask("open", model="a")
    page.wait(lambda frames: frames)
    page.motion()
    page.wait(lambda frames: len(frames) == 2)
    assert models["a"].begun == [1, 2]
    page.session.close()


# -- frames that wait ------------------------------------------------------------------------------
def test_work_waits_for_room_and_hears_stop():
    from saltus.interrupt import Stop

    outbox, stop = Outbox(most=10), Stop()
    outbox.put(b"x" * 11, stop)
    ended = threading.Event()

    def put():
        with pytest.raises(Interrupted):
            outbox.put(b"y", stop)
        ended.set()

    worker = threading.Thread(target=put)
    worker.start()
    assert not ended.is_set()
    stop.set()
    assert ended.wait(PATIENCE)
    worker.join()
    assert outbox.take() == b"x" * 11
    assert outbox.take() is None


def test_what_is_dropped_is_said():
    outbox = Outbox(most=10)
    for _ in range(4):
        outbox.put(b"x" * 8)
    assert [outbox.take(), outbox.take()] == [b"x" * 8] * 2
    assert unpacked(outbox.take())[0] == {"kind": "dropped", "count": 2}
    assert outbox.take() is None


# -- memory ----------------------------------------------------------------------------------------
@pytest.mark.skipif(
    "glibc" not in platform.libc_ver(), reason="other C libraries free by themselves"
)
def test_memory_of_a_map_is_given_back():
    def resident():
        with open("/proc/self/statm") as statm:
            return int(statm.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6

    class Taker:
        def answer(self, question, emit):
            arrays = [np.ones(10_000) for _ in range(1000)]
            self.held, self.kept = resident(), arrays[9::10]  # memory in between is free
            emit({"kind": "map-end"}, {})

    page = Page(Taker())
    page.map()
    page.wait(len)
    page.session.close()
    assert len(page.desk.kept) == 100
    assert resident() < page.desk.held - 50
