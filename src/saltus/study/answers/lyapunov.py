"""[lyapunov]: the Lyapunov exponents of the motions that given starts lead to."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from saltus.study.answers.lyapunov_rows import exponent_table
from saltus.study.answers.question import Answers, OneVerb, first_figure

if TYPE_CHECKING:
    import xarray as xr

    from saltus.study.table import TextTable


class Exponents(OneVerb):
    """Lyapunov exponents of motions."""

    place, function, how = "lyapunov", "lyapunov", "flow"

    def rows(self, ds: xr.Dataset, found: Answers) -> list[TextTable]:  # noqa: ARG002
        """A row for each motion."""
        return [exponent_table(self.title, ds)]

    def pictures(self, ds: xr.Dataset) -> dict[str, Any]:
        """How the exponents settle."""
        from saltus import plot
        from saltus.plot.selection import MOST

        return {"": first_figure(plot.exponents(ds, ds["trajectory"].values[:MOST].tolist()))}
