"""[energy]: where the energy of motions comes from and where it goes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pydantic import Field

from saltus.errors import StudyError
from saltus.fence import MOST_COUNT
from saltus.study.identity import code_hash
from saltus.study.questions.followed import Followed, Looked

if TYPE_CHECKING:
    import xarray as xr

    from saltus.study.setting import Setting


class Energy(Followed):
    """[energy]: energy stored, supplied and dissipated by a published model. Several: [[energy]], each with a name."""

    called = "Energy balance"

    intervals: int | None = Field(
        None, ge=1, le=MOST_COUNT, description="Equal intervals of the run of a system without forcing; 100 by default.", examples=[100]
    )


class Balance(Looked):
    """An energy balance."""

    place, picture = "energy", "energy"

    def more_arguments(self, table: Energy, setting: Setting) -> dict[str, Any]:
        """The intervals; the functions are those of the model, so they aren't among the arguments."""
        from saltus import models

        model = setting.study.system.model
        if model is None:
            raise StudyError(
                f"[{self.place}] is for published models, which bring their energy along. For a system of your own write Python: "
                "sl.energy_balance(rig, energy=..., supplied=..., dissipated=..., periods=...)."
            )
        if table.intervals is not None and self.system.forced_at is not None:
            raise StudyError(f"[{self.place}] {self.system.name} is forced: its balance is drawn each forcing period. Leave intervals out.")
        self.functions = models.energy(model)
        return {"intervals": table.intervals}

    def identity(self) -> dict[str, str]:
        """With the code of the models, which holds the functions."""
        return super().identity() | {"models": code_hash("models")}

    def call(self, how: dict[str, Any]) -> xr.Dataset:
        """Draw the balance."""
        from saltus.analysis.energy import energy_balance

        call: dict[str, Any] = self.arguments | self.functions | how
        return energy_balance(self.system, **call)
