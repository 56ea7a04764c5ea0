"""Origin of a result: attributes that are enough to compute it again, and a hash of its numbers.

Nothing here depends on the clock, the host or the user: the same computation gives the same
attributes, so files compare bit by bit.
"""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Hashable, Iterable, Mapping
from functools import cache
from importlib import metadata
from typing import Any

import numpy as np
import xarray as xr

#: Packages whose versions can change the digits of a result or the layout of its file.
_PACKAGES = ("numpy", "llvmlite", "xarray", "saltus")
#: Encoder for all calls: ``json.dumps`` with an option makes a new one each time.
_JSON = json.JSONEncoder(ensure_ascii=False)


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
        Parameter values [SI]; those of ``varied`` are left out, their values are coordinates along
        ``trajectory``.
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
        ``saltus_version``, ``system``, ``source``, ``fingerprint``, ``method``, and as JSON text
        ``equations``, ``parameters``, ``varied_parameters``, ``units``, ``method_options``,
        ``versions``.
    """
    varied = list(varied)
    return {
        **made_by(),
        "system": system,
        "source": source,
        "fingerprint": fingerprint,
        "equations": to_json(list(equations)),
        "parameters": to_json(
            {name: float(value) for name, value in parameters.items() if name not in varied}
        ),
        "varied_parameters": to_json(varied),
        "units": to_json(dict(units)),
        "method": method,
        "method_options": to_json(dict(method_options)),
    }


def inherited(ds: xr.Dataset) -> dict[str, Any]:
    """Attributes that a result takes over from the result that it is made of."""
    return {
        str(key): value
        for key, value in ds.attrs.items()
        if key not in ("result_hash", "forcing_period_s")
    }


def made_by() -> dict[str, str]:
    """Attributes of a result without a system: the versions of saltus and its libraries."""
    return {"saltus_version": version("saltus"), "versions": _versions()}


def to_json(value: Any) -> str:
    """JSON text of plain values in the order given; numbers keep all their digits."""
    return _JSON.encode(value)


@cache  # reading it takes a millisecond, and what this process runs doesn't change
def version(package: str) -> str:
    """Version of an installed package, ``"not installed"`` for one that isn't (a source tree on the
    path).
    """
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "not installed"


@cache
def _versions() -> str:
    return to_json(versions())


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that a result rests on."""
    return {"python": platform.python_version()} | {
        package: version(package) for package in _PACKAGES
    }


# -- hash of the numbers ---------------------------------------------------------------------------
def content_hash(ds: xr.Dataset) -> str:
    """SHA-256 of every variable's name, dims, shape and values, in hexadecimal.

    Attributes are left out, and so is the width in which a file format keeps an integer or a text:
    the same numbers have the same hash, whichever file they went through. Every bit of a float
    counts, the sign of a zero included.
    """
    return hash_of(
        {
            str(name): (variable.dims, np.asarray(variable.values))
            for name, variable in ds.variables.items()
        }
    )


def hash_of(variables: Mapping[str, tuple[tuple[Hashable, ...], np.ndarray]]) -> str:
    """:func:`content_hash` of variables that are no Dataset yet: dims and values by name."""
    digest = hashlib.sha256()
    for name, (dims, values) in sorted(variables.items()):
        digest.update(f"{name} {dims} {values.shape}\n".encode())
        digest.update(_canonical(values))
    return digest.hexdigest()


def file_hash(ds: xr.Dataset) -> str:
    """SHA-256 of the numbers and of every attribute, in hexadecimal: equal before writing and after
    reading.
    """
    owners = {"": ds.attrs} | {str(name): variable.attrs for name, variable in ds.variables.items()}
    attrs = {
        owner: {key: value for key, value in values.items() if key != "file_hash"}
        for owner, values in owners.items()
    }
    return hashlib.sha256(
        (content_hash(ds) + json.dumps(attrs, sort_keys=True, default=str)).encode()
    ).hexdigest()


def _canonical(values: np.ndarray) -> bytes | memoryview:
    """The bytes of an array in one width for each kind of value."""
    if values.dtype.kind == "f":
        return np.ascontiguousarray(values, dtype="<f8").data
    if values.dtype.kind in "iub":
        return np.ascontiguousarray(values, dtype="<i8").data
    words = values.ravel().tolist()
    return "\0".join(words if values.dtype.kind == "U" else map(str, words)).encode()
