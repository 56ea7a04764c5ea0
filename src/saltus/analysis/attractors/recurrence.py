"""Periods of trajectories of a map, by how nearly they recur, and the orbits that these are on
their way to.
"""

from __future__ import annotations

import numpy as np

from saltus.analysis.attractors.growth import NEWTON, tangent_cost
from saltus.analysis.closed.motions import ClosedMotions
from saltus.analysis.closed.orbits import find_orbits, neutral_orbits
from saltus.analysis.solve.tolerances import LONGEST, NEAR, ROUND
from saltus.flow.maps import Map

#: Distance between points a period apart, in units of the scale, that means that they are the same.
REPEATS = 1e-6
#: Parts of the points of a motion, in which largest distances are compared.
PARTS = 4
#: Largest share to which these shrink from part to part where a motion settles.
APPROACHING = 0.9


def recurrence(points: np.ndarray, scale: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """For trajectories float64[k, m, D]: the smallest n that repeats nearly as well as the best,
    and how well, in units of the scale.
    """
    last = points[:, -1]
    candidates = []
    with np.errstate(invalid="ignore"):  # those that ran away
        for n in range(1, points.shape[1] // 2 + 1):
            now = np.abs((points[:, -1] - points[:, -1 - n]) / scale).max(axis=1)
            before = np.abs((points[:, -1 - n // 2] - points[:, -1 - n - n // 2]) / scale).max(
                axis=1
            )
            candidates.append(np.maximum(now, before))
    apart = np.stack(candidates, axis=1)
    apart = np.where(np.isfinite(apart), apart, np.inf)
    best = apart.min(axis=1)
    period = 1 + np.argmax(apart <= np.maximum(4.0 * best, 1e-12)[:, None], axis=1)
    return period, np.where(
        np.isfinite(last).all(axis=1), apart[np.arange(len(points)), period - 1], np.inf
    )


def late_periods(points: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Periods of trajectories float64[k, m, D] that settle to an orbit of more than LONGEST
    iterates, and m/2 at most, int64[k]; 0 of others.

    Points that lie n iterates apart keep their distance on a torus, however near to each other they
    are. Here they coincide, or approach one another by a share in each part of the points. Those
    that lie fewer apart don't: that would be a slow way round a shorter orbit.
    """
    period, apart = recurrence(points, scale)
    nearest = recurrence(points[:, -ROUND:], scale)[0]
    for i in np.flatnonzero((period > LONGEST) & (apart < NEAR)):
        ways = _ways(points[i], scale[i], int(period[i]))
        settles = ways[-1] < REPEATS or (ways[-1] < NEAR and _approaching(ways))
        if not settles or _approaching(_ways(points[i], scale[i], int(nearest[i]))):
            period[i] = 0
    return np.where((period > LONGEST) & (apart < NEAR), period, 0)


def _ways(points: np.ndarray, scale: np.ndarray, n: int) -> np.ndarray:
    """Largest distance between points float64[m, D] that lie n apart, in each of the last parts of
    them, float64[PARTS].
    """
    part = len(points) // (2 * PARTS)
    apart = np.abs((points[n:] - points[:-n]) / scale).max(axis=1)[-PARTS * part :]
    ways: np.ndarray = apart.reshape(PARTS, part).max(axis=1)
    return ways


def _approaching(ways: np.ndarray) -> bool:
    return bool((ways[1:] < APPROACHING * ways[:-1]).all())


def recurring_orbits(
    map_: Map, points: np.ndarray, scale: np.ndarray, near: float, purse: np.ndarray | None = None
) -> tuple[ClosedMotions, np.ndarray, np.ndarray]:
    """The orbits of trajectories that nearly recur.

    Parameters
    ----------
    map_ : Map
        The map, with a row for each trajectory or one for all.
    points : float64[k, m, D]
        Trajectories, of which the last points count.
    scale : float64[k, D]
        Range of each state in the motion.
    near : float
        Recurrence that is worth a try by Newton's method; more where errors of the map keep orbits
        from closing.
    purse : float64[k], optional
        What closing orbits may cost [iterates]. What it costs is taken off; a trajectory that can't
        pay isn't tried.

    Returns
    -------
    orbits : ClosedMotions
        What was found from the last points, k of them.
    apart, noise : float64[k]
        How nearly each recurs, and the noise of the map, in units of the scale.
    """
    period, apart = recurrence(points, scale)
    noise, result = map_.noise_of(scale), ClosedMotions.none(len(points), points.shape[2])
    price = NEWTON * period * tangent_cost(points.shape[2])
    purse = np.full(len(points), np.inf) if purse is None else purse
    ready = np.flatnonzero((apart < np.maximum(near, noise)) & (price <= purse))
    purse[ready] -= price[ready]
    for find in (find_orbits, neutral_orbits):
        result.put(
            ready,
            find(map_.rows(ready), points[ready, -1], period[ready], scale[ready], noise[ready]),
        )
        ready = ready[~result.stable[ready]]
    return result, apart, noise
