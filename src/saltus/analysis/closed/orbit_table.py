"""What is known of periodic orbits: size, contacts, margin to a graze, kind of stability."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from saltus.analysis.closed.cycles import ASIDE
from saltus.analysis.closed.measures import measure
from saltus.analysis.closed.motions import ClosedMotion
from saltus.analysis.solve.tolerances import MARGINAL
from saltus.flow.maps import Stroboscope
from saltus.results import AttractorTable
from saltus.results.dataset.orbits import OrbitTable


def table_of(
    map_: Stroboscope, motions: Sequence[ClosedMotion], found: Sequence[int]
) -> OrbitTable:
    """The table of the orbits of a forced flow, or of the limit cycles of another one, with one row
    of values, and how many starts led to each.
    """
    size, count, forced = len(map_.states), len(motions), map_.system.forced_at is not None
    rows, aside = map_.rows(np.zeros(count, np.int64)), 0 if forced else ASIDE
    time = np.array([one.time for one in motions])
    period = np.array([one.period if forced else 1 for one in motions], np.int64)
    start = np.array([one.points[aside] for one in motions]).reshape(-1, size)
    multipliers = [one.transverse for one in motions]
    numbers = measure(rows if forced else rows.with_period(time), start, period)
    per_second = 1.0 / float(map_.period[0]) if forced else 1.0
    whole = AttractorTable(
        **numbers.columns(period if forced else 0 * period),
        kind=[one.kind for one in motions],
        multipliers=np.array(multipliers, complex).reshape(count, size - (not forced and size > 1)),
        exponent=per_second * np.array([one.exponent for one in motions]),
        exponent_error=np.zeros(count),
        points=[one.points for one in motions],
        cycle=None if forced else time,
        eigenvalues=None if forced else np.full((count, size), np.nan + 0j),
    )
    return OrbitTable(
        whole,
        [stability_of(one) for one in multipliers],
        np.array([outside(one) for one in multipliers], np.int64),
        np.array(found, np.int64),
        np.array([one.mismatch for one in motions]),
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
