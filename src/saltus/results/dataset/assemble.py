"""Arrays in, Datasets out: what an analysis computed, put under the names, dims and units of the schema."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from saltus.errors import ParameterError
from saltus.results.dataset import schema
from saltus.results.dataset.finish import Once, array_variable, finish
from saltus.results.dataset.variable import Variable


# -- what the caller hands over ------------------------------------------------------------------------------------------------
@dataclass(frozen=True)
class Contacts:
    """The table of contacts, one row each, in the order of trajectory and time.

    Attributes
    ----------
    trajectory : array of int, shape (contact,)
        Index of the trajectory.
    time, time_error : array, shape (contact,)
        Time and the estimate of its error [s].
    guard : array of int, shape (contact,)
        Index of the guard.
    direction : array of int, shape (contact,)
        +1 where the gap becomes positive, -1 where it becomes negative.
    velocity : array, shape (contact,)
        Rate of the gap [unit of the gap per second].
    kind : sequence of str, length contact
        ``crossing``, ``graze`` or ``graze_unresolved``.
    states : array, shape (contact, state)
        State at the contact [units of the states].
    mode_before, mode_after : array of int, shape (contact,)
        Sides of the guards.
    steps : array of int, shape (contact,)
        Accepted steps from the start of the trajectory to the contact.
    """

    trajectory: np.ndarray
    time: np.ndarray
    time_error: np.ndarray
    guard: np.ndarray
    direction: np.ndarray
    velocity: np.ndarray
    kind: Sequence[str] | np.ndarray
    states: np.ndarray
    mode_before: np.ndarray
    mode_after: np.ndarray
    steps: np.ndarray


@dataclass(frozen=True)
class Guards:
    """The guards of a system.

    Attributes
    ----------
    names : sequence of str
        Name of each guard; its place is its bit in the mode.
    states : sequence of str or None
        State that the guard bounds, where its gap is that state minus a value.
    boundaries : array, shape (guard,) or (guard, trajectory)
        That value [unit of the state], NaN where there is none. The second shape where it differs between trajectories.
    units : sequence of str
        Coherent SI unit of each gap, ``""`` where it isn't known; empty for those of the states.
    """

    names: Sequence[str]
    states: Sequence[str | None]
    boundaries: np.ndarray
    units: Sequence[str] = ()

    def units_among(self, states: Mapping[str, str]) -> list[str]:
        """Unit of each gap, given those of the states."""
        return list(self.units) or [states.get(state, "") if state else "" for state in self.states]

    def first(self, count: int) -> Guards:
        """So many of them."""
        return Guards(self.names[:count], self.states[:count], self.boundaries[:count], self.units[:count])


# -- assembly ------------------------------------------------------------------------------------------------------------------
class Builder:
    """Collects the variables of one Dataset by the table of its kind.

    Every array comes with the trajectory first; for a single trajectory (``batch`` false) that axis is dropped here.
    """

    def __init__(self, kind: str, states: Sequence[str], units: Mapping[str, str], guards: Guards, batch: bool, count: int) -> None:
        self.table, self.batch, self.units = schema.TABLES[kind], batch, units
        self.data, self.coords = Once(), Once()
        self.guard_units = guards.units_among(units)
        self.attrs: dict[str, Any] = {"saltus_result": kind, "schema_version": schema.VERSION, "states": " ".join(states)}
        if not batch and count != 1:
            raise ParameterError(f"a Dataset without the dim trajectory holds one trajectory, not {count}. Pass batch=True.")
        reserved = {*self.table, *(dim for spec in self.table.values() for dim in spec.dims)} if kind in schema.WITH_STATES else set()
        clash = [name for name in states if name in reserved]
        if clash:
            raise ParameterError(f"the state {clash[0]!r} has the name of something else in the result. Rename the state in the system.")
        if batch:
            self.put("trajectory", np.arange(count), each=True, coord=True)

    def put(self, name: str, values: Any, *, each: bool = False, coord: bool = False, spec: Variable | None = None) -> None:
        """Add a variable; ``each``: the values have the trajectory as their first axis."""
        spec = spec or self.table[name]
        array = np.asarray(values, dtype={"str": np.str_}.get(spec.dtype, spec.dtype))
        dims = spec.dims
        if each and self.batch:
            dims = ("trajectory", *dims)
        elif each:
            array = array[0]
        target = self.coords if coord else self.data
        target[name] = array_variable(dims, array, {"units": self.unit(spec.units), "long_name": spec.long_name})

    def unit(self, text: str) -> str:
        """A unit of the table, with that of the gaps filled in."""
        if text == "<gap>":
            return _common(self.guard_units)
        return schema.rate_unit(_common(self.guard_units)) if text == "<gap rate>" else text

    def put_state(self, name: str, variable: str, dims: tuple[str, ...], long_name: str, values: Any, each: bool = True) -> None:
        """Add a variable that holds one state."""
        self.put(variable, values, each=each, spec=Variable(dims, self.units.get(name, ""), long_name))

    def put_guards(self, guards: Guards) -> None:
        """Add the guards: names as coordinate, states, boundaries."""
        self.put("guard", list(guards.names), coord=True)
        self.put("guard_state", [state or "" for state in guards.states])
        self.put("guard_units", self.guard_units)
        boundaries = np.asarray(guards.boundaries, dtype=float)
        varied = boundaries.ndim == 2 and self.batch
        spec = self.table["guard_boundary"]
        dims = ("guard", "trajectory") if varied else ("guard",)
        values = boundaries[:, 0] if boundaries.ndim == 2 and not varied else boundaries
        self.put("guard_boundary", values, spec=Variable(dims, spec.units, spec.long_name))

    def put_each(self, values: Mapping[str, Any]) -> None:
        """Add variables of the table that hold one value per trajectory."""
        for name, value in values.items():
            self.put(name, value, each=True)

    def put_forcing(self, forcing_period: float | np.ndarray | None) -> None:
        """A shared forcing period is an attribute, one per trajectory a coordinate."""
        if forcing_period is None:
            return
        if np.ndim(forcing_period) == 0 or not self.batch:
            self.attrs["forcing_period_s"] = float(np.ravel(forcing_period)[0])
        else:
            self.put("forcing_period", forcing_period, each=True, coord=True)

    def put_varied(self, varied: Mapping[str, Any]) -> None:
        """Parameter values of each trajectory, as coordinates."""
        for name, values in varied.items():
            if name in {*self.table, "contact"}:
                raise ParameterError(f"the parameter {name!r} has the name of something else in the result. Rename it in the system.")
            self.put(name, values, each=True, coord=True, spec=Variable((), self.units.get(name, ""), name.replace("_", " ")))

    def dataset(self, attrs: Mapping[str, Any]) -> xr.Dataset:
        """The Dataset, with the hash of its numbers."""
        return finish(self.data, self.coords, {**attrs, **self.attrs})


def trajectory_dataset(
    *,
    states: Sequence[str],
    units: Mapping[str, str],
    time: np.ndarray,
    values: Mapping[str, np.ndarray],
    mode: np.ndarray,
    contacts: Contacts,
    guards: Guards,
    status: Sequence[str],
    counters: Mapping[str, np.ndarray],
    minima: Mapping[str, np.ndarray],
    end_time: np.ndarray,
    end: Mapping[str, np.ndarray],
    period: np.ndarray | None = None,
    forcing_period: float | np.ndarray | None = None,
    varied: Mapping[str, np.ndarray] | None = None,
    attrs: Mapping[str, Any] | None = None,
    batch: bool = False,
) -> xr.Dataset:
    """Assemble what ``simulate`` returns. Arrays have the trajectory first also when there is one only.

    Parameters
    ----------
    states : sequence of str
        Names, in the order of the system.
    units : mapping of str to str
        Units of states and parameters; missing ones are unknown.
    time : array, shape (time,) or (trajectory, time)
        Times of the samples [s]; the second shape where the trajectories have forcing periods of their own (needs ``period``).
    values : mapping of str to array, shape (trajectory, time)
        Each state at the samples [its unit].
    mode : array of int, shape (trajectory, time)
        Sides of the guards at the samples.
    contacts, guards : Contacts, Guards
        Tables.
    status : sequence of str, length trajectory
        How each trajectory ended.
    counters, minima : mapping of str to array, shape (trajectory,)
        By their names in :data:`saltus.results.dataset.schema.TRAJECTORY_VARIABLES`.
    end_time : array, shape (trajectory,)
        Time at the end [s].
    end : mapping of str to array, shape (trajectory,)
        Each state at the end [its unit].
    period : array, shape (time,), optional
        t/T at the samples, for forced systems.
    forcing_period : float or array, shape (trajectory,), optional
        T [s].
    varied : mapping of str to array, shape (trajectory,), optional
        Parameters that differ between trajectories [SI].
    attrs : mapping, optional
        Provenance (:func:`saltus.results.provenance.attributes`); what is not text or a number is kept as JSON.
    batch : bool
        Whether to keep the dim ``trajectory``.

    Returns
    -------
    Dataset
        Dims ``time`` (or ``period``), ``contact``, ``guard`` and for a batch ``trajectory``.

    Raises
    ------
    ParameterError
        If a state or a varied parameter has the name of a variable of the result.
    """
    build = Builder(schema.TRAJECTORY, states, units, guards, batch, len(status))
    samples = _put_samples(build, np.asarray(time, dtype=float), period)
    for name in states:
        build.put_state(name, name, (samples,), name, values[name])
    build.put("mode", mode, each=True, spec=_along(samples, "mode"))
    _put_contacts(build, states, contacts, guards)
    build.put_each({"status": status, **counters, **minima, "end_time": end_time})
    for name in states:
        build.put_state(name, schema.end_name(name), (), f"{name} at the end", end[name])
    build.put_guards(guards)
    build.put_forcing(forcing_period)
    build.put_varied(varied or {})
    return build.dataset(attrs or {})


def _put_samples(build: Builder, time: np.ndarray, period: np.ndarray | None) -> str:
    """Add the coordinates of the samples; returns the dim along which they lie."""
    shared = time.ndim == 1 or not build.batch
    samples = "time" if shared else "period"
    if period is not None:
        build.put("period", period, coord=True, spec=_along(samples, "period"))
    build.put("time", time[0] if shared and time.ndim == 2 else time, each=not shared, coord=True, spec=_along(samples, "time"))
    return samples


def _along(samples: str, name: str) -> Variable:
    """A variable of the table, along the dim of the samples."""
    spec = schema.TRAJECTORY_VARIABLES[name]
    return Variable((samples,), spec.units, spec.long_name, spec.dtype)


def _put_contacts(build: Builder, states: Sequence[str], contacts: Contacts, guards: Guards) -> None:
    """Add the table of contacts."""
    names = np.asarray(list(guards.names) or [""], dtype=np.str_)
    columns = {
        "contact_time": contacts.time,
        "contact_time_error": contacts.time_error,
        "contact_guard": names[np.asarray(contacts.guard, dtype=np.int64)],
        "contact_direction": contacts.direction,
        "contact_velocity": contacts.velocity,
        "contact_kind": contacts.kind,
        "contact_mode_before": contacts.mode_before,
        "contact_mode_after": contacts.mode_after,
        "contact_steps": contacts.steps,
    }
    for name, column in columns.items():
        build.put(name, column)
    if build.batch:
        build.put("contact_trajectory", contacts.trajectory)
    table = np.asarray(contacts.states, dtype=float).reshape(len(contacts.time), len(states))
    for i, name in enumerate(states):
        build.put_state(name, schema.contact_name(name), ("contact",), f"{name} at the contact", table[:, i], each=False)


def stroboscope_dataset(
    *,
    states: Sequence[str],
    units: Mapping[str, str],
    period: np.ndarray,
    values: Mapping[str, np.ndarray],
    status: Sequence[str],
    guards: Guards,
    counters: Mapping[str, np.ndarray] | None = None,
    minima: Mapping[str, np.ndarray] | None = None,
    forcing_period: float | np.ndarray | None = None,
    varied: Mapping[str, np.ndarray] | None = None,
    attrs: Mapping[str, Any] | None = None,
    batch: bool = True,
) -> xr.Dataset:
    """Assemble what ``stroboscope`` returns: the states at whole forcing periods.

    Parameters
    ----------
    period : array of int, shape (period,)
        Whole periods since the start.
    values : mapping of str to array, shape (trajectory, period)
        Each state [its unit].
    states, units, status, guards, counters, minima, forcing_period, varied, attrs, batch
        As in :func:`trajectory_dataset`.

    Returns
    -------
    Dataset
        Dims ``period``, ``guard`` and for a batch ``trajectory``.

    Raises
    ------
    ParameterError
        If a state or a varied parameter has the name of a variable of the result.
    """
    build = Builder(schema.STROBOSCOPE, states, units, guards, batch, len(status))
    build.put("period", period, coord=True)
    for name in states:
        build.put_state(name, name, ("period",), name, values[name])
    build.put_each({"status": status, **(counters or {}), **(minima or {})})
    build.put_guards(guards)
    build.put_forcing(forcing_period)
    build.put_varied(varied or {})
    return build.dataset(attrs or {})


def _common(units: Iterable[str]) -> str:
    """The unit that all share, else ``""``."""
    found = set(units)
    return found.pop() if len(found) == 1 else ""
