"""`describe`: a few lines on a result."""

from __future__ import annotations

import json
from collections.abc import Iterator

import numpy as np
import xarray as xr

from saltus.errors import counted
from saltus.results.dataset.reader import reader
from saltus.results.dataset.schema import STROBOSCOPE, TABLES, TRAJECTORY, check, kind_of
from saltus.results.summary import summary
from saltus.results.wording import tally
from saltus.units import from_si

#: Lines of a result that a notebook shows above its variables.
_LINES = 8


@reader
def describe(ds: xr.Dataset) -> str:
    """A few lines on what a result holds and where it comes from.

    Parameters
    ----------
    ds : Dataset
        What any function of saltus returned, or :func:`~saltus.results.load`.

    Returns
    -------
    str
        System, parameters, method, extent, contacts, status and hash, a line each; of attractors
        and basins what was found.

    Raises
    ------
    ParameterError
        If ``ds`` is no result of saltus.

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    >>> run = sl.simulate(rig, start=("1 mm", 0), periods=10)
    >>> print(sl.describe(run).splitlines()[0][:37])
    delangre: mass = 3 kg, damping_ratio
    """
    check(ds, caller="describe", kinds=list(TABLES))
    lines = [f"{ds.attrs.get('system', 'system without a name')}: {_parameters(ds)}"]
    if "method" in ds.attrs or kind_of(ds) in (TRAJECTORY, STROBOSCOPE):
        lines.append(
            f"method   {ds.attrs.get('method', 'unknown')}{_options(ds)}, saltus "
            f"{ds.attrs.get('saltus_version', 'unknown')}"
        )
    if kind_of(ds) in (TRAJECTORY, STROBOSCOPE):
        lines += [f"extent   {_extent(ds)}", f"status   {_tally(ds['status'].values)}"]
    else:
        lines += summary(ds)
    if "contact_kind" in ds:
        lines.append(
            f"contacts {_tally(ds['contact_kind'].values) if ds.sizes['contact'] else 'none'}"
        )
    return "\n".join([*lines, f"hash     {ds.attrs.get('result_hash', 'none')[:16]}"])


def headline(ds: xr.Dataset) -> str:
    """The content of a result in a line or a few, such as ``delangre: 60 T, 162 contacts, ok, no
    unresolved graze``; ``""`` for a Dataset that isn't one.
    """
    name = ds.attrs.get("system", "system without a name")
    if kind_of(ds) in (TRAJECTORY, STROBOSCOPE):
        return f"{name}: {', '.join(_content(ds))}"
    if not kind_of(ds):
        return ""
    lines = summary(ds)
    more = [f"and {len(lines) - _LINES} lines more: sl.describe"] if len(lines) > _LINES else []
    return "\n".join([name, *lines[:_LINES], *more])


def _content(ds: xr.Dataset) -> Iterator[str]:
    """What a run holds: its length, contacts, status and grazes, so far as they are there."""
    if "trajectory" in ds.dims:
        yield counted(ds.sizes["trajectory"], "trajectory")
    if "period" in ds.coords and ds["period"].size:
        yield f"{np.ptp(ds['period'].values):g} T"
    elif "time" in ds.coords and ds["time"].size:
        yield f"{np.ptp(ds['time'].values):g} s"
    if "contact" in ds.dims:
        yield counted(ds.sizes["contact"], "contact") if ds.sizes["contact"] else "no contact"
    if "status" in ds:
        yield _tally(ds["status"].values)
    if "grazes_unresolved" in ds:
        grazes = int(ds["grazes_unresolved"].sum())
        yield counted(grazes, "unresolved graze") if grazes else "no unresolved graze"


def _parameters(ds: xr.Dataset) -> str:
    units = json.loads(ds.attrs.get("units", "{}"))
    values = json.loads(ds.attrs.get("parameters", "{}"))
    fixed = [f"{name} = {from_si(value, units.get(name, ''))}" for name, value in values.items()]
    return ", ".join(
        fixed + [f"{name} varies" for name in json.loads(ds.attrs.get("varied_parameters", "[]"))]
    )


def _options(ds: xr.Dataset) -> str:
    options = json.loads(ds.attrs.get("method_options", "{}"))
    return f"({', '.join(f'{name}={value}' for name, value in options.items())})" if options else ""


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


def _tally(words: np.ndarray) -> str:
    """``3 ok, 1 graze_unresolved``; a single word stays itself."""
    if words.ndim == 0:
        return str(words)
    return ", ".join(f"{count} {word}" for word, count in tally(words).items())
