"""Portraits of attractors: size, contacts, itinerary, margin to the next graze, stability - the
columns of the attractor table.
"""

from __future__ import annotations

import numpy as np

from saltus.analysis.attractors.aperiodic import SampledAttractor
from saltus.analysis.attractors.attractor_set import AttractorSet
from saltus.analysis.attractors.limit_cycles import cycle_of
from saltus.analysis.attractors.noisy import Noisy
from saltus.analysis.closed.cycles import ASIDE
from saltus.analysis.closed.field_zeros import autonomous, find_equilibria
from saltus.analysis.closed.measures import Measures, measure, unknown
from saltus.analysis.closed.unforced import rest
from saltus.flow.maps import Map, Stroboscope
from saltus.results import AttractorTable
from saltus.results.dataset.kinds import Kind

#: Periods of an attractor that never repeats: what its numbers are taken from, and what is kept of
#: it.
APERIODIC_PERIODS = 256


def portraits(map_: Map, found: AttractorSet) -> AttractorTable:
    """The table of attractors, in the order of their ids.

    Parameters
    ----------
    map_ : Map
        The map; a flow's stroboscope shows what happens between its points, another map only the
        points.
    found : AttractorSet
        The attractors.
    """
    if isinstance(map_, Stroboscope) and autonomous(map_.system):
        return _unforced(map_, found)
    size, per_second = len(map_.states), 1.0 / float(map_.period[0])
    orbits = [
        *found.orbits,
        *(one.orbit if isinstance(one, Noisy) else None for one in found.sampled),
    ]
    period = np.array([0 if orbit is None else orbit.period for orbit in orbits], np.int64)
    start = np.array(
        [*(orbit.points[0] for orbit in found.orbits), *map(_first, found.sampled)]
    ).reshape(-1, size)
    points = [
        *(orbit.points for orbit in found.orbits),
        *(one.points[:APERIODIC_PERIODS] for one in found.sampled),
    ]
    nothing = np.full(size, np.nan + 0j)
    numbers = _numbers(map_, start, period, points)
    scatter = np.array(
        [
            one.scatter[0] if isinstance(one, Noisy) else np.nan
            for one in (*found.orbits, *found.sampled)
        ]
    )
    noisy = np.flatnonzero(np.isfinite(scatter))
    if len(noisy) and map_.exact_map is not None:
        numbers.put(
            noisy, _numbers(map_.exact_map, start[noisy], period[noisy], [points[i] for i in noisy])
        )
    return AttractorTable(
        kind=[*(Kind.PERIODIC.word for _ in found.orbits), *(one.kind for one in found.sampled)],
        period=period,
        contacts=numbers.contacts * np.maximum(period, 1),
        itinerary=numbers.itinerary,
        peak=numbers.peak[:, 0],
        rms=numbers.rms[:, 0],
        margin=numbers.margin,
        multipliers=np.array(
            [nothing if orbit is None else orbit.multipliers for orbit in orbits]
        ).reshape(-1, size),
        exponent=per_second
        * np.array(
            [*(orbit.exponent for orbit in found.orbits), *(one.exponent for one in found.sampled)]
        ),
        exponent_error=per_second
        * np.array([*(0.0 for _ in found.orbits), *(one.exponent_error for one in found.sampled)]),
        points=points,
        scatter=scatter if len(noisy) else None,
    )


def _first(one: SampledAttractor) -> np.ndarray:
    """A point on an attractor that is known by where it goes: of one that never repeats its last,
    when it has settled the most.
    """
    return np.asarray(one.points[0] if isinstance(one, Noisy) else one.points[-1])


def _unforced(map_: Stroboscope, found: AttractorSet) -> AttractorTable:
    """The table of a system without forcing: equilibria, limit cycles, and what never repeats."""
    size, rests = len(map_.states), len(found.orbits)
    kind = np.array(
        [*(Kind.EQUILIBRIUM.word for _ in found.orbits), *(one.kind for one in found.sampled)],
        dtype=np.str_,
    )
    start = np.array(
        [*(orbit.points[0] for orbit in found.orbits), *(one.points[-1] for one in found.sampled)]
    ).reshape(-1, size)
    points = [
        *(orbit.points[:1] for orbit in found.orbits),
        *(one.points[:APERIODIC_PERIODS] for one in found.sampled),
    ]
    cycle, multipliers, eigenvalues = (
        np.full(len(kind), np.nan),
        *np.full((2, len(kind), size), np.nan + 0j),
    )
    exponent, error = (
        np.array(
            [(0.0, 0.0)] * rests + [(one.exponent, one.exponent_error) for one in found.sampled]
        )
        .reshape(-1, 2)
        .T
    )
    exponent, error = exponent / map_.period, error / map_.period
    still = find_equilibria(map_.rows(np.arange(rests)), start[:rests], np.ones((rests, size)))
    for i in range(rests):
        points[i] = start[i : i + 1] = (
            still.place[i : i + 1] if np.isfinite(still.place[i]).all() else start[i : i + 1]
        )
        eigenvalues[i], exponent[i] = still.eigenvalues[i], still.eigenvalues[i, 0].real
    for i in np.flatnonzero(kind == Kind.LIMIT_CYCLE.word).tolist():
        one = cycle_of(map_, found.sampled[i - rests])
        cycle[i], multipliers[i], points[i], start[i] = (
            one.time[0],
            one.multipliers[0],
            one.points[0],
            one.points[0, ASIDE],
        )
    own = map_.rows(np.arange(len(kind))).with_period(
        np.where(np.isfinite(cycle), cycle, map_.period)
    )
    numbers = measure(
        own,
        start,
        np.isin(kind, (Kind.EQUILIBRIUM.word, Kind.LIMIT_CYCLE.word)).astype(np.int64),
        APERIODIC_PERIODS,
    )
    rest(map_.rows(np.arange(rests)), start[:rests], np.arange(rests), numbers)
    return AttractorTable(
        kind=kind.tolist(),
        period=np.zeros(len(kind), np.int64),
        contacts=numbers.contacts,
        itinerary=numbers.itinerary,
        peak=numbers.peak[:, 0],
        rms=numbers.rms[:, 0],
        margin=numbers.margin,
        multipliers=multipliers,
        exponent=exponent,
        exponent_error=error,
        points=points,
        cycle=cycle,
        eigenvalues=eigenvalues,
    )


def _numbers(
    map_: Map, start: np.ndarray, period: np.ndarray, points: list[np.ndarray]
) -> Measures:
    """The numbers of attractors from a point on each."""
    if isinstance(map_, Stroboscope):
        return measure(map_.rows(np.arange(len(start))), start, period, APERIODIC_PERIODS)
    return _of_points(points, start.shape[1])


def _of_points(points: list[np.ndarray], size: int) -> Measures:
    """The numbers of attractors of a map that has nothing between its points."""
    result = unknown(len(points), size)
    result.contacts[:] = 0.0
    for i, one in enumerate(points):
        result.maximum[i], result.minimum[i] = one.max(axis=0), one.min(axis=0)
        result.mean[i], result.deviation[i] = one.mean(axis=0), one.std(axis=0)
    return result
