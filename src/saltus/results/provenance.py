"""Where a result comes from: attributes that are enough to compute it again, and a hash of its numbers.

Nothing here depends on the clock, the host or the user: the same computation gives the same attributes, so files compare bit by bit.
"""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Iterable, Mapping
from functools import cache
from importlib import metadata
from typing import Any

import numpy as np
import xarray as xr

from saltus.results.reader import reader
from saltus.results.schema import STROBOSCOPE, TABLES, TRAJECTORY, check, kind_of
from saltus.results.summary import summary
from saltus.units import from_si

#: Packages whose versions can change the digits of a result or the layout of its file.
_PACKAGES = ("numpy", "llvmlite", "xarray", "saltus")


def attributes(
    *,
    system: str,
    equations: Iterable[str],
    parameters: Mapping[str, float],
    units: Mapping[str, str],
    method: str,
    method_options: Mapping[str, Any],
    fingerprint: str,
    source: str = "",
    varied: Iterable[str] = (),
) -> dict[str, str]:
    """Provenance of a result, as attributes that every file format can hold.

    Parameters
    ----------
    system : str
        Name of the system.
    equations : iterable of str
        Its equations, one text per line.
    parameters : mapping of str to float
        Parameter values [SI]; those of ``varied`` are left out, their values are coordinates along ``trajectory``.
    units : mapping of str to str
        Units of states and parameters.
    method, method_options : str, mapping
        Name of the method and its options (numbers, text, booleans, None).
    fingerprint : str
        Hash of the equations.
    source : str
        Publication or note that the system comes from.
    varied : iterable of str
        Parameters that differ from trajectory to trajectory.

    Returns
    -------
    dict of str to str
        ``saltus_version``, ``system``, ``source``, ``fingerprint``, ``method``, and as JSON text ``equations``, ``parameters``,
        ``varied_parameters``, ``units``, ``method_options``, ``versions``.
    """
    varied = list(varied)
    return {
        "saltus_version": version("saltus"),
        "system": system,
        "source": source,
        "fingerprint": fingerprint,
        "equations": to_json(list(equations)),
        "parameters": to_json({name: float(value) for name, value in parameters.items() if name not in varied}),
        "varied_parameters": to_json(varied),
        "units": to_json(dict(units)),
        "method": method,
        "method_options": to_json(dict(method_options)),
        "versions": to_json(versions()),
    }


def to_json(value: Any) -> str:
    """JSON text of plain values in the order given; numbers keep all their digits."""
    return json.dumps(value, ensure_ascii=False)


@cache  # reading it takes a millisecond, and what this process runs doesn't change
def version(package: str) -> str:
    """Version of an installed package, ``"not installed"`` for one that isn't (a source tree on the path)."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "not installed"


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that a result rests on."""
    return {"python": platform.python_version()} | {package: version(package) for package in _PACKAGES}


# -- hash of the numbers -------------------------------------------------------------------------------------------------------
def content_hash(ds: xr.Dataset) -> str:
    """SHA-256 of every variable's name, dims, shape and values, in hexadecimal.

    Attributes are left out, and so is the width in which a file format keeps an integer or a text: the same numbers have the same hash,
    whichever file they went through. Every bit of a float counts, the sign of a zero included.
    """
    digest, variables = hashlib.sha256(), ds.variables
    for name in sorted(map(str, variables)):
        variable = variables[name]
        digest.update(f"{name} {variable.dims} {variable.shape}\n".encode())
        digest.update(_canonical(np.asarray(variable.values)))
    return digest.hexdigest()


def file_hash(ds: xr.Dataset) -> str:
    """SHA-256 of the numbers and of every attribute, in hexadecimal: what must come back from a file."""
    owners = {"": ds.attrs} | {str(name): variable.attrs for name, variable in ds.variables.items()}
    attrs = {owner: {key: value for key, value in values.items() if key != "file_hash"} for owner, values in owners.items()}
    return hashlib.sha256((content_hash(ds) + json.dumps(attrs, sort_keys=True, default=str)).encode()).hexdigest()


def _canonical(values: np.ndarray) -> bytes | memoryview:
    """The bytes of an array in one width for each kind of value."""
    if values.dtype.kind == "f":
        return np.ascontiguousarray(values, dtype="<f8").data
    if values.dtype.kind in "iub":
        return np.ascontiguousarray(values, dtype="<i8").data
    return "\0".join(map(str, values.ravel().tolist())).encode()


# -- for people ----------------------------------------------------------------------------------------------------------------
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
        System, parameters, method, extent, contacts, status and hash, a line each; of attractors and basins what was found.

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
        lines.append(f"method   {ds.attrs.get('method', 'unknown')}{_options(ds)}, saltus {ds.attrs.get('saltus_version', 'unknown')}")
    if kind_of(ds) in (TRAJECTORY, STROBOSCOPE):
        lines += [f"extent   {_extent(ds)}", f"status   {_tally(ds['status'].values)}"]
    else:
        lines += summary(ds)
    if "contact_kind" in ds:
        lines.append(f"contacts {_tally(ds['contact_kind'].values) if ds.sizes['contact'] else 'none'}")
    return "\n".join([*lines, f"hash     {ds.attrs.get('result_hash', 'none')[:16]}"])


def _parameters(ds: xr.Dataset) -> str:
    units = json.loads(ds.attrs.get("units", "{}"))
    values = json.loads(ds.attrs.get("parameters", "{}"))
    fixed = [f"{name} = {from_si(value, units.get(name, ''))}" for name, value in values.items()]
    return ", ".join(fixed + [f"{name} varies" for name in json.loads(ds.attrs.get("varied_parameters", "[]"))])


def _options(ds: xr.Dataset) -> str:
    options = json.loads(ds.attrs.get("method_options", "{}"))
    return f"({', '.join(f'{name}={value}' for name, value in options.items())})" if options else ""


def _extent(ds: xr.Dataset) -> str:
    trajectories = ds.sizes.get("trajectory", 1)
    parts = [f"{trajectories} {'trajectory' if trajectories == 1 else 'trajectories'}"]
    if "time" in ds and ds["time"].size:
        parts.append(f"{ds['time'].shape[-1]} samples from {float(ds['time'].min()):g} to {float(ds['time'].max()):g} s")
    if "period" in ds and ds["period"].size:
        parts.append(f"periods {float(ds['period'].min()):g} to {float(ds['period'].max()):g}")
    return ", ".join(parts)


def _tally(words: np.ndarray) -> str:
    """``3 ok, 1 graze_unresolved``; a single word stays itself."""
    if words.ndim == 0:
        return str(words)
    found, counts = np.unique(words.astype(str), return_counts=True)
    return ", ".join(f"{count} {word}" for word, count in zip(found, counts, strict=True))
