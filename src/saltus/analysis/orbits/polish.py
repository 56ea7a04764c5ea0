"""Newton's method on many periodic orbits at once, each of a map with parameter values of its own: orbits.py for a whole grid.

Parker & Chua, Practical Numerical Algorithms for Chaotic Systems (1989), chapter 5.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from saltus.analysis.orbits.orbits import AMPLIFIED, FOLLOWED, LAST, MARGINAL, mean_orbit
from saltus.flow.maps import Stroboscope

#: Newton steps: quadratic convergence from 1e-5 needs three.
MOST_STEPS = 12
#: A step longer than this many of the one before is slow: at a fold they halve.
SLOW = 0.75
#: A step so short, in units of the scale, is the last one: the next is rounding.
CONVERGED = 1e-12


@dataclass
class Closed:
    """Orbits of k trajectories, or none where Newton's method found none.

    Attributes
    ----------
    period : int64[k]
        n, the smallest number of iterates after which the orbit closes; 0 where there is none.
    points : float64[k, N, D]
        Its points from the smallest in the first state on, NaN after n.
    multipliers : complex128[k, D]
        Floquet multipliers, the largest first; of a limit cycle the trivial 1 before them, of an equilibrium the eigenvalues [1/s].
    time : float64[k]
        Period of a limit cycle [s], 0 of an equilibrium, NaN of an orbit of the stroboscope. A limit cycle has points in equal steps of
        its time.
    """

    period: np.ndarray
    points: np.ndarray
    multipliers: np.ndarray
    time: np.ndarray

    @classmethod
    def none(cls, count: int, longest: int, size: int) -> Closed:
        """No orbit yet."""
        points, multipliers = np.full((count, longest, size), np.nan), np.full((count, size), np.nan + 0j)
        return cls(np.zeros(count, np.int64), points, multipliers, np.full(count, np.nan))

    @property
    def stable(self) -> np.ndarray:
        """Which are orbits all of whose multipliers (but a trivial one) lie inside the unit circle by more than rounding, bool[k]."""
        leading = np.where(self.time > 0, self.multipliers[:, min(1, self.multipliers.shape[1] - 1)], self.multipliers[:, 0])
        with np.errstate(invalid="ignore"):
            inside = np.where(self.time == 0, leading.real < 0, np.abs(leading) < 1.0 - MARGINAL)
        return (self.period > 0) & inside

    def rows(self, which: np.ndarray) -> Closed:
        """Those of some rows, int64[m] or bool[k]."""
        return Closed(self.period[which], self.points[which], self.multipliers[which], self.time[which])

    def distance(self, state: np.ndarray, scale: np.ndarray, rows: np.ndarray | list[int] | slice = slice(None)) -> np.ndarray:
        """How far states float64[m, D] lie from the orbits of some rows (default all), in units of the scale; inf where there is none."""
        apart = np.abs((self.points[rows] - state[:, None]) / scale[:, None]).max(axis=2)
        return np.where(np.isnan(apart), np.inf, apart).min(axis=1)


def close(map_: Stroboscope, start: np.ndarray, n: np.ndarray, scale: np.ndarray, longest: int, nearby: bool = False) -> Closed:
    """The periodic orbits near states that nearly recur.

    Parameters
    ----------
    map_ : Stroboscope
        k maps.
    start : float64[k, D]
        A point near each orbit.
    n : int64[k]
        Its period, or a multiple of it; at most ``longest``.
    scale : float64[k, D]
        Range of each state.
    longest : int
        Longest period looked for.
    nearby : bool
        Whether to give up where Newton's method is slow twice: the orbit isn't near then. Once, a contact between the two may be the
        reason.
    """
    result = Closed.none(len(start), longest, start.shape[1])
    if not len(start):
        return result
    if not map_.exact:
        return _followed(map_, start, n, scale, result)
    x, found = _newton(map_, start, n, scale, 1 if nearby else MOST_STEPS)
    rows = np.flatnonzero(found)
    if not len(rows):
        return result
    points = map_.rows(rows).launch(x[rows], longest).advance(int(n[rows].max()))
    period = _smallest_period(points, x[rows], n[rows], scale[rows], map_.noise_of(scale[rows]))
    orbits = np.concatenate([x[rows][:, None], points], axis=1)
    return _completed(map_, rows, period, [orbit[:m] for orbit, m in zip(orbits, period, strict=True)], result)


def _newton(map_: Stroboscope, start: np.ndarray, n: np.ndarray, scale: np.ndarray, most_slow: int) -> tuple[np.ndarray, np.ndarray]:
    """Fixed points of the n-th iterates, float64[k, D], and where the iteration converged, bool[k].

    So many of its steps may be slow.
    """
    x, found = np.array(start, float), np.zeros(len(start), bool)
    before, slow = np.full(len(start), np.inf), np.zeros(len(start), np.int64)
    rows = np.arange(len(start))
    for _ in range(MOST_STEPS):
        end, matrix = map_.rows(rows).tangent(x[rows], n[rows])
        residual = np.eye(x.shape[1]) - matrix
        good = np.isfinite(matrix).all(axis=(1, 2)) & np.isfinite(end).all(axis=1)
        good[good] = np.abs(np.linalg.det(residual[good])) > 0
        rows, end, residual = rows[good], end[good], residual[good]
        step = np.linalg.solve(residual, (end - x[rows])[:, :, None])[:, :, 0]
        x[rows] += step
        length = np.abs(step / scale[rows]).max(axis=1)
        done = (length < CONVERGED) | ((length < AMPLIFIED) & (length > 0.5 * before[rows]))  # stiff orbits amplify rounding
        found[rows[done]] = True
        slow[rows] += length > SLOW * before[rows]
        before[rows] = length
        rows = rows[~done & (length < 1.0) & (slow[rows] <= most_slow)]
        if not len(rows):
            break
    return x, found


def _smallest_period(points: np.ndarray, x: np.ndarray, n: np.ndarray, scale: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """The smallest divisor of n after which each orbit closes as well as after n, int64[k]; 0 where it doesn't close after n."""
    distance = np.abs((points - x[:, None]) / scale[:, None]).max(axis=2)
    last = distance[np.arange(len(n)), n - 1]
    enough = np.maximum(10.0 * last, noise)
    period = np.zeros(len(n), np.int64)
    for m in range(points.shape[1], 0, -1):
        period[(n % m == 0) & (distance[:, m - 1] <= enough)] = m
    return np.where(np.isfinite(last) & (last < AMPLIFIED), period, 0)


def _followed(map_: Stroboscope, start: np.ndarray, n: np.ndarray, scale: np.ndarray, result: Closed) -> Closed:
    """The orbits that trajectories of inexact maps settle on: means of their last returns (see orbits.py)."""
    longest = result.points.shape[1]
    last = map_.launch(start, 2 * FOLLOWED + longest).advance(max(FOLLOWED, 2 * LAST * int(n.max())))
    noise = map_.noise_of(scale)
    means = [mean_orbit(trail, int(m), one, float(mine)) for trail, m, one, mine in zip(last, n, scale, noise, strict=True)]
    rows = np.array([i for i, mean in enumerate(means) if mean is not None and len(mean[0]) <= longest], np.int64)
    if not len(rows):
        return result
    points = [means[i][0] for i in rows]
    return _completed(map_, rows, np.array([len(one) for one in points], np.int64), points, result)


def _completed(map_: Stroboscope, rows: np.ndarray, period: np.ndarray, points: list[np.ndarray], result: Closed) -> Closed:
    """Write orbits into the result, each from its first point on, with its multipliers."""
    points = [np.roll(one, -int(np.lexsort(one.T[::-1])[0]), axis=0) if len(one) else one for one in points]
    closed = np.flatnonzero(period > 0)
    if not len(closed):
        return result
    _, matrix = map_.rows(rows[closed]).tangent(np.array([points[i][0] for i in closed]), period[closed])
    for i, monodromy in zip(closed, matrix, strict=True):
        if np.isfinite(monodromy).all():
            values = np.linalg.eigvals(monodromy)
            order = np.lexsort((-values.imag, -np.round(np.abs(values), 12)))
            row = rows[i]
            result.period[row], result.points[row, : period[i]], result.multipliers[row] = period[i], points[i], values[order]
    return result
