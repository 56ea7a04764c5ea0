"""[lyapunov]: the Lyapunov exponents of the motions that given starts lead to."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from saltus.fence import MOST_PERIODS
from saltus.study.tables.parts import Method, Named, Quantity, Start


class Lyapunov(Named):
    """[lyapunov]: Lyapunov exponents of the motions that starts lead to. Several: [[lyapunov]], each with a name."""

    called = "Lyapunov exponents"

    start: dict[str, Start] | None = Field(
        None,
        description="Every state at the start; lists make a batch. At rest by default.",
        examples=[{"x": ["0 mm", "1 mm"], "v": "0 m/s"}],
    )
    method: Literal["variational", "wolf"] = Field(
        "variational", description="By the variational equations, or the largest one by Wolf's algorithm.", examples=["wolf"]
    )
    flow: Method | None = Field(None, description="How to integrate; the study's [method] by default.", examples=[{"name": "Taylor"}])
    periods: int = Field(2000, ge=1, le=MOST_PERIODS, description="Forcing periods that growth is measured over.", examples=[2000])
    transient: int = Field(500, ge=0, le=MOST_PERIODS, description="Forcing periods before them that don't count.", examples=[500])
    every: Quantity | None = Field(None, description="Time of a block, for a system without forcing.", examples=["1 s"])
    unit: Literal["1/s", "1/period", "bit/s", "bit/period"] = Field("1/s", description="Unit of the exponents.", examples=["1/period"])
    values: dict[str, Start] = Field(
        default_factory=dict,
        description="Values that differ from [system], for this question only; lists hold one for each trajectory.",
        examples=[{"frequency": ["14 Hz", "15 Hz"]}],
    )
