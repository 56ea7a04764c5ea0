"""Table of what ``periodic_orbits`` returns: the variables of attractors that mean the same of any
orbit, and what only a search for all of them knows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.results.dataset.attractors import ATTRACTOR_VARIABLES, AttractorTable, padded
from saltus.results.dataset.variable import Variable

#: What is known of attractors, and of no orbit alone.
_OF_ATTRACTORS = ("exponent_error", "scatter", "eigenvalue", "fraction")
_EACH, _SEARCH = ("orbit",), ("search_period",)


def _renamed(row: Variable) -> Variable:
    """The row of an attractor as one of an orbit."""
    dims = tuple("orbit" if dim == "attractor" else dim for dim in row.dims)
    long_name = row.long_name.replace("attractor", "orbit")
    return Variable(dims, row.units, long_name, row.dtype, row.coord)


#: Variables of what ``periodic_orbits`` returns.
ORBIT_VARIABLES = {
    **{
        name.replace("attractor", "orbit"): _renamed(row)
        for name, row in ATTRACTOR_VARIABLES.items()
        if not name.removeprefix("attractor_").startswith(_OF_ATTRACTORS)
    },
    "orbit_stable": Variable(
        _EACH,
        "1",
        "whether all multipliers lie inside the unit circle",
        "i1",
        flags={0: "unstable", 1: "stable"},
    ),
    "orbit_stability": Variable(_EACH, "", "kind of stability, from the multipliers", "str"),
    "orbit_unstable_directions": Variable(_EACH, "1", "multipliers outside the unit circle", "i8"),
    "orbit_found": Variable(_EACH, "1", "starts that led to it", "i8"),
    "orbit_mismatch": Variable(
        _EACH, "1", "largest distance of a point from the image of the one before, of the range"
    ),
    "search_period": Variable(
        _SEARCH, "1", "period that was searched for, in forcing periods", "i8", coord=True
    ),
    "search_converged": Variable(_SEARCH, "1", "starts that led to an orbit", "i8"),
    "search_found_once": Variable(_SEARCH, "1", "orbits that one start alone led to", "i8"),
    "search_unseen": Variable(
        _SEARCH, "1", "estimated share of the starts whose orbits aren't known"
    ),
    "search_deflated": Variable(
        _SEARCH, "1", "orbits found only after the others were deflated", "i8"
    ),
    "search_exhausted": Variable(
        _SEARCH,
        "1",
        "whether the last search with all known orbits deflated found nothing",
        "i1",
        flags={0: "no", 1: "yes"},
    ),
    "search_given_up": Variable(
        _SEARCH, "1", "starts given up, since their motion used up its budget", "i8"
    ),
}


@dataclass(frozen=True)
class OrbitTable:
    """Periodic orbits, m of them.

    Attributes
    ----------
    orbits : AttractorTable
        What is known of them as of attractors.
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
            if not name.startswith(_OF_ATTRACTORS)
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
