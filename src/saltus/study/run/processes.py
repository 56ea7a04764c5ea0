"""Chunks by processes of this machine, each at the end of a pipe of its own: nothing listens, so
nobody else can hand them work.
"""

from __future__ import annotations

import multiprocessing
import signal
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from typing import TYPE_CHECKING

from saltus.errors import StudyError
from saltus.flow.threads import usable_processors
from saltus.interrupt import ctrl_c_waits

if TYPE_CHECKING:
    from saltus.analysis.attractors.attractor_set import AttractorSet
    from saltus.analysis.basins.labels import Settling
    from saltus.analysis.basins.pipeline import BasinPlan

#: Chunks that a process has at a time: one that it computes, one that it begins while the first is
#: committed.
CHUNKS_PER_PROCESS = 2
#: Times that a chunk is given to another process when its own dies.
MAX_RETRIES = 5


def run_on_processes(
    workers: int | None,
    plan: BasinPlan,
    found: AttractorSet,
    missing: Sequence[int],
    keep: Callable[[int, Settling], None],
    show: Callable[[float], None],
) -> None:
    """Compute chunks; ``keep(index, settling)`` is called from this process as each is ready, in
    any order.

    The chunks of a process that dies go to its successor. On Ctrl-C, and on any error, all
    processes are ended.

    Parameters
    ----------
    workers : int, optional
        Processes; by default one for each usable core.
    plan, found : BasinPlan, AttractorSet
        What is computed, and the attractors.
    missing : sequence of int
        Chunks to compute.
    keep, show : callable
        Called with each chunk; with the share done.

    Raises
    ------
    StudyError
        If a chunk can't be computed, or its processes die again and again.
    """
    # compiles once, before every process does
    plan.map(1).launch(plan.starts(plan.cells_of(missing[0])[:1]), 1)
    waiting, tries, done = deque(missing), dict.fromkeys(missing, 0), 0
    team = [_Worker(plan, found) for _ in range(min(workers or usable_processors(), len(missing)))]
    try:
        while waiting or any(worker.held for worker in team):
            for place, worker in enumerate(team):
                if not worker.take(waiting):
                    team[place] = _successor(worker, waiting, tries)
            for pipe in wait([worker.pipe for worker in team if worker.held], timeout=1.0):
                place = next(i for i, worker in enumerate(team) if worker.pipe is pipe)
                answer = team[place].answer()
                if answer is None:
                    team[place] = _successor(team[place], waiting, tries)
                    continue
                keep(*answer)
                done += 1
                show(done / len(missing))
    finally:
        for worker in team:
            worker.end()


class _Worker:
    """A process, the pipe to it, and the chunks that it has."""

    def __init__(self, plan: BasinPlan, found: AttractorSet):
        self._job = plan, found
        self.held: deque[int] = deque()
        context = multiprocessing.get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self._process = context.Process(target=_work, args=(theirs, plan, found), daemon=True)
        with _without_ctrl_c():
            self._process.start()
        theirs.close()

    def take(self, waiting: deque[int]) -> bool:
        """Hand it as many chunks as it may have; False if it is dead."""
        while waiting and len(self.held) < CHUNKS_PER_PROCESS:
            try:
                self.pipe.send(waiting[0])
            except OSError:
                return False
            self.held.append(waiting.popleft())
        return True

    def answer(self) -> tuple[int, Settling] | None:
        """A chunk that it has computed; None if it is dead. Raises StudyError with what went wrong
        there.
        """
        try:
            part, problem = self.pipe.recv()
        except (EOFError, OSError):
            return None
        index = self.held.popleft()
        if problem:
            raise StudyError(f"chunk {index} can't be computed: {problem}")
        return index, part

    def again(self) -> _Worker:
        """Another one in its place."""
        return _Worker(*self._job)

    def end(self) -> int | None:
        """End it; returns its exit code, minus the number of the signal that ended it."""
        self.pipe.close()
        self._process.join(0.1)
        code = self._process.exitcode
        self._process.kill()
        self._process.join()
        return code


def _successor(dead: _Worker, waiting: deque[int], tries: dict[int, int]) -> _Worker:
    """A process in place of a dead one, whose chunks wait again."""
    code = dead.end()
    for index in reversed(dead.held or list(waiting)[:1]):
        tries[index] += 1
        if tries[index] > MAX_RETRIES:
            raise StudyError(
                f"chunk {index} failed in {MAX_RETRIES} processes; the last ended "
                f"with code {code}. Is there enough memory?"
            )
    waiting.extendleft(reversed(dead.held))
    return dead.again()


@contextmanager
def _without_ctrl_c() -> Iterator[None]:
    """Processes that are started within never see Ctrl-C: it is for this one, which ends them. Here
    it waits until they are started.

    They inherit the mask. It holds for one thread: another may take the signal, and Python would
    raise it here, amid the start of a process.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    # else it starts with the first process, and lets the signal through again
    resource_tracker.ensure_running()
    with ctrl_c_waits():
        mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def _work(pipe: Connection, plan: BasinPlan, found: AttractorSet) -> None:
    """The life of a process: chunks come, answers go, until the other end of the pipe is closed."""
    from saltus.announce import silent

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with suppress(EOFError, OSError), silent():
        map_ = plan.map(1)
        while True:
            index = pipe.recv()
            answer: tuple[Settling | None, str]
            try:
                answer = plan.chunk(index, found, map_), ""
            except Exception as error:
                answer = None, f"{type(error).__name__}: {error}"
            pipe.send(answer)
