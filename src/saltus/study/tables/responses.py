"""[frequency_response] and [bifurcation_diagram]: all steady responses over a frequency, over any parameter, or over two."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from saltus.study.tables.parts import (
    BOX,
    METHOD,
    OUTPUTS,
    PERIODS,
    SEED,
    START,
    VALUES,
    Interval,
    Method,
    Named,
    Outputs,
    Quantity,
    Range,
    Starts,
)  # fmt: skip


class FrequencyResponse(Named):
    """[frequency_response]: all steady responses over a range of forcing frequencies. Several: [[frequency_response]], each with a name."""

    called = "Frequency response"

    frequency: Range = Field(description="Forcing frequencies.", examples=[{"first": "2 Hz", "last": "30 Hz", "count": 281}])
    start: Starts | None = START
    box: dict[str, Interval] | None = BOX
    follow: bool = Field(False, description="Whether each start goes on, from value to value upwards, where it stood.", examples=[True])
    periods: int = PERIODS
    seed: int = SEED
    outputs: Outputs = OUTPUTS
    method: Method | None = METHOD
    values: dict[str, Quantity] = VALUES
    measured: str | None = Field(
        None, description="CSV beside the study to draw with it: frequency [Hz], amplitude [mm].", examples=["shaker.csv"]
    )


class BifurcationDiagram(Named):
    """[bifurcation_diagram]: how all steady responses change with a parameter, or with two. Several: [[bifurcation_diagram]]."""

    called = "Bifurcation diagram"

    vary: dict[str, Range] = Field(
        description="One parameter, or two for a map of the kinds of motion.",
        examples=[{"contact_stiffness": {"first": "1e3 N/m", "last": "1e9 N/m", "count": 200, "scale": "log"}}],
    )
    sample: Literal["turning_points", "stroboscope", "contacts"] = Field(
        "turning_points", description="What is shown of each response: where its velocity is zero, at whole periods, or at contacts.",
        examples=["stroboscope"],
    )  # fmt: skip
    start: Starts | None = START
    box: dict[str, Interval] | None = BOX
    follow: bool = Field(False, description="Whether each start goes on, from value to value upwards, where it stood.", examples=[True])
    periods: int = PERIODS
    every: Quantity | None = Field(None, description="Time between two looks, for a system without forcing.", examples=["1 s"])
    seed: int = SEED
    outputs: Outputs = OUTPUTS
    method: Method | None = METHOD
    values: dict[str, Quantity] = VALUES

    @model_validator(mode="after")
    def _fits(self) -> BifurcationDiagram:
        if len(self.vary) not in (1, 2):
            raise ValueError(f"varies one parameter, or two, such as vary.contact_stiffness, not {len(self.vary)}")
        return self
