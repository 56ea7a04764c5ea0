"""[spectrum]: motions by frequency."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field

from saltus.errors import StudyError, nearest
from saltus.fence import MOST_COUNT, MOST_PERIODS
from saltus.study.questions.followed import Followed, Looked

if TYPE_CHECKING:
    import xarray as xr

    from saltus.study.setting import Setting


class Spectrum(Followed):
    """[spectrum]: amplitudes and phases of motions by frequency. Several: [[spectrum]], each with a name."""

    called = "Spectrum"

    states: list[str] | None = Field(None, min_length=1, description="Which states; all by default.", examples=[["x"]])
    samples: int | None = Field(
        None, ge=4, le=MOST_COUNT, examples=[200],
        description="Samples per period, 200 by default; of a system without forcing over the whole span, up to 10 000 by default.",
    )  # fmt: skip
    window: Literal["none", "hann"] | None = Field(
        None, description="By default none where the response repeats, else hann.", examples=["hann"]
    )
    last: int | None = Field(None, ge=1, le=MOST_PERIODS, description="Forcing periods at the end to take.", examples=[64])


class Lines(Looked):
    """Lines of a spectrum."""

    place, picture, several = "spectrum", "spectrum", True

    def more_arguments(self, table: Spectrum, setting: Setting) -> dict[str, Any]:  # noqa: ARG002
        """Which states, samples, window and periods."""
        for name in table.states or []:
            if name not in self.system.states:
                raise StudyError(f"[{self.place}] states: {name!r} is unknown to {self.system.name}. {nearest(name, self.system.states)}")
        if table.last is not None and table.periods is None:
            raise StudyError(f"[{self.place}] last counts forcing periods, and {self.system.name} isn't forced. Leave it out.")
        if table.last is not None and table.last > (table.periods or 0):
            raise StudyError(f"[{self.place}] last = {table.last} are more forcing periods than are looked at, periods = {table.periods}.")
        return {"states": table.states, "samples": table.samples, "window": table.window, "last": table.last}

    def call(self, how: dict[str, Any]) -> xr.Dataset:
        """Simulate, leave the transient out, take the spectrum."""
        from saltus.analysis.motion.simulate import simulate
        from saltus.analysis.motion.spectrum import spectrum

        asked = self.arguments
        motion = {name: asked[name] for name in ("start", "t_start", "values", "samples")}
        if self.system.forced_at is not None:
            periods = asked["transient"] + asked["periods"]
            run = simulate(self.system, periods=periods, keep=asked["periods"], **motion, **how)
        else:
            run = simulate(self.system, t_end=asked["t_end"], **motion, **how)
            run = run.sel(time=slice(asked["t_start"] + asked["transient"], None))
        return spectrum(run, asked["states"], window=asked["window"], last=asked["last"])
