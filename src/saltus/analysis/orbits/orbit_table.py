"""What is known of periodic orbits: size, contacts, margin to a graze, kind of stability."""

from __future__ import annotations

import numpy as np

from saltus.analysis.orbits.all_cycles import Cycle
from saltus.analysis.orbits.attractor_set import AttractorSet
from saltus.analysis.orbits.capture import Neighbourhoods
from saltus.analysis.orbits.orbit_measures import measure
from saltus.analysis.orbits.orbits import Orbit
from saltus.analysis.orbits.portrait import ASIDE, portraits
from saltus.analysis.orbits.tolerances import MARGINAL
from saltus.flow.maps import Map, Stroboscope
from saltus.results import AttractorTable
from saltus.results.dataset.kinds import Kind
from saltus.results.dataset.orbits import OrbitTable


def table_of(map_: Map, orbits: list[Orbit], found: list[int]) -> OrbitTable:
    """The table of orbits of a map with one row of values, and how many starts led to each."""
    size = len(map_.states)
    whole = portraits(map_, AttractorSet(Neighbourhoods.none(size), orbits))
    multipliers = [orbit.multipliers for orbit in orbits]
    return OrbitTable(
        whole,
        [stability_of(one) for one in multipliers],
        np.array([outside(one) for one in multipliers], np.int64),
        np.array(found, np.int64),
        np.array([orbit.mismatch for orbit in orbits]),
    )


def table_of_cycles(map_: Stroboscope, cycles: list[Cycle], found: list[int]) -> OrbitTable:
    """The table of limit cycles of a flow with one row of values, and how many starts led to
    each.
    """
    size, count = len(map_.states), len(cycles)
    time = np.array([one.time for one in cycles])
    leading = np.array([abs(one.multipliers[0]) for one in cycles])
    multipliers = np.array([one.multipliers for one in cycles]).reshape(count, -1 if count else 0)
    start = np.array([one.points[ASIDE] for one in cycles]).reshape(-1, size)
    rows = map_.rows(np.zeros(count, np.int64)).with_period(time)
    numbers = measure(rows, start, np.ones(count, np.int64))
    with np.errstate(divide="ignore"):
        exponent = np.maximum(np.log(leading) / time, 0.0)
    whole = AttractorTable(
        kind=[Kind.LIMIT_CYCLE.word] * count,
        period=np.zeros(count, np.int64),
        contacts=numbers.contacts,
        itinerary=numbers.itinerary,
        peak=numbers.peak[:, 0],
        rms=numbers.rms[:, 0],
        margin=numbers.margin,
        multipliers=multipliers,
        exponent=exponent,
        exponent_error=np.zeros(count),
        points=[one.points for one in cycles],
        cycle=time,
        eigenvalues=np.full((count, size), np.nan + 0j),
    )
    return OrbitTable(
        whole,
        [stability_of(one) for one in multipliers],
        np.array([outside(one) for one in multipliers], np.int64),
        np.array(found, np.int64),
        np.array([one.mismatch for one in cycles]),
    )


def outside(multipliers: np.ndarray) -> int:
    """How many multipliers lie on the unit circle or beyond it, but for rounding."""
    return int(np.count_nonzero(np.abs(multipliers) >= 1.0 - MARGINAL))


def stability_of(multipliers: np.ndarray) -> str:
    """The kind of stability, of the multipliers complex128[D] without a trivial one.

    A node is left by real multipliers, a focus by a pair. A saddle is stable in some directions;
    an inverse one has an odd number of multipliers below -1, so that what leaves it changes sides
    at every return. On the unit circle the linear part doesn't tell: ``marginal``.
    """
    sizes = np.abs(multipliers)
    if (np.abs(sizes - 1.0) < MARGINAL).any():
        return "marginal"
    leaving = multipliers[sizes > 1.0]
    if 0 < len(leaving) < len(multipliers):
        below = np.count_nonzero((leaving.imag == 0) & (leaving.real < 0))
        return "inverse saddle" if below % 2 else "saddle"
    shape = "focus" if multipliers[np.argmax(sizes)].imag != 0 else "node"
    return f"{'unstable' if len(leaving) else 'stable'} {shape}"
