"""Portraits of attractors: size, contacts, itinerary, margin to the next graze, stability - the columns of the attractor table."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from saltus.analysis.looks import largest, margin
from saltus.analysis.orbits import Orbit
from saltus.analysis.recurrence import Found
from saltus.analysis.wandering import Wandering
from saltus.flow.maps import Map, Stroboscope
from saltus.kernels import status as st
from saltus.results import AttractorTable

#: Samples per period for peaks, rms and margins; extremes lie on a parabola through three of them.
SAMPLES = 1000
#: Periods of an attractor that never repeats; fewer samples, they don't repeat either.
WANDERED, WANDERED_SAMPLES = 256, 200


@dataclass(frozen=True)
class _Looks:
    """What one attractor looks like."""

    contacts: float
    itinerary: str
    peak: float
    rms: float
    margin: float


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
    looks = [*(_of_orbit(map_, orbit) for orbit in found.orbits), *(_of_wandering(map_, one) for one in found.wandering)]
    nothing = np.full(size, np.nan + 0j)
    return AttractorTable(
        kind=[*("periodic" for _ in found.orbits), *(one.kind for one in found.wandering)],
        period=np.array([*(orbit.period for orbit in found.orbits), *(0 for _ in found.wandering)], np.int64),
        contacts=np.array([one.contacts for one in looks]),
        itinerary=[one.itinerary for one in looks],
        peak=np.array([one.peak for one in looks]),
        rms=np.array([one.rms for one in looks]),
        margin=np.array([one.margin for one in looks]),
        multipliers=np.array([*(orbit.multipliers for orbit in found.orbits), *(nothing for _ in found.wandering)]).reshape(-1, size),
        exponent=per_second * np.array([*map(_orbit_exponent, found.orbits), *(one.exponent for one in found.wandering)]),
        exponent_error=per_second * np.array([*(0.0 for _ in found.orbits), *(one.exponent_error for one in found.wandering)]),
        points=[*(orbit.points for orbit in found.orbits), *(one.points[:WANDERED] for one in found.wandering)],
    )


def _orbit_exponent(orbit: Orbit) -> float:
    """Largest Lyapunov exponent per iterate."""
    largest = abs(orbit.multipliers[0])
    return math.log(largest) / orbit.period if largest > 0 else -math.inf


def _of_orbit(map_: Map, orbit: Orbit) -> _Looks:
    if isinstance(map_, Stroboscope):
        return _of_motion(map_, orbit.points[0], orbit.period, SAMPLES, 1)
    return _of_points(orbit.points)


def _of_wandering(map_: Map, one: Wandering) -> _Looks:
    if isinstance(map_, Stroboscope):
        return _of_motion(map_, one.points[-1], WANDERED, WANDERED_SAMPLES, WANDERED)
    return _of_points(one.points)


def _of_points(points: np.ndarray) -> _Looks:
    return _Looks(0.0, "", float(np.abs(points[:, 0]).max()), float(np.sqrt(np.mean(points[:, 0] ** 2))), math.nan)


def _of_motion(map_: Stroboscope, start: np.ndarray, periods: int, samples: int, responses: int) -> _Looks:
    states, outcome = map_.trajectory(start[None], periods, samples)
    motion = states[0].T
    crossings = outcome.record_integers[outcome.record_integers[:, st.REC_KIND] != st.GRAZE]
    names = [guard.name for guard in map_.system.guards]
    texts = [f"{names[row[st.REC_GUARD]]}{'+' if row[st.REC_DIRECTION] > 0 else '-'}" for row in crossings]
    return _Looks(
        contacts=len(crossings) / responses if map_.method.records_contacts else math.nan,
        itinerary=" ".join(texts) if responses == 1 else "",
        peak=float(largest(motion[0])),
        rms=float(np.sqrt(np.mean(motion[0] ** 2))),
        margin=float(margin(map_.system, map_.period * np.arange(periods * samples) / samples, motion, map_.system.values)),
    )
