"""Threads that compute the jobs of a replication."""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from saltus.errors import SaltusError
from saltus.interrupt import Stop
from saltus.replication.job import Job, JobError, Shelf
from saltus.replication.papers import Paper, folder_of
from saltus.results.files.atomic import ResultFileError

if TYPE_CHECKING:
    import xarray as xr

#: Time between two looks at how far the jobs are [s].
LOOK = 0.25


@dataclass(frozen=True)
class Progress:
    """How far the work is.

    Attributes
    ----------
    figure : str
        The figure that is waited for.
    jobs_done, jobs : int
        Jobs of this figure that are done, and all of them.
    running : tuple of str
        Jobs under way, with the share done of each.
    done, total : int
        Jobs of all figures.
    """

    figure: str
    jobs_done: int
    jobs: int
    running: tuple[str, ...]
    done: int
    total: int


class _Stopped(Exception):  # noqa: N818  (not an error: the user wants it)
    """Ends a job under way after Ctrl-C."""


def wanted_by(paper: Paper, figure: str) -> set[str]:
    """Names of the jobs that a figure's pictures, tables and claims ask for."""
    parts: list[Any] = [*paper.pictures, *paper.claims, *paper.tables]
    return {name for one in parts if one.figure == figure for name in one.needs}


def closure(jobs: Mapping[str, Job], wanted: set[str]) -> list[str]:
    """Wanted jobs and all that they need, in the order of ``jobs``."""
    waiting, found = list(wanted), set()
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += jobs[name].needs
    return [name for name in jobs if name in found]


def cause(error: Exception) -> str:
    """What went wrong, in a sentence without its full stop; of an error that nobody foresaw also where."""
    text = str(error).rstrip(". ")
    if isinstance(error, SaltusError):
        return text
    last = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__} in {Path(last.filename).name}, line {last.lineno}{f': {text}' if text else ''}"


class Workers:
    """Threads that compute jobs in their order; a job waits for those that it needs, which come before it.

    Parameters
    ----------
    paper : Paper
    figures : sequence of str
        Whose jobs.
    quick : bool
        Whether sizes are small.
    shelf : Shelf
        Where results are kept.
    threads : int
        Jobs computed at a time.
    """

    def __init__(self, paper: Paper, figures: Sequence[str], quick: bool, shelf: Shelf, threads: int):
        self._jobs = {job.name: job for job in paper.jobs(folder_of(paper.name), quick)}
        self._of_figure = {figure: closure(self._jobs, wanted_by(paper, figure)) for figure in figures}
        self._shelf, self._stop = shelf, Stop()
        self._shares: dict[str, float] = {}
        self._futures: dict[str, Future[xr.Dataset]] = {}
        self._pool = ThreadPoolExecutor(threads)

    def __enter__(self) -> Workers:
        order = closure(self._jobs, {name for jobs in self._of_figure.values() for name in jobs})
        for name in order:
            self._futures[name] = self._pool.submit(self._one, self._jobs[name])
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._pool.shutdown(wait=True, cancel_futures=True)

    def wait_for(self, figure: str, progress: Callable[[Progress], None]) -> dict[str, xr.Dataset | JobError]:
        """Wait until a figure's jobs are done, well or not; returns the Dataset of each, or why there is none.

        Raises
        ------
        ResultFileError
            If a result can't be kept: the others couldn't be either.
        """
        names = self._of_figure[figure]
        while True:
            self._raise_what_ends_all()
            done = [name for name in names if self._futures[name].done()]
            running = tuple(f"{name} {share:.0%}" if share > 0 else name for name, share in list(self._shares.items()))
            all_done = sum(one.done() for one in self._futures.values())
            progress(Progress(figure, len(done), len(names), running, all_done, len(self._futures)))
            if len(done) == len(names):
                return {name: self._outcome(name) for name in names}
            time.sleep(LOOK)

    def _raise_what_ends_all(self) -> None:
        for one in self._futures.values():
            if one.done() and one.exception() is not None and not isinstance(one.exception(), JobError):
                one.result()

    def _outcome(self, name: str) -> xr.Dataset | JobError:
        try:
            return self._futures[name].result()
        except JobError as error:
            return error

    def _one(self, job: Job) -> xr.Dataset:
        """The Dataset of a job. Raises the JobError of a job that it needs, too."""
        self._stop.hold()
        inputs = {name: self._futures[name].result() for name in job.needs}

        def show(share: float) -> None:
            if self._stop.is_set():
                raise _Stopped
            self._shares[job.name] = share

        show(0.0)
        try:
            return self._shelf.result(job, inputs, show)
        except (_Stopped, ResultFileError):
            raise
        except Exception as error:
            raise JobError(
                f"{job.name} could not be computed: {cause(error)}. What is computed is kept in {self._shelf.folder}: run the same command "
                "again, and only what is missing is tried again. If it fails again, report this message."
            ) from error
        finally:
            self._shares.pop(job.name, None)
