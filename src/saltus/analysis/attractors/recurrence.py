"""Periods of trajectories of a map, by how nearly they recur, and the orbits that these are on
their way to.
"""

from __future__ import annotations

import numpy as np

from saltus.analysis.attractors.growth import NEWTON, tangent_cost
from saltus.analysis.closed.motions import ClosedMotions
from saltus.analysis.closed.orbits import find_orbits, neutral_orbits
from saltus.flow.maps import Map


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
