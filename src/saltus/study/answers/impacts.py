"""[impacts]: how often, how hard and how long the contacts are."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from saltus.errors import StudyError, nearest
from saltus.study.answers.followed import Looked, needs_contacts
from saltus.study.tables.motions import Impacts

if TYPE_CHECKING:
    import xarray as xr

    from saltus.study.setting.setting import Setting


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
