"""Kinds of result, and functions that read properties of a Dataset by its kind.

The file of a kind in :mod:`saltus.results.kinds` holds its :class:`ResultKind`: variables, rows and
account. :func:`saltus.results.dataset.build.build` makes Datasets by them.
"""

from __future__ import annotations

import functools
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from saltus.errors import ParameterError
from saltus.results.dataset.kinds import Kind
from saltus.results.dataset.result import Result
from saltus.results.dataset.variable import Variable
from saltus.results.table import TextTable

#: Version of the tables of variables, kept in every result as ``schema_version``.
VERSION = 1
#: Name of every kind of result, which is that of its file in :mod:`saltus.results.kinds`.
NAMES = (
    TRAJECTORY, STROBOSCOPE, BASINS, ATTRACTORS, AGREEMENT, RESPONSES, METHODS, SECTION, SPECTRUM,
    IMPACTS, ENERGY, EXPONENTS, SETTLED, WIDTHS, MODES, ORBITS, EQUILIBRIA, BRANCHES, CURVE,
    BACKBONE, SENSITIVITY, FIT, SCATTER, EVENT_SENSITIVITY,
) = (
    "trajectory", "stroboscope", "basins", "attractors", "agreement", "responses", "methods",
    "section", "spectrum", "impacts", "energy", "exponents", "settled", "widths", "modes", "orbits",
    "equilibria", "branches", "bifurcation_curve", "backbone", "sensitivity", "fit",
    "scatter", "event_sensitivity",
)  # fmt: skip


@dataclass(frozen=True)
class ResultKind:
    """A kind of result.

    Attributes
    ----------
    makers : str
        The functions that return it: ``sl.lyapunov or sl.wolf``.
    variables : mapping of str to Variable
        Its variables.
    needed : tuple of str
        Variables without which nothing can be said about it; ``<state>`` stands for every state.
    account : callable
        Its extent and content in lines, for :func:`saltus.results.describe`.
    rows : callable
        Its content in tables under a title, for studies: ``rows("title", ds)``.
    headline : callable, optional
        Its content in a line, where that isn't the first lines of the account.
    sheets : callable, optional
        All of it as columns with headers, by the end of the name of a CSV file, ``""`` last. None
        where no tables hold all of it.
    """

    makers: str
    variables: Mapping[str, Variable]
    needed: tuple[str, ...]
    account: Callable[[xr.Dataset], list[str]]
    rows: Callable[[str, xr.Dataset], list[TextTable]]
    headline: Callable[[xr.Dataset], str] | None = None
    sheets: Callable[[xr.Dataset], dict[str, Mapping[str, np.ndarray]]] | None = None


#: Every kind by its name; :mod:`saltus.results.kinds` fills it.
KINDS: dict[str, ResultKind] = {}


# -- names and units -------------------------------------------------------------------------------
def _apart(prefix: str, name: str, word: str, *kinds: str) -> str:
    """``prefix_name``; ``prefix_word_name`` where the kinds have a variable of that name."""
    plain = f"{prefix}_{name}"
    taken = any(plain in KINDS[kind].variables for kind in kinds)
    return f"{prefix}_{word}_{name}" if taken else plain


def contact_name(state: str) -> str:
    """Name of the variable that holds a state at the contacts: ``contact_x``;
    ``contact_state_velocity`` where the name is taken.
    """
    return _apart("contact", state, "state", TRAJECTORY)


def before_name(state: str) -> str:
    """Name of the variable that holds a state before the contacts: ``contact_x_before``."""
    return _apart("contact", f"{state}_before", "state", TRAJECTORY)


def attractor_name(state: str) -> str:
    """Name of the variable that holds the points of the attractors: ``attractor_x``;
    ``attractor_state_type`` where the name is taken.
    """
    return _apart("attractor", state, "state", ATTRACTORS)


def orbit_name(state: str) -> str:
    """Name of the variable that holds the points of periodic orbits: ``orbit_x``;
    ``orbit_state_type`` where the name is taken.
    """
    return _apart("orbit", state, "state", ORBITS)


def equilibrium_name(state: str) -> str:
    """Name of the variable that holds a state of the equilibria: ``equilibrium_x``;
    ``equilibrium_state_type`` where the name is taken.
    """
    return _apart("equilibrium", state, "state", EQUILIBRIA)


def response_name(name: str) -> str:
    """Name of the variable that holds a parameter, or the points of a state, of each response:
    ``response_frequency``, ``response_x``; ``response_own_peak`` where the name is taken.
    """
    return _apart("response", name, "own", RESPONSES)


def event_name(parameter: str) -> str:
    """Name of the variable that holds a parameter or a state at the events: ``event_frequency``;
    ``event_own_kind`` where the name is taken.
    """
    return _apart("event", parameter, "own", RESPONSES, BRANCHES)


def point_name(name: str) -> str:
    """Name of the variable that holds a parameter or a state at the points of branches:
    ``point_x``; ``point_own_period`` where the name is taken.
    """
    return _apart("point", name, "own", BRANCHES)


def sample_name(state: str) -> str:
    """Name of the variable that holds the sampled values of a state: ``sample_x``."""
    return f"sample_{state}"


def start_name(state: str) -> str:
    """Name of the coordinate that holds a state at the starts: ``start_x``; ``start_own_direction``
    where the name is taken.
    """
    return _apart("start", state, "own", RESPONSES)


def end_name(state: str) -> str:
    """Name of the variable that holds a state at the end of the trajectory: ``end_x``."""
    return f"end_{state}"


def rate_unit(unit: str) -> str:
    """Unit of a rate of change: ``m`` gives ``m/s``, ``m/s`` gives ``m/s^2``; an unknown one stays
    unknown.
    """
    if not unit or unit.endswith("/s"):
        return f"{unit}^2" if unit else ""
    return f"{unit}/s"


def root_unit(unit: str) -> str:
    """Unit of a square root: ``m`` gives ``m^0.5``; an unknown one stays unknown."""
    if unit in ("", "1"):
        return unit
    return f"({unit})^0.5" if "/" in unit or "^" in unit else f"{unit}^0.5"


def kind_of(ds: Any) -> str:
    """A key of :data:`KINDS`, such as ``"trajectory"``; ``""`` for anything that isn't a result of
    saltus.
    """
    kind = ds.attrs.get("saltus_result", "") if isinstance(ds, xr.Dataset) else ""
    return kind if kind in KINDS else ""


def period_text(n: int, none: str = "not periodic") -> str:
    """``T``, ``3T``; ``none`` for 0."""
    return {0: none, 1: "T"}.get(n, f"{n}T")


def kind_text(kind: str, n: int) -> str:
    """A motion in a word: ``T``, ``3T``, ``noisy 24T``, ``quasi-periodic``, ``chaotic``,
    ``equilibrium``, ``limit cycle``.
    """
    if n > 0:
        return f"noisy {period_text(n)}" if kind == Kind.NOISY_PERIODIC.word else period_text(n)
    return kind.replace("_", " " if kind == Kind.LIMIT_CYCLE.word else "-")


def states_of(ds: xr.Dataset) -> tuple[str, ...]:
    """Names of the states, in the order of the system."""
    if not isinstance(ds.attrs.get("states"), str):
        raise ParameterError(
            "this Dataset has lost the attribute 'states'. Give it as saltus "
            "returned it, or a selection of it."
        )
    return tuple(ds.attrs["states"].split())


def outputs_in(ds: xr.Dataset) -> tuple[str, ...]:
    """Names of what a result tells of its motions, the usual one first: the states in the order of
    the system, and its named outputs. Those of a structure whose states are coordinates of modes
    stand before the states.
    """
    outputs = tuple(json.loads(ds.attrs.get("outputs", "[]")))
    states = states_of(ds)
    return (*outputs, *states) if ds.attrs.get("outputs_first") else (*states, *outputs)


def told_of(ds: xr.Dataset) -> tuple[str, ...]:
    """Names of what tables tell of the motions: the states and the outputs; the outputs alone where
    they stand before the states.
    """
    names = outputs_in(ds)
    return names[: len(names) - len(states_of(ds))] if ds.attrs.get("outputs_first") else names


def output_word(ds: xr.Dataset) -> str:
    """``state``, or ``state or output`` where there are outputs: what messages call one of them."""
    return "state or output" if len(outputs_in(ds)) > len(states_of(ds)) else "state"


def first_of(ds: xr.Dataset) -> str:
    """The state or output that is shown of a result where none is asked for."""
    return outputs_in(ds)[0]


def first_size(ds: xr.Dataset, own: str, of_output: str) -> tuple[str, xr.DataArray]:
    """The size of the state or output that is shown first, and its name: the variable ``own`` of
    the first state, or that of ``of_output`` which is of the output.
    """
    name = first_of(ds)
    if name == states_of(ds)[0] or of_output not in ds:
        return states_of(ds)[0], ds[own]
    chosen = ds[of_output].sel(output=name)
    return name, chosen.assign_attrs(units=str(chosen["output_units"].item()))


@functools.cache
def reserved_names() -> frozenset[str]:
    """Names of variables and dims of results that hold outputs beside them, which no output can
    have.
    """
    tables = [kind.variables for kind in KINDS.values() if "<state>" in kind.variables]
    dims = {dim.rstrip("?") for table in tables for row in table.values() for dim in row.dims}
    return frozenset(dims.union(*tables))


def equations_of(ds: xr.Dataset) -> list[str]:
    """The equations that made a result, one text each, such as ``dx/dt = v``; none if they aren't
    known.
    """
    return list(json.loads(ds.attrs.get("equations", "[]")))


def axes_of(ds: xr.Dataset) -> tuple[str, str]:
    """The two states that a map (of basins, or of the agreement of two) is drawn over."""
    a, b = ds["basin" if kind_of(ds) == BASINS else "agreement"].dims
    return str(a), str(b)


def parameters_of(ds: xr.Dataset) -> tuple[str, ...]:
    """The one or two parameters over which responses were computed, in the order of the axes."""
    return tuple(str(dim) for dim in ds["response_of"].dims if dim != "start")


def sample_dim(ds: xr.Dataset) -> str:
    """The dim along which the states are sampled: ``time``, or ``period`` where only the phases are
    shared.
    """
    return "time" if "time" in ds.dims else "period"


def forcing_period(ds: xr.Dataset) -> float:
    """Forcing period of a single trajectory (a batch: select one first) [s]; NaN for a system that
    isn't forced.
    """
    if "forcing_period" in ds:
        return float(ds["forcing_period"])
    return float(ds.attrs.get("forcing_period_s", math.nan))


def check(ds: Any, *, caller: str, kinds: Sequence[str] = (TRAJECTORY, STROBOSCOPE)) -> None:
    """Raise a ParameterError unless ``ds`` is a result of saltus of one of these kinds."""
    *makers, last = " or ".join(KINDS[kind].makers for kind in kinds).split(" or ")
    wanted = f"{', '.join(makers)} or {last}" if makers else last
    if not isinstance(ds, xr.Dataset):
        hint = (
            " A DataArray holds one variable: give the whole Dataset."
            if isinstance(ds, xr.DataArray)
            else ""
        )
        raise ParameterError(
            f"{caller} takes the Dataset that {wanted} returns, not "
            f"{a_or_an(type(ds).__name__)}.{hint}"
        )
    kind = kind_of(ds)
    if not kind:
        raise ParameterError(
            f"{caller} takes the Dataset that {wanted} returns. This one has no attribute "
            f"'saltus_result': it is from elsewhere, or its "
            f"attributes were dropped on the way (xarray.set_options(keep_attrs=True) keeps them)."
        )
    if kind not in kinds:
        raise ParameterError(
            f"{caller} takes what {wanted} returns; this Dataset is from {KINDS[kind].makers}."
        )
    missing = [name for name in _needed(ds, kind) if name not in ds]
    if missing:
        raise ParameterError(
            f"{caller} misses {', '.join(missing)} in this Dataset. Give it the "
            f"whole Dataset, not some variables of it."
        )


def a_or_an(word: str) -> str:
    """The word with its article."""
    return f"{'an' if word[0].lower() in 'aeio' else 'a'} {word}"


def _needed(ds: xr.Dataset, kind: str) -> list[str]:
    """Variables that every text on a result needs."""
    return [
        name
        for row in KINDS[kind].needed
        for name in (states_of(ds) if row == "<state>" else (row,))
    ]


# -- after reading a file --------------------------------------------------------------------------
def restore(ds: xr.Dataset) -> xr.Dataset:
    """The Dataset with the types of the tables: netCDF-3 keeps 32-bit integers, and readers differ
    on text and attributes.
    """
    table = KINDS[kind_of(ds)].variables
    dtypes = {name: table[name].dtype for name in map(str, ds.variables) if name in table}
    variables = {}
    for name, variable in ds.variables.items():
        dtype = dtypes.get(str(name), "f8")
        data = np.asarray(variable.values).astype(np.str_ if dtype == "str" else dtype)
        attrs = {key: _plain(value) for key, value in variable.attrs.items()}
        # An array of one number is read back as a number. Codes have the type of their variable.
        if "flag_values" in attrs:
            attrs["flag_values"] = np.atleast_1d(np.asarray(attrs["flag_values"], dtype=data.dtype))
        variables[name] = xr.Variable(variable.dims, data, attrs)
    coords = {name: variables.pop(name) for name in ds.coords}
    return Result(variables, coords, {key: _plain(value) for key, value in ds.attrs.items()})


def _plain(value: Any) -> Any:
    """An attribute as a plain number or text."""
    return value.item() if isinstance(value, np.generic) else value
