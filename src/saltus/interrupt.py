"""Stopping on Ctrl-C, or by `Stop` from another thread. `Interrupted` carries what was finished.

Work on threads learns of it in flow/threads.py, between pieces of work.
"""

from __future__ import annotations

import _thread
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar, Token
from functools import cache
from types import FrameType
from typing import Any, TypeVar

Part = TypeVar("Part")
Answer = TypeVar("Answer")
#: Exit code of a command that Ctrl-C stopped: 128 + SIGINT, as shells expect.
EXIT_CODE = 130


class Interrupted(KeyboardInterrupt):
    """Ctrl-C during a computation, or a :class:`Stop`: ``partial`` holds what was finished.

    The rest has status ``interrupted`` or ``not_computed``.

    Parameters
    ----------
    assemble : callable, optional
        Puts together what was finished. It is called when ``partial`` is first read: ten million
        samples take seconds, and Ctrl-C doesn't wait for a result that nobody asks for.
    """

    def __init__(self, assemble: Callable[[], Any] | None = None) -> None:
        super().__init__()
        self._assemble = assemble and cache(assemble)

    @property
    def partial(self) -> Any:
        """The finished part of the result, as the function returns it; None if there is none."""
        return self._assemble and self._assemble()

    @property
    def has_partial(self) -> bool:
        """True if a part was finished."""
        return self._assemble is not None

    def then(self, result: Callable[[Any], Any]) -> Interrupted:
        """The interruption whose ``partial`` is what ``result`` makes of this one's, if there is
        any.
        """
        return Interrupted((lambda: result(self.partial)) if self.has_partial else None)

    def __reduce__(self) -> tuple[Any, ...]:
        """From one process to another it goes with the finished part itself."""
        return _interrupted, (self.partial,)

    def __str__(self) -> str:
        if not self.has_partial:
            return "stopped before anything was finished."
        return "stopped. What was finished stands in `partial` of this exception."


class PartInterrupted(Interrupted):
    """Ctrl-C within a part of the work of a verb: ``partial`` is of that part, and no answer."""


def answered(work: Callable[[], Part], answer: Callable[[Part], Answer]) -> Answer:
    """The answer that is made of some work.

    Raises
    ------
    Interrupted
        On Ctrl-C. Its ``partial`` is the answer made of what was finished of the work.
    """
    try:
        part = work()
    except PartInterrupted as stop:
        raise stop.then(answer) from None
    try:
        return answer(part)
    except KeyboardInterrupt:
        raise Interrupted(lambda: answer(part)) from None


def _interrupted(partial: Any) -> Interrupted:
    return Interrupted(None if partial is None else lambda: partial)


@contextmanager
def ctrl_c_waits() -> Iterator[None]:
    """Ctrl-C within is raised where the block ends.

    For what can't be stopped half done, or would swallow it: modules of other packages, while they
    are imported, lose one in a hundred.
    """
    handler = (
        signal.getsignal(signal.SIGINT)
        if threading.current_thread() is threading.main_thread()
        else None
    )
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


@contextmanager
def no_ctrl_c_is_lost() -> Iterator[None]:
    """Within, a Ctrl-C that Python drops is pressed again.

    It drops one that comes in the callback of a weak reference, or in a finalizer: nobody could
    catch what is raised there, so it is handed to ``sys.unraisablehook``, which prints it and goes
    on.
    """
    before = sys.unraisablehook

    def again(dropped: Any) -> None:
        if issubclass(dropped.exc_type, KeyboardInterrupt):
            # at once it would be dropped again, by this function
            threading.Timer(0.01, _thread.interrupt_main).start()
        else:
            before(dropped)

    sys.unraisablehook = again
    try:
        yield
    finally:
        if sys.unraisablehook is again:
            sys.unraisablehook = before


class Stop:
    """A request to stop work, which another thread may make: ``stop.set()``.

    Everything long that is called ``with stop:`` ends soon after it is made, as it does on Ctrl-C:
    with :class:`saltus.Interrupted`, whose ``partial`` is what was finished. One that was made
    stays made.

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    >>> stop = sl.Stop()
    >>> with stop:  # a window's button calls stop.set()
    ...     run = sl.simulate(rig, periods=10)
    """

    def __init__(self) -> None:
        self._asked, self._outer, self._works = threading.Event(), _CURRENT.get(), False
        self._entered: list[Token[Stop | None]] = []

    def __enter__(self) -> Stop:
        self._entered.append(_CURRENT.set(self))
        return self

    def __exit__(self, *_: object) -> None:
        _CURRENT.reset(self._entered.pop())

    def set(self) -> None:
        """Make the request."""
        self._asked.set()

    def is_set(self) -> bool:
        """True if it was made."""
        return self._asked.is_set() or (self._outer is not None and self._outer.is_set())

    @property
    def inside(self) -> bool:
        """True if the work is part of other work, which Ctrl-C asks to stop, not interrupts."""
        return self._outer is not None and (self._outer._works or self._outer.inside)

    def hold(self) -> None:
        """Let all that this thread's context calls from now on ask this request (see
        :func:`check_stop`), as parts of one work.
        """
        self._works = True
        _CURRENT.set(self)


#: The stop flag of the work in this context; None where Ctrl-C itself arrives.
_CURRENT: ContextVar[Stop | None] = ContextVar("stop", default=None)


#: Function that is called while long work goes on, and the thread that calls it.
_HEARTBEAT: ContextVar[tuple[int, Callable[[], None]] | None] = ContextVar("beat", default=None)


@contextmanager
def heartbeat(beat: Callable[[], None]) -> Iterator[None]:
    """Within, ``beat`` is called in this thread wherever long work can be stopped."""
    token = _HEARTBEAT.set((threading.get_ident(), beat))
    try:
        yield
    finally:
        _HEARTBEAT.reset(token)


def alive() -> None:
    """Call the function of :func:`heartbeat`, if this is its thread."""
    beat = _HEARTBEAT.get()
    if beat is not None and beat[0] == threading.get_ident():
        beat[1]()


def check_stop() -> None:
    """Raise Interrupted if the work that this thread does a part of was asked to stop."""
    alive()
    current = _CURRENT.get()
    if current is not None and current.is_set():
        raise Interrupted
