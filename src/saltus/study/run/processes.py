"""Chunks by processes of this machine. Each process has a pipe of its own: no port is opened, so
nobody else can send work.
"""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING, Any

from saltus.errors import StudyError
from saltus.flow.threads import on_threads, usable_processors
from saltus.interrupt import check_stop

if TYPE_CHECKING:
    import numpy as np

    from saltus.results.store.division import Division

    Chunk = Mapping[str, np.ndarray]

#: Processes that a chunk is given to, one after the other, when they die.
MAX_TRIES = 6
#: Time between two questions whether to stop, while a process computes [s].
PATIENCE = 0.1


def run_on_processes(
    workers: int | None,
    division: Division,
    shared: Any,
    missing: Sequence[int],
    keep: Callable[[int, Chunk], None],
    show: Callable[[float], None],
) -> None:
    """Compute chunks; ``keep(index, arrays)`` is called from this thread as each is ready, in any
    order.

    A thread waits for each process. The chunk of a process that dies goes to another one. On
    Ctrl-C, and on any error, all processes are ended.

    Parameters
    ----------
    workers : int, optional
        Processes; by default one for each usable core.
    division : Division
        The work.
    shared : object
        What all chunks share.
    missing : sequence of int
        Chunks to compute.
    keep, show : callable
        Called with each chunk; with the share done.

    Raises
    ------
    StudyError
        If a chunk can't be computed, or its processes die again and again.
    """
    division.prepare()  # compiles once here, so that no process compiles
    team = _Team(division, shared)
    try:
        on_threads(team.chunk, missing, keep, workers or usable_processors(), show)
    finally:
        team.end()


class _Team:
    """Team of processes: one for each thread that asks for a chunk."""

    def __init__(self, division: Division, shared: Any):
        self._job = division, shared
        self._idle: list[_Worker] = []

    def chunk(self, index: int) -> Chunk:
        """One chunk, by a process that is idle. Raises StudyError with what went wrong there."""
        code = None
        for _ in range(MAX_TRIES):
            worker = self._idle.pop() if self._idle else _Worker(*self._job)
            try:
                part, problem = worker.chunk(index)
            except (EOFError, OSError):
                code = worker.end()
                continue
            except BaseException:
                worker.end()
                raise
            self._idle.append(worker)
            if part is None:
                raise StudyError(f"chunk {index} can't be computed: {problem}")
            return part
        raise StudyError(
            f"chunk {index} failed in {MAX_TRIES} processes; the last ended with code {code}. Is "
            f"there enough memory?"
        )

    def end(self) -> None:
        """End those that are idle."""
        while self._idle:
            self._idle.pop().end()


class _Worker:
    """Process, and the pipe to it."""

    def __init__(self, division: Division, shared: Any):
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_work, args=(theirs, division, shared), daemon=True)
        with _without_ctrl_c():
            self._process.start()
        theirs.close()

    def chunk(self, index: int) -> tuple[Chunk | None, str]:
        """A chunk, or what went wrong. Raises EOFError or OSError if the process dies, Interrupted
        if the work is to stop.
        """
        self._pipe.send(index)
        while not self._pipe.poll(PATIENCE):
            check_stop()
        answer: tuple[Chunk | None, str] = self._pipe.recv()
        return answer

    def end(self) -> int | None:
        """End it; returns its exit code, minus the number of the signal that ended it."""
        self._pipe.close()
        self._process.join(0.1)
        code = self._process.exitcode
        self._process.kill()
        self._process.join()
        return code


@contextmanager
def _without_ctrl_c() -> Iterator[None]:
    """Block Ctrl-C in processes that start within the block: they inherit the signal mask of this
    thread, and the parent process ends them.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    # else it starts with the first process, and lets the signal through again
    resource_tracker.ensure_running()
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def _work(pipe: Connection, division: Division, shared: Any) -> None:
    """Loop of a process: it receives chunks and sends answers until the other end of the pipe is
    closed.
    """
    from saltus.announce import silent

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with suppress(EOFError, OSError), silent():
        while True:
            index = pipe.recv()
            answer: tuple[Chunk | None, str]
            try:
                answer = division.chunk(index, shared), ""
            except Exception as error:
                answer = None, f"{type(error).__name__}: {error}"
            pipe.send(answer)
