"""What every question of a study can do."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from saltus.study.identity import identity
from saltus.study.run.kept import kept_or_computed, save_picture
from saltus.study.run.running import Outcome, Running

if TYPE_CHECKING:
    import xarray as xr

    from saltus.study.setting.inputs import Input
    from saltus.study.table import TextTable
    from saltus.system import System


class Question(ABC):
    """A question of a study that fits its system: everything that could be checked before computing was.

    Attributes
    ----------
    title : str
        What it is called.
    stems : tuple of str
        Stems of the names of its files.
    shared : bool
        Whether several jobs (shards) may work on it; else it is left to the first of them.
    shared_inputs : list of Input
        Files that take part in all answers: those of the system.
    asked_as : str
        The table of the study that asks it.
    """

    title: str
    stems: tuple[str, ...]
    shared: bool = False
    shared_inputs: Sequence[Input] = ()
    asked_as: str = ""

    def inputs(self) -> list[Input]:
        """Files that take part in the answer."""
        return []

    def write_table(self, table: TextTable, path: Path) -> Path:
        """Write a table as CSV, with the hashes of the files that took part in it."""
        return replace(table, notes=(*table.notes, *(file.note for file in (*self.shared_inputs, *self.inputs())))).write_csv(path)

    def prepare(self, folder: Path) -> None:  # noqa: ARG002
        """Refuse an output folder with which the question can't go on; called for all questions before anything is computed."""
        return

    @abstractmethod
    def answer(self, at: Running) -> Outcome:
        """Compute what is missing, write the files, tell what came out."""


class OneDataset(Question):
    """A question whose answer is one Dataset in one file.

    Parameters
    ----------
    title, stem : str
        What it is called; stem of its files.
    system : System
        With the values of this question.
    method : Taylor or ODE45
        How to integrate.
    arguments : mapping
        What the analysis is called with, in SI; part of the identity.
    """

    def __init__(self, title: str, stem: str, system: System, method: Any, arguments: Mapping[str, Any]) -> None:
        self.title, self.stems = title, (stem,)
        self.system, self.method, self.arguments = system, method, dict(arguments)

    def identity(self) -> dict[str, str]:
        """What must be the same for a file to hold the answer."""
        return identity(self.system, self.method, self.arguments)

    @abstractmethod
    def compute(self, threads: int | None, progress: Callable[[float], None]) -> xr.Dataset:
        """The answer."""

    @abstractmethod
    def tables(self, ds: xr.Dataset) -> list[TextTable]:
        """What to print; the first one is written as CSV."""

    @abstractmethod
    def pictures(self, ds: xr.Dataset) -> dict[str, Any]:
        """Figures by the end of their file names."""

    def answer(self, at: Running) -> Outcome:
        """Compute the Dataset unless it is there, write it, its tables and pictures."""
        (stem,) = self.stems
        ds = kept_or_computed(stem, self.title, self.identity(), lambda show: self.compute(at.resources.threads, show), at)
        tables = self.tables(ds)
        files = [at.folder / f"{stem}.nc", self.write_table(tables[0], at.folder / f"{stem}.csv"), *self.more_files(ds, at.folder)]
        if at.pictures:
            from saltus import plot

            with plot.style():
                files += [save_picture(figure, at.folder / f"{stem}{end}.png") for end, figure in self.pictures(ds).items()]
        return Outcome(tables, files)

    def more_files(self, ds: xr.Dataset, folder: Path) -> list[Path]:  # noqa: ARG002
        """Write what else there is; returns the files."""
        return []
