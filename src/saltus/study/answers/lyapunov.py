"""[lyapunov]: the Lyapunov exponents of the motions that given starts lead to."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from saltus.errors import StudyError
from saltus.study.answers.question import OneDataset, Question
from saltus.study.setting import quantities
from saltus.study.tables.lyapunov import Lyapunov

if TYPE_CHECKING:
    import xarray as xr

    from saltus.study.setting.setting import Setting
    from saltus.study.table import TextTable

#: Name of the table.
LYAPUNOV = "lyapunov"


def questions(table: Lyapunov, setting: Setting) -> list[Question]:
    """The question that the table asks. Raises a SaltusError if it doesn't fit the system."""
    quantities.is_batch(table.start or {}, table.values, place=LYAPUNOV)
    fixed = {name: value for name, value in table.values.items() if not isinstance(value, list)}
    system = setting.system(fixed, f"{LYAPUNOV}.values")
    if table.every is None and system.forced_at is None:
        raise StudyError(f'[{LYAPUNOV}] {system.name} has no forcing period. Write every = "1 s", about a turn of the motion.')
    lists = {name: value for name, value in table.values.items() if isinstance(value, list)}
    arguments = {
        "start": None if table.start is None else quantities.start(system, table.start, LYAPUNOV),
        "method": table.method,
        "periods": table.periods,
        "transient": table.transient,
        "every": None if table.every is None else quantities.number(table.every, "s", LYAPUNOV, "every"),
        "unit": table.unit,
        "values": quantities.varied(system, lists, f"{LYAPUNOV}.values") or None,
    }
    return [Exponents(table.title, table.stem, system, setting.method(table.flow), arguments)]


class Exponents(OneDataset):
    """Lyapunov exponents of motions."""

    def compute(self, threads: int | None, progress: Callable[[float], None]) -> xr.Dataset:
        """Call the analysis."""
        from saltus.analysis.lyapunov.lyapunov import lyapunov

        return lyapunov(self.system, flow=self.method, threads=threads, progress=progress, **self.arguments)

    def tables(self, ds: xr.Dataset) -> list[TextTable]:
        """A row for each motion."""
        from saltus.study.answers.lyapunov_table import exponent_table

        return [exponent_table(self.title, ds)]

    def pictures(self, ds: xr.Dataset) -> dict[str, Any]:
        """How the exponents settle."""
        from saltus import plot
        from saltus.plot.selection import MOST

        axes = plot.exponents(ds, ds["trajectory"].values[:MOST].tolist())
        return {"": (axes.flat[0] if hasattr(axes, "flat") else axes).figure}
