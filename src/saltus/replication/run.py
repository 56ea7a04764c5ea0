"""Reproduce a paper: compute or fetch every job, draw the pictures, judge the claims, write the report."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from saltus.errors import ParameterError, nearest
from saltus.flow.threads import usable_processors
from saltus.replication.job import Job, Shelf
from saltus.replication.papers import Numbers, Paper, Picture, folder_of
from saltus.replication.verdict import VERDICTS, Claim, Finding
from saltus.results.files import replacing

if TYPE_CHECKING:
    import xarray as xr

    from saltus.study.table import TextTable

#: Dots per inch of the pictures: sharp on a phone, and the report stays small enough to mail.
DPI = 130
#: Folder of the Datasets, folder of the pictures, and the report.
DATA, PICTURES, REPORT = "data", "pictures", "report.html"


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


@dataclass
class Replication:
    """What came out.

    Attributes
    ----------
    paper : Paper
    data : dict of str to Dataset
        Every job's result, by name.
    findings : list of (Claim, Finding)
        In the order of the report.
    pictures : list of (Picture, Path)
        In the order of the report.
    tables : list of (Numbers, TextTable)
        In the order of the report.
    quick : bool
        Whether sizes were small.
    figures : tuple of str
        The figures that were asked for.
    seconds : float
        Wall-clock time of this run [s].
    shelf : Shelf
        What was computed, what was there already, and how long each job took.
    report : Path
        The report.
    """

    paper: Paper
    quick: bool
    figures: tuple[str, ...]
    shelf: Shelf
    report: Path
    data: dict[str, xr.Dataset] = field(default_factory=dict)
    findings: list[tuple[Claim, Finding]] = field(default_factory=list)
    pictures: list[tuple[Picture, Path]] = field(default_factory=list)
    tables: list[tuple[Numbers, TextTable]] = field(default_factory=list)
    seconds: float = 0.0


class _Stopped(Exception):  # noqa: N818  (not an error: the user wants it)
    """Ends a job under way after Ctrl-C."""


def reproduce(
    paper: Paper,
    out: Path,
    figures: Sequence[str] = (),
    quick: bool = False,
    threads: int | None = None,
    report: Callable[[Progress], None] = lambda _: None,
    say: Callable[[str], None] = lambda _: None,
) -> Replication:
    """Reproduce a paper, or some figures of it. What is in the folder already, from the same settings and code, isn't computed again.

    Parameters
    ----------
    paper : Paper
        See :func:`saltus.replication.find`.
    out : Path
        Folder for the report, pictures and data; made if it isn't there.
    figures : sequence of str
        Numbers of the figures; all by default.
    quick : bool
        Coarser grids, shorter sweeps: minutes.
    threads : int, optional
        Jobs computed at a time; by default one for each usable core.
    report, say : callable
        Called with the progress, about four times a second; with a sentence when a figure is done.

    Raises
    ------
    ParameterError
        If the paper has no such figure.
    KeyboardInterrupt
        On Ctrl-C; what is done is kept, the jobs under way are lost.
    """
    from saltus.replication.page import write_page

    chosen = _chosen(paper, figures)
    for folder in (out / DATA, out / PICTURES):
        folder.mkdir(parents=True, exist_ok=True)
    begin = time.perf_counter()
    result = Replication(paper, quick, chosen, Shelf(out / DATA), out / REPORT)
    with _Workers(paper, chosen, quick, result, threads) as workers:
        for figure in chosen:
            workers.wait_for(figure, report)
            _draw(paper, figure, result, out / PICTURES)
            count = sum(claim.figure == figure for claim in paper.claims)
            say(f"figure {figure} done: {paper.figures[figure]}; {count} {'claim' if count == 1 else 'claims'}")
    result.findings = [(claim, claim.judge(result.data)) for claim in paper.claims if claim.figure in chosen]
    result.tables = [(one, one.make(result.data)) for one in paper.tables if one.figure in chosen]
    for one, table in result.tables:
        table.write_csv(out / PICTURES / f"{one.name}.csv")
    result.seconds = time.perf_counter() - begin
    write_page(result)
    return result


def verdict_table(result: Replication) -> TextTable:
    """A row for each claim: figure, claim, verdict."""
    from saltus.study.table import TextTable

    rows = tuple((claim.figure, claim.id, claim.says, finding.verdict) for claim, finding in result.findings)
    counts = [(one, sum(finding.verdict == one for _, finding in result.findings)) for one in VERDICTS]
    note = ", ".join(f"{count} {one}" for one, count in counts if count)
    return TextTable(f"Claims of {result.paper.name}", ("fig.", "claim", "what the paper says", "verdict"), rows, (f"{note}.",))


def _chosen(paper: Paper, figures: Sequence[str]) -> tuple[str, ...]:
    for figure in figures:
        if figure not in paper.figures:
            raise ParameterError(f"{paper.name} has no figure {figure!r} to reproduce. {nearest(figure, paper.figures)}")
    return tuple(figure for figure in paper.figures if figure in figures or not figures)


def wanted_by(paper: Paper, figure: str) -> set[str]:
    """Names of the jobs that a figure's pictures and claims ask for."""
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


class _Workers:
    """Threads that compute jobs in their order; a job waits for those that it needs, which come before it."""

    def __init__(self, paper: Paper, figures: Sequence[str], quick: bool, result: Replication, threads: int | None):
        self._jobs = {job.name: job for job in paper.jobs(folder_of(paper.name), quick)}
        self._of_figure = {figure: closure(self._jobs, wanted_by(paper, figure)) for figure in figures}
        self._result, self._stop = result, threading.Event()
        self._shares: dict[str, float] = {}
        self._futures: dict[str, Future[xr.Dataset]] = {}
        self._pool = ThreadPoolExecutor(threads or usable_processors())

    def __enter__(self) -> _Workers:
        order = closure(self._jobs, {name for jobs in self._of_figure.values() for name in jobs})
        for name in order:
            self._futures[name] = self._pool.submit(self._one, self._jobs[name])
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._pool.shutdown(wait=True, cancel_futures=True)

    def _one(self, job: Job) -> xr.Dataset:
        inputs = {name: self._futures[name].result() for name in job.needs}
        if self._stop.is_set():
            raise _Stopped

        def show(share: float) -> None:
            if self._stop.is_set():
                raise _Stopped
            self._shares[job.name] = share

        self._shares[job.name] = 0.0
        try:
            return self._result.shelf.result(job, inputs, show)
        finally:
            self._shares.pop(job.name, None)

    def wait_for(self, figure: str, report: Callable[[Progress], None]) -> None:
        """Wait until a figure's jobs are done, and put their Datasets into the result. Raises what a job raised."""
        names = self._of_figure[figure]
        while True:
            done = [name for name in names if self._futures[name].done()]
            failed = next((one for one in self._futures.values() if one.done() and one.exception() is not None), None)
            if failed is not None:
                failed.result()
            running = tuple(f"{name} {share:.0%}" if share > 0 else name for name, share in list(self._shares.items()))
            all_done = sum(one.done() for one in self._futures.values())
            report(Progress(figure, len(done), len(names), running, all_done, len(self._futures)))
            if len(done) == len(names):
                break
            time.sleep(0.25)
        self._result.data |= {name: self._futures[name].result() for name in names}


def _draw(paper: Paper, figure: str, result: Replication, folder: Path) -> None:
    """Draw a figure's pictures."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    from saltus import plot

    for picture in paper.pictures:
        if picture.figure != figure:
            continue
        with plot.style():
            drawn: Any = picture.draw(result.data)
            with replacing(folder / f"{picture.name}.png") as (part,):
                drawn.savefig(part, dpi=DPI, format="png")
            plt.close("all")
        result.pictures.append((picture, folder / f"{picture.name}.png"))
