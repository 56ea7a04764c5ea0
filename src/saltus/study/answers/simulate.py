"""[simulate]: move one start, or a batch of them, and keep the motion with its contacts; [compare]: beside printed and exact times."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from saltus.errors import ParameterError, StudyError
from saltus.study.answers.question import Question
from saltus.study.identity import identity
from saltus.study.run.kept import kept_or_computed, save_picture
from saltus.study.run.running import Outcome, Running
from saltus.study.setting import quantities
from saltus.study.tables.motions import REFERENCE, RUN, Simulate
from saltus.study.tables.wording import fault

if TYPE_CHECKING:
    import xarray as xr

    from saltus.study.answers.printed import Row
    from saltus.study.setting.inputs import Input
    from saltus.study.setting.setting import Setting


def questions(table: Simulate, setting: Setting) -> list[Question]:
    """The question that the table asks.

    Raises
    ------
    StudyError, UnitError
        If it doesn't fit the system.
    """
    batch, compare, system = quantities.is_batch(table.start or {}, table.values), setting.study.compare, setting.base
    if batch and compare is not None:
        raise StudyError("[compare] is for one start: let [simulate] start hold single values.")
    if compare is not None and table.keep is not None:
        raise StudyError("[compare] counts contacts from the start of the run: leave keep out of [simulate].")
    if table.periods is not None and system.forced_at is None:
        raise StudyError(f'[simulate] periods: {system.name} has no forcing period. Write t_end = "2 s" in place of it.')
    arguments = {
        "start": quantities.start_or_rest(system, table.start, "simulate"),
        "periods": table.periods,
        "t_end": None if table.t_end is None else quantities.number(table.t_end, "s", "simulate", "t_end"),
        "t_start": quantities.number(table.t_start, "s", "simulate", "t_start"),
        "samples": table.samples,
        "keep": table.keep,
        "values": quantities.varied(system, table.values) or None,
    }
    return [Motion(setting, arguments)]


class Motion(Question):
    """How given starts move."""

    def __init__(self, setting: Setting, arguments: Mapping[str, Any]) -> None:
        self.title, self.stems = setting.study.study.name, (RUN, REFERENCE)
        self.setting, self.arguments, self.compare = setting, dict(arguments), setting.study.compare

        self._inputs, self.printed, self.exact = self._read() if self.compare is not None else ([], [], {})

    def _read(self) -> tuple[list[Input], list[Row], dict[int, float]]:
        """The files of [compare], and what they say: read now, so that a fault is told before anything is computed."""
        from saltus.study.answers.simulate_compare import exact_times, printed_rows

        assert self.compare is not None
        names = [name for name in (self.compare.printed, self.compare.exact) if name is not None]
        files = [self.setting.inputs.read(name, "compare") for name in names]
        exact = exact_times(files[1].data, files[1].path) if self.compare.exact is not None else {}
        return files, printed_rows(files[0].data, files[0].path), exact

    def inputs(self) -> list[Input]:
        """Printed and exact times."""
        return self._inputs

    def answer(self, at: Running) -> Outcome:
        """Simulate with the study's method, and the reference's if there is one; compare, tell, draw."""
        from saltus.study.answers.simulate_compare import contact_table
        from saltus.study.answers.simulate_table import run_table

        methods = {RUN: self.setting.method()}
        if self.compare is not None and self.compare.reference is not None:
            methods[REFERENCE] = self.setting.method(self.compare.reference)
        runs = {stem: self._run(stem, method, at) for stem, method in methods.items()}
        if self.compare is None:
            table = run_table(self.title, runs[RUN])
        else:
            table = contact_table(self.title, runs[RUN], self.printed, self.exact, runs.get(REFERENCE))
        files = [at.folder / f"{RUN}.nc", self.write_table(table, at.folder / f"{RUN}.csv")]
        files += [at.folder / f"{REFERENCE}.nc"] * (REFERENCE in runs)
        return Outcome([table], files + ([self._picture(runs[RUN], at.folder)] if at.pictures else []))

    def _run(self, stem: str, method: Any, at: Running) -> xr.Dataset:
        from saltus.analysis.motion.simulate import simulate

        system = self.setting.base

        def compute(show: Callable[[float], None]) -> xr.Dataset:
            try:
                return simulate(system, method=method, threads=at.resources.threads, progress=show, **self.arguments)
            except ParameterError as error:
                raise fault("simulate", error) from error

        title = self.title if stem == RUN else f"{self.title}, reference"
        return kept_or_computed(stem, title, identity(system, method, self.arguments), compute, at)

    def _picture(self, run: xr.Dataset, folder: Path) -> Path:
        """Phase portrait, or time history of a system of one state; of a large batch the first trajectories."""
        from saltus import plot
        from saltus.plot.selection import MOST
        from saltus.results.dataset.schema import states_of

        draw = plot.phase if len(states_of(run)) > 1 else plot.history
        some = {"trajectory": run["trajectory"].values[:MOST].tolist()} if "trajectory" in run.dims else {}
        with plot.style():
            axes = draw(run, **some)
            first = axes.flat[0] if hasattr(axes, "flat") else axes
            return save_picture(first.figure, folder / f"{RUN}.png")
