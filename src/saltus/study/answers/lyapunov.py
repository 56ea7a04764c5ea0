"""[lyapunov]: the Lyapunov exponents of the motions that given starts lead to."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from saltus.study.answers.question import OneVerb, first_figure

if TYPE_CHECKING:
    import xarray as xr


class Exponents(OneVerb):
    """Lyapunov exponents of motions."""

    place, function, how = "lyapunov", "lyapunov", "flow"

    def pictures(self, ds: xr.Dataset) -> dict[str, Any]:
        """How the exponents settle."""
        from saltus import plot
        from saltus.plot.selection import MOST

        return {"": first_figure(plot.exponents(ds, ds["trajectory"].values[:MOST].tolist()))}
