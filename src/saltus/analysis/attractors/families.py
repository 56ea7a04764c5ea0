"""Attractors whose motions aren't isolated: families of periodic orbits, one beside the other.

Each start leads to an orbit of its own, such as one on which friction holds a body where that came
to rest. Orbits are of one family if the way from one to the other is the way in which nothing
grows or dies out: along the eigenvectors to the multiplier 1.
"""

from __future__ import annotations

import numpy as np

from saltus.analysis.attractors.attractor_set import AttractorSet
from saltus.analysis.attractors.recurrence import recurrence
from saltus.analysis.closed.motions import ClosedMotion
from saltus.analysis.closed.orbits import neutral_orbits
from saltus.analysis.solve.tolerances import MARGINAL, NEAR, SAME
from saltus.flow.maps import Map

#: Squarings of a derivative after which nothing is left of what dies out.
SQUARINGS = 24
#: Part of the way between two orbits of a family that may lead out of its direction: the family is
#: a curve.
BENT = 0.1
#: Most orbits with which another one is compared.
MEMBERS = 256


def on_families(
    map_: Map, points: np.ndarray, scale: np.ndarray, found: AttractorSet
) -> list[ClosedMotion | None]:
    """The attractor of each trajectory float64[k, m, D] that is on a family of orbits, None for
    others. A family is known by the orbit that was met first; new ones are added.
    """
    owners: list[ClosedMotion | None] = [None] * len(points)
    period, apart = recurrence(points, scale)
    rows = np.flatnonzero(apart < NEAR)
    ranges = np.broadcast_to(scale, (len(rows), len(scale)))
    orbits = neutral_orbits(
        map_, points[rows, -1], period[rows], ranges, np.full(len(rows), map_.noise)
    )
    near = orbits.distance(points[rows, -1], ranges) < 100 * NEAR
    new = [(int(rows[i]), orbits[i]) for i in np.flatnonzero((orbits.period > 0) & near).tolist()]
    if not new:
        return owners
    known = [one for one in found.orbits if is_neutral(one)]
    ways = _ways(map_, [orbit for _, orbit in new], scale)
    members = [(one, one) for one in known]
    for (row, orbit), way in zip(new, ways, strict=True):
        home = next((first for one, first in members if _beside(orbit, way, one, scale)), None)
        if home is None:
            found.orbits.append(home := orbit)
        owners[row] = home
        if len(members) < MEMBERS:
            members.append((orbit, home))
    return owners


def is_neutral(orbit: ClosedMotion) -> bool:
    """True of an attracting orbit that isn't isolated."""
    return bool(np.abs(orbit.multipliers[0] - 1.0) < MARGINAL)


def _ways(map_: Map, orbits: list[ClosedMotion], scale: np.ndarray) -> np.ndarray:
    """Projections onto what neither grows nor dies out at the first points, in units of the scale,
    float64[m, D, D].
    """
    start = np.array([one.points[0] for one in orbits])
    period = np.array([one.period for one in orbits], np.int64)
    derivative = map_.tangent(start, period)[1] * scale / scale[:, None]
    return np.linalg.matrix_power(derivative, 2**SQUARINGS)


def _beside(one: ClosedMotion, way: np.ndarray, other: ClosedMotion, scale: np.ndarray) -> bool:
    """True where another orbit is of the family of one, whose way at its first point is given."""
    if one.period != other.period:
        return False
    apart = (other.points - one.points[0]) / scale
    along = apart @ way.T
    off, length = np.abs(apart - along).max(axis=1), np.abs(along).max(axis=1)
    return bool((off <= np.maximum(BENT * length, SAME)).any())
