"""[frequency_response] and [bifurcation_diagram]: all steady responses over a frequency, over any
parameter, or over two.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from pydantic import Field, model_validator

from saltus.errors import SaltusError, StudyError
from saltus.results.files.measured import measured_points
from saltus.study.answers.question import OneVerb, asked, first_figure
from saltus.study.tables.kinds import OF_RESPONSES
from saltus.study.tables.signature import Asked, table
from saltus.study.tables.toml import fault

if TYPE_CHECKING:
    import xarray as xr

    from saltus.analysis.attractors.grid import Grid
    from saltus.results.store.division import Division
    from saltus.study.setting.setting import Setting


_MEASURED = Field(
    None,
    description="CSV in the study's folder, drawn with it: frequency [Hz], amplitude [mm].",
    examples=["shaker.csv"],
)


class Varied(Asked):
    """A table that varies parameters."""

    @model_validator(mode="after")
    def _one_or_two(self) -> Varied:
        if len(vary := getattr(self, "vary", {})) not in (1, 2):
            raise ValueError(
                f"varies one parameter, or two, such as vary.contact_stiffness, not {len(vary)}"
            )
        return self


class Responses(OneVerb):
    """Steady responses over one or two parameters."""

    all_rows = "-responses"
    #: The argument that holds the values that are varied.
    axes: ClassVar[str]

    def check(self, table: Any, setting: Setting) -> None:  # noqa: ARG002
        """Check the arguments of the analysis before anything is computed."""
        self.grid()

    def grid(self) -> Grid:
        """Values of parameters, and starts."""
        from saltus.analysis.attractors.grid import grid_of

        start, box, seed, follow = (
            self.arguments[name] for name in ("start", "box", "seed", "follow")
        )
        return grid_of(
            self.system, self.varied(), start, box, None, seed, follow, self.arguments.get("every")
        )

    @functools.cached_property
    def division(self) -> Division | str:
        """Chunks of values, unless each begins where the one before ended."""
        from saltus.analysis.attractors.divided_grid import values_together
        from saltus.analysis.responses.divided import DividedResponses

        if (grid := self.grid()).sweeps:
            return "sweeps: each value begins where the one before ended"
        given = self.arguments
        return DividedResponses(
            grid,
            self.method,
            given["periods"],
            given["outputs"],
            values_together(len(grid.starts)),
            given.get("sample", ""),
            given["unstable"],
        )

    def varied(self) -> dict[str, Any]:
        """The values of each parameter as the analyses take them: a range, or an array."""
        return {name: _array(values) for name, values in self.arguments[self.axes].items()}

    def call(self, how: dict[str, Any]) -> xr.Dataset:
        """The responses."""
        return super().call(how | {self.axes: self.varied()})

    def drawn_with(self) -> dict[str, Any]:
        """Arguments of the picture of a frequency response."""
        return {}

    def pictures(self, ds: xr.Dataset) -> dict[str, Any]:
        """The picture that fits; over two parameters that of sizes too, of random starts that of
        their shares.
        """
        from saltus import plot
        from saltus.plot.choice import default_kind

        kind = default_kind(ds)
        names = {"": kind}
        if kind == "type_map":
            names["-sizes"] = "amplitude_map"
        elif ds.attrs["random_starts"]:
            names["-shares"] = "shares"
        figures = {}
        for end, name in names.items():
            more = self.drawn_with() if name == "frequency_response" else {}
            axes = getattr(plot, name)(ds, **more)
            start = f": {axes.get_title('left')}" if kind == "type_map" else ""
            axes.set_title(f"{self.title}{start}", loc="left")
            figures[end] = first_figure(axes)
        return figures


@asked(
    80,
    table(
        "bifurcation_diagram",
        ["bifurcation_diagram"],
        OF_RESPONSES,
        base=Varied,
        called="Bifurcation diagram",
    ),
)
class Diagram(Responses):
    """[bifurcation_diagram]."""

    axes = "vary"


@asked(
    70,
    table(
        "frequency_response",
        ["frequency_response"],
        OF_RESPONSES,
        called="Frequency response",
        measured=(str | None, _MEASURED),
    ),
)
class Response(Responses):
    """[frequency_response], with measured points."""

    axes = "frequency"

    def check_first(self, table: Any) -> None:  # noqa: ARG002
        """It needs a forcing frequency."""
        if self.system.forced_at is None:
            raise StudyError(
                f"[{self.place}] {self.system.name} has no forcing frequency. Ask for a "
                f"[{Diagram.place}] over another parameter."
            )

    def check(self, table: Any, setting: Setting) -> None:
        """Read the measured points now: errors come before anything is computed."""
        super().check(table, setting)
        self.measured = (
            None if table.measured is None else setting.inputs.read(table.measured, self.place)
        )
        self.inputs = [] if self.measured is None else [self.measured]
        self.drawn_with()

    def varied(self) -> dict[str, Any]:
        """The forcing frequencies."""
        return {str(self.system.forced_at): _array(self.arguments[self.axes])}

    def call(self, how: dict[str, Any]) -> xr.Dataset:
        """The responses."""
        return OneVerb.call(self, how | {"frequency": _array(self.arguments["frequency"])})

    def drawn_with(self) -> dict[str, Any]:
        """Measured points in SI: amplitudes of the state or sensor that is drawn."""
        if self.measured is None:
            return {}
        units, axis = self.system.units, str(self.system.forced_at)
        outputs = self.system.outputs
        unit = outputs.units[0] if outputs.first else units.get(self.system.states[0], "1")
        try:
            points = measured_points(
                self.measured.data,
                self.measured.path,
                axis,
                units.get(axis, "1"),
                unit,
            )
        except SaltusError as error:
            raise fault(self.place, error) from None
        return {"measured": points}


def _array(values: Any) -> Any:
    """Array of values given one by one, as the analyses take them."""
    return np.array(values) if isinstance(values, list) else values
