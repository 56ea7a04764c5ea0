"""[impacts]: how often, how hard and how long the contacts are."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field

from saltus.errors import StudyError, nearest
from saltus.study.questions.followed import Followed, Looked, needs_contacts

if TYPE_CHECKING:
    import xarray as xr

    from saltus.study.setting import Setting

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


class Statistics(Looked):
    """Statistics of contacts."""

    place, picture = "impacts", "impacts"

    def more_arguments(self, table: Impacts, setting: Setting) -> dict[str, Any]:  # noqa: ARG002
        """Bins and sides."""
        needs_contacts(self.method, self.place)
        names = [guard.name for guard in self.system.guards]
        if not names:
            raise StudyError(f"[{self.place}] {self.system.name} has no guard, so there is no contact to count.")
        for name in table.contact_side:
            if name not in names:
                raise StudyError(f"[{self.place}.contact_side] {name!r} is no guard of {self.system.name}. {nearest(name, names)}")
        return {"bins": table.bins, "contact_side": table.contact_side}

    def call(self, how: dict[str, Any]) -> xr.Dataset:
        """Count contacts."""
        from saltus.analysis.impacts import impact_statistics

        return impact_statistics(self.system, **self.arguments, **how)
