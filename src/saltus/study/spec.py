"""What a study file may hold: one class a table, every key typed, unknown keys refused.

Quantities stay as written here ("4 N"); :mod:`saltus.study.quantities` turns them into SI once the system is known.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

#: A quantity as written: a bare number if it has no dimension, else text with its unit.
Quantity = float | str
Start = Quantity | list[Quantity]


class Table(BaseModel):
    """A table of a study file: strict types, no unknown keys, never changed after reading."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


class Header(Table):
    """[study]: what it is, for people."""

    name: str = Field(min_length=1, description="A title.", examples=["Rig b4 at 15 Hz"])
    description: str = Field("", description="What the study shows.", examples=["Four starts, four responses"])
    source: str = Field("", description="Where the setting comes from.", examples=["Saunders et al. (2021), Table 2"])


class SystemTable(Table):
    """[system]: a model that comes with saltus and its values; only values if the system is given on the command line."""

    model_config = ConfigDict(extra="allow", strict=True, frozen=True, allow_inf_nan=False)
    __pydantic_extra__: dict[str, Quantity] = Field(init=False)

    model: str | None = Field(None, description="A published system; `saltus models` lists them.", examples=["delangre"])
    case: str | None = Field(None, description="A named set of values of the model.", examples=["b"])

    @property
    def values(self) -> dict[str, Quantity]:
        """Parameter values as written."""
        return dict(self.__pydantic_extra__ or {})


class Taylor(Table):
    """[method] name = "Taylor": machine precision, every contact."""

    name: Literal["Taylor"]
    order: int | None = Field(None, ge=6, le=40, description="Order of the series; by default chosen for speed.", examples=[20])
    tolerance: float | None = Field(None, gt=0, description="Relative local error; by default machine precision.", examples=[1e-12])


class ODE45(Table):
    """[method] name = "ODE45": MATLAB's ode45, to the digit."""

    name: Literal["ODE45"]
    rtol: float = Field(1e-3, gt=0, description="RelTol.", examples=[1e-4])
    atol: float = Field(1e-6, gt=0, description="AbsTol, in SI.", examples=[1e-7])
    events: Literal["locate", "ignore"] = Field("locate", description="Restart at contacts, or step over them.", examples=["locate"])


Method = Annotated[Taylor | ODE45, Field(discriminator="name")]
METHODS: dict[str, type[Table]] = {"Taylor": Taylor, "ODE45": ODE45}


class Simulate(Table):
    """[simulate]: move one start, or a batch of them, and keep the motion with its contacts."""

    start: dict[str, Start] = Field(
        description="Every state at t_start. A list of values makes a batch; single values beside it hold for all.",
        examples=[{"x": "0 mm", "v": "0 m/s"}, {"x": ["0.2 mm", "0.4 mm"], "v": "0 m/s"}],
    )
    periods: int | None = Field(None, ge=1, description="Length in forcing periods.", examples=[60])
    t_end: Quantity | None = Field(None, description="End time; in place of periods.", examples=["2 s"])
    t_start: Quantity = Field("0 s", description="Start time.", examples=["0 s"])
    samples: int = Field(200, ge=1, description="Samples per period; over the whole span if the system isn't forced.", examples=[200])
    keep: int | None = Field(None, ge=1, description="Keep only this many periods at the end.", examples=[12])
    values: dict[str, list[Quantity]] = Field(
        default_factory=dict,
        description="Parameters that differ from trajectory to trajectory: one value each.",
        examples=[{"frequency": ["14 Hz", "15 Hz"]}],
    )

    @model_validator(mode="after")
    def _one_length(self) -> Simulate:
        if (self.periods is None) == (self.t_end is None):
            raise ValueError('give the length once: periods = 60, or t_end = "2 s"')
        return self


class Compare(Table):
    """[compare]: set contact times beside those that somebody printed, and beside exact ones."""

    printed: str = Field(description="CSV beside the study: marker, event_number, time_s, and, if printed, position_minus_boundary_m.",
                         examples=["table2.csv"])  # fmt: skip
    exact: str | None = Field(None, description="CSV beside the study: event_number, time_s.", examples=["exact_events.csv"])
    reference: Method | None = Field(None, description="A second method to run on the same system.", examples=[{"name": "Taylor"}])


class Axis(Table):
    """An axis of a basin map: starts from one value to another, ends included."""

    first: Quantity = Field(description="The first start.", examples=["-5 mm"])
    last: Quantity = Field(description="The last start.", examples=["5 mm"])
    count: int = Field(ge=2, description="How many starts.", examples=[400])


class Map(Table):
    """[[basins.map]]: one of the maps of a study, with what sets it apart from the others."""

    name: str = Field(min_length=1, description="What it is called in tables, pictures and file names.", examples=["exact, 25.5 kN/m"])
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
    periods: int = Field(2000, ge=1, description="Forcing periods that a start is followed at most.", examples=[2000])
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


class Study(Table):
    """A study file."""

    study: Header
    system: SystemTable = SystemTable()
    method: Method = Taylor(name="Taylor")
    simulate: Simulate | None = None
    compare: Compare | None = None
    basins: Basins | None = None

    @model_validator(mode="after")
    def _one_question(self) -> Study:
        if (self.simulate is None) == (self.basins is None):
            raise ValueError("a study has one table [simulate] or one table [basins]")
        if self.compare is not None and self.simulate is None:
            raise ValueError("[compare] goes with [simulate]; maps are compared with compare = in [[basins.map]]")
        return self
