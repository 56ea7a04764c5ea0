"""Ctrl-C: the exception that carries what was finished, and how work on threads learns that it is to stop."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from types import FrameType


class Interrupted(KeyboardInterrupt):
    """Ctrl-C during a computation. ``partial`` holds what was finished; the rest has status ``interrupted`` or ``not_computed``."""

    partial: object = None

    def __str__(self) -> str:
        if self.partial is None:
            return "stopped by Ctrl-C before anything was finished."
        return "stopped by Ctrl-C. What was finished stands in `partial` of this exception."


@contextmanager
def ctrl_c_waits() -> Iterator[None]:
    """Ctrl-C within is raised where the block ends.

    For what can't be stopped half done, or would swallow it: modules of other packages, while they are imported, lose one in a hundred.
    """
    handler = signal.getsignal(signal.SIGINT) if threading.current_thread() is threading.main_thread() else None
    if not callable(handler):  # in another thread it doesn't arrive; or nobody listens
        yield
        return
    noted: list[tuple[int, FrameType | None]] = []
    signal.signal(signal.SIGINT, lambda *what: noted.append(what))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)
    if noted:
        handler(*noted[0])


class Stop:
    """A request to stop a piece of work: of its own, or of the work that it is part of."""

    def __init__(self) -> None:
        self._asked, self._outer = threading.Event(), _CURRENT.get()

    def set(self) -> None:
        """Ask for it."""
        self._asked.set()

    def is_set(self) -> bool:
        """Whether it was asked for."""
        return self._asked.is_set() or (self._outer is not None and self._outer.is_set())

    @property
    def inside(self) -> bool:
        """Whether the work is part of other work, which Ctrl-C asks to stop and doesn't interrupt."""
        return self._outer is not None

    def hold(self) -> None:
        """Let all that this thread's context calls from now on ask this request (see :func:`check_stop`)."""
        _CURRENT.set(self)


#: What the work in this context asks whether it is to stop; None where Ctrl-C itself arrives.
_CURRENT: ContextVar[Stop | None] = ContextVar("stop", default=None)


def check_stop() -> None:
    """Raise Interrupted if the work that this thread does a part of was asked to stop."""
    current = _CURRENT.get()
    if current is not None and current.is_set():
        raise Interrupted
