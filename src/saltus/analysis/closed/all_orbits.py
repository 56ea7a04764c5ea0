"""The periodic orbits of a map in a region, stable and unstable: Newton's method from many starts,
and again with the orbits that are known deflated.

The unknowns are all n points of an orbit (multiple shooting): each lane goes one iterate, so that
what an unstable orbit does to an error in n of them stands in no equation. Parker & Chua, Practical
Numerical Algorithms for Chaotic Systems (1989), chapter 5. How many orbits were missed is estimated
from those that a single start led to: Good, Biometrika 40 (1953) 237-264.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from saltus.analysis.closed.orbits import Orbit, phase_distances
from saltus.analysis.solve.newton import leading_first, newton
from saltus.analysis.solve.tolerances import AMPLIFIED, SAME
from saltus.flow.maps import Map, Travel
from saltus.flow.progress import stage
from saltus.kernels import status as st

#: Numbers in the matrices that are solved at a time: 64 MB of them.
HELD = 2**23
#: Starts of a search with known orbits deflated, searches of a period, and steps of one: most of
#: its starts lead nowhere.
DEFLATED_STARTS, DEFLATED_SEARCHES, DEFLATED_STEPS = 64, 8, 40
#: Other starts of it: beside known orbits, so far away in units of their range, and how many in
#: all. The orbit that a fold made with a known one is there.
BESIDE, MOST_BESIDE = np.repeat([0.01, 0.1, 0.3], 6), 1024
#: Iterates that starts are followed before Newton's method begins, in turn: none, so that orbits
#: are found which nothing comes near; some, so that a chaotic set is reached.
AGES = (0, 4, 8, 12)


@dataclass
class Search:
    """What the search for the orbits of one period n came to.

    Attributes
    ----------
    period : int
        n.
    starts, converged : int
        Starts, and those of them that led to an orbit of period n or of a part of it.
    found_once : int
        Orbits that one start alone led to.
    deflated : int
        Orbits that no start led to before the others were deflated.
    exhausted : bool
        Whether the last search with all known orbits deflated found nothing.
    given_up : int
        Starts that were dropped: their motion took more steps or contacts than the method allows.
    """

    period: int
    starts: int
    converged: int = 0
    found_once: int = 0
    deflated: int = 0
    exhausted: bool = False
    given_up: int = 0

    @property
    def unseen(self) -> float:
        """Estimated share of the starts whose orbit isn't known; NaN if none led to one."""
        return self.found_once / self.converged if self.converged else np.nan


@dataclass
class OrbitSet:
    """Periodic orbits, each once.

    Attributes
    ----------
    scale : float64[D]
        Range of each state.
    orbits : list of Orbit
        The orbits.
    found : list of int
        Starts that led to each.
    searches : list of Search
        One for each period.
    """

    scale: np.ndarray
    orbits: list[Orbit] = field(default_factory=list)
    found: list[int] = field(default_factory=list)
    searches: list[Search] = field(default_factory=list)

    def take(self, map_: Map, points: np.ndarray) -> np.ndarray:
        """Add the orbits float64[k, n, D] that aren't known yet; the number of each, int64[k], -1
        of one that doesn't close.
        """
        least = _least_period(points, self.scale)
        number = np.full(len(points), -1)
        for n in np.unique(least).tolist():
            rows = np.flatnonzero(least == n)
            number[rows] = self._take(map_, points[rows, :n])
        return number

    def _take(self, map_: Map, points: np.ndarray) -> np.ndarray:
        """The same for orbits of one least period."""
        units, number = points / self.scale, np.full(len(points), -1)
        marks = _marks(units)
        for i, orbit in enumerate(self.orbits):
            if orbit.period == points.shape[1]:
                mine = orbit.points / self.scale
                number[_equal(units, marks, mine, np.flatnonzero(number < 0))] = i
        for row in range(len(points)):
            if number[row] >= 0:
                continue
            alike = _equal(units, marks, units[row], np.flatnonzero(number < 0))
            one = _orbit(map_, points[row], self.scale)
            if one is None:
                number[alike] = -2
                continue
            number[alike] = len(self.orbits)
            self.orbits.append(one)
            self.found.append(0)
        return np.where(number < 0, -1, number)

    def within(self, n: int) -> np.ndarray:
        """Every orbit whose period divides n as n points, from each of its points on,
        float64[m, n D].
        """
        size = len(self.scale)
        phases = [
            np.tile(np.roll(orbit.points, -i, axis=0), (n // orbit.period, 1)).ravel()
            for orbit in self.orbits
            if n % orbit.period == 0
            for i in range(orbit.period)
        ]
        return np.array(phases).reshape(-1, n * size)

    def ordered(self) -> OrbitSet:
        """The same in an order that doesn't depend on discovery: by period, then by place."""
        order = sorted(
            range(len(self.orbits)),
            key=lambda i: (
                self.orbits[i].period,
                *np.round(self.orbits[i].points[0] / self.scale, 7).tolist(),
                *np.round(self.orbits[i].points / self.scale, 6).ravel().tolist(),
            ),
        )
        return OrbitSet(
            self.scale,
            [self.orbits[i] for i in order],
            [self.found[i] for i in order],
            self.searches,
        )


def all_orbits(
    map_: Map,
    start: np.ndarray,
    longest: int,
    scale: np.ndarray,
    progress: Callable[[float], None] | None = None,
    before: Map | None = None,
) -> OrbitSet:
    """The periodic orbits that starts lead to, up to a period.

    Parameters
    ----------
    map_ : Map
        The map, with one row of parameter values.
    start : float64[k, D]
        Newton's method begins at iterates of these: see :data:`AGES`.
    longest : int
        Largest period [iterates].
    scale : float64[D]
        Range of each state.
    progress : callable, optional
        Called with the share done.
    before : Map, optional
        The map by which starts are followed before Newton's method begins: the same, but for the
        budget of its motions, which last longer.

    Returns
    -------
    OrbitSet
        Ordered by period.
    """
    result = OrbitSet(scale)
    iterates = _guesses(before or map_, start, longest)
    for n in range(1, longest + 1):
        search = Search(n, len(start), given_up=len(start) - len(iterates))
        show = stage(progress, *(m * (m + 1) / (longest * (longest + 1)) for m in (n - 1, n)))
        result.searches.append(search)
        number = result.take(map_, close(map_, iterates[:, :n], scale))
        count = np.bincount(number[number >= 0], minlength=len(result.orbits))
        result.found = (np.array(result.found, np.int64) + count).tolist()
        search.converged, search.found_once = int(count.sum()), int((count == 1).sum())
        if show:
            show(0.5)
        _deflate(map_, iterates[:, :n], result, search)
        if show:
            show(1.0)
    return result.ordered()


def _guesses(map_: Map, start: np.ndarray, longest: int) -> np.ndarray:
    """Successive iterates float64[k, longest, D] from each start on, at its age; without the
    starts whose budget is used up.
    """
    last = AGES[-1] + longest
    flight = map_.launch(start, last)
    points = np.concatenate([start[:, None], flight.advance(last - 1)], axis=1)
    age = np.resize(AGES, len(start))
    iterates = points[np.arange(len(start))[:, None], age[:, None] + np.arange(longest)]
    return np.asarray(iterates[~used_up(flight)])


def used_up(flight: Travel) -> np.ndarray:
    """Trajectories that needed more steps or contacts than they were allowed, bool[k]."""
    return np.isin(flight.status, (st.BUDGET_STEPS, st.BUDGET_EVENTS))


def _deflate(map_: Map, guesses: np.ndarray, result: OrbitSet, search: Search) -> None:
    """Search on with the known orbits deflated, from some starts and from beside the known orbits,
    until nothing more is found.
    """
    some = guesses[:: max(1, len(guesses) // DEFLATED_STARTS)]
    random = np.random.default_rng(0)
    for _ in range(DEFLATED_SEARCHES):
        before = len(result.orbits)
        known = result.within(search.period)
        starts = np.concatenate([some, _beside(known.reshape(-1, *guesses.shape[1:]), random)])
        result.take(map_, close(map_, starts, result.scale, known, DEFLATED_STEPS))
        search.deflated += len(result.orbits) - before
        if len(result.orbits) == before:
            search.exhausted = True
            return


def _beside(known: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Points beside orbits float64[m, n, D], float64[at most MOST_BESIDE, n, D]."""
    if not len(known):
        return known
    size = np.ptp(known, axis=(0, 1))
    around = np.repeat(known, len(BESIDE), axis=0)
    far = np.tile(BESIDE, len(known))[:, None, None] * random.standard_normal(around.shape)
    beside: np.ndarray = (around + far * size)[:: -(-len(around) // MOST_BESIDE)]
    return beside


def close(
    map_: Map,
    guesses: np.ndarray,
    scale: np.ndarray,
    known: np.ndarray | None = None,
    max_steps: int | None = None,
) -> np.ndarray:
    """The orbits float64[m, n, D] that Newton's method finds from guesses float64[k, n, D] of all
    their points; ``known`` ones are deflated.
    """
    _, n, size = guesses.shape
    units = np.tile(scale, n)
    rows = max(1, HELD // max((n * size) ** 2, n * size * (0 if known is None else len(known))))
    parts = []
    for first in range(0, len(guesses), rows):
        part = guesses[first : first + rows].reshape(-1, n * size)
        zeros = newton(
            lambda z, _: shooting(map_, z.reshape(-1, n, size), scale),
            part,
            np.broadcast_to(units, part.shape),
            damped=True,
            known=known,
            max_steps=max_steps,
        )
        parts.append(zeros.z[zeros.found].reshape(-1, n, size))
    return np.concatenate(parts) if parts else np.zeros((0, n, size))


def shooting(map_: Map, points: np.ndarray, scale: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Residuals P(x_i) - x_(i+1) of points float64[k, n, D], float64[k, n D], and their derivative,
    float64[k, n D, n D]; in units of the scale.
    """
    k, n, size = points.shape
    rows = map_.rows(np.zeros(k * n, np.int64))
    residual, derivative, _ = chained(rows, points, np.broadcast_to(scale, (k, size)))
    return residual, derivative


def chained(
    map_: Map, points: np.ndarray, scale: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same by a map with k n rows, in units float64[k, D]; and the images of the points,
    float64[k, n, D].
    """
    k, n, size = points.shape
    end, matrix = map_.tangent(points.reshape(-1, size), 1)
    end, unit = end.reshape(points.shape), scale[:, None]
    residual = (end - np.roll(points, -1, axis=1)) / unit
    matrix = matrix.reshape(k, n, size, size) * unit[..., None, :] / unit[..., None]
    derivative = np.zeros((k, n, size, n, size))
    at = np.arange(n)
    derivative[:, at, :, at, :] = np.moveaxis(matrix, 1, 0)
    derivative[:, at, :, (at + 1) % n, :] -= np.eye(size)
    return residual.reshape(k, n * size), derivative.reshape(k, n * size, n * size), end


# -- one orbit -------------------------------------------------------------------------------------
def _least_period(points: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """The smallest number of iterates after which orbits float64[k, n, D] are back, int64[k]."""
    n = points.shape[1]
    least = np.full(len(points), n)
    for m in range(n - 1, 0, -1):
        if n % m == 0:
            apart = np.abs((np.roll(points, -m, axis=1) - points) / scale).max(
                axis=(1, 2), initial=0.0
            )
            least[apart < SAME] = m
    return least


def _marks(units: np.ndarray) -> np.ndarray:
    """Numbers of orbits float64[..., n, D] that don't depend on where they begin: the means of the
    points and of their squares.
    """
    return np.concatenate([units.mean(axis=-2), (units**2).mean(axis=-2)], axis=-1)


def _equal(units: np.ndarray, marks: np.ndarray, one: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Those of some rows int64[m] whose orbits are this one, float64[n, D], at some phase."""
    size = 1.0 + np.abs(one).max()
    near = rows[np.abs(marks[rows] - _marks(one)).max(axis=1, initial=0.0) < 4 * SAME * size]
    equal: np.ndarray = near[[bool(phase_distances(one, units[i]).min() < SAME) for i in near]]
    return equal


def _orbit(map_: Map, points: np.ndarray, scale: np.ndarray) -> Orbit | None:
    """The orbit of points float64[n, D], from the smallest in the first state on; None if it
    doesn't close.
    """
    points = np.roll(points, -int(np.lexsort(points.T[::-1])[0]), axis=0)
    end, matrices = map_.rows(np.zeros(len(points), np.int64)).tangent(points, 1)
    mismatch = float(np.abs((end - np.roll(points, -1, axis=0)) / scale).max())
    multipliers = multipliers_of(matrices)
    if not (mismatch < AMPLIFIED and np.isfinite(multipliers).all()):
        return None
    return Orbit(points, multipliers, mismatch)


def multipliers_of(matrices: np.ndarray) -> np.ndarray:
    """Floquet multipliers of an orbit from the derivatives along it, float64[n, D, D]:
    complex128[D], the largest first.

    Of a product whose eigenvalues differ by many orders rounding leaves the large ones only; of two
    real ones the small one is the determinant over the large one.
    """
    product = np.eye(matrices.shape[1])
    for one in matrices:
        product = one @ product
    values: np.ndarray = leading_first(product[None])[0]
    if len(values) == 2 and values[0].imag == 0 and values[0] != 0:
        values[1] = np.prod(np.linalg.det(matrices)) / values[0]
    return values
