"""What every variable of a result is: one table for each kind of Dataset.

The tables name the dims without ``trajectory``, which a batch adds in front. Units in angle brackets follow the system: ``<state>`` is the
state's unit, ``<gap>`` that of the guards' gap functions, ``<gap rate>`` the same per second.

Dims: ``time`` (samples), ``contact`` (one table for all trajectories), ``guard``, ``trajectory``. When the trajectories of a batch have
periods of their own, the samples share phases instead of times: the dim is then ``period``, and ``time`` has dims (trajectory, period).

Exponents have the dims ``trajectory``, ``exponent`` (in descending order), ``flow_exponent`` and ``running`` (times at which running means
are kept); ``<rate>`` is the unit that the caller asked for, such as ``bit/period``.

Results about attractors have the dims ``attractor``, ``phase`` (points of an orbit, one a forcing period) and ``multiplier``. What belongs
to one start has no dims in the table: a map adds the two states that it is drawn over, a list of starts ``trajectory``.

Results about steady responses over one or two parameters have these parameters as dims, ``start``, ``response`` (all of them, at all
values), ``multiplier``, ``phase``, ``sample`` (sampled values of a bifurcation diagram) and ``event``.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from saltus.errors import ParameterError
from saltus.results.dataset import motions
from saltus.results.dataset.kinds import Kind
from saltus.results.dataset.method_variables import METHODS_VARIABLES
from saltus.results.dataset.response_variables import RESPONSES_VARIABLES
from saltus.results.dataset.result import Result
from saltus.results.dataset.variable import COUNTERS, FORCING_PERIOD, GUARDS, MINIMA, STATUS, TRAJECTORY_NUMBER, Variable

#: Version of the tables below, kept in every result as ``schema_version``.
VERSION = 1
TRAJECTORY, STROBOSCOPE = "trajectory", "stroboscope"
BASINS, ATTRACTORS, AGREEMENT, RESPONSES = "basins", "attractors", "agreement", "responses"
METHODS, EXPONENTS = "methods", "exponents"
SECTION, SPECTRUM, IMPACTS, ENERGY = "section", "spectrum", "impacts", "energy"
#: The function that returns each kind.
MAKERS = {
    TRAJECTORY: "sl.simulate", STROBOSCOPE: "sl.stroboscope", BASINS: "sl.basins", ATTRACTORS: "sl.attractors or sl.basin_fractions",
    AGREEMENT: "sl.compare", RESPONSES: "sl.frequency_response or sl.bifurcation_diagram", METHODS: "sl.compare_methods",
    SECTION: "sl.poincare", SPECTRUM: "sl.spectrum", IMPACTS: "sl.impact_statistics", ENERGY: "sl.energy_balance",
    EXPONENTS: "sl.lyapunov or sl.wolf",
}  # fmt: skip

#: Kinds that hold the states under their own names.
WITH_STATES = (TRAJECTORY, STROBOSCOPE, SECTION)

#: Meaning of the values of ``agreement``.
AGREEING = {-1: "not_settled", 0: "differ", 1: "agree"}


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
    "status": STATUS,
    **COUNTERS,
    **MINIMA,
    **GUARDS,
    "end_time": Variable((), "s", "time at the end"),
    "forcing_period": FORCING_PERIOD,
    "trajectory": TRAJECTORY_NUMBER,
}

#: Variables of what ``stroboscope`` returns, beside the states.
STROBOSCOPE_VARIABLES = {
    "period": Variable(("period",), "1", "whole forcing periods since the start", "i8"),
    "status": STATUS,
    **COUNTERS,
    **MINIMA,
    **GUARDS,
    "forcing_period": FORCING_PERIOD,
    "trajectory": TRAJECTORY_NUMBER,
}

#: What is known of each attractor, beside the points ``attractor_<state>``. ``<first>``: the unit of the first state.
ATTRACTOR_VARIABLES = {
    "attractor": Variable(("attractor",), "1", "attractor", "i8"),
    "attractor_type": Variable(("attractor",), "", "kind of motion", "str"),
    "attractor_period": Variable(("attractor",), "1", "period in forcing periods, 0 if it doesn't repeat", "i8"),
    "attractor_contacts": Variable(
        ("attractor",), "1", "contacts in one period of the response (in a forcing period if it doesn't repeat)"
    ),
    "attractor_itinerary": Variable(("attractor",), "", "modes in the order in which they are visited", "str"),
    "attractor_peak": Variable(("attractor",), "<first>", "largest magnitude of the first state"),
    "attractor_rms": Variable(("attractor",), "<first>", "root mean square of the first state"),
    "attractor_margin": Variable(("attractor",), "<gap>", "smallest distance by which the orbit misses or overshoots a boundary"),
    "attractor_multiplier_real": Variable(("attractor", "multiplier"), "1", "Floquet multiplier, real part"),
    "attractor_multiplier_imag": Variable(("attractor", "multiplier"), "1", "Floquet multiplier, imaginary part"),
    "attractor_scatter": Variable(
        ("attractor",), "<first>", "root mean square distance of a noisy motion from its exact orbit, first state; NaN of others"
    ),
    "attractor_cycle": Variable(("attractor",), "s", "period of a limit cycle"),
    "attractor_eigenvalue_real": Variable(("attractor", "multiplier"), "1/s", "eigenvalue of the Jacobian of an equilibrium, real part"),
    "attractor_eigenvalue_imag": Variable(
        ("attractor", "multiplier"), "1/s", "eigenvalue of the Jacobian of an equilibrium, imaginary part"
    ),
    "attractor_exponent": Variable(("attractor",), "1/s", "largest Lyapunov exponent"),
    "attractor_exponent_error": Variable(("attractor",), "1/s", "error of the largest Lyapunov exponent"),
    "attractor_fraction": Variable(("attractor",), "1", "share of the starts"),
    "attractor_fraction_low": Variable(("attractor",), "1", "share of the starts, lower end of the 95 % interval"),
    "attractor_fraction_high": Variable(("attractor",), "1", "share of the starts, upper end of the 95 % interval"),
}
_SETTLED = {
    "basin": Variable((), "1", "attractor", "i2"),
    "periods_to_settle": Variable((), "1", "forcing periods until it had settled, -1 if it hadn't", "i4"),
}

#: Variables of what ``basins`` returns, beside the two states that the map is drawn over.
BASINS_VARIABLES = {
    **_SETTLED,
    "status": Variable((), "1", "how the trajectory ended", "i1"),
    "grazes_unresolved": Variable((), "1", "grazes shallower than the local error", "i2"),
    **ATTRACTOR_VARIABLES,
}

#: Variables of what ``attractors`` and ``basin_fractions`` return.
ATTRACTORS_VARIABLES = {"trajectory": Variable(("trajectory",), "1", "trajectory", "i8"), **_SETTLED, **ATTRACTOR_VARIABLES}

#: Variables of what ``compare`` returns, beside the two states.
AGREEMENT_VARIABLES = {
    "agreement": Variable((), "1", "whether the two maps agree", "i1"),
    "basin_a": Variable((), "1", "attractor in the first map", "i2"),
    "basin_b": Variable((), "1", "attractor in the second map, in the numbers of the first", "i2"),
    "pair": Variable(("pair",), "1", "attractor: those of the first map, then those that only the second has", "i8"),
    "match_a": Variable(("pair",), "1", "number in the first map, -1 if it isn't there", "i8"),
    "match_b": Variable(("pair",), "1", "number in the second map, -1 if it isn't there", "i8"),
    "match_type": Variable(("pair",), "", "kind of motion", "str"),
    "match_period": Variable(("pair",), "1", "period in forcing periods, 0 if it doesn't repeat", "i8"),
    "match_fraction_a": Variable(("pair",), "1", "share of the starts in the first map"),
    "match_fraction_b": Variable(("pair",), "1", "share of the starts in the second map"),
    "match_agreeing_cells": Variable(("pair",), "1", "starts that lead to it in both maps", "i8"),
    "match_orbit_distance": Variable(("pair",), "1", "distance of the two orbits in units of the axis ranges"),
}

#: Variables of what ``lyapunov`` and ``wolf`` return.
EXPONENTS_VARIABLES = {
    "trajectory": Variable(("trajectory",), "1", "trajectory", "i8"),
    "kind": Variable(("trajectory",), "", "kind of motion", "str"),
    "response_period": Variable(("trajectory",), "1", "period in forcing periods, 0 if it doesn't repeat", "i8"),
    "lyapunov_exponent": Variable(("trajectory", "exponent"), "<rate>", "Lyapunov exponent"),
    "lyapunov_error": Variable(("trajectory", "exponent"), "<rate>", "standard error of the Lyapunov exponent"),
    "lyapunov_low": Variable(("trajectory", "exponent"), "<rate>", "Lyapunov exponent, lower end of the 95 % interval"),
    "lyapunov_high": Variable(("trajectory", "exponent"), "<rate>", "Lyapunov exponent, upper end of the 95 % interval"),
    "flow_lyapunov_exponent": Variable(("trajectory", "flow_exponent"), "<rate>", "Lyapunov exponent of the flow, its phase included"),
    "exponent_sum": Variable(("trajectory",), "<rate>", "sum of the Lyapunov exponents"),
    "mean_divergence": Variable(("trajectory",), "<rate>", "mean rate at which volumes grow"),
    "independent_batches": Variable(("trajectory",), "1", "batches that the error of the largest exponent comes from", "i8"),
    "near_graze": Variable(("trajectory",), "1", "whether the motion grazes a boundary, or nearly so", "i1"),
    "grazes": Variable(("trajectory",), "1", "grazes after the transient", "i8"),
    "grazes_unresolved": Variable(("trajectory",), "1", "grazes shallower than the local error, after the transient", "i8"),
    "smallest_gap_margin": MINIMA["smallest_gap_margin"].along("trajectory"),
    "block_time": Variable(("trajectory",), "s", "time of a block: the forcing period, or the time between two looks"),
    "status": STATUS.along("trajectory"),
    "replacements": Variable(("trajectory",), "1", "replacements of the neighbour", "i8"),
    "replaced_distance": Variable(("trajectory",), "1", "mean distance at replacement, as a share of the range of the motion"),
    "replaced_angle": Variable(("trajectory",), "rad", "mean angle between old and new neighbour"),
    "running_time": Variable(("trajectory", "running"), "s", "time since the end of the transient"),
    "running_exponent": Variable(("trajectory", "exponent", "running"), "<rate>", "Lyapunov exponent so far"),
    "running_low": Variable(("trajectory", "exponent", "running"), "<rate>", "Lyapunov exponent so far, lower end of the 95 % interval"),
    "running_high": Variable(("trajectory", "exponent", "running"), "<rate>", "Lyapunov exponent so far, upper end of the 95 % interval"),
}

#: The table of each kind of result.
TABLES = {
    TRAJECTORY: TRAJECTORY_VARIABLES,
    STROBOSCOPE: STROBOSCOPE_VARIABLES,
    BASINS: BASINS_VARIABLES,
    ATTRACTORS: ATTRACTORS_VARIABLES,
    AGREEMENT: AGREEMENT_VARIABLES,
    RESPONSES: RESPONSES_VARIABLES,
    METHODS: METHODS_VARIABLES,
    SECTION: motions.SECTION_VARIABLES,
    SPECTRUM: motions.SPECTRUM_VARIABLES,
    IMPACTS: motions.IMPACTS_VARIABLES,
    ENERGY: motions.ENERGY_VARIABLES,
    EXPONENTS: EXPONENTS_VARIABLES,
}


# -- names and units -----------------------------------------------------------------------------------------------------------
def contact_name(state: str) -> str:
    """Name of the variable that holds a state at the contacts: ``contact_x``; ``contact_state_velocity`` where the name is taken."""
    name = f"contact_{state}"
    return f"contact_state_{state}" if name in TRAJECTORY_VARIABLES else name


def attractor_name(state: str) -> str:
    """Name of the variable that holds the points of the attractors: ``attractor_x``; ``attractor_state_type`` where the name is taken."""
    name = f"attractor_{state}"
    return f"attractor_state_{state}" if name in ATTRACTOR_VARIABLES else name


def response_name(name: str) -> str:
    """Name of the variable that holds a parameter, or the points of a state, of each response: ``response_frequency``, ``response_x``.

    ``response_own_peak`` where the name is taken.
    """
    return f"response_own_{name}" if f"response_{name}" in RESPONSES_VARIABLES else f"response_{name}"


def event_name(parameter: str) -> str:
    """Name of the variable that holds the parameter at the events: ``event_frequency``; ``event_own_kind`` where the name is taken."""
    return f"event_own_{parameter}" if f"event_{parameter}" in RESPONSES_VARIABLES else f"event_{parameter}"


def sample_name(state: str) -> str:
    """Name of the variable that holds the sampled values of a state: ``sample_x``."""
    return f"sample_{state}"


def start_name(state: str) -> str:
    """Name of the coordinate that holds a state at the starts: ``start_x``; ``start_own_direction`` where the name is taken."""
    return f"start_own_{state}" if f"start_{state}" in RESPONSES_VARIABLES else f"start_{state}"


def end_name(state: str) -> str:
    """Name of the variable that holds a state at the end of the trajectory: ``end_x``."""
    return f"end_{state}"


def rate_unit(unit: str) -> str:
    """Unit of a rate of change: ``m`` gives ``m/s``, ``m/s`` gives ``m/s^2``; an unknown one stays unknown."""
    if not unit or unit.endswith("/s"):
        return f"{unit}^2" if unit else ""
    return f"{unit}/s"


def kind_of(ds: Any) -> str:
    """A key of :data:`TABLES`, such as ``"trajectory"``; ``""`` for anything that isn't a result of saltus."""
    kind = ds.attrs.get("saltus_result", "") if isinstance(ds, xr.Dataset) else ""
    return kind if kind in TABLES else ""


def period_text(n: int, none: str = "not periodic") -> str:
    """``T``, ``3T``; ``none`` for 0."""
    return {0: none, 1: "T"}.get(n, f"{n}T")


def kind_text(kind: str, n: int) -> str:
    """A motion in a word: ``T``, ``3T``, ``noisy 24T``, ``quasi-periodic``, ``chaotic``, ``equilibrium``, ``limit cycle``."""
    if n > 0:
        return f"noisy {period_text(n)}" if kind == Kind.NOISY_PERIODIC.word else period_text(n)
    return kind.replace("_", " " if kind == Kind.LIMIT_CYCLE.word else "-")


def states_of(ds: xr.Dataset) -> tuple[str, ...]:
    """Names of the states, in the order of the system."""
    if not isinstance(ds.attrs.get("states"), str):
        raise ParameterError("this Dataset has lost the attribute 'states'. Give it as saltus returned it, or a selection of it.")
    return tuple(ds.attrs["states"].split())


def equations_of(ds: xr.Dataset) -> list[str]:
    """The equations that made a result, one text each, such as ``dx/dt = v``; none if they aren't known."""
    return list(json.loads(ds.attrs.get("equations", "[]")))


def axes_of(ds: xr.Dataset) -> tuple[str, str]:
    """The two states that a map (of basins, or of the agreement of two) is drawn over."""
    a, b = ds["basin" if kind_of(ds) == BASINS else "agreement"].dims
    return str(a), str(b)


def parameters_of(ds: xr.Dataset) -> tuple[str, ...]:
    """The one or two parameters over which responses were computed, in the order of the axes."""
    return tuple(str(dim) for dim in ds["response_of"].dims if dim != "start")


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
    *makers, last = " or ".join(MAKERS[kind] for kind in kinds).split(" or ")
    wanted = f"{', '.join(makers)} or {last}" if makers else last
    if not isinstance(ds, xr.Dataset):
        hint = " A DataArray holds one variable: give the whole Dataset." if isinstance(ds, xr.DataArray) else ""
        raise ParameterError(f"{caller} takes the Dataset that {wanted} returns, not {a_or_an(type(ds).__name__)}.{hint}")
    kind = kind_of(ds)
    if not kind:
        raise ParameterError(
            f"{caller} takes the Dataset that {wanted} returns. This one has no attribute 'saltus_result': it is from elsewhere, or its "
            f"attributes were dropped on the way (xarray.set_options(keep_attrs=True) keeps them)."
        )
    if kind not in kinds:
        raise ParameterError(f"{caller} takes what {wanted} returns; this Dataset is from {MAKERS[kind]}.")
    missing = [name for name in _needed(ds, kind) if name not in ds]
    if missing:
        raise ParameterError(f"{caller} misses {', '.join(missing)} in this Dataset. Give it the whole Dataset, not some variables of it.")


def a_or_an(word: str) -> str:
    """The word with its article."""
    return f"{'an' if word[0].lower() in 'aeio' else 'a'} {word}"


def _needed(ds: xr.Dataset, kind: str) -> tuple[str, ...]:
    """Variables without which nothing can be said about a result."""
    if kind in (TRAJECTORY, STROBOSCOPE):
        return (*states_of(ds), "status")
    if kind == SECTION:
        return (*states_of(ds), "crossing_time", "status")
    return {
        BASINS: ("basin", "status", "attractor_type"),
        ATTRACTORS: ("attractor_type",),
        AGREEMENT: ("agreement", "match_a"),
        RESPONSES: ("response_of", "response_type", "response_branch"),
        METHODS: ("method", "agrees"),
        SPECTRUM: ("frequency", "window"),
        IMPACTS: ("contact_speed", "contacts_per_second", "status"),
        ENERGY: ("energy", "residual", "status"),
        EXPONENTS: ("lyapunov_exponent", "running_exponent"),
    }[kind]


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
        attrs = {key: _plain(value) for key, value in variable.attrs.items()}
        if "flag_values" in attrs:  # a single number comes back as such, and the codes have the type of their variable
            attrs["flag_values"] = np.atleast_1d(np.asarray(attrs["flag_values"], dtype=data.dtype))
        variables[name] = xr.Variable(variable.dims, data, attrs)
    coords = {name: variables.pop(name) for name in ds.coords}
    return Result(variables, coords, {key: _plain(value) for key, value in ds.attrs.items()})


def _plain(value: Any) -> Any:
    """An attribute as a plain number or text."""
    return value.item() if isinstance(value, np.generic) else value
