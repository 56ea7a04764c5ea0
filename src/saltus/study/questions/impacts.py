"""[impacts]: how often, how hard and how long the contacts are."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field

from saltus.errors import StudyError, nearest
from saltus.study.questions.followed import Followed, Looked, needs_contacts
from saltus.study.spec_parts import Formula

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
    force: dict[str, Formula] = Field(
        default_factory=dict,
        description="For guards by name: the force of that contact, right in contact only. Its integral is the impulse.",
        examples=[{"upper_gap": "contact_stiffness*(x - upper_gap)"}],
    )


class Statistics(Looked):
    """Statistics of contacts."""

    place, picture = "impacts", "impacts"

    def more_arguments(self, table: Impacts, setting: Setting) -> dict[str, Any]:
        """Bins, sides and forces."""
        from saltus.system.quantity import quantity

        needs_contacts(self.method, self.place)
        names = [guard.name for guard in self.system.guards]
        if not names:
            raise StudyError(f"[{self.place}] {self.system.name} has no guard, so there is no contact to count.")
        for key in ("contact_side", "force"):
            for name in getattr(table, key):
                if name not in names:
                    raise StudyError(f"[{self.place}.{key}] {name!r} is no guard of {self.system.name}. {nearest(name, names)}")
        force = {name: setting.formula(text, f"{self.place}.force") for name, text in table.force.items()}
        for name, function in force.items():
            quantity(self.system, function, f"the force at {name!r}")
        return {"bins": table.bins, "contact_side": table.contact_side, "force": force}

    def call(self, how: dict[str, Any]) -> xr.Dataset:
        """Count contacts."""
        from saltus.analysis.motion.impacts import impact_statistics

        return impact_statistics(self.system, **self.arguments, **how)
