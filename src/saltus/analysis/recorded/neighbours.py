"""Growth of the distance between neighbours on a trajectory: the fixed evolution time program of
Wolf et al.

A point of the trajectory and a neighbour of it are followed for a fixed time, one evolution, and
the growth of their distance is noted. Then a new neighbour takes over, close to the point and in
the direction in which the old one lies. Wolf, Swift, Swinney & Vastano, Physica D 16 (1985)
285-317, section 5 and appendix B.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

#: Neighbours of a point within the default largest distance: enough that one of them lies in the
#: old direction.
CROWD = 20
#: Points for which this distance is measured, evenly spread.
ASKED = 200
#: Largest angle of a first replacement [rad] (Wolf's value).
ANGLE = 0.3
#: Widenings of the largest distance before the angle is doubled (Wolf's value).
WIDENINGS = 5


@dataclass(frozen=True)
class Evolutions:
    """The evolutions of one fiducial trajectory.

    Attributes
    ----------
    growth : float64[m]
        Logarithm of the growth of the distance in each.
    distance : float64[m]
        Distance at the beginning of each.
    angle : float64[m]
        Angle between the old neighbour and the new one [rad]; NaN where none replaced it.
    """

    growth: np.ndarray
    distance: np.ndarray
    angle: np.ndarray


@dataclass(frozen=True)
class NeighbourSearch:
    """Limits of the search for neighbours.

    Attributes
    ----------
    evolve : int
        Samples of an evolution.
    smallest, largest : float
        Distances between which a new neighbour lies, in units of the points.
    exclude : int
        Samples around a point that are no neighbours of it: they lie on the same stretch of it.
    """

    evolve: int
    smallest: float
    largest: float
    exclude: int


def crowd_distance(points: np.ndarray, smallest: float, exclude: int) -> float:
    """Median distance to the 20th allowed neighbour; inf if most points have fewer."""
    tree = cKDTree(points)
    asked = np.unique(np.linspace(0, len(points) - 1, ASKED).round().astype(int))
    return float(np.median([_crowd(points, tree, here, smallest, exclude) for here in asked]))


def _crowd(points: np.ndarray, tree: cKDTree, index: int, smallest: float, exclude: int) -> float:
    """Distance of a point to its 20th allowed neighbour; the tree returns more neighbours until
    there are enough, at last all.
    """
    for count in (4 * CROWD, 16 * CROWD, len(points)):
        if count < len(points) // 8:
            distances, places = tree.query(points[index], k=count)
        else:
            distances = np.linalg.norm(points - points[index], axis=1)
            places = np.arange(len(points))
        allowed = distances[(np.abs(places - index) > exclude) & (distances >= smallest)]
        if len(allowed) >= CROWD:
            return float(np.partition(allowed, CROWD - 1)[CROWD - 1])
    return math.inf


def follow(points: np.ndarray, search: NeighbourSearch) -> Evolutions:
    """The evolutions of the trajectory float64[n, m], from its first point with a neighbour on;
    empty if none has one.
    """
    return _Chase(points, search).run()


class _Chase:
    """A fiducial point and its neighbour, moving along the trajectory."""

    def __init__(self, points: np.ndarray, search: NeighbourSearch):
        self._points, self._search = points, search
        # a neighbour must be able to go on
        self._tree = cKDTree(points[: len(points) - search.evolve])

    def run(self) -> Evolutions:
        search, points = self._search, self._points
        rows: list[tuple[float, float, float]] = []
        neighbour, angle = None, math.nan
        for index in range(0, len(points) - search.evolve, search.evolve):
            if neighbour is None:
                neighbour, angle = self._nearest(index), math.nan
            if neighbour is None:
                continue
            there = index + search.evolve, neighbour + search.evolve
            before, after = points[neighbour] - points[index], points[there[1]] - points[there[0]]
            distance, later = float(np.linalg.norm(before)), float(np.linalg.norm(after))
            # on one another: neither growth nor direction is defined
            if later == 0.0 or distance == 0.0:
                neighbour = None
                continue
            rows.append((math.log(later / distance), distance, angle))
            neighbour, angle = self._replacement(there, after / later)
        return Evolutions(*np.array(rows).reshape(-1, 3).T)

    def _nearest(self, index: int) -> int | None:
        """The nearest allowed neighbour of a point."""
        radius = self._search.largest
        for _ in range(WIDENINGS):
            places, distances, _ = self._around(index, radius)
            if len(places):
                return int(places[distances.argmin()])
            radius += self._search.largest
        return None

    def _replacement(
        self, there: tuple[int, int], direction: np.ndarray
    ) -> tuple[int | None, float]:
        """The neighbour that replaces the old one: the one that turns least, close by if possible;
        the old one if there is no other.
        """
        index, old = there
        if index >= len(self._points) - self._search.evolve:
            return None, math.nan
        limit = ANGLE
        while limit < math.pi:
            for widening in range(1, WIDENINGS + 1):
                places, distances, offsets = self._around(index, widening * self._search.largest)
                if len(places):
                    angles = np.arccos(np.minimum(np.abs(offsets @ direction) / distances, 1.0))
                    best = int(angles.argmin())
                    if angles[best] < limit:
                        return int(places[best]), float(angles[best])
            limit *= 2.0
        return (old if old < len(self._points) - self._search.evolve else None), math.nan

    def _around(self, index: int, radius: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Allowed neighbours of a point within a radius, their distances and offsets."""
        point = self._points[index]
        places = np.array(self._tree.query_ball_point(point, radius, return_sorted=True), np.int64)
        places = places[np.abs(places - index) > self._search.exclude]
        offsets = self._points[places] - point
        distances = np.linalg.norm(offsets, axis=1)
        far = distances >= self._search.smallest
        return places[far], distances[far], offsets[far]
