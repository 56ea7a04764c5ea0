"""[lyapunov]: the Lyapunov exponents of the motions that given starts lead to."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from saltus.fence import MOST_PERIODS
from saltus.study.answers.question import OneVerb, asked, first_figure
from saltus.study.tables.kinds import KINDS, whole
from saltus.study.tables.signature import table

if TYPE_CHECKING:
    import xarray as xr


LYAPUNOV = {
    "exponents": replace(whole(3), default=None),
    "transient": whole(500, least=0, most=MOST_PERIODS),
    "periods": whole(2000, most=MOST_PERIODS),
}


@asked(60, table("lyapunov", ["lyapunov"], KINDS | LYAPUNOV, called="Lyapunov exponents"))
class ExponentsQuestion(OneVerb):
    """Lyapunov exponents of motions."""

    how = "flow"

    def pictures(self, ds: xr.Dataset) -> dict[str, Any]:
        """Draw the convergence of the exponents."""
        from saltus import plot
        from saltus.plot.selection import MOST

        return {"": first_figure(plot.exponents(ds, ds["trajectory"].values[:MOST].tolist()))}
