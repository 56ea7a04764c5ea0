"""Arrays in, Dataset out, for one analysis by several methods side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from saltus.results.dataset import schema
from saltus.results.dataset.basins import basin_meanings
from saltus.results.dataset.builder import Builder


def methods_dataset(
    *,
    base: xr.Dataset,
    labels: Sequence[str],
    columns: Mapping[str, np.ndarray],
    fields: Mapping[str, np.ndarray],
    attrs: Mapping[str, Any] | None = None,
) -> xr.Dataset:
    """Assemble what ``compare_methods`` returns.

    Parameters
    ----------
    base : Dataset
        The analysis by the reference: its coordinates, parameters or states, and starts.
    labels : sequence of str, length k
        A name for each method, the reference first.
    columns : mapping of str to array, shape (k,)
        What belongs to a method; see the table of the schema.
    fields : mapping of str to array, shape (k, n...)
        What belongs to a method and a place of the grid, with or without the dim ``start``.
    attrs : mapping, optional
        Provenance.

    Returns
    -------
    Dataset
        Dims ``method``, those of the grid, and ``start``.
    """
    units = {str(name): base[name].attrs.get("units", "") for name in base.variables}
    states = schema.states_of(base)
    build = Builder(schema.METHODS, states, {**units, states[0]: _first_unit(base, states[0])})
    maps = schema.kind_of(base) == schema.BASINS
    dims = schema.axes_of(base) if maps else schema.parameters_of(base)
    build.coords |= {str(name): base[name].variable for name in base.coords if set(base[name].dims) <= {*dims, "start"}}
    build.put("method", list(labels), coord=True)
    for name, column in columns.items():
        build.put(name, column, dims=("method",))
    for name, field in fields.items():
        own = ("method", *dims) if field.ndim == 1 + len(dims) else ("method", *dims, "start")
        if name == "basin":
            build.put_flags(name, field, basin_meanings(int(field.max(initial=-1)) + 1), own)
        elif name in ("agrees", "known"):
            build.put_flags(name, field, schema.AGREEING, own)
        else:
            build.put(name, field, dims=own)
    return build.dataset(attrs or {})


def _first_unit(base: xr.Dataset, state: str) -> str:
    """Unit of the first state, wherever it stands."""
    name = "peak" if "peak" in base else schema.attractor_name(state)
    return str(base[name].attrs.get("units", ""))
