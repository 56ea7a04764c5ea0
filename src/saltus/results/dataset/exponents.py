"""Arrays in, Dataset out, for Lyapunov exponents."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from saltus.errors import ParameterError
from saltus.results.dataset import schema
from saltus.results.dataset.finish import array_variable, finish

#: Meaning of the values of ``near_graze``.
_NEAR = {0: "clear_of_grazes", 1: "near_graze"}


def exponents_dataset(
    *,
    columns: Mapping[str, Any],
    rate: str,
    states: Sequence[str] = (),
    units: Mapping[str, str] | None = None,
    gap_unit: str = "",
    varied: Mapping[str, np.ndarray] | None = None,
    attrs: Mapping[str, Any] | None = None,
) -> xr.Dataset:
    """Assemble what ``lyapunov`` and ``wolf`` return.

    Parameters
    ----------
    columns : mapping of str to array
        The variables, by their names and with the dims of :data:`saltus.results.dataset.schema.EXPONENTS_VARIABLES`. Variables that make
        no sense for a method may be left out.
    rate : str
        Unit of the exponents.
    states : sequence of str
        Names, in the order of the system; none for a recorded series.
    units : mapping of str to str, optional
        Units of the varied parameters.
    gap_unit : str
        Unit of the guards' gaps.
    varied : mapping of str to array, shape (trajectory,), optional
        Parameters that differ between trajectories [SI].
    attrs : mapping, optional
        Provenance and settings; values that are neither text nor number become JSON text.

    Returns
    -------
    Dataset
        Dims ``trajectory``, ``exponent``, ``running``, and ``flow_exponent`` where the flow's convention is given.

    Raises
    ------
    ParameterError
        If a varied parameter has the name of a variable of the result.
    """
    table = schema.EXPONENTS_VARIABLES
    data = {}
    for name, values in columns.items():
        spec = table[name]
        labels: dict[str, Any] = {"units": {"<rate>": rate, "<gap>": gap_unit}.get(spec.units, spec.units), "long_name": spec.long_name}
        if name == "near_graze":
            labels |= {"flag_values": np.array(sorted(_NEAR), dtype=np.int8), "flag_meanings": " ".join(_NEAR.values())}
        data[name] = array_variable(spec.dims, np.asarray(values, dtype={"str": np.str_}.get(spec.dtype, spec.dtype)), labels)
    coords = {"trajectory": _index(len(data["kind"]))}
    for name, column in (varied or {}).items():
        if name in table:
            raise ParameterError(f"the parameter {name!r} has the name of something else in the result. Rename it in the system.")
        coords[name] = array_variable(
            ("trajectory",), np.asarray(column, float), {"units": (units or {}).get(name, ""), "long_name": name.replace("_", " ")}
        )
    own = {"saltus_result": schema.EXPONENTS, "schema_version": schema.VERSION, "states": " ".join(states)}
    return finish(data, coords, {**(attrs or {}), **own})


def _index(count: int) -> xr.Variable:
    spec = schema.EXPONENTS_VARIABLES["trajectory"]
    return array_variable(spec.dims, np.arange(count), {"units": spec.units, "long_name": spec.long_name})
