"""Distances of one method's responses from another's: orbit by orbit, and period by period."""

from __future__ import annotations

import numpy as np
import xarray as xr

from saltus.analysis.attractors.find_responses import motion_range
from saltus.analysis.closed.motions import orbit_distance
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import Method
from saltus.kernels import status as st
from saltus.results.dataset.schema import parameters_of, response_name, states_of
from saltus.system import System

#: Orbits of two methods are one below this multiple of the method's noise.
SAME_NOISE = 4.0
#: They are one below this part of the motion's range, too.
SAME_AT_LEAST = 1e-3
#: Points of a response from which one-period errors are measured; more add nothing.
POINTS = 64


def orbit_distances(exact: xr.Dataset, other: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Distances of the responses of one Dataset from those of an exact one at the same values.

    Returns
    -------
    distance : float64[places..., s]
        From the exact response of the same start, in units of the range of its stroboscopic points
        and its peak; inf if kind or period differ, NaN where one of both has none. Motions that
        never repeat are compared by peak and rms.
    nearest : float64[places..., s]
        From the nearest of the exact responses at that value.
    """
    of, to = other["response_of"].values, exact["response_of"].values
    first, second = _points(exact), _points(other)
    distance, nearest = np.full(of.shape, np.nan), np.full(of.shape, np.nan)
    for index in np.ndindex(*of.shape[:-1]):
        known = sorted({int(i) for i in to[index] if i >= 0})
        for s, response in enumerate(of[index]):
            if response < 0:
                continue
            apart = {i: _apart(exact, first, i, other, second, int(response)) for i in known}
            nearest[(*index, s)] = min(apart.values(), default=np.nan)
            if to[index][s] >= 0:
                distance[(*index, s)] = apart[int(to[index][s])]
    return distance, nearest


def state_distances(exact: xr.Dataset, other: xr.Dataset) -> np.ndarray:
    """Distances of the states of a run from those of an exact one at the same times, the largest of
    all states in units of the range of each in the exact run, float64[..., time].
    """
    first, second = (
        np.stack([ds[name].values for name in states_of(exact)]) for ds in (exact, other)
    )
    wide = np.nanmax(first, axis=-1, keepdims=True) - np.nanmin(first, axis=-1, keepdims=True)
    apart: np.ndarray = (np.abs(second - first) / np.where(wide > 0, wide, 1.0)).max(axis=0)
    return apart


def _points(ds: xr.Dataset) -> np.ndarray:
    """Stroboscopic points, float64[response, phase, D]."""
    return np.stack([ds[response_name(name)].values for name in states_of(ds)], axis=2)


def _apart(
    a: xr.Dataset, first: np.ndarray, i: int, b: xr.Dataset, second: np.ndarray, j: int
) -> float:
    """Distance of two responses, in units of the exact one's size."""
    if (
        a["response_type"].values[i] != b["response_type"].values[j]
        or a["response_period"].values[i] != b["response_period"].values[j]
    ):
        return np.inf
    n = int(a["response_period"].values[i])
    levels = [
        abs(float(a[name].values[i] - b[name].values[j])) / float(a["response_peak"].values[i])
        for name in ("response_peak", "response_rms")
    ]
    if n == 0:
        return max(levels)
    p, q = first[i, :n], second[j, :n]
    scale = np.maximum(np.abs(p).max(axis=0), 1e-300)
    scale[0] = float(a["response_peak"].values[i])
    return orbit_distance(p, q, scale)


def response_noise(system: System, method: Method, exact: xr.Dataset) -> np.ndarray:
    """Noise of a method in units of the exact response of each start, float64[places..., s]; 0
    where there is none.
    """
    peaks = exact["response_peak"].values[:, None]
    noise = Stroboscope(system, method).noise_of(peaks)
    of_starts: np.ndarray = np.append(noise, 0.0)[exact["response_of"].values.clip(-1)]
    return of_starts


def cell_agreement(
    exact: xr.Dataset, other: xr.Dataset, distance: np.ndarray, noise: np.ndarray
) -> np.ndarray:
    """1 where two methods give one response, 0 where they differ, -1 where one of them gives none,
    int8.
    """
    settled = (exact["response_of"].values >= 0) & (other["response_of"].values >= 0)
    aperiodic = (exact["type"].values == other["type"].values) & (other["period"].values == 0)
    same = (distance <= np.maximum(SAME_NOISE * noise, SAME_AT_LEAST)) | (
        aperiodic & np.isfinite(distance)
    )
    return np.where(settled, same.astype(np.int8), np.int8(-1)).astype(np.int8)


def one_period_errors(
    system: System, reference: Method, method: Method, exact: xr.Dataset, threads: int | None = None
) -> dict[str, np.ndarray]:
    """Error of a method over one forcing period, from states on the exact responses at each value
    of the parameters.

    It doesn't depend on stability or basins, so it is a smooth function of the parameters: the
    method's own error.

    Returns
    -------
    dict of float64[places...]
        ``step_error``, ``step_error_rms``: largest and root mean square over the states of the
        responses and their points, in units of the range of each state in the motion, NaN where
        the method doesn't get through the period;
        ``steps_per_period``: steps tried.
    """
    axes = parameters_of(exact)
    places = np.array(exact["response_of"].shape[:-1])
    m, points = exact.sizes["response"], _points(exact)[:, :POINTS]
    valid = np.isfinite(points).all(axis=2)
    response = np.repeat(np.arange(m), valid.sum(axis=1))
    start = points[valid]
    names = list(system.values)
    rows = np.tile(np.array(list(system.values.values())), (len(start), 1))
    where = np.zeros((len(start), len(axes)), np.int64)
    for a, name in enumerate(axes):
        column = exact[response_name(name)].values[response]
        rows[:, names.index(name)] = column
        where[:, a] = np.abs(exact[name].values[None, :] - column[:, None]).argmin(axis=1)
    flat = (
        np.ravel_multi_index(tuple(where.T), tuple(places)) if len(start) else np.zeros(0, np.int64)
    )
    right, wrong = (Stroboscope(system, one, rows, threads=threads) for one in (reference, method))
    scale = motion_range(right, start)
    outcome = wrong.run(start, 1)
    apart = np.abs((outcome.state - right.run(start, 1).state) / scale)
    lost = ~np.isin(outcome.status, (st.OK, st.GRAZE_UNRESOLVED))
    steps = outcome.counters[:, st.STEPS] + outcome.counters[:, st.REJECTED]
    size = int(np.prod(places))
    count = np.maximum(np.bincount(flat, minlength=size), 1)
    largest = np.full(size, np.nan)
    np.fmax.at(largest, flat, apart.max(axis=1))
    gone = np.bincount(flat, lost, size) > 0
    empty = np.bincount(flat, minlength=size) == 0
    fields = {
        "step_error": np.where(gone, np.nan, largest),
        "step_error_rms": np.where(
            gone, np.nan, np.sqrt(np.bincount(flat, np.mean(apart**2, axis=1), size) / count)
        ),
        "steps_per_period": np.bincount(flat, steps, size) / count,
    }
    return {
        name: np.where(empty, np.nan, values).reshape(places) for name, values in fields.items()
    }
