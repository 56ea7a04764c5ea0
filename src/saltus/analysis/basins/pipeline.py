"""The plan of a basin map: its starts, its chunks, and the work of each chunk. A store or a cluster
needs nothing else.

Three stages, each a pure function of the plan and of the stages before: *scout* finds the
attractors from a fixed sample of the starts, *chunk* labels one run of cells with them, *finish*
labels what no known attractor captured and makes the Dataset.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.attractors.attractor_set import AttractorSet
from saltus.analysis.attractors.attractors import no_attractor
from saltus.analysis.attractors.noisy import stray_attrs
from saltus.analysis.attractors.portrait import portraits
from saltus.analysis.basins import uncertainty
from saltus.analysis.basins.labels import (
    OPEN,
    Settling,
    complete,
    on_known_families,
    renumber,
    settle,
)
from saltus.analysis.basins.levels import GridLevel, levels_of
from saltus.analysis.basins.scouting import SCOUTS, glanced, scouted
from saltus.analysis.closed.spread import spread
from saltus.analysis.closed.turns import ASKED, looks_every
from saltus.analysis.dataset_parts import provenance, subject
from saltus.analysis.inputs.axes import along, count_along
from saltus.analysis.inputs.box import fixed_of, states_at, units_of
from saltus.analysis.inputs.halton import halton
from saltus.analysis.inputs.starts import check_system
from saltus.errors import ParameterError
from saltus.flow.counts import whole
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import MANY_STATES, Method
from saltus.flow.room import check_room
from saltus.intervals import wilson
from saltus.kernels import status as st
from saltus.results import build
from saltus.results.dataset import schema
from saltus.results.dataset.attractors import basin_meanings
from saltus.results.dataset.kinds import Kind
from saltus.results.provenance import to_json
from saltus.system import System
from saltus.system.structures.told import by_modes
from saltus.units import to_si

#: Cells of one task: seconds of work at most, and enough cells to keep lanes full to the end.
CHUNK = 4096
#: Cells recomputed by a more exact method.
CHECKED = 1000
#: Forcing periods that each cell is followed at most; of many states as many as the work of all
#: allows, cells times periods times the cube of the number of states, but so many at least. Where
#: nothing settles, as at a damping of 1e-5, that is some hours of two cores.
PERIODS, WORK, LEAST = 2000, 2**35, 64
#: Cells whose motions say how large those of a map over sensors are.
SPREAD_STARTS = 64


@dataclass(frozen=True)
class BasinPlan:
    """A basin map to be computed.

    Attributes
    ----------
    system : System
        Equations and values.
    method : Method
        The method of integration.
    axes : mapping of str to float64[n]
        The two states, or sensors of a structure, that the map is drawn over, and their values
        [SI].
    fixed : mapping of str to float
        The other states, or sensors, at the start [SI].
    periods : int
        Forcing periods that a trajectory is followed at most, before and once more after new
        attractors are looked for.
    every : float or None
        Time between two samples [s] for a system without forcing.
    scouts : int
        Starts from which attractors are looked for first; the fewer, the more is left to what the
        cells themselves lead to.
    """

    system: System
    method: Method
    axes: Mapping[str, np.ndarray]
    fixed: Mapping[str, float]
    periods: int
    every: float | None = None
    scouts: int = field(default_factory=lambda: SCOUTS)

    @property
    def shape(self) -> tuple[int, int]:
        """Cells along the two axes."""
        first, second = (len(values) for values in self.axes.values())
        return first, second

    @property
    def cells(self) -> int:
        """Number of cells."""
        return self.shape[0] * self.shape[1]

    @property
    def chunks(self) -> int:
        """Number of tasks."""
        return -(-self.cells // CHUNK)

    def map(self, threads: int | None = None) -> Stroboscope:
        """The map whose attractors are computed."""
        return Stroboscope(self.system, self.method, every=self.every, threads=threads)

    @functools.cached_property
    def scale(self) -> np.ndarray:
        """Range of each state: of an axis its length, of other states the largest of those with the
        same unit, else of any. With sensors on the axes that of motions from some of the cells.
        """
        if not set(self.axes) <= set(self.system.states):
            return spread(self.map(1), self.starts(self.sample(SPREAD_STARTS)))
        lengths = {name: float(np.ptp(values)) for name, values in self.axes.items()}
        units = self.system.units
        alike = {
            name: [length for axis, length in lengths.items() if units[axis] == units[name]]
            for name in self.system.states
        }
        return np.array(
            [
                lengths.get(name) or max(alike[name] or lengths.values())
                for name in self.system.states
            ]
        )

    def starts(self, cells: np.ndarray) -> np.ndarray:
        """States at the start of cells int64[k] of the flattened grid, float64[k, D]."""
        rows = dict(zip(self.axes, np.unravel_index(cells, self.shape), strict=True))
        return self._states({name: self.axes[name][row] for name, row in rows.items()})

    def _states(self, columns: Mapping[str, np.ndarray]) -> np.ndarray:
        """States float64[k, D] at places float64[k] along both axes."""
        return states_at(self.system, columns, self.fixed)

    def cells_of(self, chunk: int) -> np.ndarray:
        """Cells of a chunk, int64[k]."""
        return np.arange(chunk * CHUNK, min((chunk + 1) * CHUNK, self.cells))

    def levels(self) -> list[GridLevel]:
        """Its cells coarse to fine, each level from the middle of the map outwards."""
        return levels_of(self.shape)

    # -- the three stages --------------------------------------------------------------------------
    def scout(self, threads: int | None = None, known: AttractorSet | None = None) -> AttractorSet:
        """The attractors that a fixed quasi-random sample of the box leads to, and known ones."""
        *_, found = self.scouted(threads, known=known)
        return found

    def scouted(
        self,
        threads: int | None = None,
        progress: Callable[[float], None] | None = None,
        known: AttractorSet | None = None,
    ) -> Iterator[AttractorSet]:
        """The same, more and more of them."""
        start = self.drawn(self.scouts)
        return scouted(self.map(threads), start, self.scale, self.periods, progress, known)

    def glanced(
        self, count: int, threads: int | None = None, known: AttractorSet | None = None
    ) -> AttractorSet:
        """Known attractors, and those of ``count`` starts that are seen early."""
        start = self.drawn(min(count, self.scouts))
        return glanced(self.map(threads), start, self.scale, self.periods, known)

    def drawn(self, count: int) -> np.ndarray:
        """A fixed quasi-random sample of starts from the box, float64[count, D]."""
        low, high = (
            np.array([end(values) for values in self.axes.values()]) for end in (np.min, np.max)
        )
        unit = halton(count, 2)
        return self._states(dict(zip(self.axes, (low + (high - low) * unit).T, strict=True)))

    def sample(self, count: int) -> np.ndarray:
        """Indices of cells drawn at random, the same each time: int64[count at most], ascending."""
        return np.sort(
            np.random.default_rng(0).choice(self.cells, min(count, self.cells), replace=False)
        )

    def chunk(self, index: int, found: AttractorSet, map_: Stroboscope | None = None) -> Settling:
        """Label the starts of one chunk, on one thread."""
        return settle(map_ or self.map(1), self.starts(self.cells_of(index)), found, self.periods)

    def finish(
        self,
        result: Settling,
        found: AttractorSet,
        threads: int | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> xr.Dataset:
        """The finished Dataset: open cells are settled first, and a sample is checked. Changes
        ``result``.
        """
        map_ = self.map(threads)
        found = complete(map_, result, found, self.scale, self.periods, threads, progress)
        return self.dataset(result, found, threads).assign_attrs(self._check(result, found))

    def dataset(
        self, result: Settling, found: AttractorSet, threads: int | None = None
    ) -> xr.Dataset:
        """The Dataset of all known labels; open cells count as unconverged. Changes ``result``."""
        map_ = self.map(threads)
        result.label[result.label == OPEN] = Kind.UNCONVERGED
        labels = result.label.reshape(self.shape)
        table = replace(portraits(map_, found), fractions=uncertainty.fractions(labels, len(found)))
        values = {
            "<state>": self.axes,
            "basin": labels,
            "periods_to_settle": result.periods.reshape(self.shape),
            "status": result.status.reshape(self.shape),
            "grazes_unresolved": result.unresolved.reshape(self.shape),
            **table.values(len(self.system.states)),
        }
        flags = {
            "basin": basin_meanings(len(table)),
            "status": {code: name for code, (name, _) in st.STATUS.items()},
        }
        words = {"<when>": table.points_when}
        ds = build(
            schema.BASINS,
            subject(self.system, self.attrs()),
            values,
            grid=tuple(self.axes),
            words=words,
            flags=flags,
        )
        strays = found.astray if (labels == Kind.UNCONVERGED).any() else []
        return ds.assign_attrs(
            uncertainty.measure(ds),
            **stray_attrs(strays),
            **no_attractor(self.system, found, labels),
            flip_rate=np.nan,
            flip_checked=0,
        )

    def attrs(self) -> dict[str, Any]:
        """Provenance."""
        every = {} if self.every is None else {"every": self.every}
        return (
            provenance(self.system, self.method, self.system.values)
            | {"periods": self.periods, "at": to_json(dict(self.fixed))}
            | every
        )

    def _check(self, result: Settling, found: AttractorSet) -> dict[str, float | int]:
        """Recompute a random sample of settled cells by a more exact method: the share that leads
        elsewhere, with its interval.
        """
        chosen = self.sample(CHECKED)
        chosen = chosen[result.label[chosen] >= 0]
        if not len(chosen) or self.method.companion() == self.method:
            return {}
        again = settle(
            self.map(1).by(self.method.companion()), self.starts(chosen), found, 2 * self.periods
        )
        left = np.flatnonzero(again.label == OPEN)
        exact = self.map(1).by(self.method.companion())
        wider, label = on_known_families(exact, again.end[left], found, self.scale)
        before = result.label[chosen]
        for one in (before, again.label):
            renumber(one, wider.ids(found))
        again.label[left] = label
        flips = int(np.count_nonzero(again.label != before))
        low, high = wilson(flips, len(chosen))
        return {
            "flip_rate": flips / len(chosen),
            "flip_rate_low": float(low),
            "flip_rate_high": float(high),
            "flip_checked": len(chosen),
        }


def memory(cells: int, states: int) -> float:
    """Memory of a map, or of as many random starts [bytes]: the data of each cell, and the measures
    of the map.
    """
    return 2.5e8 + cells * (120.0 + 24.0 * states)


def basin_plan(
    system: System,
    axes: Mapping[str, Any],
    at: Mapping[str, Any] | None,
    method: Method,
    periods: int | None,
    every: float | str | None,
) -> BasinPlan:
    """A checked plan from a user's arguments; without ``periods`` as many as :data:`WORK` allows.

    Raises
    ------
    ParameterError, UnitError
        If an axis isn't a state, a range is empty, or the grid is too large.
    """
    check_system(system)
    fixed = fixed_of(system, at, axes)
    if len(axes) != 2:
        example = ", ".join(
            f'{name}=("-1 {system.units[name]}", "1 {system.units[name]}", 400)'
            for name in system.states[:2]
        )
        if by_modes(system):
            example = 'tip=("-1 mm", "1 mm", 400), **{"tip speed": ("-1 m/s", "1 m/s", 400)}'
        raise ParameterError(
            f"a basin map has two axes, not {len(axes)}. Give two "
            f"{'sensors' if by_modes(system) else 'states'} with range and number of starts: "
            f"{example}."
        )
    first, second = (count_along(given) for given in axes.values())
    check_room(
        memory(first * second, len(system.states)),
        f"{first} x {second} cells",
        lambda say: f"Take a coarser grid, or {say.verb('basin_fractions')}.",
    )
    periods = (
        _allowed(first * second, len(system.states))
        if periods is None
        else whole(periods, "periods")
    )
    units = units_of(system)
    values = {name: _axis(units[name], name, given) for name, given in axes.items()}
    plan = BasinPlan(system, method, values, fixed, periods)
    some = plan.starts(np.linspace(0, plan.cells - 1, ASKED).astype(int))
    return replace(plan, every=looks_every(system, every, some))


def _allowed(cells: int, states: int) -> int:
    """Forcing periods that each cell is followed at most where none are given."""
    if states < MANY_STATES:
        return PERIODS
    return int(np.clip(WORK / (cells * states**3), LEAST, PERIODS))


def _axis(unit: str, name: str, given: Any) -> np.ndarray:
    """Starts along one state from (low, high, count) or a list or array of starts."""
    example = {name: ("-5 mm", "5 mm", 400)}
    values = along(name, given, lambda value: to_si(value, unit, name), "starts", example, 2)
    if len(values) < 2 or not (np.diff(values) > 0).all():
        raise ParameterError(f"the starts along {name} must ascend, at least two of them.")
    return values
