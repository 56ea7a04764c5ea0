"""A result as plain tables: columns with headers, for formats that know no dims."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any

import numpy as np
import xarray as xr

from saltus.results.dataset.schema import parameters_of, response_name, sample_dim, states_of
from saltus.results.wording import unit_of
from saltus.units import titled

Table = dict[str, np.ndarray]


#: Columns by name, each with the variable of the result that it is.
Columns = dict[str, tuple[str, np.ndarray]]


def sample_columns(ds: xr.Dataset) -> Columns:
    """One row a sample: trajectory (of a batch), time, period, states, mode."""
    names = [
        name for name in ("trajectory", "time", "period", *states_of(ds), "mode") if name in ds
    ]
    dims = [dim for dim in ("trajectory", sample_dim(ds)) if dim in ds.dims]
    shape = xr.Variable(dims, np.empty([ds.sizes[dim] for dim in dims]))
    return {name: (name, _spread(ds[name].variable, shape)) for name in names}


def contact_columns(ds: xr.Dataset) -> Columns:
    """One row a contact, of the trajectories that the Dataset (still) has. The prefix ``contact_``
    is dropped; empty for a result without contacts.
    """
    names = [str(name) for name in ds.data_vars if ds[name].dims == ("contact",)]
    names.sort(key=lambda name: name != "contact_trajectory")
    mine: Any = slice(None)
    if "contact_trajectory" in names and "trajectory" in ds:
        mine = np.isin(ds["contact_trajectory"].values, ds["trajectory"].values)
    return {name.removeprefix("contact_"): (name, ds[name].values[mine]) for name in names}


def samples(ds: xr.Dataset) -> Table:
    """As :func:`sample_columns`, with headers that carry the units: ``x [m]``."""
    return {_header(ds, name): values for name, values in sample_columns(ds).values()}


def contacts(ds: xr.Dataset) -> Table:
    """As :func:`contact_columns`, with headers that carry the units."""
    return {
        _header(ds, name).removeprefix("contact_"): values
        for name, values in contact_columns(ds).values()
    }


def trajectories(ds: xr.Dataset) -> Table:
    """One row a trajectory of a batch: its parameters, status, counters and end."""
    names = [str(name) for name in ds.variables if ds[name].dims == ("trajectory",)]
    names.sort(key=lambda name: name != "trajectory")
    return {_header(ds, name): ds[name].values for name in names}


def responses(ds: xr.Dataset) -> Table:
    """One row a response: its parameters, branch, kind, size, stability. The prefix ``response_``
    is dropped.
    """
    names = [str(name) for name in ds.variables if ds[name].dims == ("response",)]
    first = ["response", *(response_name(name) for name in parameters_of(ds))]
    names.sort(key=lambda name: first.index(name) if name in first else len(first))
    return {
        _header(ds, name).removeprefix("response_"): ds[name].values for name in names
    } | _outputs(ds)


def _outputs(ds: xr.Dataset) -> Table:
    """A column for each number of each output: ``stop force amplitude [N]``."""
    table = {}
    for i, output in enumerate(ds["output"].values.tolist() if "output" in ds else []):
        for name in (str(name) for name in ds.data_vars if ds[name].dims == ("response", "output")):
            unit = "rad" if name == "output_phase" else ds["output_units"].values[i]
            header = f"{output} {name.removeprefix('output_').replace('_', ' ')}"
            table[titled(header, unit)] = ds[name].values[:, i]
    return table


def events(ds: xr.Dataset) -> Table:
    """One row for what happens to a branch. The prefix ``event_`` is dropped; empty for a result
    without events.
    """
    names = (
        [str(name) for name in ds.variables if ds[name].dims == ("event",)]
        if ds.sizes.get("event")
        else []
    )
    return {_header(ds, name).removeprefix("event_"): ds[name].values for name in names}


def scalars(ds: xr.Dataset) -> dict[str, object]:
    """What has no dims: the status, counters and end of a single trajectory."""
    return {_header(ds, str(name)): ds[name].item() for name in ds.variables if ds[name].dims == ()}


def guards(ds: xr.Dataset) -> list[str]:
    """A line for each guard, such as ``upper_gap: x = 0.0004 m``."""
    lines = []
    for i, name in enumerate(ds["guard"].values.tolist() if "guard" in ds else []):
        guard = ds.isel(guard=i)
        state, unit = guard["guard_state"].item(), guard["guard_units"].item()
        place = " ".join(map(str, np.atleast_1d(guard["guard_boundary"].values).tolist()))
        lines.append(f"{name}: {state} = {place} {unit}".rstrip() if state else name)
    return lines


def _header(ds: xr.Dataset, name: str) -> str:
    return titled(name, unit_of(ds[name]))


def _spread(variable: xr.Variable, shape: xr.Variable) -> np.ndarray:
    """A variable as a column that has a row for every element of ``shape``."""
    return np.ravel(variable.set_dims(dict(shape.sizes)).transpose(*shape.dims).values)


def notes(ds: xr.Dataset) -> Iterable[str]:
    """Provenance, guards and scalars as lines ``name: value``; no line holds a line break."""
    for name, value in {**ds.attrs, **scalars(ds)}.items():
        several_lines = isinstance(value, str) and "\n" in value
        yield f"{name}: {json.dumps(value, ensure_ascii=False) if several_lines else value}"
    yield from (f"guard {line}" for line in guards(ds))
