"""Periodic orbits of a map: polished by Newton's method, with their multipliers; those of an inexact map (ode45's) are followed instead.

Newton on P^n(x) - x = 0 with the derivative from the tangent flow; Parker & Chua, Practical Numerical Algorithms for Chaotic Systems
(1989), chapter 5.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from saltus.flow.maps import Map

#: Newton steps: quadratic convergence needs a handful.
MOST_STEPS = 30
#: Distance of a multiplier from the unit circle that rounding can't make.
MARGINAL = 1e-7
#: Mismatch up to which a stiff orbit may amplify rounding.
AMPLIFIED = 1e-9
#: Iterates after which a trajectory of an inexact map has settled, and returns whose mean is taken then.
FOLLOWED, LAST = 400, 8
#: Scatter of the returns to one place, in units of the map's noise, that its errors may make; places lie so many scatters apart.
JITTER, APART = 2.0, 5.0
#: Scatter below which nothing is looked for in it.
SHOWING = 1e-6
#: A step shorter than this times the scale is rounding.
SHORTEST = 1e-15


@dataclass(frozen=True)
class Orbit:
    """An orbit of period n of a map with D states.

    Attributes
    ----------
    points : float64[n, D]
        Its points, in the order in which they are visited; the first is the smallest in the first state.
    monodromy : float64[n, D, D]
        Derivative of the n-th return at each of them.
    multipliers : complex128[D]
        Its eigenvalues, the largest first.
    mismatch : float
        Largest distance between a point and its n-th image, in units of the scale.
    """

    points: np.ndarray
    monodromy: np.ndarray
    multipliers: np.ndarray
    mismatch: float

    @property
    def period(self) -> int:
        """n."""
        return len(self.points)

    @property
    def stable(self) -> bool:
        """Whether all multipliers lie inside the unit circle, by more than rounding."""
        return bool(np.abs(self.multipliers[0]) < 1.0 - MARGINAL)

    @property
    def exponent(self) -> float:
        """Largest Lyapunov exponent [per iterate]."""
        largest = abs(self.multipliers[0])
        return math.log(largest) / self.period if largest > 0 else -math.inf


def polish(map_: Map, start: np.ndarray, n: int, scale: np.ndarray) -> Orbit | None:
    """The periodic orbit near a point, if Newton's method finds one.

    Parameters
    ----------
    map_ : Map
        The map.
    start : float64[D]
        A point near the orbit.
    n : int
        Its period; the result has the smallest period that divides n.
    scale : float64[D]
        Range of each state.

    Returns
    -------
    Orbit or None
    """
    if not map_.exact:
        return _followed(map_, start, n, scale)
    x = np.array(start, float)
    for _ in range(MOST_STEPS):
        end, matrix = map_.tangent(x[None], n)
        if not np.isfinite(matrix).all():
            return None
        try:
            step = np.linalg.solve(np.eye(len(x)) - matrix[0], end[0] - x)
        except np.linalg.LinAlgError:
            return None
        x = x + step
        length = np.abs(step / scale).max()
        if not length < 1.0:
            return None
        if length < SHORTEST:
            break
    return _closed(map_, x, n, scale)


def _followed(map_: Map, start: np.ndarray, n: int, scale: np.ndarray) -> Orbit | None:
    """The orbit that a trajectory of an inexact map settles on: the mean of its last returns.

    ode45 restarted at every period has another fixed point than ode45 that goes on: a twentieth of the range apart at (1e-4, 1e-7) where
    damping is weak. What a run settles on is its attractor.
    """
    returns = max(-(-FOLLOWED // n), 2 * LAST)
    mean = mean_orbit(map_.launch(start[None], returns * n + 1).advance(returns * n + 1)[0, :-1], n, scale, map_.noise)
    return None if mean is None else _orbit(map_, *mean)


def mean_orbit(trail: np.ndarray, n: int, scale: np.ndarray, noise: float) -> tuple[np.ndarray, float] | None:
    """The orbit that the end of a trail of an inexact map lies on, and how far the trail lies from it; None if it lies on none.

    Parameters
    ----------
    trail : float64[m, D]
        States one iterate apart, at least 16 n of them.
    n : int
        Iterates after which they nearly recur.
    scale : float64[D]
        Range of each state.
    noise : float
        Errors of the map, in units of the scale.
    """
    last = trail[-LAST * n :]
    points, scatter = _mean(last, n, scale)
    if not scatter <= JITTER * noise:
        return None
    double, less = _mean(last, 2 * n, scale)
    if scatter > SHOWING and less < 0.25 * scatter:  # two loops that lie side by side
        points = double
    parts = [m for m in range(1, len(points) + 1) if len(points) % m == 0]
    apart = [np.abs((np.roll(points, -m, axis=0) - points) / scale).max() for m in parts]
    points, scatter = _mean(last, parts[int(np.argmax(np.array(apart) <= noise))], scale)  # loops that its errors alone part are one
    return (points, scatter) if _spacing(points, scale) >= APART * scatter else None


def _spacing(points: np.ndarray, scale: np.ndarray) -> float:
    """Least distance between two of the points, in units of the scale; inf for one point."""
    distances = np.abs((points[:, None] - points[None]) / scale).max(axis=2)
    return float((distances + np.diag(np.full(len(points), np.inf))).min())


def _mean(points: np.ndarray, n: int, scale: np.ndarray) -> tuple[np.ndarray, float]:
    """Mean of the returns of period n in float64[m n, D], float64[n, D], and how far one lies from it at most."""
    returns = points.reshape(-1, n, points.shape[1])
    mean = returns.mean(axis=0)
    return mean, float(np.abs((returns - mean) / scale).max())


def _closed(map_: Map, x: np.ndarray, n: int, scale: np.ndarray) -> Orbit | None:
    """The orbit through a point, if it comes back."""
    points = np.concatenate([x[None], map_.launch(x[None], n).advance(n)[0]])
    distances = np.abs((points[1:] - x) / scale).max(axis=1)
    if not np.isfinite(distances).all() or distances[-1] > min(map_.noise * _stiffness(map_, x, n, scale), AMPLIFIED):
        return None
    n = 1 + int(np.argmax(distances <= max(10 * distances[-1], map_.noise)))
    return _orbit(map_, points[:n], float(distances[n - 1]))


def _orbit(map_: Map, points: np.ndarray, mismatch: float) -> Orbit | None:
    """An orbit from its points: which is the first, monodromy, multipliers."""
    points = np.roll(points, -int(np.lexsort(points.T[::-1])[0]), axis=0)
    _, matrices = map_.tangent(points, len(points))
    if not np.isfinite(matrices).all():
        return None
    values = np.linalg.eigvals(matrices[0])
    order = np.lexsort((-values.imag, -np.round(np.abs(values), 12)))
    return Orbit(points, matrices, values[order], mismatch)


def _stiffness(map_: Map, x: np.ndarray, n: int, scale: np.ndarray) -> float:
    """How much the return amplifies rounding."""
    _, matrix = map_.tangent(x[None], n)
    return max(1.0, float(np.abs(matrix * scale / scale[:, None]).max())) if np.isfinite(matrix).all() else 1.0


def same(a: Orbit, b: Orbit, scale: np.ndarray, tolerance: float) -> bool:
    """Whether two orbits are one, or one the other several times over: each point of one lies on the other."""
    if max(a.period, b.period) % min(a.period, b.period):
        return False
    distances = np.abs((a.points[:, None] - b.points[None]) / scale).max(axis=2).min(axis=1)
    return bool(distances.max() < tolerance)
