"""What every variable of a result is: one table for each kind of Dataset.

The tables name the dims without ``trajectory``, which a batch adds in front. Units in angle brackets follow the system: ``<state>`` is the
state's unit, ``<gap>`` that of the guards' gap functions, ``<gap rate>`` the same per second.

Dims: ``time`` (samples), ``contact`` (one table for all trajectories), ``guard``, ``trajectory``. When the trajectories of a batch have
periods of their own, the samples share phases instead of times: the dim is then ``period``, and ``time`` has dims (trajectory, period).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from saltus.errors import ParameterError

#: Version of the tables below, kept in every result as ``schema_version``.
VERSION = 1
TRAJECTORY, STROBOSCOPE = "trajectory", "stroboscope"


@dataclass(frozen=True)
class Variable:
    """What one variable of a result is.

    Attributes
    ----------
    dims : tuple of str
        Dims of one trajectory.
    units : str
        SI unit, ``"1"`` for a plain number, ``""`` for text.
    long_name : str
        A few words, as on an axis.
    dtype : str
        ``f8``, ``i8``, ``i1`` or ``str``.
    """

    dims: tuple[str, ...]
    units: str
    long_name: str
    dtype: str = "f8"


_STATUS = Variable((), "", "how the trajectory ended", "str")
_COUNTERS = {
    "events": Variable((), "1", "contacts", "i8"),
    "grazes": Variable((), "1", "grazes", "i8"),
    "grazes_unresolved": Variable((), "1", "grazes shallower than the local error", "i8"),
    "steps": Variable((), "1", "accepted steps", "i8"),
    "rejected_steps": Variable((), "1", "rejected steps", "i8"),
    "mode_violations": Variable((), "1", "accepted steps that ended on the wrong side of a guard", "i8"),
}
_MINIMA = {
    "smallest_contact_speed": Variable((), "<gap rate>", "smallest gap rate at a contact"),
    "smallest_gap_margin": Variable((), "<gap>", "smallest distance of a turning point of the gap from a guard"),
}
_GUARDS = {
    "guard": Variable(("guard",), "", "guard", "str"),
    "guard_state": Variable(("guard",), "", "state that the guard bounds", "str"),
    "guard_boundary": Variable(("guard",), "<gap>", "value of the state on the guard"),
    "guard_units": Variable(("guard",), "", "unit of the gap", "str"),
}

#: Variables of what ``simulate`` returns, beside the states.
TRAJECTORY_VARIABLES = {
    "time": Variable(("time",), "s", "time"),
    "period": Variable(("time",), "1", "time in forcing periods"),
    "mode": Variable(("time",), "1", "sides of the guards: bit i is set where gap i is positive", "i8"),
    "contact_time": Variable(("contact",), "s", "time of the contact"),
    "contact_time_error": Variable(("contact",), "s", "estimated error of the time of the contact"),
    "contact_guard": Variable(("contact",), "", "guard that was met", "str"),
    "contact_direction": Variable(("contact",), "1", "+1 where the gap becomes positive, -1 where it becomes negative", "i1"),
    "contact_velocity": Variable(("contact",), "<gap rate>", "rate of the gap at the contact"),
    "contact_kind": Variable(("contact",), "", "kind of contact", "str"),
    "contact_mode_before": Variable(("contact",), "1", "mode before the contact", "i8"),
    "contact_mode_after": Variable(("contact",), "1", "mode after the contact", "i8"),
    "contact_steps": Variable(("contact",), "1", "accepted steps from the start to the contact", "i8"),
    "contact_trajectory": Variable(("contact",), "1", "trajectory that the contact belongs to", "i8"),
    "status": _STATUS,
    **_COUNTERS,
    **_MINIMA,
    **_GUARDS,
    "end_time": Variable((), "s", "time at the end"),
    "forcing_period": Variable((), "s", "forcing period"),
    "trajectory": Variable((), "1", "trajectory", "i8"),
}

#: Variables of what ``stroboscope`` returns, beside the states.
STROBOSCOPE_VARIABLES = {
    "period": Variable(("period",), "1", "whole forcing periods since the start", "i8"),
    "status": _STATUS,
    **_COUNTERS,
    **_MINIMA,
    **_GUARDS,
    "forcing_period": Variable((), "s", "forcing period"),
    "trajectory": Variable((), "1", "trajectory", "i8"),
}

#: The table of each kind of result.
TABLES = {TRAJECTORY: TRAJECTORY_VARIABLES, STROBOSCOPE: STROBOSCOPE_VARIABLES}


# -- names and units -----------------------------------------------------------------------------------------------------------
def contact_name(state: str) -> str:
    """Name of the variable that holds a state at the contacts: ``contact_x``; ``contact_state_velocity`` where the name is taken."""
    name = f"contact_{state}"
    return f"contact_state_{state}" if name in TRAJECTORY_VARIABLES else name


def end_name(state: str) -> str:
    """Name of the variable that holds a state at the end of the trajectory: ``end_x``."""
    return f"end_{state}"


def rate_unit(unit: str) -> str:
    """Unit of a rate of change: ``m`` gives ``m/s``, ``m/s`` gives ``m/s^2``; an unknown one stays unknown."""
    if not unit or unit.endswith("/s"):
        return f"{unit}^2" if unit else ""
    return f"{unit}/s"


def kind_of(ds: Any) -> str:
    """``"trajectory"``, ``"stroboscope"`` or ``""`` for anything that isn't a result of saltus."""
    kind = ds.attrs.get("saltus_result", "") if isinstance(ds, xr.Dataset) else ""
    return kind if kind in TABLES else ""


def states_of(ds: xr.Dataset) -> tuple[str, ...]:
    """Names of the states, in the order of the system."""
    return tuple(ds.attrs["states"].split())


def sample_dim(ds: xr.Dataset) -> str:
    """The dim along which the states are sampled: ``time``, or ``period`` where only the phases are shared."""
    return "time" if "time" in ds.dims else "period"


def forcing_period(ds: xr.Dataset) -> float:
    """Forcing period of a single trajectory (a batch: select one first) [s]; NaN for a system that isn't forced."""
    if "forcing_period" in ds:
        return float(ds["forcing_period"])
    return float(ds.attrs.get("forcing_period_s", math.nan))


def check(ds: Any, *, caller: str, kinds: Sequence[str] = (TRAJECTORY, STROBOSCOPE)) -> None:
    """Raise a ParameterError unless ``ds`` is a result of saltus of one of these kinds."""
    wanted = " or ".join({TRAJECTORY: "simulate", STROBOSCOPE: "stroboscope"}[kind] for kind in kinds)
    if not isinstance(ds, xr.Dataset):
        hint = " A DataArray holds one variable: give the whole Dataset." if isinstance(ds, xr.DataArray) else ""
        raise ParameterError(f"{caller} takes the Dataset that {wanted} returns, not a {type(ds).__name__}.{hint}")
    kind = kind_of(ds)
    if not kind:
        raise ParameterError(
            f"{caller} takes the Dataset that {wanted} returns. This one has no attribute 'saltus_result': it is from elsewhere, or its "
            f"attributes were dropped on the way (xarray.set_options(keep_attrs=True) keeps them)."
        )
    if kind not in kinds:
        raise ParameterError(f"{caller} takes what {wanted} returns; this Dataset is from {'simulate' if kind == TRAJECTORY else kind}.")
    missing = [name for name in (*states_of(ds), "status") if name not in ds]
    if missing:
        raise ParameterError(f"{caller} misses {', '.join(missing)} in this Dataset. Give it the whole Dataset, not some variables of it.")


# -- after reading a file ------------------------------------------------------------------------------------------------------
def restore(ds: xr.Dataset) -> xr.Dataset:
    """The Dataset with the types of the tables: netCDF-3 keeps 32-bit integers, and readers differ on text and attributes."""
    table = TABLES[kind_of(ds)]
    dtypes = {name: table[name].dtype for name in map(str, ds.variables) if name in table}
    if kind_of(ds) == TRAJECTORY:
        dtypes["period"] = "f8"
    variables = {}
    for name, variable in ds.variables.items():
        dtype = dtypes.get(str(name), "f8")
        data = np.asarray(variable.values).astype(np.str_ if dtype == "str" else dtype)
        variables[name] = xr.Variable(variable.dims, data, {key: _plain(value) for key, value in variable.attrs.items()})
    coords = {name: variables.pop(name) for name in ds.coords}
    return xr.Dataset(variables, coords, {key: _plain(value) for key, value in ds.attrs.items()})


def _plain(value: Any) -> Any:
    """An attribute as a plain number or text."""
    return value.item() if isinstance(value, np.generic) else value
