"""Periodic orbits of maps, many at a time: closed by Newton's method, with their multipliers.

Newton on P^n(x) - x = 0 with the derivative from the tangent flow; Parker & Chua, Practical
Numerical Algorithms for Chaotic Systems (1989), chapter 5. Orbits of an inexact map (ode45's) are
followed instead: ode45 restarted at every period has another fixed point than ode45 that goes on, a
twentieth of the range apart at (1e-4, 1e-7) where damping is weak. What a run settles on is its
attractor.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np

from saltus.analysis.solve.newton import leading_first, newton
from saltus.analysis.solve.tolerances import (
    AMPLIFIED,
    APART,
    AVERAGED_RETURNS,
    JITTER,
    LONGEST,
    MARGINAL,
    MAX_NEWTON_STEPS,
    SETTLING_ITERATES,
    SHOWING,
)
from saltus.flow.maps import Map


@dataclass(frozen=True)
class Orbit:
    """An orbit of period n of a map with D states: one of a batch.

    Attributes
    ----------
    points : float64[n, D]
        Its points, in the order in which they are visited; the first is the smallest in the first
        state.
    multipliers : complex128[D]
        Floquet multipliers, the largest first.
    mismatch : float
        Largest distance between a point and its n-th image, in units of the scale.
    """

    points: np.ndarray
    multipliers: np.ndarray
    mismatch: float

    @property
    def period(self) -> int:
        """n."""
        return len(self.points)

    @property
    def exponent(self) -> float:
        """Largest Lyapunov exponent [per iterate]."""
        largest = abs(self.multipliers[0])
        return math.log(largest) / self.period if largest > 0 else -math.inf


@dataclass
class OrbitBatch:
    """Orbits of k trajectories, or none where none was found.

    Attributes
    ----------
    period : int64[k]
        n, the smallest number of iterates after which the orbit closes; 0 where there is none.
    points : float64[k, N, D]
        Its points from the smallest in the first state on, NaN after n.
    multipliers : complex128[k, D]
        Floquet multipliers, the largest first; of a limit cycle the trivial 1 before them, of an
        equilibrium the eigenvalues [1/s].
    time : float64[k]
        Period of a limit cycle [s], 0 of an equilibrium, NaN of an orbit of a map. A limit cycle
        has points in equal steps of its time.
    mismatch : float64[k]
        Largest distance between a point of an orbit of a map and its n-th image, in units of the
        scale.
    """

    period: np.ndarray
    points: np.ndarray
    multipliers: np.ndarray
    time: np.ndarray
    mismatch: np.ndarray

    @classmethod
    def none(cls, count: int, size: int) -> OrbitBatch:
        """No orbit yet, of points with this number of states."""
        points, multipliers = (
            np.full((count, LONGEST, size), np.nan),
            np.full((count, size), np.nan + 0j),
        )
        return cls(np.zeros(count, np.int64), points, multipliers, *np.full((2, count), np.nan))

    def __len__(self) -> int:
        return len(self.period)

    def __iter__(self) -> Iterator[Orbit]:
        return (self[row] for row in range(len(self)))

    def __getitem__(self, row: int) -> Orbit:
        return Orbit(
            self.points[row, : self.period[row]].copy(),
            self.multipliers[row],
            float(self.mismatch[row]),
        )

    @property
    def stable(self) -> np.ndarray:
        """Which are orbits all of whose multipliers (but a trivial one) lie inside the unit circle
        by more than rounding, bool[k].
        """
        leading = np.where(
            self.time > 0,
            self.multipliers[:, min(1, self.multipliers.shape[1] - 1)],
            self.multipliers[:, 0],
        )
        with np.errstate(invalid="ignore"):
            inside = np.where(self.time == 0, leading.real < 0, np.abs(leading) < 1.0 - MARGINAL)
        return (self.period > 0) & inside

    def rows(self, which: np.ndarray) -> OrbitBatch:
        """Those of some rows, int64[m] or bool[k]."""
        return OrbitBatch(*(getattr(self, field.name)[which] for field in fields(self)))

    def put(self, rows: np.ndarray, other: OrbitBatch) -> None:
        """Write others to the rows int64[m]."""
        for field in fields(self):
            getattr(self, field.name)[rows] = getattr(other, field.name)

    def distance(
        self,
        state: np.ndarray,
        scale: np.ndarray,
        rows: np.ndarray | list[int] | slice = slice(None),
    ) -> np.ndarray:
        """How far states float64[m, D] lie from the orbits of some rows (default all), in units of
        the scale; inf where there is none.
        """
        apart = np.abs((self.points[rows] - state[:, None]) / scale[:, None]).max(axis=2)
        nearest: np.ndarray = np.where(np.isnan(apart), np.inf, apart).min(axis=1)
        return nearest


def find_orbits(
    map_: Map,
    start: np.ndarray,
    n: np.ndarray,
    scale: np.ndarray,
    noise: np.ndarray,
    max_slow: int = MAX_NEWTON_STEPS,
) -> OrbitBatch:
    """The periodic orbits near states that nearly recur.

    Parameters
    ----------
    map_ : Map
        The map.
    start : float64[k, D]
        A point near each orbit.
    n : int64[k]
        Its period, or a multiple of it; at most LONGEST.
    scale : float64[k, D]
        Range of each state.
    noise : float64[k]
        Mismatch of a closed orbit that errors of the map explain, in units of the scale.
    max_slow : int
        Newton's method gives up after this number of slow steps: the orbit isn't near. One may be
        due to a contact between.
    """
    result = OrbitBatch.none(*start.shape)
    if not len(start):
        return result
    if map_.exact:
        rows, points, mismatch = _closed(map_, start, n, scale, noise, max_slow)
    else:
        rows, points, mismatch = _averaged(map_, start, n, scale, noise)
    points = [np.roll(one, -int(np.lexsort(one.T[::-1])[0]), axis=0) for one in points]
    period = np.array([len(one) for one in points], np.int64)
    if len(rows):
        _, monodromy = map_.rows(rows).tangent(np.array([one[0] for one in points]), period)
        multipliers = leading_first(monodromy)
        for i in np.flatnonzero(np.isfinite(multipliers).all(axis=1)):
            row = rows[i]
            result.period[row], result.points[row, : period[i]], result.multipliers[row] = (
                period[i],
                points[i],
                multipliers[i],
            )
            result.mismatch[row] = mismatch[i]
    return result


def _closed(
    map_: Map, start: np.ndarray, n: np.ndarray, scale: np.ndarray, noise: np.ndarray, max_slow: int
) -> tuple[np.ndarray, list[np.ndarray], np.ndarray]:
    """Which rows Newton's method closes, int64[m], the points of their orbits, float64[n, D] each,
    and their mismatch, float64[m].
    """

    def equations(x: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        end, matrix = map_.rows(rows).tangent(x, n[rows])
        unit = scale[rows]
        return (end - x) / unit, matrix * unit[:, None, :] / unit[:, :, None] - np.eye(x.shape[1])

    zeros = newton(equations, start, scale, max_slow=max_slow)
    x, rows = zeros.z, np.flatnonzero(zeros.found)
    if not len(rows):
        return rows, [], np.zeros(0)
    points = np.concatenate(
        [x[rows][:, None], map_.rows(rows).launch(x[rows], LONGEST).advance(int(n[rows].max()))],
        axis=1,
    )
    distance = np.abs((points[:, 1:] - points[:, :1]) / scale[rows, None]).max(axis=2)
    last = distance[np.arange(len(rows)), n[rows] - 1]
    period = _smallest_period(distance, n[rows], np.maximum(10.0 * last, noise[rows]))
    closes = np.flatnonzero(last < AMPLIFIED)
    return (
        rows[closes],
        [points[i, : period[i]] for i in closes],
        distance[closes, period[closes] - 1],
    )


def _smallest_period(distance: np.ndarray, n: np.ndarray, enough: np.ndarray) -> np.ndarray:
    """The smallest divisor of n int64[k] after which orbits are back, int64[k]; distances
    float64[k, m] are those after 1, 2, ...
    """
    period = n.copy()
    for m in range(distance.shape[1], 0, -1):
        period[(n % m == 0) & (distance[:, m - 1] <= enough)] = m
    return period


def _averaged(
    map_: Map, start: np.ndarray, n: np.ndarray, scale: np.ndarray, noise: np.ndarray
) -> tuple[np.ndarray, list[np.ndarray], np.ndarray]:
    """Which trajectories of inexact maps settle on an orbit, the means of their last returns, and
    how far these scatter.

    One more iterate is run than is looked at: a step of ode45 ends there, and nowhere before.
    """
    length = n * np.maximum(-(-SETTLING_ITERATES // n), 2 * AVERAGED_RETURNS)
    longest = int(length.max())
    runs = map_.launch(start, longest + 1).advance(longest + 1)
    means = [
        mean_orbit(runs[i, : length[i]], int(n[i]), scale[i], float(noise[i]))
        for i in range(len(n))
    ]
    known = [
        (row, *mean)
        for row, mean in enumerate(means)
        if mean is not None and len(mean[0]) <= LONGEST
    ]
    return (
        np.array([row for row, _, _ in known], np.int64),
        [points for _, points, _ in known],
        np.array([mean[2] for mean in known]),
    )


def mean_orbit(
    iterates: np.ndarray, n: int, scale: np.ndarray, noise: float
) -> tuple[np.ndarray, float] | None:
    """The orbit on which iterates of an inexact map end, and how far they lie from it; None if they
    end on none.

    Parameters
    ----------
    iterates : float64[m, D]
        States one iterate apart, at least 16 n of them.
    n : int
        Iterates after which they nearly recur.
    scale : float64[D]
        Range of each state.
    noise : float
        Errors of the map, in units of the scale.
    """
    last = iterates[-AVERAGED_RETURNS * n :]
    points, scatter = _mean(last, n, scale)
    if not scatter <= JITTER * noise:
        return None
    double, less = _mean(last, 2 * n, scale)
    if scatter > SHOWING and less < 0.25 * scatter:  # two loops that lie side by side
        points = double
    parts = [m for m in range(1, len(points) + 1) if len(points) % m == 0]
    apart = [np.abs((np.roll(points, -m, axis=0) - points) / scale).max() for m in parts]
    # loops that its errors alone part are one
    points, scatter = _mean(last, parts[int(np.argmax(np.array(apart) <= noise))], scale)
    return (points, scatter) if _spacing(points, scale) >= APART * scatter else None


def _spacing(points: np.ndarray, scale: np.ndarray) -> float:
    """Least distance between two of the points, in units of the scale; inf for one point."""
    distances = np.abs((points[:, None] - points[None]) / scale).max(axis=2)
    return float((distances + np.diag(np.full(len(points), np.inf))).min())


def _mean(points: np.ndarray, n: int, scale: np.ndarray) -> tuple[np.ndarray, float]:
    """Mean of the returns of period n in float64[m n, D], float64[n, D], and how far one lies from
    it at most.
    """
    returns = points.reshape(-1, n, points.shape[1])
    mean = returns.mean(axis=0)
    return mean, float(np.abs((returns - mean) / scale).max())


def same(a: Orbit, b: Orbit, scale: np.ndarray, tolerance: float) -> bool:
    """Whether two orbits are one, or one the other several times over: each point of one lies on
    the other.
    """
    if max(a.period, b.period) % min(a.period, b.period):
        return False
    distances = np.abs((a.points[:, None] - b.points[None]) / scale).max(axis=2).min(axis=1)
    return bool(distances.max() < tolerance)


def phase_distances(p: np.ndarray, q: np.ndarray, scale: np.ndarray | float = 1.0) -> np.ndarray:
    """Largest difference of the points of two orbits of one period, float64[n, D], where q begins
    with its point 0, 1, ...: float64[n].
    """
    phases = (np.arange(len(q))[:, None] + np.arange(len(q))) % len(q)
    return np.asarray(np.abs((p[None] - q[phases]) / scale).max(axis=(1, 2)))


def orbit_distance(p: np.ndarray, q: np.ndarray, scale: np.ndarray | float = 1.0) -> float:
    """Largest difference of the points of two orbits, float64[n, D], at the best phase, in units of
    the scale; inf if periods differ.
    """
    return float(phase_distances(p, q, scale).min()) if len(p) == len(q) else np.inf
