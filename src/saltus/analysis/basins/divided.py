"""A basin map in chunks, for a store."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.analysis.attractors.attractor_set import AttractorSet
from saltus.analysis.basins import pipeline
from saltus.analysis.basins.basins import compiled
from saltus.analysis.basins.labels import settle
from saltus.analysis.basins.serial import (
    cell_types,
    found_data,
    found_from,
    settling_arrays,
    settling_from,
)
from saltus.results.store.division import Division

if TYPE_CHECKING:
    import xarray as xr

    from saltus.results.store.store import Store

#: Cells whose labels are timed for the estimate.
TIMED_CELLS = 512


@dataclass(frozen=True)
class DividedMap(Division):
    """The chunks of a basin map. They share its attractors.

    Attributes
    ----------
    plan : BasinPlan
        Plan of the map.
    """

    plan: pipeline.BasinPlan
    kept = "attractors"

    @property
    def shape(self) -> tuple[int, ...]:
        """Cells along the two axes."""
        return self.plan.shape

    @property
    def cells(self) -> int:
        """Cells of one chunk."""
        return pipeline.CHUNK

    @property
    def arrays(self) -> Mapping[str, Any]:
        """Name and type of the data of each cell."""
        return cell_types(self.plan.system.states)

    def share(self, threads: int | None) -> Any:
        """Find the attractors that all chunks are labelled with."""
        return found_data(self.plan.scout(threads))

    def shared_from(self, data: Any) -> AttractorSet:
        """The attractors."""
        return found_from(data, len(self.plan.system.states))

    def prepare(self) -> None:
        """Compile the map."""
        compiled(self.plan)

    def chunk(self, index: int, shared: AttractorSet) -> dict[str, np.ndarray]:
        """Label the starts of one chunk."""
        return settling_arrays(self.plan.chunk(index, shared), self.plan.system.states)

    def finish(
        self,
        store: Store,
        shared: AttractorSet,
        threads: int | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> xr.Dataset:
        """The Dataset of the finished map."""
        cells = settling_from(store.read_all(), self.plan.system.states)
        return self.plan.finish(cells, shared, threads, progress)

    def estimate(self, shared: AttractorSet, processors: int) -> str:
        """Sentence on the time, memory and disk space that the map will take, estimated from a few
        hundred of its cells.
        """
        plan = self.plan
        cells, map_ = plan.sample(TIMED_CELLS), compiled(plan)
        begin = time.perf_counter()
        settle(map_, plan.starts(cells), shared, plan.periods)
        seconds = (time.perf_counter() - begin) / len(cells) * plan.cells / processors
        size = len(plan.system.states)
        needed, disk = pipeline.memory(plan.cells, size), plan.cells * (9.0 + 8.0 * size)
        return (
            f"{plan.cells} cells: about {seconds:.0f} s here, {needed / 1e9:.1f} GB of memory, "
            f"{disk / 1e6:.0f} MB on the disk"
        )
