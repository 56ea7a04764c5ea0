"""What is known of periodic orbits: size, contacts, margin to a graze, kind of stability."""

from __future__ import annotations

import numpy as np

from saltus.analysis.closed.all_cycles import Cycle
from saltus.analysis.closed.cycles import ASIDE
from saltus.analysis.closed.measures import measure
from saltus.analysis.closed.orbits import Orbit
from saltus.analysis.solve.tolerances import MARGINAL
from saltus.flow.maps import Stroboscope
from saltus.results import AttractorTable
from saltus.results.dataset.kinds import Kind
from saltus.results.dataset.orbits import OrbitTable


def table_of(map_: Stroboscope, orbits: list[Orbit], found: list[int]) -> OrbitTable:
    """The table of orbits of a forced flow with one row of values, and how many starts led to
    each.
    """
    size, count = len(map_.states), len(orbits)
    period = np.array([orbit.period for orbit in orbits], np.int64)
    multipliers = np.array([orbit.multipliers for orbit in orbits]).reshape(-1, size)
    start = np.array([orbit.points[0] for orbit in orbits]).reshape(-1, size)
    numbers = measure(map_.rows(np.zeros(count, np.int64)), start, period)
    whole = AttractorTable(
        kind=[Kind.PERIODIC.word] * count,
        period=period,
        contacts=numbers.contacts * period,
        itinerary=numbers.itinerary,
        peak=numbers.peak[:, 0],
        rms=numbers.rms[:, 0],
        margin=numbers.margin,
        multipliers=multipliers,
        exponent=1.0 / float(map_.period[0]) * np.array([orbit.exponent for orbit in orbits]),
        exponent_error=np.zeros(count),
        points=[orbit.points for orbit in orbits],
    )
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
