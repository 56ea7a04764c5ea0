"""[spectrum]: motions by frequency."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from saltus.errors import StudyError, nearest
from saltus.study.answers.followed import Looked
from saltus.study.tables.motions import Spectrum

if TYPE_CHECKING:
    import xarray as xr

    from saltus.study.setting.setting import Setting


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
