"""Edge tracking: the unstable orbit on the boundary of a basin, from a start on either side.

The two starts are brought together by bisection, then both followed until they part; they have
shadowed a trajectory on the boundary, and are brought together again where they stand. On the
boundary only its own attractor is left: mostly a saddle, which Newton's method closes. Skufca,
Yorke & Eckhardt, Phys. Rev. Lett. 96 (2006) 174101; Battelino et al., Physica D 32 (1988) 296-305.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from saltus.analysis.attractors.aperiodic import SampledMotion
from saltus.analysis.attractors.attractor_set import AttractorSet
from saltus.analysis.attractors.find_attractors import find_attractors
from saltus.analysis.attractors.recurrence import recurrence
from saltus.analysis.closed.all_orbits import Orbits
from saltus.analysis.closed.motions import ClosedMotion
from saltus.analysis.closed.shooting import close
from saltus.flow.maps import Map

#: Points that are tried between the two at once.
BETWEEN = 15
#: Distance to which the two are brought together, in units of the scale.
TOGETHER = 1e-9
#: Distance from which on they have parted, in units of the scale.
PARTED = 1e-5
#: Most iterates on the boundary.
MOST = 256
#: Iterates before the first test for recurrence.
FIRST = 4
#: Recurrence on the boundary from which Newton's method is tried.
NEAR = 1e-2
#: Farthest that its orbit lies from there.
BESIDE = 0.1
#: Distance from the orbit, along its unstable direction, at which both sides are looked at.
ASIDE = 1e-6


@dataclass
class Edge:
    """Orbit on the boundary between two starts, and the attractors met.

    Attributes
    ----------
    found : AttractorSet
        The attractors that were met.
    sides : tuple of two int
        Ids of those that the two starts lead to; -1 where none was established.
    orbit : ClosedMotion or None
        The orbit on the boundary; None if no motion there repeated.
    beside : tuple of two int
        Ids of the attractors on the two sides of the orbit.
    iterates : int
        Iterates that the boundary was followed for.
    """

    found: AttractorSet
    sides: tuple[int, int]
    orbit: ClosedMotion | None = None
    beside: tuple[int, int] = (-1, -1)
    iterates: int = 0


class _Sides:
    """Attractors that states lead to, compared with that of the first start."""

    def __init__(self, map_: Map, ends: np.ndarray, scale: np.ndarray, most: int) -> None:
        self._map, self._scale, self._most = map_, scale, most
        self.found: AttractorSet | None = None
        self.first: ClosedMotion | SampledMotion | None = None
        self.first, self.second = self.of(ends)

    def of(self, states: np.ndarray) -> list[ClosedMotion | SampledMotion | None]:
        """The attractors of states float64[k, D]; None where none was established."""
        self.found, label, _ = find_attractors(
            self._map, states, self._scale, self._most, self.found
        )
        every = self.found.every
        return [every[i] if i >= 0 else None for i in label.tolist()]

    def number(self, one: ClosedMotion | SampledMotion | None) -> int:
        """The id of an attractor as they are now."""
        return -1 if one is None or self.found is None else self.found.index(one)

    def crossing(self, ends: np.ndarray) -> np.ndarray:
        """Two states float64[2, D] between these, TOGETHER apart: the first leads where the first
        start does, the second doesn't.
        """
        share = np.arange(1, BETWEEN + 1)[:, None] / (BETWEEN + 1)
        while np.abs((ends[1] - ends[0]) / self._scale).max() > TOGETHER:
            points = np.concatenate([ends[:1], ends[0] + share * (ends[1] - ends[0]), ends[1:]])
            here = [one is self.first for one in self.of(points[1:-1])]
            leaves = next((i for i, stays in enumerate(here) if not stays), BETWEEN)
            ends = points[leaves : leaves + 2]
        return ends


def follow_edge(
    map_: Map,
    ends: np.ndarray,
    scale: np.ndarray,
    most: int,
    progress: Callable[[float], None] | None = None,
) -> Edge:
    """The orbit on the boundary of the basin that the first of two starts lies in.

    Parameters
    ----------
    map_ : Map
        The map, with one row of values.
    ends : float64[2, D]
        Two starts.
    scale : float64[D]
        Range of each state.
    most : int
        Iterates after which a trajectory that hasn't settled is surveyed for chaos.
    progress : callable, optional
        Called with the share of the longest search that is done.
    """
    sides = _Sides(map_, ends, scale, most)
    orbit, points = None, np.zeros((0, len(scale)))
    if sides.first is not None and sides.second is not None and sides.first is not sides.second:
        while len(points) < MOST and orbit is None:
            if progress:
                progress(len(points) / MOST)
            ends = sides.crossing(ends)
            shadow, ends = _shadowed(map_, ends, scale, MOST - len(points))
            points = np.concatenate([points, shadow])
            orbit = _closed(map_, points, scale)
    beside = _beside(map_, orbit, scale, sides) if orbit is not None else (None, None)
    number = sides.number
    assert sides.found is not None
    return Edge(
        sides.found,
        (number(sides.first), number(sides.second)),
        orbit,
        (number(beside[0]), number(beside[1])),
        len(points),
    )


def _shadowed(
    map_: Map, ends: np.ndarray, scale: np.ndarray, longest: int
) -> tuple[np.ndarray, np.ndarray]:
    """Iterates on the boundary until the two have parted, float64[m, D], and where they stand."""
    travel, points = map_.rows(np.zeros(2, np.int64)).launch(ends, longest), [ends.mean(axis=0)]
    while len(points) < longest:
        ends = travel.advance(1)[:, 0]
        if not np.abs((ends[1] - ends[0]) / scale).max() < PARTED:
            break
        points.append(ends.mean(axis=0))
    return np.array(points), ends


def _closed(map_: Map, points: np.ndarray, scale: np.ndarray) -> ClosedMotion | None:
    """The orbit that iterates float64[m, D] on the boundary end on; None if there is none yet."""
    if len(points) < FIRST:
        return None
    period, apart = recurrence(points[None], scale)
    n = int(period[0])
    if not apart[0] < NEAR:
        return None
    guess = points[-n:]
    found = Orbits(map_, scale)
    found.take(close(found.guess(guess[None]))[1])
    near = [
        one
        for one in found.motions
        if np.abs((one.points - guess[-1]) / scale).max(axis=1).min() < BESIDE
        and abs(one.multipliers[0]) > 1.0
    ]
    return near[0] if near else None


def _beside(
    map_: Map, orbit: ClosedMotion, scale: np.ndarray, sides: _Sides
) -> list[ClosedMotion | SampledMotion | None]:
    """The attractors on the two sides of an orbit, along its most unstable direction."""
    n = orbit.period
    _, matrix = map_.tangent(orbit.points[:1], n)
    values, vectors = np.linalg.eig(matrix[0] * scale / scale[:, None])
    direction = vectors[:, np.argmax(np.abs(values))].real
    step = ASIDE * direction / np.abs(direction).max() * scale
    return sides.of(orbit.points[0] + np.array([[1.0], [-1.0]]) * step)
