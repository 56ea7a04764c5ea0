"""Variables of orbits, many of which attractors have too."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.results.dataset.attractors import AttractorTable, padded

#: Variables that attractors have and other orbits lack.
OF_ATTRACTORS = ("exponent_error", "scatter", "eigenvalue", "fraction")


@dataclass(frozen=True)
class OrbitTable:
    """Periodic orbits, m of them.

    Attributes
    ----------
    orbits : AttractorTable
        Properties that attractors have too.
    stability : sequence of str, length m
        Kind of stability.
    unstable : array of int, shape (m,)
        Multipliers outside the unit circle.
    found : array of int, shape (m,)
        Starts that led to each.
    mismatch : array, shape (m,)
        Largest distance of a point from the image of the one before, in units of the range.
    """

    orbits: AttractorTable
    stability: Sequence[str]
    unstable: np.ndarray
    found: np.ndarray
    mismatch: np.ndarray

    def values(self, size: int) -> dict[str, Any]:
        """The variables of a result."""
        columns = {
            f"orbit_{name}": column
            for name, column in self.orbits.columns(size).items()
            if not name.startswith(OF_ATTRACTORS)
        }
        return {
            "orbit": np.arange(len(self.orbits)),
            **columns,
            "orbit_stable": (self.unstable == 0).astype(np.int8),
            "orbit_stability": np.array(self.stability, np.str_),
            "orbit_unstable_directions": self.unstable,
            "orbit_found": self.found,
            "orbit_mismatch": self.mismatch,
            "orbit_<state>": padded(self.orbits.points, size),
        }
