"""Steady responses over a grid in chunks, for a store: the branches between values are followed
when all chunks are there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from saltus.analysis.attractors.divided_grid import DividedGrid
from saltus.analysis.responses.response_table import finished, response_plan

if TYPE_CHECKING:
    import xarray as xr

    from saltus.results.store.store import Store


@dataclass(frozen=True)
class DividedResponses(DividedGrid):
    """The chunks of a grid of responses whose values begin afresh each.

    Attributes
    ----------
    sample, unstable
        As for :func:`saltus.analysis.responses.response_table.response_plan`.
    """

    sample: str = ""
    unstable: bool = False

    def finish(
        self,
        store: Store,
        shared: None,  # noqa: ARG002
        threads: int | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> xr.Dataset:
        """The Dataset of all responses; of those that are there if some aren't."""
        plan = response_plan(
            self.grid, self.method, self.periods, self.sample, self.outputs, self.unstable
        )
        return finished(self.found(store, threads), plan, threads, progress)
