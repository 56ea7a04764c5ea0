"""Options of a run of a study, its reports, and its results."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from saltus.errors import StudyError
from saltus.results.table import TextTable


@dataclass(frozen=True)
class Resources:
    """Resources to compute with.

    Attributes
    ----------
    threads : int or None
        Threads of this process; all usable cores by default.
    workers : int or None
        Processes of this machine, for questions that divide into chunks.
    scheduler : str or None
        For these: address of a dask scheduler, or ``"local"`` for processes of this machine.
    shard : (k, n) or None
        Of these only the chunks i with i % n == k: one of n jobs that share the folder and nothing
        else. All other questions are taken in turn.
    """

    threads: int | None = None
    workers: int | None = None
    scheduler: str | None = None
    shard: tuple[int, int] | None = None

    @property
    def divide(self) -> bool:
        """True if questions are to be divided into chunks."""
        return any(one is not None for one in (self.workers, self.scheduler, self.shard))


def shard_of(text: str) -> tuple[int, int]:
    """Read (k, n) from "k/n". Raises StudyError for any other text."""
    match = re.fullmatch(r"(\d+)/(\d+)", text.strip())
    if not match or not int(match[1]) < int(match[2]):
        raise StudyError(f"--shard {text}: write K/N with K from 0 to N - 1, such as 0/4.")
    return int(match[1]), int(match[2])


@dataclass(frozen=True)
class Report:
    """Progress of a question. Of chunks it is read from the store, so the work of other machines
    counts too.

    ``what`` is counted: chunks, or per cent.
    """

    name: str
    done: int
    total: int
    seconds: float
    computed: int
    last: bool = False
    what: str = "chunks"

    @property
    def seconds_left(self) -> float | None:
        """Time left at the rate so far [s]; None before the first chunk."""
        return self.seconds / self.computed * (self.total - self.done) if self.computed else None


@dataclass
class StudyOutcome:
    """Outcome of a study: tables to print, files written, and the questions that other shards have
    yet to answer.
    """

    tables: list[TextTable] = field(default_factory=list)
    files: list[Path] = field(default_factory=list)
    waiting: list[str] = field(default_factory=list)

    def add(self, other: StudyOutcome) -> None:
        """Add the outcome of another question."""
        self.tables += other.tables
        self.files += other.files
        self.waiting += other.waiting


@dataclass(frozen=True)
class Running:
    """Settings of a run of a study: its output folder and its resources.

    Attributes
    ----------
    folder : Path
        Output.
    text : str
        Text of the study, stored with each result.
    resources : Resources
    report, say : callable
        Called with the progress of a question; with a sentence.
    pictures : bool
        Whether to draw.
    """

    folder: Path
    text: str
    resources: Resources
    report: Callable[[Report], None]
    say: Callable[[str], None]
    pictures: bool = True
