"""Run a study: from a checked file to Datasets and to the tables that tell what came out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any

from saltus.errors import ParameterError, StudyError
from saltus.study import quantities
from saltus.study.compare import contact_table
from saltus.study.report import run_table
from saltus.study.spec import Study, SystemTable
from saltus.study.spec import Table as SpecTable
from saltus.study.table import TextTable

if TYPE_CHECKING:
    import xarray as xr

    from saltus.system import System


@dataclass(frozen=True)
class Outcome:
    """What a study gave.

    Attributes
    ----------
    system : System
        With the study's values.
    run : Dataset
        What ``simulate`` returned; the text of the study is in its attribute ``study``.
    reference : Dataset or None
        The same by the second method, if [compare] asks for one.
    table : TextTable
        What to print.
    """

    system: System
    run: xr.Dataset
    reference: xr.Dataset | None
    table: TextTable

    def write(self, folder: Path) -> list[Path]:
        """Write ``run.nc``, ``table.csv`` and, if there is one, ``reference.nc`` to a folder; returns the files."""
        from saltus.results import save

        folder.mkdir(parents=True, exist_ok=True)
        files = [save(self.run, folder / "run.nc"), self.table.write_csv(folder / "table.csv")]
        return files + ([save(self.reference, folder / "reference.nc")] if self.reference is not None else [])


def run_study(
    study: Study,
    text: str,
    folder: Path,
    own: System | None = None,
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Outcome:
    """Run a study.

    Parameters
    ----------
    study : Study
        What to compute.
    text : str
        The file as it stands, kept with the result; :func:`saltus.study.read.read` returns both.
    folder : Path
        Where the study stands; files that it names are looked for there.
    own : System, optional
        The system, if it isn't one of saltus's models.
    threads : int, optional
        Threads to compute with.
    progress : callable, optional
        Called with the share done.

    Raises
    ------
    StudyError, UnitError, ParameterError
        If the study doesn't fit its system.
    """
    if study.simulate is None:
        raise StudyError("this study has [basins]: run it with run_maps.")
    system = system_of(study.system, own)
    if quantities.is_batch(study.simulate) and study.compare is not None:
        raise StudyError("[compare] is for one start: let [simulate] start hold single values.")
    if study.compare is not None and study.simulate.keep is not None:
        raise StudyError("[compare] counts contacts from the start of the run: leave keep out of [simulate].")
    computing = {"threads": threads, "progress": progress or False}
    run = _simulate(system, study, study.method, text, computing)
    if study.compare is None:
        return Outcome(system, run, None, run_table(study.study.name, run))
    second = study.compare.reference
    reference = _simulate(system, study, second, text, computing) if second is not None else None
    return Outcome(system, run, reference, contact_table(study.study.name, run, study.compare, folder, reference))


def system_of(table: SystemTable, own: System | None = None) -> System:
    """The system that [system] names, with its values.

    Raises
    ------
    StudyError
        If neither or both of the table and the command line give a system, or a value lacks its unit.
    ParameterError, UnitError
        If the model, the case or a value is refused.
    """
    from saltus import models

    if own is not None:
        if table.model is not None or table.case is not None:
            raise StudyError("[system] names a model, and --system gives another system. Keep one of the two.")
        base = own
    elif table.model is None:
        raise StudyError('[system] names no model. Write model = "delangre" (`saltus models` lists them), or give --system my_rig.py:rig.')
    else:
        model = models.find(table.model)
        if table.case is not None and "case" not in signature(model).parameters:
            raise StudyError(f"[system] case: {table.model} has no cases.")
        base = model() if table.case is None else model(table.case)
    return base.with_values(**quantities.parameters(base, table.values))


def method_of(table: SpecTable) -> Any:
    """The method that a [method] table describes."""
    from saltus import flow

    options = table.model_dump(exclude_unset=True)
    return getattr(flow, options.pop("name"))(**options)


def _simulate(system: System, study: Study, method: SpecTable, text: str, computing: dict[str, Any]) -> xr.Dataset:
    from saltus.analysis import simulate

    table = study.simulate
    assert table is not None
    if table.periods is not None and system.forced_at is None:
        raise StudyError(f'[simulate] periods: {system.name} has no forcing period. Write t_end = "2 s" in place of it.')
    start, values = quantities.start(system, table.start), quantities.varied(system, table.values)
    t_end = None if table.t_end is None else quantities.number(table.t_end, "s", "simulate", "t_end")
    t_start = quantities.number(table.t_start, "s", "simulate", "t_start")
    try:
        run = simulate(
            system, start, table.periods, t_end, t_start=t_start, method=method_of(method), samples=table.samples, keep=table.keep,
            values=values, **computing,
        )  # fmt: skip
    except ParameterError as error:
        raise StudyError(f"[simulate] {error}") from error
    return run.assign_attrs(study=text)
