"""[basins]: the attractor that each start of a grid leads to, in one map or several, and their
agreement.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any

from pydantic import Field, model_validator

from saltus.analysis.basins.basins import map_of
from saltus.analysis.basins.divided import DividedMap
from saltus.analysis.basins.pipeline import BasinPlan, basin_plan
from saltus.fence import MOST_COUNT
from saltus.results.kinds.agreement import rows
from saltus.study.answers.question import Answers, Question, Show, asked
from saltus.study.identity import identity
from saltus.study.setting import quantities
from saltus.study.setting.arguments import arguments
from saltus.study.setting.setting import Setting
from saltus.study.tables.kinds import OF_RESPONSES
from saltus.study.tables.methods import Method
from saltus.study.tables.parts import FileTitle, Quantity, Range, StudyTable, slug
from saltus.study.tables.signature import Generated
from saltus.study.tables.signature import table as asking

if TYPE_CHECKING:
    import xarray as xr

    from saltus.results.table import TextTable

#: Most attractors in a gallery.
GALLERY = 8
#: Forcing periods drawn of an attractor that never repeats.
PERIODS = 24
#: End of the stem of the file of a map's attractors.
ATTRACTORS = "-attractors"
#: End of the stem of the file of a map's agreement with another.
AGREEMENT = "-agreement"


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


class MapTable(StudyTable):
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
        examples=[
            {
                "x": {"first": "-5 mm", "last": "5 mm", "count": 400},
                "v": {"first": "-1 m/s", "last": "1 m/s", "count": 400},
            }
        ],
    )
    map: list[MapTable] = Field(
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


@asked(
    140,
    asking("basins", ["basins"], OF_RESPONSES, base=OfMaps, without=("method",)),
    lambda _table, _study: [],
)
def questions(table: Any, setting: Setting) -> list[Question]:
    """Questions of the table: its maps, then the agreement of those that are compared. Raises
    StudyError, UnitError or ParameterError.
    """
    maps = [
        BasinMap(table, one, setting)
        for one in table.map or [MapTable(name=setting.study.study.name)]
    ]
    stems = {one.title: one.stem for one in maps}
    return [
        *maps,
        *(
            Agreement(one, one.compare, stems[one.compare])
            for one in maps
            if one.compare is not None
        ),
    ]


class BasinMap(Question):
    """One map of a study.

    Attributes
    ----------
    plan : BasinPlan
        Plan of the map, in chunks.
    compare : str or None
        The title of the map to compare it with.
    """

    place, shared = "basins", True

    def __init__(self, table: Any, one: MapTable, setting: Setting) -> None:
        self.title, self.group, self.compare = one.name, setting.study.study.name, one.compare
        self.stem = slug(one.name) if table.map else "basins"
        system, place = setting.system(one.values, "basins.map.values"), self.place
        axes = quantities.axes(system, table.axes, f"{place}.axes")
        asked = arguments(table, system, setting, place)
        self.plan: BasinPlan = basin_plan(
            system,
            axes,
            asked["at"],
            setting.method(one.method, f"{place}.map.method"),
            asked["periods"],
            asked["every"],
        )

    @property
    def stems(self) -> tuple[str, ...]:
        """Stems of the files of the map, and of the gallery of its attractors."""
        return self.stem, f"{self.stem}{ATTRACTORS}"

    def identity(self) -> dict[str, str]:
        """Texts that must be the same to go on with a store."""
        plan = self.plan
        axes = {
            name: f"{float(values[0])!r} to {float(values[-1])!r} in {len(values)}"
            for name, values in plan.axes.items()
        }
        asked = {"axes": axes, "at": dict(plan.fixed), "periods": plan.periods, "every": plan.every}
        return identity(plan.system, plan.method, asked)

    @functools.cached_property
    def division(self) -> DividedMap:
        """Chunks of cells."""
        return DividedMap(self.plan)

    def compute(self, found: Answers, threads: int | None, progress: Show) -> xr.Dataset:  # noqa: ARG002
        """The map, all at once; nothing is stored before it is complete."""
        return map_of(self.plan, threads, progress)

    def pictures(self, ds: xr.Dataset) -> dict[str, Any]:
        """The map, and the motions on its attractors."""
        from saltus import plot

        axes = plot.basins(ds)
        axes.set_title(": ".join(filter(None, (self.title, axes.get_title("left")))), loc="left")
        if ds.sizes["attractor"] == 0 or ds.attrs["method"] != "Taylor":
            return {"": axes.figure}
        shown = list(range(min(ds.sizes["attractor"], GALLERY)))
        return {"": axes.figure, ATTRACTORS: plot.gallery(ds, self._motions(ds), attractors=shown)}

    def _motions(self, ds: xr.Dataset) -> xr.Dataset:
        """Motions on the attractors, long enough for their pictures."""
        from saltus.analysis.motion.simulate import simulate

        system = self.plan.system
        start = {name: ds[f"attractor_{name}"].values[:, 0] for name in system.states}
        longest = max(int(ds["attractor_period"].max()), PERIODS)
        if system.forced_at is None:
            return simulate(system, start, t_end=longest * (self.plan.every or 1.0), progress=False)
        return simulate(system, start, periods=longest, time_errors="local", progress=False)


class Agreement(Question):
    """Agreement of two maps."""

    place, shared = "basins", True

    def __init__(self, one: BasinMap, other: str, other_stem: str) -> None:
        self.title, self.group, self.names = (
            f"{one.title} beside {other}",
            one.group,
            (other, one.title),
        )
        self.stem, self.needs = f"{one.stem}{AGREEMENT}", (other_stem, one.stem)

    def compute(self, found: Answers, threads: int | None, progress: Show) -> xr.Dataset:  # noqa: ARG002
        """Compare the maps, cell by cell."""
        from saltus.analysis.basins.compare import compare

        return compare(*(found[stem] for stem in self.needs)).assign_attrs(
            name_a=self.names[0], name_b=self.names[1]
        )

    def rows(self, ds: xr.Dataset, found: Answers) -> list[TextTable]:  # noqa: ARG002
        """A row for each pair of attractors, under the names of the maps."""
        a, b = self.names
        return rows(f"a: {a} / b: {b}", ds)

    def pictures(self, ds: xr.Dataset) -> dict[str, Any]:
        """The cells on which they differ."""
        from saltus import plot

        return {"": plot.agreement(ds)[0].figure}
