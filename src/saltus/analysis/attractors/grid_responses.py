"""All steady responses over a grid of parameter values: settle every start at every value, tell
which lead to the same response.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from saltus.analysis.attractors.aperiodic import SampledMotion, alike
from saltus.analysis.attractors.early_chaos import SEEN, looked_at
from saltus.analysis.attractors.find_responses import (
    KEPT_ITERATES,
    SettledMotions,
    find_responses,
)
from saltus.analysis.attractors.grid import Grid
from saltus.analysis.closed.cycles import ASIDE
from saltus.analysis.closed.measures import Measures, measure, unknown
from saltus.analysis.closed.unforced import measure_equilibria, multipliers_and_eigenvalues
from saltus.analysis.inputs.outputs import Outputs
from saltus.analysis.solve.tolerances import SAME
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import Method
from saltus.flow.progress import stage
from saltus.intervals import wilson
from saltus.results import AttractorTable
from saltus.results.dataset.kinds import CLOSED, Kind

#: Kinds that repeat after whole periods of the forcing.
REPEATING = (Kind.PERIODIC, Kind.LONG_PERIODIC)
#: Points kept of a motion that never repeats.
APERIODIC_PERIODS = 64


@dataclass
class GridResponses:
    """The responses of a grid, m of them, in the order of their places, at each place by period and
    size.

    Attributes
    ----------
    motions : SettledMotions
        What every trajectory settled to: row place * s + start.
    row : int64[m]
        A trajectory that settled to the response.
    place : int64[m]
        Where on the grid it is.
    response_of : int64[places, s]
        Response of every trajectory, or a code below zero.
    """

    motions: SettledMotions
    row: np.ndarray
    place: np.ndarray
    response_of: np.ndarray
    complete: bool = True
    measured: GridNumbers | None = field(default=None, repr=False)

    def __len__(self) -> int:
        return len(self.row)

    @property
    def kind(self) -> np.ndarray:
        """Kind of each response, int64[m]."""
        kind: np.ndarray = self.motions.kind[self.row]
        return kind

    @property
    def period(self) -> np.ndarray:
        """Points by which each is known: n of an nT, 1 of an equilibrium, 0 if it doesn't repeat,
        int64[m].
        """
        period: np.ndarray = self.motions.orbits.period[self.row]
        return period

    @property
    def time(self) -> np.ndarray:
        """Period of each limit cycle [s], 0 of an equilibrium, NaN of what follows a forcing,
        float64[m].
        """
        time: np.ndarray = self.motions.orbits.time[self.row]
        return time

    @property
    def numbers(self) -> Measures:
        """Numbers of each response: of the outputs that were asked for."""
        assert self.measured is not None
        return self.measured.of(self)

    def part(self, which: np.ndarray) -> GridResponses:
        """Some of the responses, bool[m]."""
        return replace(self, row=self.row[which], place=self.place[which])

    def points(self, response: int) -> np.ndarray:
        """Its stroboscopic points, float64[n, D]."""
        row = int(self.row[response])
        return (
            self.motions.iterates[row]
            if row in self.motions.iterates
            else self.motions.orbits.points[row, : self.motions.orbits.period[row]]
        )

    def watched(self, grid: Grid, method: Method, most: int) -> int:
        """Iterates for which all chaotic ones were watched at least, where motions are followed for
        ``most``.
        """
        chaotic = self.place[self.kind == Kind.CHAOTIC]
        kept = KEPT_ITERATES if len(grid.starts) > 1 else SEEN
        return int(looked_at(grid.map(method).rows(chaotic), most, kept).min(initial=most))

    def start(self, aside: bool = False) -> np.ndarray:
        """A state on each, float64[m, D]; ``aside``: not where a limit cycle turns."""
        index = np.where(aside & (self.kind == Kind.LIMIT_CYCLE), ASIDE, 0)
        return np.array([self.points(i)[index[i]] for i in range(len(self))]).reshape(
            len(self), self.motions.orbits.points.shape[-1]
        )


def find(
    grid: Grid,
    method: Method,
    most: int,
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
    outputs: Outputs | None = None,
    places: np.ndarray | None = None,
) -> GridResponses:
    """The responses of a grid, with the numbers of ``outputs``; on Ctrl-C those that are known,
    with ``complete`` False. ``places``: those of some points of a grid without sweeps, int64[p],
    ascending.
    """
    map_, count = grid.map(method, threads), len(grid.starts)
    places = np.arange(grid.places) if places is None else places
    result = SettledMotions.empty(len(places) * count, grid.starts.shape[1])
    place, complete = np.repeat(places, count), True
    numbers = None if outputs is None else GridNumbers(grid, map_, place, outputs)
    try:
        if grid.sweeps:
            _sweep(grid, map_, most, result, threads, progress, numbers)
        else:
            starts = np.tile(grid.starts, (len(places), 1))
            then = None if numbers is None else numbers.add
            find_responses(map_.rows(place), starts, most, threads, progress, result, then)
    except KeyboardInterrupt:
        complete = False
        if numbers is not None:  # to measure motions that don't repeat would keep Ctrl-C waiting
            many = (result.kind >= 0) & ~np.isin(result.kind, CLOSED)
            result.kind[many & ~numbers.done] = Kind.NOT_COMPUTED
    return gathered(grid, map_, result, places, numbers, complete)


def gathered(
    grid: Grid,
    map_: Stroboscope,
    result: SettledMotions,
    places: np.ndarray,
    numbers: GridNumbers | None,
    complete: bool,
) -> GridResponses:
    """The responses of what all starts settled to at places int64[p] of a grid."""
    count = len(grid.starts)
    place, noise = np.repeat(places, count), map_.noise_of(result.scale)
    found = _gathered(result, place, 4.0 * noise, complete)
    return replace(
        found, response_of=found.response_of.reshape(len(places), count), measured=numbers
    )


class GridNumbers:
    """Numbers of the responses of a grid, computed as these are found.

    Parameters
    ----------
    grid, map_ : Grid, Stroboscope
        The grid, and its map.
    place : int64[k]
        Where on the grid each trajectory is.
    outputs : Outputs
        What is asked about.

    Attributes
    ----------
    done : bool[k]
        Trajectories whose responses have numbers.
    """

    def __init__(self, grid: Grid, map_: Stroboscope, place: np.ndarray, outputs: Outputs) -> None:
        self._grid, self._map, self._place, self._outputs = grid, map_, place, outputs
        self._every = unknown(len(place), grid.starts.shape[1], len(outputs))
        self._own, self.done = np.zeros((2, len(place)), bool)

    def add(self, rows: np.ndarray, settled: SettledMotions) -> None:
        """Those of what trajectories int64[m] settled to: of each response once."""
        noise = 4.0 * self._map.noise_of(settled.scale)
        self._measure(_gathered(settled, self._place[rows], noise), rows)
        self.done[rows] = True

    def of(self, found: GridResponses) -> Measures:
        """Those of all responses."""
        new = found.part(~self._own[found.row])
        if len(new):  # alike is who is like the first of its kind, and this may be another one now
            self._measure(new, np.arange(len(self._place)))
        return self._every.rows(found.row)

    def known(self) -> tuple[np.ndarray, Measures]:
        """Trajectories int64[n] whose own responses were measured, and these numbers."""
        rows = np.flatnonzero(self._own)
        return rows, self._every.rows(rows)

    def put(self, rows: np.ndarray, numbers: Measures) -> None:
        """Take over what another one of them knows of trajectories int64[n]."""
        self._every.put(rows, numbers)
        self._own[rows] = True

    def _measure(self, found: GridResponses, rows: np.ndarray) -> None:
        self.put(rows[found.row], numbers_of(found, self._outputs, self._grid, self._map))


def _sweep(
    grid: Grid,
    map_: Stroboscope,
    most: int,
    result: SettledMotions,
    threads: int | None,
    progress: Callable[[float], None] | None,
    numbers: GridNumbers | None,
) -> None:
    """Each start along the axis: where it stands at one value is where it starts at the next."""
    count = len(grid.starts)
    for k in range(grid.places):
        ways = list(dict.fromkeys(grid.sweeps))
        for n, way in enumerate(ways):
            who = np.array([i for i, sweep in enumerate(grid.sweeps) if sweep == way])
            place, before = (k, k - 1) if way == "up" else (grid.places - 1 - k, grid.places - k)
            start = result.end[before * count + who] if k else grid.starts[who]
            rows = place * count + who
            found = find_responses(
                map_.rows(np.full(len(who), place)),
                np.where(np.isfinite(start), start, 0.0),
                most,
                threads,
                stage(progress, (k + n / len(ways)) / grid.places, (k + 1) / grid.places),
            )
            if numbers is not None:
                numbers.add(rows, found)
            result.put(rows, found)
        if progress:
            progress((k + 1) / grid.places)


def _gathered(
    result: SettledMotions, place: np.ndarray, tolerance: np.ndarray, complete: bool = True
) -> GridResponses:
    """Group the trajectories of each value, which are at ``place`` int64[k] in ascending order, by
    the response they settled to.
    """
    response_of = result.kind.copy()
    sampled = functools.cache(
        lambda row: SampledMotion("", 0.0, 0.0, result.iterates[row], result.scale[row])
    )
    rows: list[int] = []
    for every in np.split(np.arange(len(place)), np.flatnonzero(np.diff(place)) + 1):
        here = [row for row in every.tolist() if result.kind[row] >= 0]
        groups: list[list[int]] = []
        for row in here:
            home = next(
                (
                    group
                    for group in groups
                    if _same(result, sampled, group[0], row, max(SAME, tolerance[row]))
                ),
                None,
            )
            if home is None:
                groups.append([row])
            else:
                home.append(row)
        for group in sorted(groups, key=lambda group: _order(result, group[0])):
            response_of[group] = len(rows)
            rows.append(group[0])
    chosen = np.array(rows, np.int64)
    return GridResponses(result, chosen, place[chosen], response_of, complete)


def _same(
    result: SettledMotions,
    sampled: Callable[[int], SampledMotion],
    a: int,
    b: int,
    tolerance: float,
) -> bool:
    """True where two trajectories at one value settled to the same response."""
    if result.kind[a] != result.kind[b]:
        return False
    if (
        result.kind[a] == Kind.LIMIT_CYCLE
        and abs(result.orbits.time[a] / result.orbits.time[b] - 1.0) > tolerance
    ):
        return False
    if result.kind[a] in CLOSED:
        return bool(
            result.orbits.period[a] == result.orbits.period[b]
            and result.orbits.distance(result.orbits.points[[b], 0], result.scale[[a]], [a])[0]
            < tolerance
        )
    return alike(sampled(a), sampled(b))


def _order(result: SettledMotions, row: int) -> tuple[float, ...]:
    """By kind, period, then size, coarse enough that rounding can't change it."""
    period = result.orbits.period[row]
    points = (
        result.iterates[row].mean(axis=0)[None]
        if row in result.iterates
        else result.orbits.points[row, :period]
    )
    sizes = np.atleast_1d(np.round(np.sqrt(np.mean((points / result.scale[row]) ** 2, axis=0)), 7))
    return (int(result.kind[row]), int(period), *(float(size) for size in sizes))


def numbers_of(found: GridResponses, outputs: Outputs, grid: Grid, every: Stroboscope) -> Measures:
    """The numbers of each response; ``every``: the map of the grid."""
    map_, times = every.rows(found.place, threads=1), own_times(found, grid)
    numbers = measure(
        map_ if times is None else map_.with_period(times),
        found.start(aside=True),
        spans_of(found),
        outputs=outputs,
    )
    equilibria = np.flatnonzero(found.kind == Kind.EQUILIBRIUM)
    if len(equilibria):
        measure_equilibria(
            map_.rows(equilibria), found.start()[equilibria], equilibria, numbers, outputs
        )
    return numbers


def table_of(found: GridResponses, numbers: Measures, grid: Grid, method: Method) -> AttractorTable:
    """Table of the responses."""
    map_ = grid.map(method).rows(found.place)
    kind, s, free = found.kind, found.motions, grid.every is not None
    period = np.where(np.isin(kind, REPEATING), found.period, 0)
    multipliers, eigenvalues = multipliers_and_eigenvalues(
        s.orbits.multipliers[found.row], kind == Kind.EQUILIBRIUM
    )
    hits = np.bincount(found.response_of[found.response_of >= 0], minlength=len(found))
    low, high = wilson(hits, len(grid.starts))
    shares = (hits / len(grid.starts), low, high) if grid.drawn else None
    return AttractorTable(
        **{**numbers.columns(period), "itinerary": [""] * len(found)},
        kind=[Kind(code).word for code in kind],
        multipliers=multipliers,
        exponent=s.exponent[found.row] / map_.period,
        exponent_error=s.exponent_error[found.row] / map_.period,
        points=[
            found.points(i)[: int(known)]
            for i, known in enumerate(np.where(found.period > 0, found.period, APERIODIC_PERIODS))
        ],
        fractions=shares,
        cycle=np.where(kind == Kind.LIMIT_CYCLE, found.time, np.nan) if free else None,
        eigenvalues=eigenvalues if free else None,
    )


def spans_of(found: GridResponses) -> np.ndarray:
    """Periods of each response, int64[m]: n of an nT, 1 of a limit cycle or an equilibrium, 0 of
    one that never repeats.
    """
    repeats = np.isin(found.kind, REPEATING)
    return np.where(repeats, found.period, np.where(found.period > 0, 1, 0))


def own_times(found: GridResponses, grid: Grid) -> np.ndarray | None:
    """Time of one of these periods [s], of a system without forcing: that of the limit cycle, else
    that between two samples.
    """
    return None if grid.every is None else np.where(found.time > 0, found.time, grid.every)
