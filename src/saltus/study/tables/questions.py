"""The tables that ask something. Keys are parameters of the functions that answer; what stands here
is more than their call.
"""

from __future__ import annotations

from typing import Any

from pydantic import Field, model_validator

from saltus.fence import MOST_COUNT, MOST_PERIODS
from saltus.study.tables.kinds import (
    KINDS,
    OF_BACKBONES,
    OF_BRANCHES,
    OF_CURVES,
    OF_EQUILIBRIA,
    OF_ORBITS,
    OF_RESPONSES,
    whole,
)
from saltus.study.tables.methods import Method
from saltus.study.tables.parts import FileTitle, Interval, Quantity, Range, Table
from saltus.study.tables.signature import Asked, Generated, table

#: Stems of the files of [simulate]: of the run, and of that of a second method.
RUN, REFERENCE = "run", "run-reference"


# -- motions from given starts ---------------------------------------------------------------------
class OfLength(Generated):
    """A table that says how long to go on."""

    @model_validator(mode="after")
    def _one_length(self) -> OfLength:
        if (getattr(self, "periods", None) is None) == (getattr(self, "t_end", None) is None):
            raise ValueError(
                "give the length once: periods = 60, or, of a system without forcing, "
                't_end = "20 s"'
            )
        return self


class Compare(Table):
    """[compare]: compare contact times with printed ones, and with exact ones."""

    printed: str = Field(
        description="CSV in the study's folder: marker, event_number, time_s, "
        "and, if printed, position_minus_boundary_m.",
        examples=["table2.csv"],
    )
    exact: str | None = Field(
        None,
        description="CSV in the study's folder: event_number, time_s.",
        examples=["exact_events.csv"],
    )
    reference: Method | None = Field(
        None,
        description="A second method to run on the same system.",
        examples=[{"name": "Taylor"}],
    )


_OF_MOTION: Any = (OfLength, Asked)
Simulate = table("simulate", ["simulate"], KINDS, base=OfLength)
Poincare = table("poincare", ["poincare"], KINDS, base=_OF_MOTION, called="Poincare section")
Spectrum = table(
    "spectrum", ["spectrum", "simulate", "poincare"], KINDS | {"samples": whole(200, least=4)},
    base=_OF_MOTION, called="Spectrum",
    without=("state", "keep", "time_errors", "surface", "direction"),
    states=(list[str] | None, Field(None, min_length=1, description="Which states; all by "
        "default.", examples=[["x"]])),
)  # fmt: skip
Impacts = table(
    "impacts", ["impact_statistics"], KINDS, base=_OF_MOTION, called="Impact statistics"
)
Energy = table("energy", ["energy_balance"], KINDS, base=_OF_MOTION, called="Energy balance")
_OF_BLOCKS = {
    "transient": whole(500, least=0, most=MOST_PERIODS),
    "periods": whole(2000, most=MOST_PERIODS),
}
Lyapunov = table("lyapunov", ["lyapunov"], KINDS | _OF_BLOCKS, called="Lyapunov exponents")


# -- responses -------------------------------------------------------------------------------------
class Varied(Asked):
    """A table that varies parameters."""

    @model_validator(mode="after")
    def _one_or_two(self) -> Varied:
        if len(vary := getattr(self, "vary", {})) not in (1, 2):
            raise ValueError(
                f"varies one parameter, or two, such as vary.contact_stiffness, not {len(vary)}"
            )
        return self


_MEASURED = Field(
    None,
    description="CSV in the study's folder, drawn with it: frequency [Hz], amplitude [mm].",
    examples=["shaker.csv"],
)
FrequencyResponse = table(
    "frequency_response",
    ["frequency_response"],
    OF_RESPONSES,
    called="Frequency response",
    measured=(str | None, _MEASURED),
)
BifurcationDiagram = table(
    "bifurcation_diagram",
    ["bifurcation_diagram"],
    OF_RESPONSES,
    base=Varied,
    called="Bifurcation diagram",
)
Equilibria = table(
    "equilibria",
    ["equilibria"],
    OF_EQUILIBRIA,
    called="Equilibria",
    box=(
        dict[str, Interval] | None,
        Field(
            None,
            description="Ranges of the starts of Newton's method.",
            examples=[{"x": ["-5 mm", "5 mm"]}],
        ),
    ),
)
PeriodicOrbits = table("periodic_orbits", ["periodic_orbits"], OF_ORBITS, called="Periodic orbits")
Branches = table("branches", ["branches"], OF_BRANCHES, called="Branches of periodic orbits")
BifurcationCurve = table(
    "bifurcation_curve",
    ["bifurcation_curve"],
    OF_CURVES,
    called="Bifurcation curve",
    branches=(
        str | None,
        Field(None, description="Name of the [branches], of several.", examples=["main"]),
    ),
    near=(
        Quantity | None,
        Field(None, description="Value of the branches' parameter near it.", examples=["17.8 Hz"]),
    ),
)
Backbone = table("backbone", ["backbone"], OF_BACKBONES, called="Backbone")


# -- basins ----------------------------------------------------------------------------------------
class Axis(Range):
    """An axis of a basin map: starts from one value to another, ends included, or
    given one by one.
    """

    first: Quantity | None = Field(None, description="The first start.", examples=["-5 mm"])
    last: Quantity | None = Field(None, description="The last start.", examples=["5 mm"])
    count: int | None = Field(
        None, ge=2, le=MOST_COUNT, description="How many starts.", examples=[400]
    )
    values: list[Quantity] | None = Field(
        None,
        min_length=2,
        description="The starts themselves, ascending.",
        examples=[["-1 mm", "1 mm"]],
    )


class Map(Table):
    """[[basins.map]]: one of the maps of a study, with what sets it apart from the others."""

    name: FileTitle = Field(
        description="What it is called in tables, pictures and file names.",
        examples=["exact, 25.5 kN/m"],
    )
    method: Method | None = Field(
        None,
        description="How to integrate; the study's [method] by default.",
        examples=[{"name": "Taylor"}],
    )
    values: dict[str, Quantity] = Field(
        default_factory=dict,
        description="Values that differ from [system].",
        examples=[{"contact_stiffness": "25.5 kN/m"}],
    )
    compare: str | None = Field(
        None,
        description="The name of another map to compare with this one, cell by cell.",
        examples=["exact"],
    )


class OfMaps(Generated):
    """A table of one map, or of several."""

    axes: dict[str, Axis] = Field(
        description="The two states that the map is drawn over.",
        examples=[{"x": {"first": "-5 mm", "last": "5 mm", "count": 400},
            "v": {"first": "-1 m/s", "last": "1 m/s", "count": 400}}],
    )  # fmt: skip
    map: list[Map] = Field(
        default_factory=list,
        description="Several maps of one study.",
        examples=[[{"name": "exact"}]],
    )

    @model_validator(mode="after")
    def _fits(self) -> OfMaps:
        if len(self.axes) != 2:
            raise ValueError(f"a map has two axes, such as axes.x and axes.v, not {len(self.axes)}")
        names = [one.name for one in self.map]
        if len(set(names)) < len(names):
            raise ValueError("two maps have the same name")
        for one in self.map:
            if one.compare is not None and (one.compare not in names or one.compare == one.name):
                raise ValueError(
                    f"map {one.name!r} is compared with {one.compare!r}, which is no "
                    f"other map of this study"
                )
        return self


Basins = table("basins", ["basins"], OF_RESPONSES, base=OfMaps, without=("method",))
