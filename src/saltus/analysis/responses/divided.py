"""Steady responses over a grid in chunks, for a store. A chunk settles the starts of some values;
the branches between values are followed when all are there.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.analysis.attractors.find_responses import SettledMotions
from saltus.analysis.attractors.grid_responses import GridNumbers, find, gathered
from saltus.analysis.closed.measures import Measures
from saltus.analysis.responses.response_table import ResponsePlan, finished, response_plan
from saltus.results.store.division import Division

if TYPE_CHECKING:
    import xarray as xr

    from saltus.analysis.attractors.grid import Grid
    from saltus.flow.methods import Method
    from saltus.results.store.store import Store

#: Trajectories of a chunk: they fill the lanes some times, and enough chunks are left for many
#: processors.
TRAJECTORIES = 64
#: Columns of motions that settled: numbers, and what is known of their orbits.
_SETTLED = ("kind", "exponent", "exponent_error", "settled", "scale", "end", "share")
_ORBITS = ("period", "multipliers", "time", "mismatch")


@dataclass(frozen=True)
class DividedResponses(Division):
    """The chunks of a grid of responses whose values begin afresh each.

    Attributes
    ----------
    grid, method, periods, sample, outputs, unstable
        As for :func:`saltus.analysis.responses.response_table.response_plan`. The plan itself isn't
        plain data.
    together : int
        Values in one chunk.
    """

    grid: Grid
    method: Method
    periods: int
    sample: str
    outputs: Mapping[str, Any] | None
    unstable: bool
    together: int

    @property
    def plan(self) -> ResponsePlan:
        """The checked plan."""
        return response_plan(
            self.grid, self.method, self.periods, self.sample, self.outputs, self.unstable
        )

    @property
    def shape(self) -> tuple[int, ...]:
        """Values of parameters."""
        return self.grid.shape

    @property
    def cells(self) -> int:
        """Values in one chunk."""
        return self.together

    def prepare(self) -> None:
        """Compile the map."""
        grid, first = self.grid, np.zeros(1, np.int64)
        grid.map(self.method, 1).rows(first).launch(grid.starts[:1], 1)

    def chunk(self, index: int, shared: None) -> dict[str, np.ndarray]:  # noqa: ARG002
        """Settle all starts at the values of one chunk, and measure their responses."""
        plan, every = self.plan, np.arange(self.grid.places)
        places = every[index * self.cells : (index + 1) * self.cells]
        found = find(plan.grid, plan.method, plan.periods, 1, outputs=plan.outputs, places=places)
        if not found.complete:
            raise KeyboardInterrupt
        assert found.measured is not None
        return _settled_arrays(found.motions) | _measured_arrays(*found.measured.known())

    def finish(
        self,
        store: Store,
        shared: None,  # noqa: ARG002
        threads: int | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> xr.Dataset:
        """The Dataset of all responses; of those that are there if some aren't."""
        grid, done = self.grid, np.flatnonzero(store.done())
        count, size = len(grid.starts), grid.starts.shape[1]
        place, map_ = np.repeat(np.arange(grid.places), count), grid.map(self.method, threads)
        settled = SettledMotions.empty(len(place), size)
        plan = self.plan
        numbers = GridNumbers(grid, map_, place, plan.outputs)
        for index in done.tolist():
            extent, values = store.chunks.extent(index), store.read(index)
            rows = np.arange(extent.start * count, extent.stop * count)
            settled.put(rows, _settled_from(values, len(rows), size))
            mine, measured = _measured_from(values)
            numbers.put(rows[mine], measured)
        complete = len(done) == store.chunks.count
        found = gathered(grid, map_, settled, np.arange(grid.places), numbers, complete)
        return finished(found, plan, threads, progress)


def _settled_arrays(settled: SettledMotions) -> dict[str, np.ndarray]:
    """Motions that settled, as arrays: the points of all orbits one behind the other."""
    orbits, rows = settled.orbits, np.array(sorted(settled.iterates), np.int64)
    there = np.arange(orbits.points.shape[1]) < orbits.period[:, None]
    return {
        **{name: getattr(settled, name) for name in _SETTLED},
        **{f"orbit_{name}": getattr(orbits, name) for name in _ORBITS},
        "orbit_points": orbits.points[there],
        "aperiodic": rows,
        "iterates": np.array([settled.iterates[row] for row in rows.tolist()]),
    }


def _settled_from(values: Mapping[str, np.ndarray], count: int, size: int) -> SettledMotions:
    """Motions from :func:`_settled_arrays`' result."""
    settled = SettledMotions.empty(count, size)
    for name in _SETTLED:
        getattr(settled, name)[:] = values[name]
    for name in _ORBITS:
        getattr(settled.orbits, name)[:] = values[f"orbit_{name}"]
    points = settled.orbits.points
    points[np.arange(points.shape[1]) < settled.orbits.period[:, None]] = values["orbit_points"]
    rows = values["aperiodic"].tolist()
    settled.iterates.update(zip(rows, values["iterates"], strict=True))
    return settled


def _measured_arrays(rows: np.ndarray, numbers: Measures) -> dict[str, np.ndarray]:
    """Numbers of rows int64[n], as arrays: turning points one behind the other."""
    found = {"measured": rows, "turns": np.array([len(one) for one in numbers.turning], np.int64)}
    for field in fields(numbers):
        column = getattr(numbers, field.name)
        if field.name == "turning":
            column = np.concatenate([np.zeros((0, numbers.maximum.shape[1])), *column])
        found[f"numbers_{field.name}"] = np.asarray(column)
    return found


def _measured_from(values: Mapping[str, np.ndarray]) -> tuple[np.ndarray, Measures]:
    """Rows and their numbers from :func:`_measured_arrays`' result."""
    columns = {field.name: values[f"numbers_{field.name}"] for field in fields(Measures)}
    turning = np.split(columns.pop("turning"), np.cumsum(values["turns"])[:-1])
    itinerary = [str(text) for text in columns.pop("itinerary")]
    some = turning[: len(itinerary)]
    return values["measured"], Measures(**columns, itinerary=itinerary, turning=some)
