"""Arrays in, Datasets out, for what is known of attractors and their basins."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from saltus.errors import ParameterError
from saltus.results.dataset import schema
from saltus.results.dataset.builder import Builder
from saltus.results.dataset.finish import array_variable
from saltus.results.dataset.kinds import WITHOUT_WORDS

#: The largest count that ``grazes_unresolved`` holds; more are kept as this.
_MOST_GRAZES = np.iinfo(np.int16).max


# -- what the caller hands over ------------------------------------------------------------------------------------------------
@dataclass(frozen=True)
class AttractorTable:
    """The attractors of a system, m of them, in the order of their numbers; D states.

    Attributes
    ----------
    kind : sequence of str, length m
        ``periodic``, ``quasi_periodic`` or ``chaotic``; ``noisy_periodic`` where errors of the method keep an orbit from closing; of a
        system without forcing ``equilibrium`` or ``limit_cycle`` too.
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
        Stroboscopic points in the order in which they are visited [units of the states]; n may differ between attractors.
    fractions : tuple of three arrays, shape (m,), optional
        Share of the starts, and the lower and upper end of its interval: what :func:`saltus.analysis.basins.uncertainty.fractions` returns.
    cycle : array, shape (m,), optional
        Of a system without forcing: period of each limit cycle [s], else NaN.
    eigenvalues : array of complex, shape (m, D), optional
        Of a system without forcing: eigenvalues of the Jacobian of each equilibrium [1/s], else NaN.
    scatter : array, shape (m,), optional
        Where one is noisy: root mean square distance of its points from the exact orbit, first state [its unit]; NaN of the others.
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

    def __len__(self) -> int:
        return len(self.kind)

    @property
    def points_when(self) -> str:
        """When the points are taken, in words."""
        return "at whole forcing periods" if self.cycle is None else "in equal steps of time"

    def unforced(self, size: int) -> dict[str, np.ndarray]:
        """Columns of a system without forcing, by the ends of their names; none of a forced one. ``size``: as below."""
        if self.cycle is None or self.eigenvalues is None:
            return {}
        both = np.asarray(self.eigenvalues, dtype=complex).reshape(len(self), -1 if len(self) else size)
        parts = both.real, np.where(np.isnan(both), np.nan, both.imag)
        return {"cycle": self.cycle, "eigenvalue_real": parts[0], "eigenvalue_imag": parts[1]}

    def multiplier_parts(self, size: int) -> tuple[np.ndarray, np.ndarray]:
        """Real and imaginary parts, shape (m, D) each; ``size``: D, where there are no attractors to tell it."""
        both = np.asarray(self.multipliers, dtype=complex).reshape(len(self), -1 if len(self) else size)
        return both.real, np.where(np.isnan(both), np.nan, both.imag)  # a plain NaN has the imaginary part 0


# -- assembly ------------------------------------------------------------------------------------------------------------------
class _Builder(Builder):
    """A builder that knows the parts that these results share."""

    def put_axes(self, axes: Mapping[str, np.ndarray]) -> tuple[str, str]:
        """Add the two states that a map is drawn over; returns their names."""
        if len(axes) != 2 or not set(axes) <= set(self.states):
            raise ParameterError(f"a map is drawn over two states of {', '.join(self.states)}, not over {', '.join(axes) or 'none'}.")
        for name, values in axes.items():
            if name in {*self.table, "phase", "multiplier"}:
                raise ParameterError(f"the state {name!r} has the name of something else in the result. Rename the state in the system.")
            attrs = {"units": self.units.get(name, ""), "long_name": f"{name} at the start"}
            self.coords[name] = array_variable((name,), np.asarray(values, dtype=float), attrs)
        first, second = axes
        return first, second

    def put_attractors(self, table: AttractorTable) -> None:
        """Add what is known of each attractor."""
        real, imag = table.multiplier_parts(len(self.states))
        columns = {
            "attractor_type": list(table.kind),
            "attractor_period": table.period,
            "attractor_contacts": table.contacts,
            "attractor_itinerary": list(table.itinerary),
            "attractor_peak": table.peak,
            "attractor_rms": table.rms,
            "attractor_margin": table.margin,
            "attractor_multiplier_real": real,
            "attractor_multiplier_imag": imag,
            "attractor_exponent": table.exponent,
            "attractor_exponent_error": table.exponent_error,
            **{f"attractor_{name}": column for name, column in table.unforced(len(self.states)).items()},
        }
        self.put("attractor", np.arange(len(table)), coord=True)
        for name, column in columns.items():
            self.put(name, column)
        if table.scatter is not None:
            self.put("attractor_scatter", table.scatter)
        if table.fractions is not None:
            for end, column in zip(("", "_low", "_high"), table.fractions, strict=True):
                self.put(f"attractor_fraction{end}", column)
        self.put_points(table.points, ("attractor", "phase"), schema.attractor_name, table.points_when)


def basin_meanings(attractors: int) -> dict[int, str]:
    """Words for the labels of a map with so many attractors."""
    return {**WITHOUT_WORDS, **{i: f"attractor_{i}" for i in range(attractors)}}


def basins_dataset(
    *,
    states: Sequence[str],
    units: Mapping[str, str],
    axes: Mapping[str, np.ndarray],
    basin: np.ndarray,
    periods_to_settle: np.ndarray,
    status: np.ndarray,
    status_meanings: Mapping[int, str],
    grazes_unresolved: np.ndarray,
    attractors: AttractorTable,
    gap_unit: str = "",
    attrs: Mapping[str, Any] | None = None,
) -> xr.Dataset:
    """Assemble what ``basins`` returns.

    Parameters
    ----------
    states : sequence of str
        Names, in the order of the system.
    units : mapping of str to str
        Units of the states; missing ones are unknown.
    axes : mapping of str to array
        The two states that the map is drawn over, and the nA and nB values of each [its unit].
    basin : array of int, shape (nA, nB)
        Attractor to which each start leads; -1 escaped, -2 unconverged, -3 failed, -4 not computed.
    periods_to_settle : array of int, shape (nA, nB)
        Forcing periods until it had settled, -1 if it hadn't.
    status : array of int, shape (nA, nB)
        How the trajectory ended.
    status_meanings : mapping of int to str
        The word for each code of ``status``.
    grazes_unresolved : array of int, shape (nA, nB)
        Grazes shallower than the local error; more than 32767 are kept as 32767.
    attractors : AttractorTable
        The attractors, in the order of their numbers.
    gap_unit : str
        Unit of the guards' gaps.
    attrs : mapping, optional
        Provenance and trust numbers; values that are neither text nor number become JSON text.

    Returns
    -------
    Dataset
        Dims: the two states, ``attractor``, ``multiplier``, ``phase``.

    Raises
    ------
    ParameterError
        If the axes aren't two states, or one has the name of something else in the result.
    """
    build = _Builder(schema.BASINS, states, units, gap_unit)
    dims = build.put_axes(axes)
    build.put_flags("basin", basin, basin_meanings(len(attractors)), dims)
    build.put("periods_to_settle", periods_to_settle, dims=dims)
    build.put_flags("status", status, status_meanings, dims)
    build.put("grazes_unresolved", np.minimum(grazes_unresolved, _MOST_GRAZES), dims=dims)
    build.put_attractors(attractors)
    return build.dataset(attrs or {})


def attractors_dataset(
    *,
    states: Sequence[str],
    units: Mapping[str, str],
    attractors: AttractorTable,
    basin: np.ndarray | None = None,
    periods_to_settle: np.ndarray | None = None,
    gap_unit: str = "",
    attrs: Mapping[str, Any] | None = None,
) -> xr.Dataset:
    """Assemble what ``attractors`` and ``basin_fractions`` return.

    Parameters
    ----------
    basin, periods_to_settle : array of int, shape (trajectory,), optional
        Where each start leads and how soon, as in :func:`basins_dataset`. Left out together where the starts aren't kept.
    states, units, attractors, gap_unit, attrs
        As in :func:`basins_dataset`.

    Returns
    -------
    Dataset
        Dims ``attractor``, ``multiplier``, ``phase``, and ``trajectory`` if the starts are kept.
    """
    build = _Builder(schema.ATTRACTORS, states, units, gap_unit)
    if basin is not None:
        build.put("trajectory", np.arange(len(basin)), coord=True)
        build.put_flags("basin", basin, basin_meanings(len(attractors)), ("trajectory",))
        build.put("periods_to_settle", periods_to_settle, dims=("trajectory",))
    build.put_attractors(attractors)
    return build.dataset(attrs or {})


def agreement_dataset(
    *,
    states: Sequence[str],
    units: Mapping[str, str],
    axes: Mapping[str, np.ndarray],
    agreement: np.ndarray,
    basin_a: np.ndarray,
    basin_b: np.ndarray,
    match: Mapping[str, Any],
    attrs: Mapping[str, Any] | None = None,
) -> xr.Dataset:
    """Assemble what ``compare`` returns.

    Parameters
    ----------
    agreement : array of int, shape (nA, nB)
        1 where the maps agree, 0 where they differ, -1 where one of them has no attractor.
    basin_a, basin_b : array of int, shape (nA, nB)
        Attractors of both maps in one numbering.
    match : mapping of str to array, shape (pair,)
        Columns ``a``, ``b``, ``type``, ``period``, ``fraction_a``, ``fraction_b``, ``agreeing_cells``, ``orbit_distance``; see the table
        of the schema.
    states, units, axes, attrs
        As in :func:`basins_dataset`.

    Returns
    -------
    Dataset
        Dims: the two states, ``pair``.
    """
    build = _Builder(schema.AGREEMENT, states, units)
    dims = build.put_axes(axes)
    pairs = len(match["a"])
    build.put("pair", np.arange(pairs), coord=True)
    build.put_flags("agreement", agreement, schema.AGREEING, dims)
    build.put_flags("basin_a", basin_a, basin_meanings(pairs), dims)
    build.put_flags("basin_b", basin_b, basin_meanings(pairs), dims)
    for name, column in match.items():
        build.put(f"match_{name}", column)
    return build.dataset(attrs or {})
