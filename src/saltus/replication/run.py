"""Reproduce a paper: compute or read every job, draw the pictures, judge the claims, write the
report.
"""

from __future__ import annotations

import re
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from saltus.errors import ParameterError, SaltusError, counted
from saltus.flow.threads import usable_processors
from saltus.replication.job import Job
from saltus.replication.outcome import Replication
from saltus.replication.papers import Claim, Numbers, Paper, Picture, folder_of
from saltus.replication.tables import claims_table
from saltus.replication.verdict import undecided
from saltus.results.files.atomic import ResultFileError, replacing, usable_folder
from saltus.results.files.sheets import write_table
from saltus.results.store.lock import WHOLE, locked
from saltus.study.run.running import Report, Resources, Running

if TYPE_CHECKING:
    pass

_Made = TypeVar("_Made")

#: Dots per inch of the pictures: sharp on a phone, in a report small enough to mail.
DPI = 130
#: Folder of the Datasets, beside the report.
DATA = "data"
#: Folder of the pictures.
PICTURES = "pictures"
#: Folder of the lock against a second run.
LOCKS = "locks"


def reproduce(
    paper: Paper,
    out: Path,
    figures: Sequence[str] = (),
    quick: bool = False,
    threads: int | None = None,
    report: Callable[[Report], None] = lambda _: None,
    say: Callable[[str], None] = lambda _: None,
) -> Replication:
    """Reproduce a paper, or some of its figures. Results in the folder with the same settings and
    code aren't computed again.

    A job, picture, table or judge that fails costs only what needs it: the rest is finished, and
    the report says what is missing and why.

    Parameters
    ----------
    paper : Paper
        See :func:`saltus.replication.find`.
    out : Path
        Folder for the report, pictures and data; made if it isn't there.
    figures : sequence of str
        Their numbers, such as ``"8"`` or ``"fig8"``; all by default.
    quick : bool
        Coarser grids, shorter sweeps: minutes.
    threads : int, optional
        Of each computation; by default one for each usable core. Results don't depend on it.
    report, say : callable
        Called with the progress of a computation; with a sentence, such as when a figure is done.

    Returns
    -------
    Replication
        With ``failures``, empty if all went well.

    Raises
    ------
    ParameterError
        If the paper has no such figure: raised before anything is made.
    ResultFileError
        If the folder can't be written to.
    StoreError
        If another run works in the folder: names host, process and time.
    KeyboardInterrupt
        On Ctrl-C; what is done is kept.
    """
    chosen = _chosen(paper, figures)
    for name in (DATA, PICTURES, LOCKS):
        usable_folder(out / name)
    result = Replication(paper, quick, chosen, out, threads or usable_processors())
    with locked(out / LOCKS, WHOLE):
        _make(result, report, say)
    return result


def _chosen(paper: Paper, figures: Sequence[str]) -> tuple[str, ...]:
    """Numbers of the wanted figures, in the paper's order."""
    wanted = {re.sub(r"(?i)^fig(ure)?[. ]*", "", figure.strip()): figure for figure in figures}
    for number, text in wanted.items():
        if number not in paper.figures:
            raise ParameterError(
                f"{paper.name} has no figure {text!r} to reproduce. Its figures: "
                f"{', '.join(paper.figures)}."
            )
    return tuple(figure for figure in paper.figures if figure in wanted or not wanted)


def _make(
    result: Replication, report: Callable[[Report], None], say: Callable[[str], None]
) -> None:
    """Compute, draw, judge and write."""
    from saltus.replication.page import write_page

    begin = time.perf_counter()
    jobs = {job.name: job for job in result.paper.jobs(folder_of(result.paper.name), result.quick)}
    at = Running(
        result.folder / DATA,
        f"saltus reproduce {result.paper.name}",
        Resources(result.threads),
        report,
        say,
    )
    for figure in result.figures:
        names = closure(jobs, wanted_by(result.paper, figure))
        for number, name in enumerate(names, 1):
            if name not in result.data and name not in result.failures:
                _compute(
                    result,
                    jobs[name],
                    replace(at, report=partial(_counted, report, f"{number} of {len(names)}")),
                )
        say(_finish(result, figure))
    result.seconds = time.perf_counter() - begin
    write_table(claims_table(result), result.claims_file)
    write_page(result)


def wanted_by(paper: Paper, figure: str) -> set[str]:
    """Names of the jobs that a figure's pictures, tables and claims need."""
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


def _counted(report: Callable[[Report], None], number: str, one: Report) -> None:
    report(replace(one, name=f"{one.name} ({number})"))


def _compute(result: Replication, job: Job, at: Running) -> None:
    """Add the Dataset of a job, or the reason for its failure."""
    lost = next((name for name in job.needs if name not in result.data), None)
    if lost is not None:
        result.failures[job.name] = result.failures[lost]
        return
    try:
        ds, new = job.result(result.data, at)
    except ResultFileError:  # the next file couldn't be written either
        raise
    except Exception as error:
        result.failures[job.name] = (
            f"{job.name} could not be computed: {_cause(error)}. What is computed is kept in "
            f"{at.folder}: run the same command again, "
            "and only what is missing is tried again. If it fails again, report this message."
        )
        return
    result.data[job.name] = ds
    result.computed += [job.name] * new


def _cause(error: Exception) -> str:
    """The cause of an error as a sentence without full stop; for an unexpected error with its
    place.
    """
    text = str(error).rstrip(". ")
    if isinstance(error, SaltusError):
        return text
    last = traceback.extract_tb(error.__traceback__)[-1]
    return (
        f"{type(error).__name__} in {Path(last.filename).name}, line "
        f"{last.lineno}{f': {text}' if text else ''}"
    )


# -- what stands in the report ---------------------------------------------------------------------
def _finish(result: Replication, figure: str) -> str:
    """Draw a figure's pictures, make its tables and judge its claims, as far as their data exist;
    return a sentence about it.
    """
    paper, folder, before = result.paper, result.folder / PICTURES, len(result.failures)
    for picture in (one for one in paper.pictures if one.figure == figure):
        file = folder / f"{picture.name}.png"
        if _attempt(result, f"picture {picture.name}", picture, partial(_draw, picture, file)):
            result.pictures.append((picture, file))
    for numbers in (one for one in paper.tables if one.figure == figure):
        table = _attempt(result, f"table {numbers.name}", numbers, numbers.make)
        if table is not None:
            write_table(table, folder / f"{numbers.name}.csv")
            result.tables.append((numbers, table))
    claims = [one for one in paper.claims if one.figure == figure]
    for claim in claims:
        finding = _attempt(result, f"claim {claim.id}", claim, claim.judge)
        result.findings.append((claim, finding or undecided(result.failures[f"claim {claim.id}"])))
    state = "done" if len(result.failures) == before else "not complete"
    return f"figure {figure} {state}: {paper.figures[figure]}; {counted(len(claims), 'claim')}"


def _attempt(
    result: Replication,
    what: str,
    part: Picture | Numbers | Claim,
    make: Callable[[dict[str, Any]], _Made],
) -> _Made | None:
    """The value of a part of the report; None, with the reason in ``failures``, if it fails or a
    job that it needs failed.
    """
    lost = next((name for name in part.needs if name not in result.data), None)
    if lost is not None:
        result.failures[what] = result.failures[lost]
        return None
    try:
        return make(result.data)
    except ResultFileError:  # the next file couldn't be written either
        raise
    except Exception as error:
        result.failures[what] = (
            f"{what} failed: {_cause(error)}. Its data are kept in "
            f"{result.folder / DATA}. Report this message."
        )
        return None


def _draw(picture: Picture, file: Path, data: dict[str, Any]) -> Path:
    """Draw a picture into a file. Open figures, e.g. a notebook's, stay open."""
    import matplotlib.pyplot as plt

    from saltus import plot

    before = set(plt.get_fignums())
    try:
        with plot.style(), replacing(file) as (part,):
            picture.draw(data).savefig(part, dpi=DPI, format="png")
    finally:
        for number in set(plt.get_fignums()) - before:
            plt.close(number)
    return file
