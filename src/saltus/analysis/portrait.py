"""Portraits of attractors: size, contacts, itinerary, margin to the next graze, stability - the columns of the attractor table."""

from __future__ import annotations

import math

import numpy as np

from saltus.analysis.orbit_measures import Measures, measure, unknown
from saltus.analysis.orbits import Orbit
from saltus.analysis.recurrence import Found
from saltus.flow.maps import Map, Stroboscope
from saltus.results import AttractorTable

#: Periods of an attractor that never repeats: what its numbers are taken from, and what is kept of it.
WANDERED = 256


def portraits(map_: Map, found: Found) -> AttractorTable:
    """The table of attractors, in the order of their ids.

    Parameters
    ----------
    map_ : Map
        The map; a flow's stroboscope shows what happens between its points, another map only the points.
    found : Found
        The attractors.
    """
    size, per_second = len(map_.states), 1.0 / map_.period
    period = np.array([*(orbit.period for orbit in found.orbits), *(0 for _ in found.wandering)], np.int64)
    start = np.array([*(orbit.points[0] for orbit in found.orbits), *(one.points[-1] for one in found.wandering)]).reshape(-1, size)
    points = [*(orbit.points for orbit in found.orbits), *(one.points[:WANDERED] for one in found.wandering)]
    numbers = _numbers(map_, start, period, points)
    nothing = np.full(size, np.nan + 0j)
    return AttractorTable(
        kind=[*("periodic" for _ in found.orbits), *(one.kind for one in found.wandering)],
        period=period,
        contacts=numbers.contacts * np.maximum(period, 1),
        itinerary=numbers.itinerary,
        peak=numbers.peak[:, 0],
        rms=numbers.rms[:, 0],
        margin=numbers.margin,
        multipliers=np.array([*(orbit.multipliers for orbit in found.orbits), *(nothing for _ in found.wandering)]).reshape(-1, size),
        exponent=per_second * np.array([*map(_orbit_exponent, found.orbits), *(one.exponent for one in found.wandering)]),
        exponent_error=per_second * np.array([*(0.0 for _ in found.orbits), *(one.exponent_error for one in found.wandering)]),
        points=points,
    )


def _orbit_exponent(orbit: Orbit) -> float:
    """Largest Lyapunov exponent per iterate."""
    largest = abs(orbit.multipliers[0])
    return math.log(largest) / orbit.period if largest > 0 else -math.inf


def _numbers(map_: Map, start: np.ndarray, period: np.ndarray, points: list[np.ndarray]) -> Measures:
    """The numbers of attractors from a point on each."""
    if isinstance(map_, Stroboscope):
        return measure(map_.family(len(start)), start, period, WANDERED)
    return _of_points(points, start.shape[1])


def _of_points(points: list[np.ndarray], size: int) -> Measures:
    """The numbers of attractors of a map that has nothing between its points."""
    result = unknown(len(points), size)
    result.contacts[:] = 0.0
    for i, one in enumerate(points):
        result.maximum[i], result.minimum[i] = one.max(axis=0), one.min(axis=0)
        result.mean[i], result.deviation[i] = one.mean(axis=0), one.std(axis=0)
    return result
