"""Arrays in, Datasets out, for the results that look at a motion more closely: see :mod:`saltus.results.dataset.motions`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from saltus.results.dataset import schema
from saltus.results.dataset.assemble import Builder, Guards
from saltus.results.dataset.variable import Variable


def motion_dataset(
    kind: str,
    *,
    states: Sequence[str],
    units: Mapping[str, str],
    guards: Guards,
    status: Sequence[str],
    each: Mapping[str, np.ndarray],
    table: Mapping[str, np.ndarray],
    end: Mapping[str, np.ndarray],
    along: str | None = None,
    coords: Mapping[str, np.ndarray] | None = None,
    table_units: Mapping[str, str] | None = None,
    forcing_period: float | np.ndarray | None = None,
    varied: Mapping[str, np.ndarray] | None = None,
    attrs: Mapping[str, Any] | None = None,
    batch: bool = False,
) -> xr.Dataset:
    """Assemble what ``poincare``, ``impact_statistics`` or ``energy_balance`` returns.

    Parameters
    ----------
    kind : str
        ``schema.SECTION``, ``schema.IMPACTS`` or ``schema.ENERGY``.
    states, units, status, forcing_period, varied, attrs, batch
        As in :func:`saltus.results.trajectory_dataset`.
    guards : Guards
        Those of the system; left out where the kind doesn't list them.
    each : mapping of str to array, shape (trajectory, ...)
        Variables of the table of this kind that each trajectory has.
    table : mapping of str to array, shape (row,)
        Variables that are one table for all trajectories; states among them by their names.
    end : mapping of str to array, shape (trajectory,)
        Each state at the end [its unit].
    along : str, optional
        Dim in place of ``period``.
    coords : mapping of str to array, optional
        Coordinates, the same for all trajectories.
    table_units : mapping of str to str, optional
        Units of variables to which the table gives none.

    Returns
    -------
    Dataset

    Raises
    ------
    ParameterError
        If a state or a varied parameter has the name of a variable of the result.
    """
    build = Builder(kind, states, units, guards, batch, len(status))

    def spec(name: str) -> Variable:
        found = build.table[name]
        dims = tuple(along if dim == "period" and along else dim for dim in found.dims)
        return Variable(dims, (table_units or {}).get(name, found.units), found.long_name, found.dtype)

    for name, values in (coords or {}).items():
        build.put(name, values, coord=True, spec=spec(name))
    for name, values in table.items():
        if name in states:
            build.put_state(name, name, ("crossing",), f"{name} at the crossing", values, each=False)
        elif batch or not name.endswith("_trajectory"):
            build.put(name, values, spec=spec(name))
    for name, value in {"status": status, **each}.items():
        build.put(name, value, each=True, spec=spec(name))
    for name, values in end.items():
        build.put_state(name, schema.end_name(name), (), f"{name} at the end", values)
    if "guard" in build.table:
        build.put_guards(guards)
    build.put_forcing(forcing_period)
    build.put_varied(varied or {})
    return build.dataset(attrs or {})


def spectrum_dataset(
    *,
    states: Sequence[str],
    units: Mapping[str, str],
    frequency: np.ndarray,
    order: np.ndarray | None,
    amplitude: Mapping[str, np.ndarray],
    phase: Mapping[str, np.ndarray],
    each: Mapping[str, Any],
    forcing_period: float | np.ndarray | None,
    varied: Mapping[str, np.ndarray],
    attrs: Mapping[str, Any],
    batch: bool,
) -> xr.Dataset:
    """Assemble what ``spectrum`` returns.

    Parameters
    ----------
    states : sequence of str
        Those that have a spectrum.
    units, forcing_period, varied, attrs, batch
        As in :func:`saltus.results.trajectory_dataset`.
    frequency : array, shape (frequency,) or (trajectory, order)
        [Hz]; the second shape where the trajectories have forcing periods of their own.
    order : array, shape (frequency,), optional
        Frequency in units of the forcing frequency, for forced systems.
    amplitude, phase : mapping of str to array, shape (trajectory, frequency)
        Of each state [its unit; rad].
    each : mapping of str to sequence, length trajectory
        ``window``, ``noise_bandwidth``, ``response_period``, ``status``.

    Returns
    -------
    Dataset
        Dim ``frequency`` (or ``order``), and ``trajectory`` for a batch.
    """
    build = Builder(schema.SPECTRUM, states, units, Guards([], [], np.zeros(0)), batch, len(each["status"]))
    dim = "frequency" if frequency.ndim == 1 else "order"
    for name, places in (("frequency", frequency), ("order", order)):
        if places is not None:
            found = build.table[name]
            build.put(name, places, each=places.ndim == 2, coord=True, spec=Variable((dim,), found.units, found.long_name))
    for name in states:
        build.put(f"{name}_amplitude", amplitude[name], each=True, spec=Variable((dim,), units.get(name, ""), f"amplitude of {name}"))
        build.put(f"{name}_phase", phase[name], each=True, spec=Variable((dim,), "rad", f"phase of {name}"))
    build.put_each(each)
    build.put_forcing(forcing_period)
    build.put_varied(varied)
    return build.dataset(attrs)
