"""Motions that repeat: orbits of maps by their points, limit cycles by points in equal steps of
their time, equilibria by one point.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np

from saltus.analysis.solve.tolerances import LONGEST, MARGINAL, SAME
from saltus.results.dataset.kinds import Kind


@dataclass(frozen=True)
class ClosedMotion:
    """A motion of D states that repeats: one of a batch, or of a search.

    Attributes
    ----------
    points : float64[n, D]
        Its points, in the order in which they are visited; the first is the smallest in the first
        state.
    multipliers : complex128[D]
        Floquet multipliers, the largest first; of a limit cycle the trivial 1 before them.
    mismatch : float
        Largest distance between a point and its image where the motion closes, in units of the
        scale.
    time : float
        Period of a limit cycle [s]; NaN of an orbit of a map.
    """

    points: np.ndarray
    multipliers: np.ndarray
    mismatch: float
    time: float = math.nan

    @property
    def period(self) -> int:
        """n."""
        return len(self.points)

    @property
    def kind(self) -> str:
        """Kind of motion, in the word of results."""
        return (Kind.LIMIT_CYCLE if self.time > 0 else Kind.PERIODIC).word

    @property
    def transverse(self) -> np.ndarray:
        """The multipliers but for the trivial one, complex128[D] or [D - 1]. A limit cycle of one
        state, which jumps, has nothing across it: a single 0.
        """
        if not self.time > 0:
            return self.multipliers
        return self.multipliers[1:] if len(self.multipliers) > 1 else np.zeros(1, complex)

    @property
    def exponent(self) -> float:
        """Largest Lyapunov exponent [per iterate]; of a limit cycle [1/s], at least the 0 along
        it.
        """
        largest = abs(self.transverse[0])
        growth = math.log(largest) if largest > 0 else -math.inf
        return max(growth / self.time, 0.0) if self.time > 0 else growth / self.period

    @property
    def exponent_error(self) -> float:
        """Its standard error: none."""
        return 0.0


@dataclass
class ClosedMotions:
    """Closed motions of k trajectories, or none where none was found.

    Attributes
    ----------
    period : int64[k]
        n, the number of points; of an orbit of a map the smallest number of iterates after which it
        closes. 0 where there is none.
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
    def none(cls, count: int, size: int) -> ClosedMotions:
        """No motion yet, of points with this number of states."""
        points, multipliers = (
            np.full((count, LONGEST, size), np.nan),
            np.full((count, size), np.nan + 0j),
        )
        return cls(np.zeros(count, np.int64), points, multipliers, *np.full((2, count), np.nan))

    def __len__(self) -> int:
        return len(self.period)

    def __iter__(self) -> Iterator[ClosedMotion]:
        return (self[row] for row in range(len(self)))

    def __getitem__(self, row: int) -> ClosedMotion:
        return ClosedMotion(
            self.points[row, : self.period[row]].copy(),
            self.multipliers[row],
            float(self.mismatch[row]),
            float(self.time[row]),
        )

    @property
    def stable(self) -> np.ndarray:
        """True where all multipliers (but a trivial one) lie inside the unit circle by more than
        rounding, bool[k].
        """
        leading = np.where(
            self.time > 0,
            self.multipliers[:, min(1, self.multipliers.shape[1] - 1)],
            self.multipliers[:, 0],
        )
        with np.errstate(invalid="ignore"):
            inside = np.where(self.time == 0, leading.real < 0, np.abs(leading) < 1.0 - MARGINAL)
        return (self.period > 0) & inside

    @property
    def neutral(self) -> np.ndarray:
        """True where some multipliers of an orbit of a map are 1 but for rounding and all others
        lie inside the unit circle, bool[k]: it isn't isolated, others lie beside it.
        """
        with np.errstate(invalid="ignore"):
            ones = np.abs(self.multipliers - 1.0) < MARGINAL
            kept = ones | (np.abs(self.multipliers) < 1.0 - MARGINAL)
        of_map = (self.period > 0) & np.isnan(self.time)
        return np.asarray(of_map & kept.all(axis=1) & ones.any(axis=1))

    def rows(self, which: np.ndarray) -> ClosedMotions:
        """Those of some rows, int64[m] or bool[k]."""
        return ClosedMotions(*(getattr(self, field.name)[which] for field in fields(self)))

    def put(self, rows: np.ndarray, other: ClosedMotions) -> None:
        """Write others to the rows int64[m]."""
        for field in fields(self):
            getattr(self, field.name)[rows] = getattr(other, field.name)

    def distance(
        self,
        state: np.ndarray,
        scale: np.ndarray,
        rows: np.ndarray | list[int] | slice = slice(None),
    ) -> np.ndarray:
        """Distances of states float64[m, D] from the points of some rows (default all), in units of
        the scale; inf where there is none.
        """
        apart = np.abs((self.points[rows] - state[:, None]) / scale[:, None]).max(axis=2)
        nearest: np.ndarray = np.where(np.isnan(apart), np.inf, apart).min(axis=1)
        return nearest


# -- the points of orbits --------------------------------------------------------------------------
def least_period(
    points: np.ndarray, scale: np.ndarray, enough: np.ndarray | float = SAME
) -> np.ndarray:
    """The smallest number of iterates after which orbits float64[k, n, D] are back at each of their
    points, int64[k]: to such a distance, in units of the scale.
    """
    n = points.shape[1]
    least = np.full(len(points), n)
    for m in range(n - 1, 0, -1):
        if n % m == 0:
            apart = np.abs((np.roll(points, -m, axis=1) - points) / scale)
            least[apart.max(axis=(1, 2), initial=0.0) <= enough] = m
    return least


def from_smallest(points: np.ndarray) -> np.ndarray:
    """The points of an orbit, float64[n, D], from the smallest in the first state on."""
    return np.roll(points, -int(np.lexsort(points.T[::-1])[0]), axis=0)


def same(a: ClosedMotion, b: ClosedMotion, scale: np.ndarray, tolerance: float) -> bool:
    """True where two orbits are one, or one is the other several times over: each point of one lies
    on the other.
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
