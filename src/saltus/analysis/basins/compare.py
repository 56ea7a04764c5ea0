"""Compare two maps of basins: match their attractors one to one, then compare cell by cell."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from scipy.optimize import linear_sum_assignment

from saltus.analysis.closed.motions import orbit_distance
from saltus.analysis.inputs.verb import verb
from saltus.errors import ParameterError
from saltus.intervals import wilson
from saltus.results import Subject, build, made_by
from saltus.results.dataset.attractors import basin_meanings
from saltus.results.dataset.kinds import Kind
from saltus.results.dataset.reader import reader
from saltus.results.dataset.schema import (
    AGREEMENT,
    BASINS,
    attractor_name,
    axes_of,
    check,
    states_of,
)

#: Largest distance of two orbits that count as one, in units of the axis ranges. Methods differ far
#: less on one attractor, and neighbouring orbits of the rig differ more.
TOLERANCE = 0.01
#: Orbits of equal peak and rms count as one up to this multiple of that distance: errors of a
#: weakly damped response add up in its phase.
SHIFTED = 10.0
#: Largest difference of two grids that is rounding, in units of the axis range.
_ROUNDING = 1e-9
#: Attributes of both maps that the result keeps, with suffixes _a and _b.
_KEPT = ("system", "parameters", "method", "method_options", "result_hash", "saltus_version")
#: Cost of an impossible pair in the assignment: more than all possible pairs together.
_NEVER = 1e9


@verb
@reader
def compare(map_a: xr.Dataset, map_b: xr.Dataset, *, tolerance: float = TOLERANCE) -> xr.Dataset:
    """Compare two maps of basins on one grid, such as those of two methods.

    Attractors are matched one to one. Only those of equal type and period can be the same, and only
    within ``tolerance``; a noisy one is taken for the periodic orbit about which it scatters. Among
    periodic ones the nearest go together: the distance of two orbits is the largest difference of
    their stroboscopic points, at the best shift of the phase, in units of the axis ranges. Up to
    ten times ``tolerance`` apart they can still be the same if their peaks and rms are within it:
    in a weakly damped response the errors of a method shift the phase. Motions that don't repeat
    have no points to compare; they can be the same if peak and rms of the first state are within
    ``tolerance``, and those go together that share the most cells (mirror twins have equal peaks).

    Parameters
    ----------
    map_a, map_b : Dataset
        The result of ``basins``.
    tolerance : float
        Largest distance of two orbits that count as one, in units of the axis ranges. A state that
        is no axis is measured by the largest magnitude of the points.

    Returns
    -------
    Dataset
        Dims: the two states, and ``pair``, one for each attractor: first those of ``map_a``, under
        their numbers, then those that only ``map_b`` has. ``agreement``: 1 where both maps name the
        same attractor, 0 where they differ, -1 where one of them has none. ``basin_a``,
        ``basin_b``: the maps in the numbers of the pairs. ``match_a``, ``match_b``: numbers in
        either map, -1 if it isn't there; ``match_type``, ``match_period``, ``match_fraction_a``,
        ``match_fraction_b``, ``match_agreeing_cells``, ``match_orbit_distance`` (NaN without a
        partner). Attributes ``agreement`` (share of the cells that are settled in both),
        ``agreement_low``, ``agreement_high`` (95 % score interval; see
        :func:`saltus.analysis.basins.uncertainty.fractions` on what it means on a grid),
        ``settled_cells``, and of each map ``method_a``, ``result_hash_a``, ...

    Raises
    ------
    ParameterError
        If one isn't a map of basins, or the grids differ.

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    >>> starts = {"x": ("-1 mm", "1 mm", 8), "v": ("-20 mm/s", "20 mm/s", 8)}
    >>> exact = sl.basins(rig, **starts)
    >>> rough = sl.basins(rig, method=sl.Taylor(tolerance=1e-9), **starts)
    >>> sl.compare(exact, rough).attrs["agreement"]
    1.0
    """
    check(map_a, caller="compare", kinds=[BASINS])
    check(map_b, caller="compare", kinds=[BASINS])
    if not tolerance >= 0:
        raise ParameterError(
            f"tolerance = {tolerance} is no distance: give a number of 0 or more, "
            f"such as {TOLERANCE}."
        )
    _same_grid(map_a, map_b)
    partner, distance = _match(map_a, map_b, tolerance)
    a, b = map_a["basin"].values.astype(np.int64), map_b["basin"].values.astype(np.int64)
    ids_a, ids_b = _pairs(partner, map_b.sizes["attractor"])
    b = _renumbered(b, ids_b)
    settled = (a >= 0) & (b >= 0)
    agreement = np.where(settled, (a == b).astype(np.int64), -1)
    match = {
        "match_a": ids_a,
        "match_b": ids_b,
        "match_type": _column(map_a, map_b, ids_a, ids_b, "attractor_type"),
        "match_period": _column(map_a, map_b, ids_a, ids_b, "attractor_period"),
        "match_fraction_a": _shares(map_a, ids_a),
        "match_fraction_b": _shares(map_b, ids_b),
        "match_agreeing_cells": np.bincount(a[agreement == 1], minlength=len(ids_a)),
        "match_orbit_distance": np.concatenate(
            [distance, np.full(len(ids_a) - len(distance), np.nan)]
        ),
    }
    axes = axes_of(map_a)
    attrs = {**_numbers(agreement), "tolerance": tolerance, **_provenance(map_a, map_b)}
    subject = Subject(
        states_of(map_a), {name: map_a[name].attrs.get("units", "") for name in axes}, attrs
    )
    labels = {"agreement": agreement, "basin_a": a, "basin_b": b}
    values = {
        "<state>": {name: map_a[name].values for name in axes},
        "pair": np.arange(len(ids_a)),
        **labels,
        **match,
    }
    return build(
        AGREEMENT,
        subject,
        values,
        grid=axes,
        flags=dict.fromkeys(("basin_a", "basin_b"), basin_meanings(len(ids_a))),
    )


# -- the grids -------------------------------------------------------------------------------------
def _same_grid(a: xr.Dataset, b: xr.Dataset) -> None:
    """Raise a ParameterError that names the difference of two grids."""
    differ = _difference(a, b)
    if differ:
        raise ParameterError(
            f"the two maps aren't on one grid: {differ}. Compute both with the "
            f"same states, ranges and numbers of cells."
        )


def _difference(a: xr.Dataset, b: xr.Dataset) -> str:
    """The first difference of two grids, as text; empty if they are equal."""
    if states_of(a) != states_of(b):
        return f"the states are {', '.join(states_of(a))} and {', '.join(states_of(b))}"
    if axes_of(a) != axes_of(b):
        return f"the axes are {', '.join(axes_of(a))} and {', '.join(axes_of(b))}"
    for name in axes_of(a):
        first, second = a[name], b[name]
        if first.size != second.size:
            return f"{name} has {first.size} and {second.size} cells"
        units = [one.attrs.get("units", "") for one in (first, second)]
        if units[0] != units[1]:
            return (
                f"{name} is in {units[0] or 'an unknown unit'} and in "
                f"{units[1] or 'an unknown unit'}"
            )
        gap = np.abs(first.values - second.values).max(initial=0.0)
        if not gap <= _ROUNDING * np.ptp(first.values):
            ends = [
                f"{one.values.min():.17g} to {one.values.max():.17g}" for one in (first, second)
            ]
            return (
                f"{name} runs from {ends[0]} and from {ends[1]} {units[0]}".rstrip()
                + f", up to {gap:.3g} apart"
            )
    return ""


# -- the attractors --------------------------------------------------------------------------------
def _match(a: xr.Dataset, b: xr.Dataset, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """For each attractor of a: its partner in b (-1: none), and their distance (NaN)."""
    distance = _distances(a, b)
    possible = (distance <= tolerance) | (
        (distance <= SHIFTED * tolerance) & (_level_distances(a, b) <= tolerance)
    )
    cost = np.where(possible, distance / (tolerance or 1.0), _NEVER)
    aperiodic = possible & (a["attractor_period"].values[:, None] == 0)
    cost[aperiodic] = (1.0 - _shared_cells(a, b))[aperiodic]
    rows, columns = linear_sum_assignment(cost)
    rows, columns = rows[possible[rows, columns]], columns[possible[rows, columns]]
    partner, gap = np.full(len(distance), -1), np.full(len(distance), np.nan)
    partner[rows], gap[rows] = columns, distance[rows, columns]
    return partner, gap


def _distances(a: xr.Dataset, b: xr.Dataset) -> np.ndarray:
    """Distance of every attractor of a from every one of b; infinite where type or
    period differ.
    """
    names, scale, levels = states_of(a), _scales(a, b), _level_distances(a, b)
    result = np.full(levels.shape, np.inf)
    points = [
        np.stack([ds[attractor_name(name)].values for name in names], axis=-1) / scale
        for ds in (a, b)
    ]
    types = [ds["attractor_type"].values for ds in (a, b)]
    types = [np.where(own == Kind.NOISY_PERIODIC.word, Kind.PERIODIC.word, own) for own in types]
    periods = [ds["attractor_period"].values for ds in (a, b)]
    for i, j in np.ndindex(*levels.shape):
        n = int(periods[0][i])
        if types[0][i] != types[1][j] or n != periods[1][j]:
            continue
        result[i, j] = orbit_distance(points[0][i, :n], points[1][j, :n]) if n else levels[i, j]
    return np.where(np.isnan(result), np.inf, result)


def _level_distances(a: xr.Dataset, b: xr.Dataset) -> np.ndarray:
    """Difference in peak or rms, the larger, of every attractor of a from every one of b, in units
    of the first axis' range.
    """
    levels = [
        np.stack([ds["attractor_peak"].values, ds["attractor_rms"].values], axis=-1)
        / _scales(a, b)[0]
        for ds in (a, b)
    ]
    distances: np.ndarray = np.abs(levels[0][:, None] - levels[1][None]).max(axis=2)
    return distances


def _scales(a: xr.Dataset, b: xr.Dataset) -> np.ndarray:
    """Unit of distance for each state: the range of its axis, else the largest magnitude of the
    points; never 0.
    """
    scales = []
    for name in states_of(a):
        values = np.concatenate([ds[attractor_name(name)].values.ravel() for ds in (a, b)])
        scale = (
            np.ptp(a[name].values)
            if name in axes_of(a)
            else np.abs(values[np.isfinite(values)]).max(initial=0.0)
        )
        scales.append(scale if scale > 0 else 1.0)
    return np.array(scales)


def _shared_cells(a: xr.Dataset, b: xr.Dataset) -> np.ndarray:
    """Cells shared by each attractor of a and each of b, over the cells that either has."""
    size = (a.sizes["attractor"], b.sizes["attractor"])
    first, second = a["basin"].values.ravel(), b["basin"].values.ravel()
    both = np.zeros(size)
    settled = (first >= 0) & (second >= 0)
    np.add.at(both, (first[settled], second[settled]), 1.0)
    either = _cells(first, size[0])[:, None] + _cells(second, size[1])[None, :] - both
    shares: np.ndarray = both / np.maximum(either, 1.0)
    return shares


def _cells(labels: np.ndarray, m: int) -> np.ndarray:
    return np.bincount(labels[labels >= 0], minlength=m)


# -- one numbering ---------------------------------------------------------------------------------
def _pairs(partner: np.ndarray, m_b: int) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of each pair in a and in b, -1 for none: first the attractors of a, then those in b
    only.
    """
    alone = np.setdiff1d(np.arange(m_b), partner)
    return np.concatenate([np.arange(len(partner)), np.full(len(alone), -1)]), np.concatenate(
        [partner, alone]
    )


def _renumbered(labels: np.ndarray, ids: np.ndarray) -> np.ndarray:
    """The labels in the numbers of the pairs; negative codes are kept."""
    number = np.empty(ids.max(initial=-1) + 1, dtype=np.int64)
    number[ids[ids >= 0]] = np.flatnonzero(ids >= 0)
    result = labels.copy()
    result[labels >= 0] = number[labels[labels >= 0]]
    return result


def _column(
    a: xr.Dataset, b: xr.Dataset, ids_a: np.ndarray, ids_b: np.ndarray, name: str
) -> list[Any]:
    """A variable of the attractors for each pair, from a map that has it."""
    first, second = a[name].values, b[name].values
    return [first[i] if i >= 0 else second[j] for i, j in zip(ids_a, ids_b, strict=True)]


def _shares(ds: xr.Dataset, ids: Sequence[int] | np.ndarray) -> np.ndarray:
    """Share of the starts for each pair, NaN if the map lacks it."""
    share = np.append(
        ds["attractor_fraction"].values
        if "attractor_fraction" in ds
        else np.full(ds.sizes["attractor"], np.nan),
        np.nan,
    )
    return share[np.asarray(ids, dtype=np.int64)]


# -- attributes ------------------------------------------------------------------------------------
def _numbers(agreement: np.ndarray) -> dict[str, float | int]:
    """Share of the settled cells in which two maps agree, with its interval."""
    cells, agreeing = int((agreement >= 0).sum()), int((agreement == 1).sum())
    low, high = wilson(agreeing, cells)
    share = agreeing / cells if cells else np.nan
    return {
        "agreement": share,
        "agreement_low": float(low),
        "agreement_high": float(high),
        "settled_cells": cells,
    }


def _provenance(a: xr.Dataset, b: xr.Dataset) -> dict[str, Any]:
    """Provenance of both maps; entries that they share have plain names."""
    result = {
        f"{name}_{which}": ds.attrs[name]
        for which, ds in (("a", a), ("b", b))
        for name in _KEPT
        if name in ds.attrs
    }
    common = {
        name: a.attrs[name]
        for name in ("system", "parameters", "units")
        if name in a.attrs and a.attrs[name] == b.attrs.get(name)
    }
    # shared parameters; those that differ are in parameters_a and parameters_b
    if "parameters" not in common:
        first, second = (json.loads(ds.attrs.get("parameters", "{}")) for ds in (a, b))
        common["parameters"] = json.dumps(
            {name: value for name, value in first.items() if second.get(name) == value},
            ensure_ascii=False,
        )
    return {**made_by(), **result, **common}
