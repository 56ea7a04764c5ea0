"""[sensitivity]: derivatives of motions with respect to parameters."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any

from pydantic import Field

from saltus.study.answers.question import OneVerb, asked
from saltus.study.setting.setting import Setting
from saltus.study.tables.kinds import KINDS
from saltus.study.tables.signature import Asked, OfLength, table

if TYPE_CHECKING:
    from saltus.results.store.division import Division

_TO = Field(
    min_length=1,
    description="Parameters, and states at the start: what derivatives are with respect to.",
    examples=[["gap", "x(0)"]],
)


@asked(
    55,
    table(
        "sensitivity",
        ["sensitivity"],
        KINDS,
        base=(OfLength, Asked),
        called="Derivatives",
        without=("at", "to"),
        to=(list[str], _TO),
    ),
)
class Derivatives(OneVerb):
    """[sensitivity]: derivatives of motions."""

    def check(self, table: Any, setting: Setting) -> None:  # noqa: ARG002
        """Check start, length and values, and what the derivatives are with respect to."""
        from saltus.analysis.derivatives.columns import Columns
        from saltus.analysis.motion.window import stretch

        self.arguments["to"] = table.to
        Columns.of(self.system, table.to)
        names = ("start", "values", "periods", "t_end", "t_start")
        stretch(self.system, **{name: self.arguments[name] for name in names}, transient=0)

    @functools.cached_property
    def division(self) -> Division | str:
        """Chunks of trajectories."""
        from saltus.analysis.derivatives.divided import DividedSensitivity

        return DividedSensitivity.of(self.system, self.method, self.arguments)
