"""[periodic_orbits]: the periodic orbits of a system, stable or not, from many starts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from saltus.study.answers.question import OneVerb, first_figure

if TYPE_CHECKING:
    import xarray as xr


class Orbits(OneVerb):
    """Periodic orbits, stable and unstable."""

    place, function = "periodic_orbits", "periodic_orbits"

    def pictures(self, ds: xr.Dataset) -> dict[str, Any]:
        """Their points at whole periods."""
        from saltus import plot

        axes = plot.periodic_orbits(ds)
        axes.set_title(self.title, loc="left")
        return {"": first_figure(axes)}
