"""[energy]: where the energy of motions comes from and where it goes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from saltus.errors import StudyError
from saltus.study.answers.followed import Looked
from saltus.study.identity import code_hash
from saltus.study.tables.motions import Energy

if TYPE_CHECKING:
    import xarray as xr

    from saltus.study.setting.setting import Setting

#: What a balance is made of.
_PARTS = ("energy", "supplied", "dissipated")


class Balance(Looked):
    """An energy balance."""

    place, picture = "energy", "energy"

    def more_arguments(self, table: Energy, setting: Setting) -> dict[str, Any]:
        """The intervals, and the functions unless they are those of the model."""
        self.functions, self.coded = self._functions(table, setting)
        if table.intervals is not None and self.system.forced_at is not None:
            raise StudyError(f"[{self.place}] {self.system.name} is forced: its balance is drawn each forcing period. Leave intervals out.")
        return {"intervals": table.intervals, **({} if self.coded else {"functions": self.functions})}

    def _functions(self, table: Energy, setting: Setting) -> tuple[dict[str, Any], bool]:
        """Energy and powers, and whether they are those of a model, which stand in its code."""
        from saltus import models
        from saltus.system.quantity import quantity

        written = {name: text for name in _PARTS if (text := getattr(table, name)) is not None}
        model = setting.study.system.model
        if not written and model is not None:
            return models.energy(model), True
        if lacking := [name for name in _PARTS if name not in written]:
            bring = "" if model is None else ", or leave all three out: the model brings them along"
            raise StudyError(f'[{self.place}] lacks {lacking[0]}. Write {lacking[0]} = "..." as a formula, 0 if there is none{bring}.')
        functions = {name: setting.formula(text, self.place) for name, text in written.items()}
        for name, function in functions.items():
            quantity(self.system, function, f"{name} =")
        return functions, False

    def identity(self) -> dict[str, str]:
        """With the code of the models, if that holds the functions."""
        return super().identity() | ({"models": code_hash("models")} if self.coded else {})

    def call(self, how: dict[str, Any]) -> xr.Dataset:
        """Draw the balance."""
        from saltus.analysis.motion.energy import energy_balance

        asked = {name: value for name, value in self.arguments.items() if name != "functions"}
        call: dict[str, Any] = asked | self.functions | how
        return energy_balance(self.system, **call)
