"""[simulate], [compare], and the questions on motions from given starts: [poincare], [spectrum], [impacts], [energy]."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, field_validator, model_validator

from saltus.fence import MOST_COUNT, MOST_PERIODS
from saltus.study.tables.parts import METHOD, Formula, Method, Named, Quantity, Start, Table

#: Stems of the files: of the run, and of that of a second method.
RUN, REFERENCE = "run", "run-reference"


class Simulate(Table):
    """[simulate]: move one start, or a batch of them, and keep the motion with its contacts."""

    start: dict[str, Start] | None = Field(
        None,
        description="Every state at t_start. A list of values makes a batch; single values beside it hold for all. At rest by default.",
        examples=[{"x": "0 mm", "v": "0 m/s"}, {"x": ["0.2 mm", "0.4 mm"], "v": "0 m/s"}],
    )
    periods: int | None = Field(None, ge=1, le=MOST_PERIODS, description="Length in forcing periods.", examples=[60])
    t_end: Quantity | None = Field(None, description="End time; in place of periods.", examples=["2 s"])
    t_start: Quantity = Field("0 s", description="Start time.", examples=["0 s"])
    samples: int | None = Field(
        None, ge=1, le=MOST_COUNT, examples=[200],
        description="Samples per period, 200 by default; of a system without forcing over the whole span, up to 10 000 by default.",
    )  # fmt: skip
    keep: int | None = Field(None, ge=1, le=MOST_PERIODS, description="Keep only this many periods at the end.", examples=[12])
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


class Followed(Named):
    """The keys of a question on motions from given starts."""

    start: dict[str, Start] | None = Field(
        None,
        description="Every state at t_start; lists make a batch. At rest by default.",
        examples=[{"x": ["0.2 mm", "0.4 mm"], "v": "0 m/s"}],
    )
    periods: int | None = Field(None, ge=1, le=MOST_PERIODS, description="Forcing periods to look at, after the transient.", examples=[200])
    t_end: Quantity | None = Field(None, description="End time, of a system without forcing; in place of periods.", examples=["20 s"])
    t_start: Quantity = Field("0 s", description="Start time.", examples=["0 s"])
    transient: Quantity | None = Field(
        None, description="Forcing periods before that don't count; of a system without forcing a time.", examples=[500, "5 s"]
    )
    method: Method | None = METHOD
    values: dict[str, Start] = Field(
        default_factory=dict,
        description="Values that differ from [system], for this question only; lists hold one for each trajectory.",
        examples=[{"frequency": ["14 Hz", "15 Hz"]}],
    )

    @model_validator(mode="after")
    def _one_length(self) -> Followed:
        if (self.periods is None) == (self.t_end is None):
            raise ValueError('give the length once: periods = 200, or, of a system without forcing, t_end = "20 s"')
        return self


#: A level of a state, or a surface by its name.
Surface = Annotated[
    Annotated[dict[str, Quantity], Tag("dict[str]")] | Annotated[str, Tag("str")],
    Discriminator(lambda given: "dict[str]" if isinstance(given, dict) else "str"),
]


class Poincare(Followed):
    """[poincare]: where motions cross a surface, point by point. Several: [[poincare]], each with a name."""

    called = "Poincare section"

    surface: Surface = Field(
        description='A level of a state; its turning points, "x turns"; a guard of the system by name; or where a formula is zero.',
        examples=[{"x": "0.3 mm"}, "x turns", {"formula": "x - 0.1*v"}],
    )
    direction: int = Field(0, ge=-1, le=1, description="1: only crossings upwards; -1: only downwards; 0: both.", examples=[1])

    @field_validator("surface")
    @classmethod
    def _one_level(cls, surface: Any) -> Any:
        if isinstance(surface, dict) and len(surface) != 1:
            raise ValueError('surface is a level of one state, such as { x = "0.3 mm" }')
        return surface


class Spectrum(Followed):
    """[spectrum]: amplitudes and phases of motions by frequency. Several: [[spectrum]], each with a name."""

    called = "Spectrum"

    states: list[str] | None = Field(None, min_length=1, description="Which states; all by default.", examples=[["x"]])
    samples: int | None = Field(
        None, ge=4, le=MOST_COUNT, examples=[200],
        description="Samples per period, 200 by default; of a system without forcing over the whole span, up to 10 000 by default.",
    )  # fmt: skip
    window: Literal["none", "hann"] | None = Field(
        None, description="By default none where the response repeats, else hann.", examples=["hann"]
    )
    last: int | None = Field(None, ge=1, le=MOST_PERIODS, description="Forcing periods at the end to take.", examples=[64])


#: Most bins of a histogram.
MOST_BINS = 10_000


class Impacts(Followed):
    """[impacts]: rate, speed and duration of the contacts, guard by guard. Several: [[impacts]], each with a name."""

    called = "Impact statistics"

    bins: int = Field(20, ge=1, le=MOST_BINS, description="Bins of the histogram of speeds.", examples=[20])
    contact_side: dict[str, Literal[-1, 1]] = Field(
        default_factory=dict,
        description="For guards by name: the sign of the gap in contact. By default the side on which the state of rest doesn't lie.",
        examples=[{"upper_gap": 1}],
    )
    force: dict[str, Formula] = Field(
        default_factory=dict,
        description="For guards by name: the force of that contact, right in contact only. Its integral is the impulse.",
        examples=[{"upper_gap": "contact_stiffness*(x - upper_gap)"}],
    )


class Energy(Followed):
    """[energy]: energy stored, supplied and dissipated. Several: [[energy]], each with a name."""

    called = "Energy balance"

    energy: Formula | None = Field(
        None, description="Stored energy [J]; of a published model it is known.", examples=["(mass*v**2 + stiffness*x**2)/2"]
    )
    supplied: Formula | None = Field(None, description="Power that flows in [W].", examples=["force*cos(2*pi*frequency*t)*v"])
    dissipated: Formula | None = Field(None, description="Power that is lost [W].", examples=["damping*v**2"])
    intervals: int | None = Field(
        None, ge=1, le=MOST_COUNT, description="Equal intervals of the run of a system without forcing; 100 by default.", examples=[100]
    )
