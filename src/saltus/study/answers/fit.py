"""[fit]: unknowns of the system from a measurement."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pydantic import Field

from saltus.errors import StudyError, nearest
from saltus.study.answers.question import OneVerb, asked
from saltus.study.setting import quantities
from saltus.study.tables.kinds import OF_RESPONSES, whole
from saltus.study.tables.parts import Interval, Quantity
from saltus.study.tables.signature import Asked, WrittenAs, table

if TYPE_CHECKING:
    import xarray as xr

    from saltus.study.setting.setting import Setting

_MEASURED = Field(
    description="CSV in the study's folder: t and states or outputs, units in the headings.",
    examples=["measured.csv"],
)
_FREE = Field(
    min_length=1,
    description="Unknowns and their bounds: parameters, starts such as x(0), and t_start.",
    examples=[{"gap": ["0.1 mm", "2 mm"]}],
)
OF_FITS = OF_RESPONSES | {
    "start": WrittenAs(
        dict[str, Quantity], ({"x": "1 mm", "v": "0 m/s"},), "Every state at the start. At rest by "
        "default.", None, convert="start",
    ),
    "noise": WrittenAs(
        dict[str, Quantity], ({"x": "0.01 mm"},), "Standard deviation of the noise of each "
        "measured output; by default estimated from the residuals.", None,
    ),
    "weights": WrittenAs(dict[str, float], ({"x": 1.0},), default=None),
    "starts": whole(16),
    "flows": whole(4000, least=2),
}  # fmt: skip


@asked(
    60,
    table(
        "fit",
        ["fit"],
        OF_FITS,
        base=Asked,
        called="Fit",
        without=("measured", "free"),
        measured=(str, _MEASURED),
        free=(dict[str, Interval], _FREE),
    ),
)
class Fit(OneVerb):
    """[fit]: unknowns of the system from a measurement."""

    whole = "is one search, each of whose descents ends at the minima of those before it"

    def check(self, table: Any, setting: Setting) -> None:
        """Read the measurement, the bounds and the noise now: errors come before anything is
        computed.
        """
        from saltus.analysis.fits.fit import check_fit

        file = setting.inputs.read(table.measured, self.place)
        self.inputs, self._measured = [file], file.data
        self.arguments |= {
            "measured": file.sha256,
            "free": {
                name: tuple(self._number(name, end, "free") for end in ends)
                for name, ends in table.free.items()
            },
        }
        if table.noise is not None:
            self.arguments["noise"] = {
                name: self._number(name, one, "noise") for name, one in table.noise.items()
            }
        check_fit(self.system, **(self.arguments | {"measured": self._measured}))

    def _number(self, name: str, value: Quantity, key: str) -> float:
        """A value of an unknown or an output in SI; its unit must be written."""
        outputs = dict(zip(self.system.outputs.names, self.system.outputs.units, strict=True))
        units = {**outputs, **self.system.units, "t_start": "s"}
        known = name.removesuffix("(0)")
        if known not in units:
            raise StudyError(
                f"[{self.place}.{key}] {name!r} is unknown to {self.system.name}. "
                f"{nearest(name, units)}"
            )
        return quantities.number(value, units[known], f"{self.place}.{key}", name)

    def call(self, how: dict[str, Any]) -> xr.Dataset:
        """The fit to what the file holds."""
        return super().call(how | {"measured": self._measured})
