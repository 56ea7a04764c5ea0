"""[basins]: which attractor each start of a grid leads to; one map, or several and where they agree."""

from __future__ import annotations

from pydantic import Field, model_validator

from saltus.fence import MOST_COUNT
from saltus.study.tables.parts import PERIODS, FileTitle, Method, Quantity, Range, Table


class Axis(Range):
    """An axis of a basin map: starts from one value to another, ends included, or given one by one."""

    first: Quantity | None = Field(None, description="The first start.", examples=["-5 mm"])
    last: Quantity | None = Field(None, description="The last start.", examples=["5 mm"])
    count: int | None = Field(None, ge=2, le=MOST_COUNT, description="How many starts.", examples=[400])
    values: list[Quantity] | None = Field(None, min_length=2, description="The starts themselves, ascending.", examples=[["-1 mm", "1 mm"]])


class Map(Table):
    """[[basins.map]]: one of the maps of a study, with what sets it apart from the others."""

    name: FileTitle = Field(description="What it is called in tables, pictures and file names.", examples=["exact, 25.5 kN/m"])
    method: Method | None = Field(None, description="How to integrate; the study's [method] by default.", examples=[{"name": "Taylor"}])
    values: dict[str, Quantity] = Field(
        default_factory=dict, description="Values that differ from [system].", examples=[{"contact_stiffness": "25.5 kN/m"}]
    )
    compare: str | None = Field(None, description="The name of another map to set beside this one, cell by cell.", examples=["exact"])


class Basins(Table):
    """[basins]: which attractor each start of a grid leads to."""

    axes: dict[str, Axis] = Field(
        description="The two states that the map is drawn over.",
        examples=[{"x": {"first": "-5 mm", "last": "5 mm", "count": 400}, "v": {"first": "-1 m/s", "last": "1 m/s", "count": 400}}],
    )  # fmt: skip
    at: dict[str, Quantity] = Field(default_factory=dict, description="Starts of the other states; 0 by default.", examples=[{"y": "0 mm"}])
    periods: int = PERIODS
    every: Quantity | None = Field(None, description="Time between two looks, for a system without forcing.", examples=["1 s"])
    map: list[Map] = Field(default_factory=list, description="Several maps of one study.", examples=[[{"name": "exact"}]])

    @model_validator(mode="after")
    def _fits(self) -> Basins:
        if len(self.axes) != 2:
            raise ValueError(f"a map has two axes, such as axes.x and axes.v, not {len(self.axes)}")
        names = [one.name for one in self.map]
        if len(set(names)) < len(names):
            raise ValueError("two maps have the same name")
        for one in self.map:
            if one.compare is not None and (one.compare not in names or one.compare == one.name):
                raise ValueError(f"map {one.name!r} is compared with {one.compare!r}, which is no other map of this study")
        return self
