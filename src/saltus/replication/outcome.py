"""The outcome of a replication: results, findings, pictures, tables, failures."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from saltus.replication.job import SECONDS
from saltus.replication.papers import Claim, Numbers, Paper, Picture
from saltus.replication.verdict import Finding

if TYPE_CHECKING:
    import xarray as xr

    from saltus.results.table import TextTable


@dataclass
class Replication:
    """The outcome of a replication.

    Attributes
    ----------
    paper : Paper
    quick : bool
        Whether sizes were small.
    figures : tuple of str
        The figures that were asked for.
    folder : Path
        Folder of all files.
    threads : int
        Threads of each computation.
    data : dict of str to Dataset
        Every job's result, by name.
    computed : list of str
        Jobs computed by this run; the results of the others were there.
    findings : list of (Claim, Finding)
        In the order of the report.
    pictures : list of (Picture, Path)
        In the order of the report.
    tables : list of (Numbers, TextTable)
        In the order of the report.
    failures : dict of str to str
        What could not be made, such as ``"fig4/exact"`` (a job), ``"picture fig4"``, ``"claim
        fig4-periods"``: why not.
    seconds : float
        Wall-clock time of this run [s].
    """

    paper: Paper
    quick: bool
    figures: tuple[str, ...]
    folder: Path
    threads: int
    data: dict[str, xr.Dataset] = field(default_factory=dict)
    computed: list[str] = field(default_factory=list)
    findings: list[tuple[Claim, Finding]] = field(default_factory=list)
    pictures: list[tuple[Picture, Path]] = field(default_factory=list)
    tables: list[tuple[Numbers, TextTable]] = field(default_factory=list)
    failures: dict[str, str] = field(default_factory=dict)
    seconds: float = 0.0

    @property
    def report(self) -> Path:
        """The file of the report: ``report.html``, or ``report-fig8.html`` for some figures only,
        so that the report of all figures is kept.
        """
        return self.folder / f"report{self._some}.html"

    @property
    def claims_file(self) -> Path:
        """The file of the claims with their answers and verdicts: ``claims.csv``, or
        ``claims-fig8.csv`` for some figures only.
        """
        return self.folder / f"claims{self._some}.csv"

    @property
    def _some(self) -> str:
        return (
            ""
            if len(self.figures) == len(self.paper.figures)
            else "".join(f"-fig{figure}" for figure in self.figures)
        )

    @property
    def seconds_in_all(self) -> float:
        """Time of all computations, the earlier ones included [s]."""
        return float(sum(ds.attrs.get(SECONDS, 0.0) for ds in self.data.values()))
