"""Motions that are on their way to an orbit, but still too far from it to be taken for periodic:
their largest exponent is hardly below zero, as that of a quasi-periodic motion seems to be.
"""

from __future__ import annotations

import math

import numpy as np

from saltus.analysis.attractors.growth import BUDGET, NEWTON, tangent_cost
from saltus.analysis.attractors.recurrence import recurrence
from saltus.analysis.closed.motions import ClosedMotion
from saltus.analysis.closed.orbits import find_orbits
from saltus.analysis.solve.tolerances import ROUND
from saltus.flow.maps import Map

#: Parts of the points of a motion, whose largest distances from an orbit are compared.
PARTS = 4
#: A way that shrinks to this share of itself, from the first part to the last, is an approach. That
#: of a motion which doesn't settle stays as long as it is, but for the chance of few points.
APPROACHING = 0.75


def may_settle(map_: Map, points: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """True for motions that settle to an orbit, or may do so too slowly to be seen: an attracting
    orbit is found from their last points, and either their distance from it shrinks in each quarter
    of the points, or its multipliers shrink nothing visibly in so short a time.

    Parameters
    ----------
    map_ : Map
        The map, with a row for each trajectory or one for all.
    points : float64[k, m, D]
        Trajectories, m >= 64. Closing orbits costs BUDGET times m iterates of each at most.
    scale : float64[k, D]
        Range of each state.

    Returns
    -------
    bool[k]
    """
    found, span = np.zeros(len(points), bool), points.shape[1]
    finite = np.flatnonzero(np.isfinite(points).all(axis=(1, 2)))
    nearest = np.ones(len(points), np.int64)
    nearest[finite] = recurrence(points[finite, -ROUND:], scale[finite])[0]
    for n in (np.ones_like(nearest), nearest):
        payable = NEWTON * n * tangent_cost(points.shape[2]) <= BUDGET * span
        rows = finite[~found[finite] & payable[finite]]
        noise = map_.noise_of(scale)[rows]
        orbits = find_orbits(map_.rows(rows), points[rows, -1], n[rows], scale[rows], noise)
        for row, orbit, stable in zip(rows.tolist(), orbits, orbits.stable, strict=True):
            found[row] = stable and (
                _approaches(points[row], orbit, scale[row]) or _is_slow(orbit, span)
            )
    return found


def _approaches(points: np.ndarray, orbit: ClosedMotion, scale: np.ndarray) -> bool:
    """True where the distance of a motion float64[m, D] from an orbit shrinks from part to part."""
    distance = np.abs((points[:, None] - orbit.points[None]) / scale).max(axis=2).min(axis=1)
    ways = np.array([part.max() for part in np.array_split(distance, PARTS)])
    return bool((np.diff(ways) < 0).all() and ways[-1] < APPROACHING * ways[0])


def _is_slow(orbit: ClosedMotion, span: int) -> bool:
    """True where an orbit attracts too slowly for its approach to be seen in so many iterates."""
    return orbit.exponent * span * (1 - 1 / PARTS) > math.log(APPROACHING)
