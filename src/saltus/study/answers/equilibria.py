"""[equilibria]: where a system without forcing can rest, stable or not."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from saltus.errors import StudyError
from saltus.study.answers.question import OneVerb
from saltus.study.setting import quantities

if TYPE_CHECKING:
    import xarray as xr

    from saltus.study.setting.setting import Setting


class Equilibria(OneVerb):
    """Equilibria in each region, on boundaries, and held by contacts."""

    place, function = "equilibria", "equilibria"

    def check(self, table: Any, setting: Setting) -> None:  # noqa: ARG002
        """The ranges of a box are arguments of their own."""
        if table.start is not None and (table.box or table.at):
            raise StudyError("[equilibria] takes start, or box and at; leave out one of them.")
        self.arguments |= quantities.box(self.system, table.box, self.place) or {}

    def call(self, how: dict[str, Any]) -> xr.Dataset:  # noqa: ARG002
        """Nothing is integrated: there are no threads, and no method."""
        return super().call({})
