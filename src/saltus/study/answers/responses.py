"""[frequency_response] and [bifurcation_diagram]: all steady responses over a frequency, over any parameter, or over two."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from saltus.errors import SaltusError, StudyError
from saltus.results.files.measured import measured_points
from saltus.study.answers.question import OneDataset, Question
from saltus.study.setting import quantities
from saltus.study.tables.responses import BifurcationDiagram, FrequencyResponse
from saltus.study.tables.wording import fault

if TYPE_CHECKING:
    import xarray as xr

    from saltus.study.setting.inputs import Input
    from saltus.study.setting.setting import Setting
    from saltus.study.table import TextTable
    from saltus.system import System

#: Names of the tables.
FREQUENCY_RESPONSE, BIFURCATION_DIAGRAM = "frequency_response", "bifurcation_diagram"


# -- the questions -------------------------------------------------------------------------------------------------------------
def frequency_responses(table: FrequencyResponse, setting: Setting) -> list[Question]:
    """The question that a [frequency_response] asks. Raises a SaltusError if it doesn't fit the system."""
    place = FREQUENCY_RESPONSE
    system = setting.system(table.values, f"{place}.values")
    if system.forced_at is None:
        raise StudyError(f"[{place}] {system.name} has no forcing frequency. Ask for a [{BIFURCATION_DIAGRAM}] over another parameter.")
    grid = quantities.grid(system, system.forced_at, table.frequency, f"{place}.frequency")
    arguments = {"frequency": grid, **_followed(system, table, setting, place)}
    _check(system, {system.forced_at: grid}, arguments, place)
    measured = None if table.measured is None else setting.inputs.read(table.measured, place)
    if measured is not None:
        _points(measured, system.forced_at, system, place)  # read now, so that a fault is told before anything is computed
    return [Responses(table.title, table.stem, system, setting.method(table.method), arguments, place, measured)]


def bifurcation_diagrams(table: BifurcationDiagram, setting: Setting) -> list[Question]:
    """The question that a [bifurcation_diagram] asks. Raises a SaltusError if it doesn't fit the system."""
    place = BIFURCATION_DIAGRAM
    system = setting.system(table.values, f"{place}.values")
    vary = {name: quantities.grid(system, name, given, f"{place}.vary") for name, given in table.vary.items()}
    arguments = {"vary": vary, **_followed(system, table, setting, place), "sample": table.sample}
    arguments["every"] = None if table.every is None else quantities.number(table.every, "s", place, "every")
    _check(system, vary, arguments, place)
    return [Responses(table.title, table.stem, system, setting.method(table.method), arguments, place)]


def _followed(system: System, table: FrequencyResponse | BifurcationDiagram, setting: Setting, place: str) -> dict[str, Any]:
    """The arguments that both analyses take."""
    return {
        "start": quantities.starts(system, table.start, place), "box": quantities.box(system, table.box, place), "follow": table.follow,
        "periods": table.periods, "seed": table.seed, "outputs": setting.outputs(system, table.outputs, place),
    }  # fmt: skip


def _check(system: System, axes: dict[str, Any], arguments: dict[str, Any], place: str) -> None:
    """Have the analysis look at its arguments before anything is computed."""
    from saltus.analysis.responses.grid import grid_of

    try:
        start, box, seed, follow = (arguments[name] for name in ("start", "box", "seed", "follow"))
        grid_of(system, _arrays(axes), start, box, None, seed, follow, arguments.get("every"))
    except SaltusError as error:
        raise fault(place, error) from error


def _arrays(axes: dict[str, Any]) -> dict[str, Any]:
    """Lists of values as the arrays that the analyses take."""
    import numpy as np

    return {name: np.array(values) if isinstance(values, list) else values for name, values in axes.items()}


def _points(measured: Input, axis: str, system: System, place: str) -> xr.Dataset:
    """Measured points in SI: amplitudes of the first state."""
    try:
        return measured_points(measured.data, measured.path, axis, system.units.get(axis, "1"), system.units.get(system.states[0], "1"))
    except SaltusError as error:
        raise fault(place, error) from None


class Responses(OneDataset):
    """Steady responses over one or two parameters."""

    def __init__(
        self, title: str, stem: str, system: System, method: Any, arguments: dict[str, Any], analysis: str, measured: Input | None = None
    ) -> None:
        super().__init__(title, stem, system, method, arguments)
        self.analysis, self.measured = analysis, measured

    def inputs(self) -> list[Input]:
        """Measured points."""
        return [] if self.measured is None else [self.measured]

    def compute(self, threads: int | None, progress: Callable[[float], None]) -> xr.Dataset:
        """Call the analysis."""
        from saltus.analysis.responses.bifurcation_diagram import bifurcation_diagram
        from saltus.analysis.responses.frequency_response import frequency_response

        axes = _arrays({"frequency": self.arguments["frequency"]} if "frequency" in self.arguments else self.arguments["vary"])
        call = {name: value for name, value in self.arguments.items() if name not in ("frequency", "vary")}
        call |= axes if "frequency" in self.arguments else {"vary": axes}
        verbs: dict[str, Callable[..., xr.Dataset]] = {FREQUENCY_RESPONSE: frequency_response, BIFURCATION_DIAGRAM: bifurcation_diagram}
        return verbs[self.analysis](self.system, method=self.method, threads=threads, progress=progress, **call)

    def tables(self, ds: xr.Dataset) -> list[TextTable]:
        """Branches, and what happens to them; kinds of motion over two parameters."""
        from saltus.study.answers.responses_table import tables

        return tables(self.title, ds)

    def more_files(self, ds: xr.Dataset, folder: Path) -> list[Path]:
        """Every response, a row each, with all digits."""
        from saltus.results import to_csv

        return [to_csv(ds, folder / f"{self.stems[0]}-responses.csv")]

    def pictures(self, ds: xr.Dataset) -> dict[str, Any]:
        """The picture that fits."""
        from saltus import plot
        from saltus.plot.choice import default_kind

        kind = default_kind(ds)
        more = {}
        if self.measured is not None and kind == FREQUENCY_RESPONSE:
            assert self.system.forced_at is not None
            more["measured"] = _points(self.measured, self.system.forced_at, self.system, self.analysis)
        axes = getattr(plot, kind)(ds, **more)
        axes.set_title(self.title if kind != "type_map" else f"{self.title}: {axes.get_title('left')}", loc="left")
        return {"": axes.figure}
