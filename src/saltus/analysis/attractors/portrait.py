"""Portraits of attractors: size, contacts, itinerary, margin to the next graze, stability - the
columns of the attractor table.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from saltus.analysis.attractors.aperiodic import SampledMotion
from saltus.analysis.attractors.attractor_set import AttractorSet
from saltus.analysis.attractors.limit_cycles import cycle_of
from saltus.analysis.attractors.noisy import Noisy
from saltus.analysis.closed.cycles import ASIDE
from saltus.analysis.closed.field_zeros import autonomous, find_equilibria
from saltus.analysis.closed.measures import Measures, measure, unknown
from saltus.analysis.closed.motions import ClosedMotion
from saltus.analysis.closed.unforced import eigenvalues_of, measure_equilibria
from saltus.analysis.inputs.outputs import outputs_of
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
    size, every = len(map_.states), found.every
    orbits = [one.orbit if isinstance(one, Noisy) else one for one in every]
    period = np.array(
        [one.period if isinstance(one, ClosedMotion) else 0 for one in orbits], np.int64
    )
    multipliers = np.array(
        [
            one.multipliers if isinstance(one, ClosedMotion) else np.full(size, np.nan + 0j)
            for one in orbits
        ]
    )
    points = [one.points[:APERIODIC_PERIODS] for one in every]
    start = _starts(every, size)
    numbers = _numbers(map_, start, period, points)
    scatter = np.array([one.scatter[0] if isinstance(one, Noisy) else np.nan for one in every])
    noisy = np.flatnonzero(np.isfinite(scatter))
    if len(noisy) and map_.exact_map is not None:
        exact = _numbers(map_.exact_map, start[noisy], period[noisy], [points[i] for i in noisy])
        numbers.put(noisy, exact)
    exponent, error = 1.0 / float(map_.period[0]) * _exponents(every)
    return AttractorTable(
        **numbers.columns(period),
        kind=[one.kind for one in every],
        multipliers=multipliers.reshape(-1, size),
        exponent=exponent,
        exponent_error=error,
        points=points,
        scatter=scatter if len(noisy) else None,
        outputs=_outputs(map_, numbers),
    )


def _starts(every: Sequence[ClosedMotion | SampledMotion], size: int) -> np.ndarray:
    """A point on each motion, float64[m, D]: of one that never repeats the last, when it has
    settled the most.
    """
    repeats = [isinstance(one, (ClosedMotion, Noisy)) for one in every]
    points = [one.points[0 if known else -1] for one, known in zip(every, repeats, strict=True)]
    return np.array(points).reshape(-1, size)


def _exponents(every: Sequence[ClosedMotion | SampledMotion]) -> np.ndarray:
    """The largest Lyapunov exponent of each motion and its error [per iterate], float64[2, m]."""
    return np.array([(one.exponent, one.exponent_error) for one in every]).reshape(-1, 2).T


def _unforced(map_: Stroboscope, found: AttractorSet) -> AttractorTable:
    """The table of a system without forcing: equilibria, limit cycles, and what never repeats."""
    size, equilibria, every = len(map_.states), len(found.orbits), found.every
    kind = np.array(
        [*(Kind.EQUILIBRIUM.word for _ in found.orbits), *(one.kind for one in found.sampled)],
        dtype=np.str_,
    )
    start = _starts(every, size)
    points = [
        *(one.points[:1] for one in found.orbits),
        *(one.points[:APERIODIC_PERIODS] for one in found.sampled),
    ]
    cycle, multipliers, eigenvalues = (
        np.full(len(kind), np.nan),
        *np.full((2, len(kind), size), np.nan + 0j),
    )
    exponent, error = _exponents(every) / map_.period
    still = find_equilibria(
        map_.rows(np.arange(equilibria)), start[:equilibria], np.ones((equilibria, size))
    )
    for i in range(equilibria):
        points[i] = start[i : i + 1] = still.points[i, :1] if still.period[i] else start[i : i + 1]
        eigenvalues[i] = (
            still.multipliers[i]
            if still.period[i]  # the field of what a contact holds doesn't vanish
            else eigenvalues_of(found.orbits[i].multipliers, float(map_.period[0]))
        )
        exponent[i] = eigenvalues[i, 0].real
    for i in np.flatnonzero(kind == Kind.LIMIT_CYCLE.word).tolist():
        one = cycle_of(map_, found.sampled[i - equilibria])
        cycle[i], multipliers[i], points[i], start[i] = (
            one.time[0],
            one.multipliers[0],
            one.points[0],
            one.points[0, ASIDE],
        )
    own = map_.rows(np.arange(len(kind))).with_period(
        np.where(np.isfinite(cycle), cycle, map_.period)
    )
    closed = np.isin(kind, (Kind.EQUILIBRIUM.word, Kind.LIMIT_CYCLE.word)).astype(np.int64)
    asked = outputs_of(map_.system)
    numbers = measure(own, start, closed, APERIODIC_PERIODS, asked)
    measure_equilibria(
        map_.rows(np.arange(equilibria)), start[:equilibria], np.arange(equilibria), numbers, asked
    )
    return AttractorTable(
        **numbers.columns(np.zeros(len(kind), np.int64)),
        kind=kind.tolist(),
        multipliers=multipliers,
        exponent=exponent,
        exponent_error=error,
        points=points,
        cycle=cycle,
        eigenvalues=eigenvalues,
        outputs=_outputs(map_, numbers),
    )


def _numbers(
    map_: Map, start: np.ndarray, period: np.ndarray, points: list[np.ndarray]
) -> Measures:
    """The numbers of attractors from a point on each."""
    if isinstance(map_, Stroboscope):
        rows, asked = map_.rows(np.arange(len(start))), outputs_of(map_.system)
        return measure(rows, start, period, APERIODIC_PERIODS, asked)
    return _of_points(points, start.shape[1])


def _outputs(map_: Map, numbers: Measures) -> dict[str, Any] | None:
    """The numbers of the outputs of a flow; None of a system without outputs of its own."""
    if not isinstance(map_, Stroboscope) or not len(map_.system.outputs):
        return None
    asked = outputs_of(map_.system)
    return {
        "output": list(asked.names),
        "output_units": list(asked.units),
        **{f"attractor_output_{name}": one for name, one in numbers.by_name().items()},
    }


def _of_points(points: list[np.ndarray], size: int) -> Measures:
    """The numbers of attractors of a map that has nothing between its points."""
    result = unknown(len(points), size)
    result.contacts[:] = 0.0
    for i, one in enumerate(points):
        result.maximum[i], result.minimum[i] = one.max(axis=0), one.min(axis=0)
        result.mean[i], result.deviation[i] = one.mean(axis=0), one.std(axis=0)
    return result
