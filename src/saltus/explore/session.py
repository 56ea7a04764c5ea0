"""Questions of one page, and the order of answers: the newest question counts. Knows threads,
and neither sockets nor files.
"""

from __future__ import annotations

import ctypes
import os
import secrets
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Protocol

import numpy as np

from saltus.announce import announcing_to
from saltus.errors import SaltusError
from saltus.explore.frames import Emit, packed
from saltus.explore.questions import (
    Open,
    PageQuestion,
    Pause,
    QuestionError,
    Seen,
    Show,
    StopWork,
    read,
)
from saltus.interrupt import Interrupted, Stop

#: Pieces of a map that may be on their way unseen; then its work waits.
WINDOW = 8
#: Most questions in a second, receipts of pieces not counted.
RATE = 200
#: Most bytes that wait for a page that doesn't read; then its work waits, and refusals are dropped.
WAITING = 2**24
#: Kinds of question of which a newer one stops the older. Of others one is finished and one waits.
STOPPED_BY_NEWER = ("map", "responses", "settle")
#: Questions that are under way as those of another kind are: a newer one of either stops the older.
AS = {"agreement": "map"}
#: Kinds whose threads give way to others, and by how much: a click doesn't wait for them.
BEHIND, NICE = ("map", "responses"), 10
#: Time between two looks whether waiting work was asked to stop [s].
LOOK = 0.1


class AnswersQuestions(Protocol):
    """A desk: it answers a question by one answer or several, while it works."""

    def answer(self, question: PageQuestion, emit: Emit) -> None:
        """Answer a question: ``emit(head, arrays)`` for each answer, from this thread."""


class Outbox:
    """Frames for a page, until they are taken. Work that puts more than fit waits.

    Parameters
    ----------
    ready : callable, optional
        Called, from any thread, when there is a frame to take.
    most : int
        Bytes that fit.
    """

    def __init__(self, ready: Callable[[], None] | None = None, most: int = WAITING) -> None:
        self._frames: deque[bytes] = deque()
        self._ready, self._most = ready, most
        self._room = threading.Condition()
        self.size, self.dropped, self.closed = 0, 0, False

    def put(self, frame: bytes, stop: Stop | None = None) -> None:
        """Add a frame. With ``stop`` this thread waits for room until that is set, and Interrupted
        is raised then; without, a frame that doesn't fit is dropped and counted.
        """
        with self._room:
            while stop is not None and self.size > self._most and not self.closed:
                if stop.is_set():
                    raise Interrupted
                self._room.wait(LOOK)
            if self.closed or (stop is None and self.size > self._most):
                self.dropped += not self.closed
                return
            self._frames.append(frame)
            self.size += len(frame)
        if self._ready:
            self._ready()

    def take(self) -> bytes | None:
        """The oldest frame; None if there is none."""
        with self._room:
            if self.dropped and not self._frames:
                told = packed({"kind": "dropped", "count": self.dropped}, {})
                self.dropped = 0
                return told
            if not self._frames:
                return None
            frame = self._frames.popleft()
            self.size -= len(frame)
            self._room.notify_all()
            return frame

    def close(self) -> None:
        """Drop all frames, and take no more."""
        with self._room:
            self.closed, self.size = True, 0
            self._frames.clear()
            self._room.notify_all()


class _Lane:
    """Questions of one kind: one under way, and one that waits."""

    def __init__(self) -> None:
        self.waiting: PageQuestion | None = None
        self.stop: Stop | None = None  # of the one under way
        self.busy = False


class Session:
    """One page at a desk.

    A newer map, set of responses or start that settles stops the older. Of every other kind of
    question one is finished and one waits, and a newer one takes the place of the one that waits: a
    drag has answers all the time, and the last one is that of its end.

    Parameters
    ----------
    desk : AnswersQuestions
        The desk.
    outbox : Outbox
        Where frames go.
    opened : callable, optional
        The desk of a model that the page opens, by the model's name.
    clock : callable
        The time [s], for the rate of questions.
    """

    def __init__(
        self,
        desk: AnswersQuestions,
        outbox: Outbox,
        opened: Callable[[str], AnswersQuestions] | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._desk, self._outbox, self._opened, self._clock = desk, outbox, opened, clock
        self._lanes: dict[str, _Lane] = {}
        self._lock = threading.Lock()
        self._pool = ThreadPoolExecutor(thread_name_prefix="saltus-explore")
        self._behind = ThreadPoolExecutor(
            len(BEHIND), thread_name_prefix="saltus-behind", initializer=_give_way
        )
        self._windows: dict[int, threading.Semaphore] = {}
        self._looked_at = threading.Event()
        self._looked_at.set()
        self._second, self._count, self._closed = 0, 0, False
        self.view: Mapping[str, Any] = {}

    def hear(self, text: str) -> None:
        """Take a question of the page. Never waits, never raises."""
        try:
            question = read(text)
            if isinstance(question, Seen):
                if (window := self._windows.get(question.id)) is not None:
                    window.release()
                return
            self._check_rate(question)
            self._take(question)
        except QuestionError as error:
            self._outbox.put(_refused(error, error.ask, error.id))

    def close(self) -> None:
        """End all work of the page, and wait for its end."""
        with self._lock:
            self._closed = True
        self._stop(None)
        self._outbox.close()
        for pool in (self._pool, self._behind):
            pool.shutdown(wait=True, cancel_futures=True)

    # -- order -------------------------------------------------------------------------------------
    def _check_rate(self, question: PageQuestion) -> None:
        second = int(self._clock())
        self._count = self._count + 1 if second == self._second else 1
        self._second = second
        if self._count > RATE:
            error = QuestionError(f"too many questions: more than {RATE} in a second.")
            error.ask, error.id = question.ask, question.id
            raise error

    def _take(self, question: PageQuestion) -> None:
        if isinstance(question, StopWork):
            self._stop(question.of)
        elif isinstance(question, Show):
            self.view = question.view
        elif isinstance(question, Pause):
            (self._looked_at.clear if question.on else self._looked_at.set)()
        else:
            self._queue(question)

    def _queue(self, question: PageQuestion) -> None:
        with self._lock:
            if self._closed:
                return
            kind = AS.get(question.ask, question.ask)
            lane = self._lanes.setdefault(kind, _Lane())
            replaced, lane.waiting = lane.waiting, question
            if kind in STOPPED_BY_NEWER and lane.stop is not None:
                lane.stop.set()
            begins, lane.busy = not lane.busy, True
            if begins:
                (self._behind if kind in BEHIND else self._pool).submit(self._work, lane)
        if replaced is not None:
            self._outbox.put(packed(_stopped(replaced), {}))

    def _stop(self, of: str | None) -> None:
        with self._lock:
            lanes = [lane for ask, lane in self._lanes.items() if of in (None, ask)]
            waiting = [lane.waiting for lane in lanes if lane.waiting is not None]
            for lane in lanes:
                lane.waiting = None
                if lane.stop is not None:
                    lane.stop.set()
        for question in waiting:
            self._outbox.put(packed(_stopped(question), {}))

    # -- work --------------------------------------------------------------------------------------
    def _work(self, lane: _Lane) -> None:
        """Answer the questions of a lane until none waits."""
        while True:
            with self._lock:
                question, lane.waiting = lane.waiting, None
                if question is None:
                    lane.busy, lane.stop = False, None
                    return
                stop = lane.stop = Stop()
            try:
                self._answer(question, stop)
            except KeyboardInterrupt:  # nobody takes the last words
                continue

    def _answer(self, question: PageQuestion, stop: Stop) -> None:
        """Answer a question, whatever happens."""
        window = threading.Semaphore(WINDOW)
        self._windows[question.id] = window

        def emit(head: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> None:
            if head["kind"] == "map-piece":
                self._wait(window, stop)
            whose = {"ask": question.ask, "id": question.id}
            self._outbox.put(packed({**head, **whose}, arrays), stop)

        try:
            with (
                stop,
                np.errstate(all="ignore"),
                announcing_to(lambda text: self._outbox.put(_waits(question, text))),
            ):
                self._desk_for(question).answer(question, emit)
        except KeyboardInterrupt:
            self._outbox.put(packed(_stopped(question), {}))
        except (SaltusError, MemoryError) as error:
            self._outbox.put(_refused(error, question.ask, question.id), stop)
        except Exception:
            self._outbox.put(packed(_failed(question), {}), stop)
        finally:
            self._windows.pop(question.id, None)
            if question.ask in BEHIND:
                _give_back()

    def _desk_for(self, question: PageQuestion) -> AnswersQuestions:
        """The desk; that of another model from where the page opens one."""
        if isinstance(question, Open):
            if self._opened is None:
                raise QuestionError("the system was chosen where the explorer was started.")
            self._desk = self._opened(question.model)
        return self._desk

    def _wait(self, window: threading.Semaphore, stop: Stop) -> None:
        """Wait until the page has seen enough pieces, and is looked at."""
        while not self._looked_at.wait(LOOK) or not window.acquire(timeout=LOOK):
            if stop.is_set():
                raise Interrupted


def _give_way() -> None:
    """Let this thread, and those that it begins, run when others don't: on Linux, where a thread
    can do so by itself.
    """
    if sys.platform == "linux":
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), NICE)


def _give_back() -> None:
    """Return freed memory to the system, where the C library keeps it for each thread (glibc): 306
    MB after 20 s of maps and clicks became 263. It takes half a millisecond.
    """
    if sys.platform == "linux" and (trim := getattr(ctypes.CDLL(None), "malloc_trim", None)):
        trim(0)


def _stopped(question: PageQuestion) -> dict[str, Any]:
    kind = "map-stopped" if question.ask == "map" else "stopped"
    return {"kind": kind, "ask": question.ask, "id": question.id}


def _waits(question: PageQuestion, text: str) -> bytes:
    """The frame that says what an answer waits for."""
    head = {"kind": "waits", "ask": question.ask, "id": question.id, "words": [text]}
    return packed(head, {})


def _refused(error: BaseException, ask: str | None, number: int | None) -> bytes:
    """The frame that says why a question isn't answered."""
    why = str(error) or "memory is used up. Ask for fewer starts or samples."
    field = getattr(error, "field", None)
    return packed({"kind": "refused", "ask": ask, "id": number, "why": why, "field": field}, {})


def _failed(question: PageQuestion) -> dict[str, Any]:
    """The head that says that an exception was met; the terminal has it under the same number."""
    number = secrets.token_hex(2)
    told = traceback.format_exc()
    sys.stderr.write(f"saltus: failure {number} in the question {question.ask!r}:\n{told}")
    why = f"saltus failed here; the terminal has the reason under the number {number}."
    return {
        "kind": "failed", "ask": question.ask, "id": question.id, "number": number, "why": why,
    }  # fmt: skip
