"""[equilibria]: the equilibria of a system without forcing, stable or not."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pydantic import Field

from saltus.errors import StudyError
from saltus.study.answers.question import OneVerb, asked
from saltus.study.setting import quantities
from saltus.study.tables.kinds import KINDS, whole
from saltus.study.tables.parts import Interval, Start
from saltus.study.tables.signature import WrittenAs
from saltus.study.tables.signature import table as asking

if TYPE_CHECKING:
    import xarray as xr

    from saltus.study.setting.setting import Setting


#: They are looked for in a box, or from starts.
KEYS = KINDS | {
    "start": WrittenAs(
        dict[str, Start],
        KINDS["start"].examples,
        "Starts of Newton's method, in place of a box: every state; lists make a batch.",
        None,
        convert="start",
    ),
    "starts": whole(256),
}
_BOX = Field(
    None,
    description="Ranges of the starts of Newton's method.",
    examples=[{"x": ["-5 mm", "5 mm"]}],
)


@asked(
    90,
    asking(
        "equilibria",
        ["equilibria"],
        KEYS,
        called="Equilibria",
        box=(dict[str, Interval] | None, _BOX),
    ),
)
class Equilibria(OneVerb):
    """Equilibria in each region, on boundaries, and held by contacts."""

    def check(self, table: Any, setting: Setting) -> None:  # noqa: ARG002
        """Refuse start together with a box. The ranges of the box become arguments."""
        if table.start is not None and (table.box or table.at):
            raise StudyError("[equilibria] takes start, or box and at; leave out one of them.")
        self.arguments |= quantities.box(self.system, table.box, self.place) or {}

    def call(self, how: dict[str, Any]) -> xr.Dataset:  # noqa: ARG002
        """Call the analysis without threads and method: nothing is integrated."""
        return super().call({})
