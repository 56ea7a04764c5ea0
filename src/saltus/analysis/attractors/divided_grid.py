"""Motions over a grid of parameters in chunks, for a store. A chunk settles the starts at some
values.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.analysis.attractors.find_responses import SettledMotions
from saltus.analysis.attractors.grid_responses import GridNumbers, GridResponses, find, gathered
from saltus.analysis.closed.measures import Measures
from saltus.analysis.inputs.outputs import Outputs, outputs_of
from saltus.results.store.division import Division

if TYPE_CHECKING:
    from saltus.analysis.attractors.grid import Grid
    from saltus.flow.methods import Method
    from saltus.results.store.store import Store

#: Trajectories of a chunk: they fill the lanes some times, and enough chunks are left for many
#: processors.
TRAJECTORIES = 64
#: Columns of motions that settled: numbers, and what is known of their orbits.
_SETTLED = ("kind", "exponent", "exponent_error", "settled", "scale", "end", "share")
_ORBITS = ("period", "multipliers", "time", "mismatch")


def values_together(starts: int) -> int:
    """Values in one chunk, for a number of starts at each."""
    return max(1, TRAJECTORIES // starts)


@dataclass(frozen=True)
class DividedGrid(Division):
    """The chunks of a grid whose values begin afresh each.

    Attributes
    ----------
    grid : Grid
        Values of parameters, and starts.
    method : Method
        The method of integration.
    periods : int
        Forcing periods that a trajectory is followed at most.
    outputs : mapping, optional
        What is read off each motion, as users write it: expressions aren't plain data.
    together : int
        Values in one chunk.
    """

    grid: Grid
    method: Method
    periods: int
    outputs: Mapping[str, Any] | None
    together: int

    @property
    def shape(self) -> tuple[int, ...]:
        """Values of parameters."""
        return self.grid.shape

    @property
    def cells(self) -> int:
        """Values in one chunk."""
        return self.together

    @property
    def read(self) -> Outputs:
        """Answer that is read off each motion."""
        return outputs_of(self.grid.system, self.outputs)

    def prepare(self) -> None:
        """Compile the map."""
        grid, first = self.grid, np.zeros(1, np.int64)
        grid.map(self.method, 1).rows(first).launch(grid.starts[:1], 1)

    def chunk(self, index: int, shared: None) -> dict[str, np.ndarray]:  # noqa: ARG002
        """Settle all starts at the values of one chunk, and measure their motions."""
        every = np.arange(self.grid.places)
        places = every[index * self.cells : (index + 1) * self.cells]
        found = find(self.grid, self.method, self.periods, 1, outputs=self.read, places=places)
        if not found.complete:
            raise KeyboardInterrupt
        assert found.measured is not None
        return _settled_arrays(found.motions) | _measured_arrays(*found.measured.known())

    def found(self, store: Store, threads: int | None) -> GridResponses:
        """The motions of all chunks that are there, as :func:`find` gives them."""
        grid, done = self.grid, np.flatnonzero(store.done())
        count, size = len(grid.starts), grid.starts.shape[1]
        place, map_ = np.repeat(np.arange(grid.places), count), grid.map(self.method, threads)
        settled = SettledMotions.empty(len(place), size)
        numbers = GridNumbers(grid, map_, place, self.read)
        for index in done.tolist():
            extent, values = store.chunks.extent(index), store.read(index)
            rows = np.arange(extent.start * count, extent.stop * count)
            settled.put(rows, _settled_from(values, len(rows), size))
            mine, measured = _measured_from(values)
            numbers.put(rows[mine], measured)
        complete = len(done) == store.chunks.count
        return gathered(grid, map_, settled, np.arange(grid.places), numbers, complete)


def _settled_arrays(settled: SettledMotions) -> dict[str, np.ndarray]:
    """Motions that settled, as arrays: the points of all one behind the other."""
    orbits, rows = settled.orbits, np.array(sorted(settled.iterates), np.int64)
    there = np.arange(orbits.points.shape[1]) < orbits.period[:, None]
    return {
        **{name: getattr(settled, name) for name in _SETTLED},
        **{f"orbit_{name}": getattr(orbits, name) for name in _ORBITS},
        "orbit_points": orbits.points[there],
        "aperiodic": rows,
        "iterates_of": np.array([len(settled.iterates[row]) for row in rows.tolist()], np.int64),
        "iterates": np.concatenate(
            [settled.end[:0], *(settled.iterates[row] for row in rows.tolist())]
        ),
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
    rows, ends = values["aperiodic"].tolist(), np.cumsum(values["iterates_of"])
    parts = np.split(values["iterates"], ends)[: len(rows)]
    settled.iterates.update(zip(rows, parts, strict=True))
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
