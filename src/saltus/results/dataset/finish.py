"""The last step of every result: from arrays to variables, from variables to a Dataset with the hash of its numbers.

Everything that goes in is an array of NumPy. Where xarray isn't told so, it asks whether an array is one of dask, pint, cupy or sparse, and
imports for it those that are installed: dask.array alone takes 0.4 s.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd  # type: ignore[import-untyped]
import xarray as xr

from saltus.errors import ParameterError
from saltus.results.dataset.result import Result
from saltus.results.provenance import content_hash, to_json

_TWICE = "{!r} would stand for two things in the result. Rename the state, or the parameter, of this name."


def array_variable(dims: tuple[str, ...], values: np.ndarray, attrs: Mapping[str, Any]) -> xr.Variable:
    """A variable that holds this very array."""
    return xr.Variable(dims, np.asarray(values), dict(attrs), fastpath=True)


class Once(dict[str, xr.Variable]):
    """Variables by name. Raises ParameterError where a name is given twice: a state, or a parameter, may be called as something else is."""

    def __setitem__(self, name: str, variable: xr.Variable) -> None:
        if name in self:
            raise ParameterError(_TWICE.format(name))
        super().__setitem__(name, variable)


def finish(data: Mapping[str, xr.Variable], coords: Mapping[str, xr.Variable], attrs: Mapping[str, Any]) -> Result:
    """The Dataset of these variables; attributes that are neither text nor number become JSON text."""
    for name in data:
        if name in coords:
            raise ParameterError(_TWICE.format(name))
    plain = {key: value if isinstance(value, str | int | float) else to_json(value) for key, value in attrs.items()}
    ds = Result(data, indexed(coords), plain)
    ds.attrs["result_hash"] = content_hash(ds)
    return ds


def indexed(coords: Mapping[str, xr.Variable]) -> xr.Coordinates:
    """Coordinates, with an index for each that has the name of its dim."""
    indexes = {name: xr.indexes.PandasIndex(pd.Index(one.values), name, one.dtype) for name, one in coords.items() if one.dims == (name,)}
    variables: dict[str, Any] = dict(coords)
    for name, index in indexes.items():
        variables |= index.create_variables({name: coords[name]})
    return xr.Coordinates(variables, indexes)
