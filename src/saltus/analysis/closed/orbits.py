"""Periodic orbits of maps, many at a time: closed by Newton's method, with their multipliers.

Newton on P^n(x) - x = 0 with the derivative from the tangent flow; Parker & Chua, Practical
Numerical Algorithms for Chaotic Systems (1989), chapter 5. Orbits of an inexact map (ode45's) are
followed instead: ode45 restarted at every period has another fixed point than ode45 that goes on, a
twentieth of the range apart at (1e-4, 1e-7) where damping is weak. What a run settles on is its
attractor.
"""

from __future__ import annotations

import numpy as np

from saltus.analysis.closed.field_zeros import autonomous
from saltus.analysis.closed.motions import ClosedMotions, from_smallest, least_period
from saltus.analysis.closed.shooting import Shooting
from saltus.analysis.solve.newton import leading_first, newton
from saltus.analysis.solve.tolerances import (
    AMPLIFIED,
    APART,
    AVERAGED_RETURNS,
    JITTER,
    LONGEST,
    MARGINAL,
    MAX_NEWTON_STEPS,
    ROUNDING,
    SAME,
    SETTLING_ITERATES,
    SHOWING,
)
from saltus.flow.maps import Map, Stroboscope

#: Share of an interval between two looks that no turn of a motion fits into.
ASIDE = 0.381966


def find_orbits(
    map_: Map,
    start: np.ndarray,
    n: np.ndarray,
    scale: np.ndarray,
    noise: np.ndarray,
    max_slow: int = MAX_NEWTON_STEPS,
    isolated: bool = True,
) -> ClosedMotions:
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
    isolated : bool
        Whether they are. Of others the nearest is taken: each step is the shortest.
    """
    result = ClosedMotions.none(*start.shape)
    if not len(start):
        return result
    if map_.exact:
        rows, points, mismatch = _closed(map_, start, n, scale, max_slow, isolated)
    else:
        rows, points, mismatch = _averaged(map_, start, n, scale, noise)
    points = [from_smallest(one) for one in points]
    period = np.array([len(one) for one in points], np.int64)
    if len(rows):
        _, monodromy = map_.rows(rows).tangent(np.array([one[0] for one in points]), period)
        multipliers = leading_first(monodromy)
        for i in np.flatnonzero(np.isfinite(multipliers).all(axis=1)):
            row = rows[i]
            result.period[row], result.multipliers[row] = period[i], multipliers[i]
            result.points[row, : period[i]], result.mismatch[row] = points[i], mismatch[i]
    return result


def neutral_orbits(
    map_: Map, start: np.ndarray, n: np.ndarray, scale: np.ndarray, noise: np.ndarray
) -> ClosedMotions:
    """The orbits near states that nearly recur, of those that aren't isolated: see
    :attr:`ClosedMotions.neutral`. Arguments are those of :func:`find_orbits`. Without forcing those
    that rest.

    What static friction holds somewhere in an interval stays anywhere else in it too, and so does a
    joint that nothing makes yield, or a body that no spring ties to a place.
    """
    result = ClosedMotions.none(*start.shape)
    if not map_.exact or not len(start):
        return result
    near = leading_first(map_.tangent(start, n)[1])
    with np.errstate(invalid="ignore"):
        rows = np.flatnonzero((np.abs(near - 1.0) < MARGINAL).any(axis=1))
    orbits = find_orbits(
        map_.rows(rows), start[rows], n[rows], scale[rows], noise[rows], isolated=False
    )
    kept = orbits.neutral
    if kept.any() and isinstance(map_, Stroboscope) and autonomous(map_.system):
        first, own = orbits.points[kept, 0], map_.rows(rows[kept])
        ends = own.with_period(ASIDE * own.period).ends(first, 1)[0]
        kept[kept] = np.abs((ends - first) / scale[rows[kept]]).max(axis=1) < ROUNDING
    result.put(rows[kept], orbits.rows(kept))
    return result


def _closed(
    map_: Map,
    start: np.ndarray,
    n: np.ndarray,
    scale: np.ndarray,
    max_slow: int,
    isolated: bool,
) -> tuple[np.ndarray, list[np.ndarray], np.ndarray]:
    """Rows that Newton's method closes, int64[m], the points of their orbits, float64[n, D] each,
    and their mismatch, float64[m].
    """
    guess = Shooting(map_, np.arange(len(start)), start[:, None], scale, iterates=n)
    zeros = newton(
        guess, guess.unknowns, guess.units, max_slow=max_slow, least_squares=not isolated
    )
    x, rows = zeros.z, np.flatnonzero(zeros.found)
    if not len(rows):
        return rows, [], np.zeros(0)
    points = np.concatenate(
        [x[rows][:, None], map_.rows(rows).launch(x[rows], LONGEST).advance(int(n[rows].max()))],
        axis=1,
    )
    distance = np.abs((points[:, 1:] - points[:, :1]) / scale[rows, None]).max(axis=2)
    last = distance[np.arange(len(rows)), n[rows] - 1]
    closes = np.flatnonzero(last < AMPLIFIED)
    orbits = [
        points[i, : _period(points[i, :m], scale[row])]
        for i, row, m in zip(closes, rows[closes], n[rows[closes]], strict=True)
    ]
    lengths = np.array([len(one) for one in orbits], np.int64)
    return rows[closes], orbits, distance[closes, lengths - 1]


def _period(points: np.ndarray, scale: np.ndarray, enough: float = SAME) -> int:
    """The least period of one orbit float64[n, D]."""
    return int(least_period(points[None], scale, enough)[0])


def _averaged(
    map_: Map, start: np.ndarray, n: np.ndarray, scale: np.ndarray, noise: np.ndarray
) -> tuple[np.ndarray, list[np.ndarray], np.ndarray]:
    """Trajectories of inexact maps that settle on an orbit, the means of their last returns, and
    the scatter of these.

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
    # loops that its errors alone part are one
    points, scatter = _mean(last, _period(points, scale, noise), scale)
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
