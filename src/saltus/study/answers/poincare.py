"""[poincare]: where motions cross a surface."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from saltus.errors import StudyError, nearest
from saltus.fence import shown
from saltus.study.answers.followed import Looked, needs_contacts
from saltus.study.setting import quantities
from saltus.study.tables.motions import Poincare

if TYPE_CHECKING:
    import xarray as xr

    from saltus.study.setting.setting import Setting

#: The key of a surface that is a formula.
FORMULA = "formula"


class Section(Looked):
    """Crossings of a surface."""

    place, picture, several = "poincare", "section", True

    def more_arguments(self, table: Poincare, setting: Setting) -> dict[str, Any]:
        """The surface in SI, and the direction."""
        from saltus.analysis.motion.poincare import crossed

        needs_contacts(self.method, self.place)
        surface: Any = table.surface
        known = [*(guard.name for guard in self.system.guards), *(f"{name} turns" for name in self.system.states)]
        if isinstance(surface, dict) and isinstance(text := surface.get(FORMULA), str) and FORMULA not in self.system.states:
            surface = setting.formula(text, f"{self.place}.surface")
        elif isinstance(surface, dict):
            (surface,) = quantities.states(self.system, surface, f"{self.place}.surface").items()
        elif surface not in known:
            level = f'surface = {{ {self.system.states[0]} = "0.3 mm" }}'
            raise StudyError(f"[{self.place}] surface = {shown(surface)!r} is unknown. {nearest(surface, known)} Or give a level: {level}.")
        crossed(self.system, surface, self.arguments["values"] or {})
        return {"surface": surface, "direction": table.direction}

    def call(self, how: dict[str, Any]) -> xr.Dataset:
        """Crossings."""
        from saltus.analysis.motion.poincare import poincare

        return poincare(self.system, **self.arguments, **how)
