"""Announcements to a user who waits for an equation: the system being compiled, and the time."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar

#: Time after which work says what it is, and between two changes of that line on a terminal [s].
PATIENCE, EVERY = 2.0, 1.0
#: To the beginning of the line, and what stands in it away.
_WIPE = "\r\x1b[K"


def _to_stderr(text: str) -> None:
    sys.stderr.write(f"saltus: {text}\n")
    sys.stderr.flush()


_WRITE: ContextVar[Callable[[str], None]] = ContextVar("write", default=_to_stderr)


@contextmanager
def announcing_to(write: Callable[[str], None]) -> Iterator[None]:
    """A context in which sentences about compiling go to ``write``; by default they go to standard
    error.
    """
    token = _WRITE.set(write)
    try:
        yield
    finally:
        _WRITE.reset(token)


@contextmanager
def silent() -> Iterator[None]:
    """A context without sentences about compiling."""
    with announcing_to(lambda _: None):
        yield


def announce(what: str, seconds: float) -> None:
    """Announce a compilation, and its duration on a quiet machine [s]."""
    waiting = _WAITING.get()
    if waiting is not None:
        waiting.close()  # this says it
    _WRITE.get()(f"compiling {what}, about {seconds:.0f} s")


@contextmanager
def working(what: Callable[[], str]) -> Iterator[None]:
    """Work that says what it does if it lasts: one line, which on a terminal counts the seconds and
    is gone when the work ends, in whatever way. Work inside is a part of it.
    """
    if _WAITING.get() is not None:
        yield
        return
    waiting = _Waiting(what, _WRITE.get())
    token = _WAITING.set(waiting)
    try:
        yield
    finally:
        _WAITING.reset(token)
        waiting.close()


class _Waiting:
    """A thread that writes the line of :func:`working`."""

    def __init__(self, what: Callable[[], str], write: Callable[[str], None]) -> None:
        self._what, self._write, self._begun = what, write, time.monotonic()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="saltus: waiting", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the line."""
        self._ended.set()
        self._thread.join()

    def _run(self) -> None:
        if not self._ended.wait(PATIENCE):
            with suppress(Exception):  # no standard error, or a closed one: nobody waits there
                self._show()

    def _show(self) -> None:
        # a bar that has the terminal hands lines on, and no half ones
        own = self._write is _to_stderr and sys.stderr is sys.__stderr__ and os.isatty(2)
        if not own:
            self._write(self._line())
            return
        while True:
            sys.stderr.write(f"{_WIPE}saltus: {self._line()}")
            sys.stderr.flush()
            if self._ended.wait(EVERY):
                break
        sys.stderr.write(_WIPE)
        sys.stderr.flush()

    def _line(self) -> str:
        return f"{self._what()}, {time.monotonic() - self._begun:.0f} s so far"


_WAITING: ContextVar[_Waiting | None] = ContextVar("waiting", default=None)
