"""All steady responses over a grid of parameter values: settle every start at every value, tell
which lead to the same response.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from saltus.analysis.attractors.aperiodic import SampledMotion, alike
from saltus.analysis.attractors.find_responses import SettledMotions, find_responses
from saltus.analysis.attractors.grid import Grid
from saltus.analysis.closed.cycles import ASIDE
from saltus.analysis.closed.measures import Measures, measure
from saltus.analysis.closed.unforced import measure_equilibria, multipliers_and_eigenvalues
from saltus.analysis.inputs.outputs import Outputs
from saltus.analysis.solve.tolerances import SAME
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import Method
from saltus.flow.progress import stage
from saltus.intervals import wilson
from saltus.results import AttractorTable
from saltus.results.dataset.kinds import CLOSED, Kind

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
    table: AttractorTable | None = field(default=None, repr=False)

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

    def points(self, response: int) -> np.ndarray:
        """Its stroboscopic points, float64[n, D]."""
        row = int(self.row[response])
        return (
            self.motions.iterates[row]
            if row in self.motions.iterates
            else self.motions.orbits.points[row, : self.motions.orbits.period[row]]
        )

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
) -> GridResponses:
    """The responses of a grid; on Ctrl-C those that are known, with ``complete`` False."""
    map_, count = grid.map(method, threads), len(grid.starts)
    result = SettledMotions.empty(grid.places * count, grid.starts.shape[1])
    complete = True
    try:
        if grid.sweeps:
            _sweep(grid, map_, most, result, threads, progress)
        else:
            find_responses(
                map_.rows(np.repeat(np.arange(grid.places), count)),
                np.tile(grid.starts, (grid.places, 1)),
                most,
                threads,
                progress,
                result,
            )
    except KeyboardInterrupt:
        complete = False
    return _gathered(result, grid.places, count, 4.0 * map_.noise_of(result.scale), complete)


def _sweep(
    grid: Grid,
    map_: Stroboscope,
    most: int,
    result: SettledMotions,
    threads: int | None,
    progress: Callable[[float], None] | None,
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
            result.put(
                rows,
                find_responses(
                    map_.rows(np.full(len(who), place)),
                    np.where(np.isfinite(start), start, 0.0),
                    most,
                    threads,
                    stage(progress, (k + n / len(ways)) / grid.places, (k + 1) / grid.places),
                ),
            )
        if progress:
            progress((k + 1) / grid.places)


def _gathered(
    result: SettledMotions, places: int, count: int, tolerance: np.ndarray, complete: bool
) -> GridResponses:
    """Group the trajectories of each value by the response they settled to."""
    response_of = result.kind.copy()
    rows: list[int] = []
    for place in range(places):
        here = [row for row in range(place * count, (place + 1) * count) if result.kind[row] >= 0]
        groups: list[list[int]] = []
        for row in here:
            home = next(
                (
                    group
                    for group in groups
                    if _same(result, group[0], row, max(SAME, tolerance[row]))
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
    return GridResponses(
        result, chosen, chosen // count, response_of.reshape(places, count), complete
    )


def _same(result: SettledMotions, a: int, b: int, tolerance: float) -> bool:
    """True where two trajectories at one value settled to the same response."""
    if result.kind[a] != result.kind[b] or result.orbits.period[a] != result.orbits.period[b]:
        return False
    if (
        result.kind[a] == Kind.LIMIT_CYCLE
        and abs(result.orbits.time[a] / result.orbits.time[b] - 1.0) > tolerance
    ):
        return False
    if result.kind[a] in CLOSED:
        return bool(
            result.orbits.distance(result.orbits.points[[b], 0], result.scale[[a]], [a])[0]
            < tolerance
        )
    first, second = (
        SampledMotion("", 0.0, 0.0, result.iterates[row], result.scale[a]) for row in (a, b)
    )
    return alike(first, second)


def _order(result: SettledMotions, row: int) -> tuple[float, ...]:
    """By kind, period, then size, coarse enough that rounding can't change it."""
    period = result.orbits.period[row]
    points = (
        result.orbits.points[row, :period] if period else result.iterates[row].mean(axis=0)[None]
    )
    sizes = np.atleast_1d(np.round(np.sqrt(np.mean((points / result.scale[row]) ** 2, axis=0)), 7))
    return (int(result.kind[row]), int(period), *(float(size) for size in sizes))


def numbers_of(
    found: GridResponses, outputs: Outputs, grid: Grid, method: Method, threads: int | None = None
) -> Measures:
    """The numbers of each response."""
    map_, times = grid.map(method, threads).rows(found.place), own_times(found, grid)
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
    period = np.where(kind == Kind.PERIODIC, found.period, 0)
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
    return np.where(found.kind == Kind.PERIODIC, found.period, np.where(found.period > 0, 1, 0))


def own_times(found: GridResponses, grid: Grid) -> np.ndarray | None:
    """Time of one of these periods [s], of a system without forcing: that of the limit cycle, else
    that between two samples.
    """
    return None if grid.every is None else np.where(found.time > 0, found.time, grid.every)
