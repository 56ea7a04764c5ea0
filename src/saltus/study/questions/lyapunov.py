"""[lyapunov]: the Lyapunov exponents of the motions that given starts lead to."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field

from saltus.errors import StudyError
from saltus.fence import MOST_PERIODS
from saltus.study import quantities
from saltus.study.questions.question import OneDataset, Question
from saltus.study.spec_parts import Method, Named, Quantity, Start

if TYPE_CHECKING:
    import xarray as xr

    from saltus.study.setting import Setting
    from saltus.study.table import TextTable

#: Name of the table.
LYAPUNOV = "lyapunov"


class Lyapunov(Named):
    """[lyapunov]: Lyapunov exponents of the motions that starts lead to. Several: [[lyapunov]], each with a name."""

    called = "Lyapunov exponents"

    start: dict[str, Start] | None = Field(
        None,
        description="Every state at the start; lists make a batch. At rest by default.",
        examples=[{"x": ["0 mm", "1 mm"], "v": "0 m/s"}],
    )
    method: Literal["variational", "wolf"] = Field(
        "variational", description="By the variational equations, or the largest one by Wolf's algorithm.", examples=["wolf"]
    )
    flow: Method | None = Field(None, description="How to integrate; the study's [method] by default.", examples=[{"name": "Taylor"}])
    periods: int = Field(2000, ge=1, le=MOST_PERIODS, description="Forcing periods that growth is measured over.", examples=[2000])
    transient: int = Field(500, ge=0, le=MOST_PERIODS, description="Forcing periods before them that don't count.", examples=[500])
    every: Quantity | None = Field(None, description="Time of a block, for a system without forcing.", examples=["1 s"])
    unit: Literal["1/s", "1/period", "bit/s", "bit/period"] = Field("1/s", description="Unit of the exponents.", examples=["1/period"])
    values: dict[str, Start] = Field(
        default_factory=dict,
        description="Values that differ from [system], for this question only; lists hold one for each trajectory.",
        examples=[{"frequency": ["14 Hz", "15 Hz"]}],
    )


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
        from saltus.study.questions.lyapunov_table import exponent_table

        return [exponent_table(self.title, ds)]

    def pictures(self, ds: xr.Dataset) -> dict[str, Any]:
        """How the exponents settle."""
        from saltus import plot
        from saltus.plot.selection import MOST

        axes = plot.exponents(ds, ds["trajectory"].values[:MOST].tolist())
        return {"": (axes.flat[0] if hasattr(axes, "flat") else axes).figure}
