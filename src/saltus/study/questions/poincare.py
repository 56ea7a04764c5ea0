"""[poincare]: where motions cross a surface."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Discriminator, Field, Tag, field_validator

from saltus.errors import StudyError, nearest
from saltus.fence import shown
from saltus.study import quantities
from saltus.study.questions.followed import Followed, Looked, needs_contacts
from saltus.study.spec_parts import Quantity

if TYPE_CHECKING:
    import xarray as xr

    from saltus.study.setting import Setting

#: A level of a state, or a surface by its name.
Surface = Annotated[
    Annotated[dict[str, Quantity], Tag("dict[str]")] | Annotated[str, Tag("str")],
    Discriminator(lambda given: "dict[str]" if isinstance(given, dict) else "str"),
]
#: The key of a surface that is a formula.
FORMULA = "formula"


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
