"""Sets of uncertain values in chunks, for a store: which responses of two sets are one is told when
all chunks are there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from saltus.analysis.attractors.divided_grid import DividedGrid
from saltus.analysis.scatter.answers import SetGrid, told
from saltus.analysis.scatter.plan import ScatterPlan

if TYPE_CHECKING:
    import xarray as xr

    from saltus.results.store.store import Store


@dataclass(frozen=True)
class DividedScatter(DividedGrid):
    """The chunks of a scatter of steady responses.

    Attributes
    ----------
    plan : ScatterPlan
        The sets.
    """

    grid: SetGrid
    plan: ScatterPlan

    def finish(
        self,
        store: Store,
        shared: None,  # noqa: ARG002
        threads: int | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> xr.Dataset:
        """The Dataset of all sets; of those that are there if some aren't."""
        found = self.found(store, threads)
        return self.plan.finished(told(found, self.grid, self.method, self.read, threads, progress))
