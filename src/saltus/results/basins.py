"""Arrays in, Datasets out, for what is known of attractors and their basins."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from saltus.errors import ParameterError
from saltus.results import schema
from saltus.results.provenance import content_hash, to_json
from saltus.results.variable import Variable

#: The largest count that ``grazes_unresolved`` holds; more are kept as this.
_MOST_GRAZES = np.iinfo(np.int16).max


# -- what the caller hands over ------------------------------------------------------------------------------------------------
@dataclass(frozen=True)
class AttractorTable:
    """The attractors of a system, m of them, in the order of their numbers; D states.

    Attributes
    ----------
    kind : sequence of str, length m
        ``periodic``, ``quasi_periodic`` or ``chaotic``.
    period : array of int, shape (m,)
        Period [forcing periods], 0 where the motion doesn't repeat.
    contacts : array, shape (m,)
        Contacts in one period of the response; in a forcing period where it doesn't repeat.
    itinerary : sequence of str, length m
        Modes in the order in which they are visited.
    peak, rms : array, shape (m,)
        Largest magnitude and root mean square of the first state [its unit].
    margin : array, shape (m,)
        Smallest distance by which the orbit misses or overshoots a boundary [unit of the gap].
    multipliers : array of complex, shape (m, D)
        Floquet multipliers; NaN where there are none.
    exponent, exponent_error : array, shape (m,)
        Largest Lyapunov exponent and its error [1/s].
    points : sequence of array, shape (n, D) each
        Stroboscopic points in the order in which they are visited [units of the states]; n may differ between attractors.
    fractions : tuple of three arrays, shape (m,), optional
        Share of the starts, and the lower and upper end of its interval: what :func:`saltus.analysis.uncertainty.fractions` returns.
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

    def __len__(self) -> int:
        return len(self.kind)


# -- assembly ------------------------------------------------------------------------------------------------------------------
class _Builder:
    """Collects the variables of one Dataset by the table of its kind."""

    def __init__(self, kind: str, states: Sequence[str], units: Mapping[str, str], gap_unit: str = "") -> None:
        self.kind, self.states, self.units, self.gap_unit = kind, tuple(states), units, gap_unit
        self.table = schema.TABLES[kind]
        self.data: dict[str, Any] = {}
        self.coords: dict[str, Any] = {}

    def put(self, name: str, values: Any, *, dims: tuple[str, ...] = (), coord: bool = False, **attrs: Any) -> None:
        """Add a variable of the table; ``dims`` are those that the table leaves open."""
        spec = self.table[name]
        array = np.asarray(values, dtype={"str": np.str_}.get(spec.dtype, spec.dtype))
        if array.dtype.kind == "i" and not np.array_equal(array, values):
            raise ParameterError(f"{name} holds {np.max(np.abs(values))}, which {array.dtype} can't. Split the work into smaller parts.")
        labels = {"units": self._unit(spec), "long_name": spec.long_name, **attrs}
        (self.coords if coord else self.data)[name] = xr.Variable((*dims, *spec.dims), array, labels)

    def put_flags(self, name: str, values: Any, meanings: Mapping[int, str], dims: tuple[str, ...]) -> None:
        """Add a variable of codes, with their meanings as the CF conventions write them."""
        codes = np.array(sorted(meanings), dtype=self.table[name].dtype)
        self.put(name, values, dims=dims, flag_values=codes, flag_meanings=" ".join(meanings[int(code)] for code in codes))

    def put_axes(self, axes: Mapping[str, np.ndarray]) -> tuple[str, str]:
        """Add the two states that a map is drawn over; returns their names."""
        if len(axes) != 2 or not set(axes) <= set(self.states):
            raise ParameterError(f"a map is drawn over two states of {', '.join(self.states)}, not over {', '.join(axes) or 'none'}.")
        for name, values in axes.items():
            if name in {*self.table, "phase", "multiplier"}:
                raise ParameterError(f"the state {name!r} has the name of something else in the result. Rename the state in the system.")
            attrs = {"units": self.units.get(name, ""), "long_name": f"{name} at the start"}
            self.coords[name] = xr.Variable((name,), np.asarray(values, dtype=float), attrs)
        first, second = axes
        return first, second

    def put_attractors(self, table: AttractorTable) -> None:
        """Add what is known of each attractor."""
        multipliers = np.asarray(table.multipliers, dtype=complex).reshape(len(table), -1 if len(table) else len(self.states))
        columns = {
            "attractor_type": list(table.kind),
            "attractor_period": table.period,
            "attractor_contacts": table.contacts,
            "attractor_itinerary": list(table.itinerary),
            "attractor_peak": table.peak,
            "attractor_rms": table.rms,
            "attractor_margin": table.margin,
            "attractor_multiplier_real": multipliers.real,
            "attractor_multiplier_imag": np.where(np.isnan(multipliers), np.nan, multipliers.imag),  # a plain NaN has the imaginary part 0
            "attractor_exponent": table.exponent,
            "attractor_exponent_error": table.exponent_error,
        }
        self.put("attractor", np.arange(len(table)), coord=True)
        for name, column in columns.items():
            self.put(name, column)
        if table.fractions is not None:
            for end, column in zip(("", "_low", "_high"), table.fractions, strict=True):
                self.put(f"attractor_fraction{end}", column)
        self._put_points(table)

    def _put_points(self, table: AttractorTable) -> None:
        """Add the stroboscopic points, padded with NaN to the longest orbit; at least one, as netCDF-3 has room for one empty dim only."""
        longest = max((len(points) for points in table.points), default=0) or 1
        padded = np.full((len(table), longest, len(self.states)), np.nan)
        for row, points in zip(padded, table.points, strict=True):
            row[: len(points)] = points
        for i, name in enumerate(self.states):
            attrs = {"units": self.units.get(name, ""), "long_name": f"{name} at whole forcing periods"}
            self.data[schema.attractor_name(name)] = xr.Variable(("attractor", "phase"), padded[:, :, i], attrs)

    def _unit(self, spec: Variable) -> str:
        """The unit of the table, with what follows the system filled in."""
        return {"<first>": self.units.get(self.states[0], ""), "<gap>": self.gap_unit}.get(spec.units, spec.units)

    def dataset(self, attrs: Mapping[str, Any]) -> xr.Dataset:
        """The Dataset, with the hash of its numbers."""
        plain = {key: value if isinstance(value, str | int | float) else to_json(value) for key, value in attrs.items()}
        own = {"saltus_result": self.kind, "schema_version": schema.VERSION, "states": " ".join(self.states)}
        ds = xr.Dataset(self.data, self.coords, {**plain, **own})
        ds.attrs["result_hash"] = content_hash(ds)
        return ds


def _basin_meanings(attractors: int) -> dict[int, str]:
    return {**schema.NO_BASIN, **{i: f"attractor_{i}" for i in range(attractors)}}


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
    build.put_flags("basin", basin, _basin_meanings(len(attractors)), dims)
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
        build.put_flags("basin", basin, _basin_meanings(len(attractors)), ("trajectory",))
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
    build.put_flags("basin_a", basin_a, _basin_meanings(pairs), dims)
    build.put_flags("basin_b", basin_b, _basin_meanings(pairs), dims)
    for name, column in match.items():
        build.put(f"match_{name}", column)
    return build.dataset(attrs or {})
