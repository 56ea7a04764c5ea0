"""What is known of periodic orbits: size, contacts, margin to a graze, kind of stability."""

from __future__ import annotations

import numpy as np

from saltus.analysis.orbits.attractor_set import AttractorSet
from saltus.analysis.orbits.capture import Neighbourhoods
from saltus.analysis.orbits.orbits import Orbit
from saltus.analysis.orbits.portrait import portraits
from saltus.analysis.orbits.tolerances import MARGINAL
from saltus.flow.maps import Map
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
