"""Result of ``simulate``: motions, their contacts and how they ended."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np
import xarray as xr

from saltus.errors import counted
from saltus.results.dataset.schema import ResultKind, end_name, outputs_in, sample_dim, told_of
from saltus.results.dataset.variable import (
    COUNTERS,
    END_STATES,
    END_TIME,
    GUARDS,
    MINIMA,
    SHARED,
    STATUS,
    Variable,
)
from saltus.results.table import TextTable, left_out, of_trajectory, quantity, table, words
from saltus.results.wording import ended_early, header, plain, tally, unit_of

_CONTACT = ("contact",)

#: Variables of the result of ``simulate``. Trajectories whose forcing periods differ share phases,
#: not times: the dim of their samples is ``period``, not ``time``. Contacts are one table for all
#: trajectories.
VARIABLES = {
    "<state>": Variable(("trajectory", "time"), "<state>", "<state>"),
    "time": Variable(("trajectory?", "time"), "s", "time", coord=True),
    "period": Variable(("time",), "1", "time in forcing periods", coord=True),
    "mode": Variable(
        ("trajectory", "time"),
        "1",
        "sides of the guards: bit i is set where gap i is positive",
        "i8",
    ),
    "contact_time": Variable(_CONTACT, "s", "time of the contact"),
    "contact_time_error": Variable(_CONTACT, "s", "estimated error of the time of the contact"),
    "contact_guard": Variable(_CONTACT, "", "guard that was met", "str"),
    "contact_direction": Variable(
        _CONTACT, "1", "+1 where the gap becomes positive, -1 where it becomes negative", "i1"
    ),
    "contact_velocity": Variable(_CONTACT, "<gap rate>", "rate of the gap at the contact"),
    "contact_kind": Variable(_CONTACT, "", "kind of contact", "str"),
    "contact_mode_before": Variable(_CONTACT, "1", "mode before the contact", "i8"),
    "contact_mode_after": Variable(_CONTACT, "1", "mode after the contact", "i8"),
    "contact_steps": Variable(_CONTACT, "1", "accepted steps from the start to the contact", "i8"),
    "contact_trajectory": Variable(_CONTACT, "1", "trajectory that the contact belongs to", "i8"),
    "contact_<state>": Variable(
        _CONTACT, "<state>", "<state> at the contact; behind it where it jumps"
    ),
    "contact_<state>_before": Variable(_CONTACT, "<state>", "<state> before the contact"),
    "status": STATUS,
    **COUNTERS,
    **MINIMA,
    **END_TIME,
    **END_STATES,
    **GUARDS,
    **SHARED,
}


# -- account ---------------------------------------------------------------------------------------
def account(ds: xr.Dataset) -> list[str]:
    """Extent, status and contacts."""
    lines = [f"extent   {_extent(ds)}", f"status   {told(ds['status'].values)}"]
    if "until" in ds.attrs:
        met = int((ds["status"].values == "until").sum())
        lines.append(f"until    {ds.attrs['until']}{'' if met else ', which never came true'}")
    if "contact_kind" in ds:
        kinds = told(ds["contact_kind"].values) if ds.sizes["contact"] else "none"
        lines.append(f"contacts {kinds}")
    if "contact_time_error" in ds:
        lines += _unknown(ds)
    return lines


def _unknown(ds: xr.Dataset) -> list[str]:
    """A line on the contacts of which nothing is known, as their motion has magnified rounding."""
    unknown = np.isinf(ds["contact_time_error"].values)
    if not unknown.any():
        return []
    first = float(ds["contact_time"].values[unknown].min())
    return [
        f"         times of {int(unknown.sum())} aren't known, from {first:.6g} s on: rounding has "
        f"grown to the size of the motion"
    ]


def headline(ds: xr.Dataset) -> str:
    """Length, contacts, status and grazes in a line, as far as the Dataset has them."""
    return ", ".join(_content(ds))


def told(status: np.ndarray) -> str:
    """``3 ok, 1 graze_unresolved``; a single word stays itself."""
    if status.ndim == 0:
        return str(status)
    return ", ".join(f"{count} {word}" for word, count in tally(status).items())


def _extent(ds: xr.Dataset) -> str:
    parts = [counted(ds.sizes.get("trajectory", 1), "trajectory")]
    if "time" in ds and ds["time"].size:
        parts.append(
            f"{ds['time'].shape[-1]} samples from {float(ds['time'].min()):g} to "
            f"{float(ds['time'].max()):g} s"
        )
    if "period" in ds and ds["period"].size:
        parts.append(f"periods {float(ds['period'].min()):g} to {float(ds['period'].max()):g}")
    return ", ".join(parts)


def _content(ds: xr.Dataset) -> Iterator[str]:
    if "trajectory" in ds.dims:
        yield counted(ds.sizes["trajectory"], "trajectory")
    if "period" in ds.coords and ds["period"].size:
        yield f"{np.ptp(ds['period'].values):g} T"
    elif "time" in ds.coords and ds["time"].size:
        yield f"{np.ptp(ds['time'].values):g} s"
    if "contact" in ds.dims:
        yield counted(ds.sizes["contact"], "contact") if ds.sizes["contact"] else "no contact"
    if "status" in ds:
        yield told(ds["status"].values)
    if "grazes_unresolved" in ds:
        grazes = int(ds["grazes_unresolved"].sum())
        yield counted(grazes, "unresolved graze") if grazes else "no unresolved graze"


# -- rows ------------------------------------------------------------------------------------------
def rows(
    title: str,
    run: xr.Dataset,
    responses: Sequence[str] = (),
    sentences: Mapping[str, str] = MappingProxyType({}),
) -> list[TextTable]:
    """A row for each trajectory: status, contacts, grazes, steps, state at the end and, where it is
    given, its response; ``sentences`` say what each status means.
    """
    batch = run if "trajectory" in run.dims else run.expand_dims("trajectory")
    total = batch.sizes["trajectory"]
    counts = [
        name
        for name in ("events", "grazes", "grazes_unresolved", "steps")
        if name in batch and (name in ("events", "steps") or batch[name].any())
    ]
    columns = of_trajectory(run, heading="") or [words("", [0], "trajectory")]
    columns.append(words("status", batch["status"].values.astype(str)))
    columns += [
        words("contacts" if name == "events" else plain(name), batch[name].values)
        for name in counts
    ]
    columns += [
        quantity(f"{name} at the end", batch[end_name(name)].values, unit_of(batch[name]), 5)
        for name in told_of(run)
        if end_name(name) in batch
    ]
    columns += [words("response", responses)] * bool(responses)
    early = [
        f"{count} of {total} {word}: {sentences.get(word, '')}."
        for word, count in ended_early(batch).items()
    ]
    return [table(title, columns, (*left_out(total, "trajectories"), *early))]


def sample_rows(run: xr.Dataset) -> TextTable:
    """A row for each given time, of each trajectory: the states there."""
    columns = {name: values for name, (_, values) in sample_columns(run).items()}
    shown = [words("", columns["trajectory"], "trajectory")] if "trajectory" in columns else []
    shown += [
        quantity(name, columns[name], unit_of(run[name]), 6) for name in ("time", *told_of(run))
    ]
    total = len(columns["time"])
    return table("states at the given times", shown, left_out(total, "times"))


# -- all of it -------------------------------------------------------------------------------------
#: Columns by name, each with the name and the values of its variable.
Columns = dict[str, tuple[str, np.ndarray]]


def sample_columns(ds: xr.Dataset) -> Columns:
    """One row a sample: trajectory (of a batch), time, period, states, outputs, mode."""
    names = [
        name for name in ("trajectory", "time", "period", *outputs_in(ds), "mode") if name in ds
    ]
    dims = [dim for dim in ("trajectory", sample_dim(ds)) if dim in ds.dims]
    shape = xr.Variable(dims, np.empty([ds.sizes[dim] for dim in dims]))
    return {name: (name, _spread(ds[name].variable, shape)) for name in names}


def contact_columns(ds: xr.Dataset) -> Columns:
    """Columns with one row a contact, of the trajectories that the Dataset has. The prefix
    ``contact_`` is dropped; empty for a result without contacts.
    """
    names = [str(name) for name in ds.data_vars if ds[name].dims == ("contact",)]
    names.sort(key=lambda name: name != "contact_trajectory")
    mine: Any = slice(None)
    if "contact_trajectory" in names and "trajectory" in ds:
        mine = np.isin(ds["contact_trajectory"].values, ds["trajectory"].values)
    return {name.removeprefix("contact_"): (name, ds[name].values[mine]) for name in names}


def sheets(ds: xr.Dataset) -> dict[str, Mapping[str, np.ndarray]]:
    """Contacts; of a batch trajectories with parameters, status, counters and end; samples."""
    return {
        "contacts": _titled(ds, contact_columns(ds), "contact_"),
        "trajectories": _trajectories(ds) if "trajectory" in ds.dims else {},
        "": _titled(ds, sample_columns(ds)),
    }


def _titled(ds: xr.Dataset, columns: Columns, prefix: str = "") -> dict[str, np.ndarray]:
    """Columns under headers that carry the units: ``x [m]``."""
    return {header(ds, name).removeprefix(prefix): values for name, values in columns.values()}


def _trajectories(ds: xr.Dataset) -> dict[str, np.ndarray]:
    names = [str(name) for name in ds.variables if ds[name].dims == ("trajectory",)]
    names.sort(key=lambda name: name != "trajectory")
    return {header(ds, name): ds[name].values for name in names}


def _spread(variable: xr.Variable, shape: xr.Variable) -> np.ndarray:
    """A variable as a column that has a row for every element of ``shape``."""
    return np.ravel(variable.set_dims(dict(shape.sizes)).transpose(*shape.dims).values)


KIND = ResultKind(
    "sl.simulate", VARIABLES, ("<state>", "status"), account, rows, headline=headline, sheets=sheets
)
