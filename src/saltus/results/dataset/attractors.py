"""Numbers of attractors, in every result that holds some."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from saltus.results.dataset.kinds import WITHOUT_WORDS
from saltus.results.dataset.variable import Variable

#: Ends of the names of a share and of its interval.
ENDS = ("", "_low", "_high")

_EACH = ("attractor",)
_MULTIPLIER = ("attractor", "multiplier")
#: Variables of attractors; ``phase`` counts the points of an orbit.
#: ``<first>``: the unit of the first state.
ATTRACTOR_VARIABLES = {
    "attractor": Variable(_EACH, "1", "attractor", "i8", coord=True),
    "attractor_type": Variable(_EACH, "", "kind of motion", "str"),
    "attractor_period": Variable(
        _EACH, "1", "period in forcing periods, 0 if it doesn't repeat", "i8"
    ),
    "attractor_contacts": Variable(
        _EACH,
        "1",
        "contacts in one period of the response (in a forcing period if it doesn't repeat)",
    ),
    "attractor_itinerary": Variable(
        _EACH, "", "modes in the order in which they are visited", "str"
    ),
    "attractor_peak": Variable(_EACH, "<first>", "largest magnitude of the first state"),
    "attractor_rms": Variable(_EACH, "<first>", "root mean square of the first state"),
    "attractor_margin": Variable(
        _EACH, "<margin>", "smallest distance by which the orbit misses or overshoots a boundary"
    ),
    "attractor_multiplier_real": Variable(_MULTIPLIER, "1", "Floquet multiplier, real part"),
    "attractor_multiplier_imag": Variable(_MULTIPLIER, "1", "Floquet multiplier, imaginary part"),
    "attractor_scatter": Variable(
        _EACH,
        "<first>",
        "root mean square distance of a noisy motion from its exact orbit, first "
        "state; NaN of others",
    ),
    "attractor_cycle": Variable(_EACH, "s", "period of a limit cycle"),
    "attractor_eigenvalue_real": Variable(
        _MULTIPLIER, "1/s", "eigenvalue of the Jacobian of an equilibrium, real part"
    ),
    "attractor_eigenvalue_imag": Variable(
        _MULTIPLIER, "1/s", "eigenvalue of the Jacobian of an equilibrium, imaginary part"
    ),
    "attractor_exponent": Variable(_EACH, "1/s", "largest Lyapunov exponent"),
    "attractor_exponent_error": Variable(_EACH, "1/s", "error of the largest Lyapunov exponent"),
    "attractor_fraction": Variable(_EACH, "1", "share of the starts"),
    "attractor_fraction_low": Variable(
        _EACH, "1", "share of the starts, lower end of the 95 % interval"
    ),
    "attractor_fraction_high": Variable(
        _EACH, "1", "share of the starts, upper end of the 95 % interval"
    ),
    "attractor_<state>": Variable(("attractor", "phase"), "<state>", "<state> <when>"),
}


def rows_as(what: str, without: Sequence[str] = ()) -> dict[str, Variable]:
    """Variables of attractors under the name of something with the same properties: an orbit, a
    response. ``without``: beginnings of names that are left out.
    """
    return {
        name.replace("attractor", what): replace(
            row,
            dims=tuple(what if dim == "attractor" else dim for dim in row.dims),
            long_name=row.long_name.replace("attractor", what),
        )
        for name, row in ATTRACTOR_VARIABLES.items()
        if not name.removeprefix("attractor_").startswith(tuple(without))
    }


@dataclass(frozen=True)
class AttractorTable:
    """The attractors of a system, m of them, in the order of their numbers; D states.

    Attributes
    ----------
    kind : sequence of str, length m
        ``periodic``, ``quasi_periodic`` or ``chaotic``; ``noisy_periodic`` where errors of the
        method keep an orbit from closing; of a system without forcing ``equilibrium`` or
        ``limit_cycle`` too; of responses ``long_periodic`` where an orbit is too long to be
        closed, and ``not_repeating`` where exponents don't say.
    period : array of int, shape (m,)
        Period [forcing periods], 0 where the motion doesn't repeat, or nothing forces it.
    contacts : array, shape (m,)
        Contacts in one period of the response; in a forcing period where it doesn't repeat.
    itinerary : sequence of str, length m
        Modes in the order in which they are visited.
    peak, rms : array, shape (m,)
        Largest magnitude and root mean square of the first state [its unit].
    margin : array, shape (m,)
        Smallest distance by which the orbit misses or overshoots a boundary [unit of the gap].
    multipliers : array of complex, shape (m, D)
        Floquet multipliers, of a limit cycle the trivial 1 among them; NaN where there are none.
    exponent, exponent_error : array, shape (m,)
        Largest Lyapunov exponent and its error [1/s].
    points : sequence of array, shape (n, D) each
        Stroboscopic points in the order in which they are visited [units of the states]; n may
        differ between attractors.
    fractions : tuple of three arrays, shape (m,), optional
        Share of the starts, and the lower and upper end of its interval: what
        :func:`saltus.analysis.basins.uncertainty.fractions` returns.
    cycle : array, shape (m,), optional
        Of a system without forcing: period of each limit cycle [s], else NaN.
    eigenvalues : array of complex, shape (m, D), optional
        Of a system without forcing: eigenvalues of the Jacobian of each equilibrium [1/s], else
        NaN.
    scatter : array, shape (m,), optional
        Root mean square distance of the points of a noisy attractor from the exact orbit, first
        state [its unit]; NaN for the others.
    outputs : mapping of str to array, shape (m, K), optional
        Numbers of the states and outputs of a system that has outputs, by the names of their
        variables, with the names and units of the outputs.
    """

    kind: Sequence[str]
    period: np.ndarray
    contacts: np.ndarray
    itinerary: Sequence[str]
    peak: np.ndarray
    rms: np.ndarray
    margin: np.ndarray
    multipliers: np.ndarray
    exponent: np.ndarray
    exponent_error: np.ndarray
    points: Sequence[np.ndarray]
    fractions: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None
    cycle: np.ndarray | None = None
    eigenvalues: np.ndarray | None = None
    scatter: np.ndarray | None = None
    outputs: Mapping[str, Any] | None = None

    def __len__(self) -> int:
        return len(self.kind)

    @property
    def points_when(self) -> str:
        """Times of the points, in words."""
        return "at whole forcing periods" if self.cycle is None else "in equal steps of time"

    def columns(self, size: int) -> dict[str, Any]:
        """Columns of the attractors, by the names of the variables without ``attractor_``.
        ``size``: number of states, D, for a table without attractors.
        """
        real, imag = _parts(self.multipliers, len(self), size)
        found = {
            "type": list(self.kind), "period": self.period, "contacts": self.contacts,
            "itinerary": list(self.itinerary),
            "peak": self.peak, "rms": self.rms, "margin": self.margin, "multiplier_real": real,
            "multiplier_imag": imag,
            "exponent": self.exponent, "exponent_error": self.exponent_error,
        }  # fmt: skip
        if self.cycle is not None and self.eigenvalues is not None:
            real, imag = _parts(self.eigenvalues, len(self), size)
            found |= {"cycle": self.cycle, "eigenvalue_real": real, "eigenvalue_imag": imag}
        return found

    def values(self, size: int) -> dict[str, Any]:
        """The variables of the attractors of a result."""
        found = {
            "attractor": np.arange(len(self)),
            **{f"attractor_{name}": column for name, column in self.columns(size).items()},
        }
        if self.scatter is not None:
            found["attractor_scatter"] = self.scatter
        if self.fractions is not None:
            found |= dict(
                zip((f"attractor_fraction{end}" for end in ENDS), self.fractions, strict=True)
            )
        return found | dict(self.outputs or {}) | {"attractor_<state>": padded(self.points, size)}


def _parts(both: np.ndarray, count: int, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Real and imaginary parts, shape (count, D) each."""
    both = np.asarray(both, dtype=complex).reshape(count, -1 if count else size)
    # The imaginary part of a real NaN is 0.
    return both.real, np.where(np.isnan(both), np.nan, both.imag)


def padded(points: Sequence[np.ndarray], size: int) -> np.ndarray:
    """Rows of unequal length (n, D) as one array (row, longest, D), padded with NaN to the longest.

    The longest is taken as one at least: netCDF-3 has room for one empty dim only.
    """
    whole = np.full((len(points), max(map(len, points), default=0) or 1, size), np.nan)
    for row, one in zip(whole, points, strict=True):
        row[: len(one)] = one
    return whole


def basin_meanings(attractors: int) -> dict[int, str]:
    """Words for the labels of a map with this number of attractors."""
    return {**WITHOUT_WORDS, **{i: f"attractor_{i}" for i in range(attractors)}}
