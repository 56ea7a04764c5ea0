"""Selection from a run for a picture: one trajectory, a window of time, the samples and contacts in
it.
"""

from __future__ import annotations

import json
import math
import numbers
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from saltus.errors import ParameterError, among, nearest, shown
from saltus.plot.picture import PictureError, caller
from saltus.results.dataset.schema import (
    before_name,
    contact_name,
    equations_of,
    forcing_period,
    output_word,
    outputs_in,
    rate_unit,
    sample_dim,
    states_of,
    told_of,
)
from saltus.units import from_si

Periods = int | float | tuple[float, float] | None
#: Most trajectories in one picture: the colours of the palette.
MOST = 8
#: Most states at the start that a legend names a trajectory by.
MOST_STATES = 2


# -- trajectory ------------------------------------------------------------------------------------
def chosen(run: xr.Dataset, trajectory: Any) -> list[int]:
    """Labels of the trajectories to show; an empty list for a run with one trajectory.

    Raises
    ------
    ParameterError
        If a label is unknown, or there are more than :data:`MOST` and none was chosen.
    """
    if isinstance(trajectory, str) and trajectory in run:
        name = shown(trajectory)
        raise ParameterError(
            f"{name} is a quantity of this run, not a trajectory. Write state={name} in a history, "
            "or the name of the argument that it is meant for."
        )
    if "trajectory" not in run.dims:
        if trajectory not in (None, 0):
            raise ParameterError(
                f"trajectory={shown(trajectory)}, but this run holds a single "
                f"trajectory. Leave trajectory out."
            )
        return []
    known: list[int] = run["trajectory"].values.tolist()
    if trajectory is None:
        labels = known
    else:
        labels = [
            int(one) if isinstance(one, numbers.Integral) else one
            for one in np.atleast_1d(trajectory).tolist()
        ]
    strange = [label for label in labels if label not in known]
    if strange:
        raise ParameterError(
            f"there is no trajectory {shown(strange[0])}; this run has {_span(known)}."
        )
    if not 0 < len(labels) <= MOST:
        raise PictureError(
            f"{caller()} shows 1 to {MOST} trajectories, not {len(labels)}. "
            f"Choose, such as trajectory=[{known[0]}]."
        )
    return labels


def _span(known: list[int]) -> str:
    return f"{known[0]} to {known[-1]}" if len(known) > 1 else f"only {known[0]}"


def single(run: xr.Dataset, label: int | None) -> xr.Dataset:
    """Select one trajectory of a run, its samples in the order of time, with its contacts only."""
    ds = run if label is None else run.sel(trajectory=label)
    if sample_dim(ds) in ds.dims and "sample_times" in ds.attrs:
        ds = ds.sortby(sample_dim(ds))
    if "contact_trajectory" in ds and "trajectory" in ds.coords:
        ds = ds.isel(
            contact=np.flatnonzero(ds["contact_trajectory"].values == int(ds["trajectory"]))
        )
    return ds


def named(run: xr.Dataset, one: xr.Dataset, label: int) -> str:
    """Name of a trajectory of a batch: the parameters that vary, else its start if that is known,
    else its number.
    """
    varied = json.loads(one.attrs.get("varied_parameters", "[]"))
    known = [one[name] for name in varied if name in one.coords and one[name].ndim == 0]
    if known:
        return _valued(known)
    starts = _start_that_differs(run, one)
    return f"from {_valued(starts)}" if starts else f"trajectory {label}"


def _valued(known: list[xr.DataArray]) -> str:
    texts = [
        f"{value.name} = {from_si(float(value), value.attrs.get('units', ''), 4)}"
        for value in known
    ]
    return ", ".join(text.replace("_", " ") for text in texts)


def _start_that_differs(run: xr.Dataset, trajectory: xr.Dataset) -> list[xr.DataArray]:
    """Initial values of the states and outputs that differ between trajectories; none if the start
    wasn't kept, or they are more than fit a legend.
    """
    dim = sample_dim(run)
    sampled = dim in run.dims and all(name in run for name in told_of(run))
    if (
        not sampled
        or "sample_times" in run.attrs
        or ("period" in run.coords and float(run["period"].values.min(initial=0.0)) != 0.0)
    ):
        return []
    first = {name: run[name].isel({dim: 0}).values for name in told_of(run)}
    differing = [name for name, values in first.items() if np.ptp(values) > 0.0]
    return (
        [trajectory[name].isel({dim: 0}) for name in differing]
        if len(differing) <= MOST_STATES
        else []
    )


def rate_of(ds: xr.Dataset, state: str) -> str:
    """State that is the rate of another, as v is of x; of an output the next one that has the unit
    of its rate. Empty if there is none.
    """
    if state not in states_of(ds):
        unit = ds[state].attrs.get("units", "")
        behind = told_of(ds)[told_of(ds).index(state) + 1 :] if unit else ()
        rates = [name for name in behind if ds[name].attrs.get("units") == rate_unit(unit)]
        return rates[0] if rates else ""
    return next((name for name in states_of(ds) if f"d{state}/dt = {name}" in equations_of(ds)), "")


def state_named(run: xr.Dataset, name: str) -> str:
    """Return the name if it is that of a state or an output; else raise a ParameterError with the
    nearest name.
    """
    known = outputs_in(run)
    if not among(name, known):
        raise ParameterError(
            f"this run has no {output_word(run)} {shown(name)}. {nearest(name, known)}"
        )
    return name


def units_of_states(run: xr.Dataset, units: Mapping[str, str] | None) -> dict[str, str]:
    """Display units that the user chose, every name checked."""
    return {state_named(run, name): unit for name, unit in (units or {}).items()}


# -- window ----------------------------------------------------------------------------------------
def window(ds: xr.Dataset, periods: Periods, default_share: float = 1.0) -> tuple[float, float]:
    """Begin and end of the window in the run's coordinate: periods if it is forced, else seconds.

    Parameters
    ----------
    ds : Dataset
        One trajectory.
    periods : int, float or pair of float, optional
        Number of periods at the end, or (first, last) period.
    default_share : float
        The last share of the run that is shown without ``periods``; of a forced run a whole number
        of periods, at least one.

    Raises
    ------
    ParameterError
        If the run is not forced, or the window lies outside it.
    """
    axis = sample_axis(ds)
    if not axis.size:
        raise ParameterError("this run holds no samples.")
    there = np.isfinite(np.stack([ds[name].values for name in states_of(ds)])).all(axis=0)
    # A trajectory that stopped early ends in NaN.
    first, last = float(axis[0]), float(axis[there][-1] if there.any() else axis[0])
    if there.sum() < 2:
        return first, first
    if periods is None:
        length = default_share * (last - first)
        if "period" in ds and default_share < 1:
            length = max(1.0, math.ceil(length - 1e-9))
        return max(first, last - length), last
    if "period" not in ds:
        raise ParameterError(
            f"periods={shown(periods)}, but this system isn't forced. Select by "
            f"time: run.sel(time=slice(1, 2))."
        )
    begin, end = _interval(periods, last)
    if begin >= last or end <= first:
        raise ParameterError(
            f"periods={shown(periods)} is outside this run, which holds periods "
            f"{first:g} to {last:g}."
        )
    return max(begin, first), min(end, last)


def _interval(periods: Any, last: float) -> tuple[float, float]:
    """``periods`` as begin and end."""
    if isinstance(periods, numbers.Real) and not isinstance(periods, bool):
        if float(periods) > 0:
            return last - float(periods), last
    elif (
        isinstance(periods, tuple | list)
        and len(periods) == 2
        and float(periods[0]) < float(periods[1])
    ):
        return float(periods[0]), float(periods[1])
    raise ParameterError(
        f"periods={shown(periods)}. Give the number of last periods, such as 5, "
        f"or begin and end, such as (10, 15)."
    )


def sample_axis(ds: xr.Dataset) -> np.ndarray:
    """Periods of the samples of one trajectory if it is forced, else their times [s]."""
    return np.asarray(ds["period" if "period" in ds else "time"].values, dtype=float)


# -- points ----------------------------------------------------------------------------------------
@dataclass(frozen=True)
class Path:
    """Samples and contacts in the window, in the order of time. A piece of curve has the mode of
    the point at which it begins.

    Attributes
    ----------
    time : array, shape (point,)
        [s]
    values : array, shape (point, state)
        The states that were asked for [their units].
    mode : array of int, shape (point,)
        Sides of the guards just after the point.
    """

    time: np.ndarray
    values: np.ndarray
    mode: np.ndarray


def contacts_in(ds: xr.Dataset, begin: float, end: float) -> xr.Dataset:
    """The rows of the table of contacts in the window."""
    where = ds["contact_time"].values
    if "period" in ds:  # counted from the start of the run, which may be at any time
        first = {sample_dim(ds): 0}
        since = where - float(ds["time"].isel(first))
        where = float(ds["period"].isel(first)) + since / forcing_period(ds)
    return ds.isel(contact=np.flatnonzero((where >= begin) & (where <= end)))


def path(ds: xr.Dataset, states: tuple[str, ...], begin: float, end: float) -> Path:
    """Curve of one trajectory in the window. Contacts are inserted, so that colours change exactly
    there; at a jump both sides are.
    """
    axis = sample_axis(ds)
    slack = 1e-9 * max(1.0, abs(end))
    inside = ds.isel(
        {sample_dim(ds): np.flatnonzero((axis >= begin - slack) & (axis <= end + slack))}
    )
    table = contacts_in(ds, begin, end)
    sides: list[tuple[Callable[[str], str], str]] = [(contact_name, "contact_mode_after")]
    if any(before_name(name) in table for name in states):
        sides.insert(0, (_before(table), "contact_mode_before"))

    def joined(samples: str, contacts: list[str]) -> np.ndarray:
        columns = np.stack([table[name].values for name in contacts], axis=-1)
        return np.concatenate([inside[samples].values, columns.ravel()])

    time = joined("time", ["contact_time"] * len(sides))
    values = np.stack(
        [joined(name, [of_state(name) for of_state, _ in sides]) for name in states], axis=-1
    )
    mode = joined("mode", [name for _, name in sides])
    # At equal times contacts come last: the curve continues in their mode.
    order = np.argsort(time, kind="stable")
    return Path(time[order], values[order], mode[order])


def _before(table: xr.Dataset) -> Callable[[str], str]:
    """Name of the values before the contacts: those at the contacts where nothing jumps."""
    return lambda name: before_name(name) if before_name(name) in table else contact_name(name)


def stroboscope_points(
    ds: xr.Dataset, states: tuple[str, ...], begin: float, end: float
) -> np.ndarray:
    """The states at whole forcing periods in the window, shape (point, state); none if the system
    isn't forced.
    """
    if "period" not in ds:
        return np.empty((0, len(states)))
    axis = sample_axis(ds)
    # A millionth of a period is far less than the distance of two samples.
    at_periods = np.abs(axis - np.round(axis)) < 1e-6
    index = np.flatnonzero(at_periods & (axis >= begin - 1e-6) & (axis <= end + 1e-6))
    return np.stack([ds[name].values[index] for name in states], axis=-1)
