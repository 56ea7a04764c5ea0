"""What every variable of a result is: one table for each kind of Dataset, and what is read off a
Dataset by them.

The rows are :class:`saltus.results.dataset.variable.Variable`;
:func:`saltus.results.dataset.build.build` makes Datasets by them.
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
from saltus.results.dataset.attractors import (
    AGREEMENT_VARIABLES,
    ATTRACTOR_VARIABLES,
    ATTRACTORS_VARIABLES,
    BASINS_VARIABLES,
)
from saltus.results.dataset.backbones import BACKBONE_VARIABLES
from saltus.results.dataset.bifurcation_curves import CURVE_VARIABLES
from saltus.results.dataset.branches import BRANCHES_VARIABLES
from saltus.results.dataset.equilibria import EQUILIBRIA_VARIABLES
from saltus.results.dataset.exponents import EXPONENTS_VARIABLES
from saltus.results.dataset.kinds import Kind
from saltus.results.dataset.methods import METHODS_VARIABLES, WIDTHS_VARIABLES
from saltus.results.dataset.orbits import ORBIT_VARIABLES
from saltus.results.dataset.responses import RESPONSES_VARIABLES
from saltus.results.dataset.result import Result
from saltus.results.dataset.structures import MODES_VARIABLES
from saltus.results.dataset.trajectories import STROBOSCOPE_VARIABLES, TRAJECTORY_VARIABLES

#: Version of the tables below, kept in every result as ``schema_version``.
VERSION = 1
TRAJECTORY, STROBOSCOPE = "trajectory", "stroboscope"
BASINS, ATTRACTORS, AGREEMENT, RESPONSES = "basins", "attractors", "agreement", "responses"
METHODS, EXPONENTS = "methods", "exponents"
ORBITS = "orbits"
SETTLED, WIDTHS, MODES, BRANCHES = "settled", "widths", "modes", "branches"
CURVE, BACKBONE = "bifurcation_curve", "backbone"
EQUILIBRIA = "equilibria"
SECTION, SPECTRUM, IMPACTS, ENERGY = "section", "spectrum", "impacts", "energy"
#: The function that returns each kind.
MAKERS = {
    TRAJECTORY: "sl.simulate", STROBOSCOPE: "sl.stroboscope", BASINS: "sl.basins",
    ATTRACTORS: "sl.attractors "
        "or sl.basin_fractions",
    AGREEMENT: "sl.compare", RESPONSES: "sl.frequency_response or sl.bifurcation_diagram",
    METHODS: "sl.compare_methods",
    SECTION: "sl.poincare", SPECTRUM: "sl.spectrum", IMPACTS: "sl.impact_statistics",
    ENERGY: "sl.energy_balance",
    EXPONENTS: "sl.lyapunov or sl.wolf",
    SETTLED: "sl.settled", WIDTHS: "sl.regularisation_widths",
    ORBITS: "sl.periodic_orbits or sl.edge_orbit",
    MODES: "sl.structure_modes", BRANCHES: "sl.branches",
    CURVE: "sl.bifurcation_curve", BACKBONE: "sl.backbone",
    EQUILIBRIA: "sl.equilibria",
}  # fmt: skip

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
    SETTLED: motions.SETTLED_VARIABLES,
    WIDTHS: WIDTHS_VARIABLES,
    MODES: MODES_VARIABLES,
    ORBITS: ORBIT_VARIABLES,
    EQUILIBRIA: EQUILIBRIA_VARIABLES,
    BRANCHES: BRANCHES_VARIABLES,
    CURVE: CURVE_VARIABLES,
    BACKBONE: BACKBONE_VARIABLES,
}


# -- names and units -------------------------------------------------------------------------------
def contact_name(state: str) -> str:
    """Name of the variable that holds a state at the contacts: ``contact_x``;
    ``contact_state_velocity`` where the name is taken.
    """
    name = f"contact_{state}"
    return f"contact_state_{state}" if name in TRAJECTORY_VARIABLES else name


def before_name(state: str) -> str:
    """Name of the variable that holds a state before the contacts: ``contact_x_before``."""
    name = f"contact_{state}_before"
    return f"contact_state_{state}_before" if name in TRAJECTORY_VARIABLES else name


def attractor_name(state: str) -> str:
    """Name of the variable that holds the points of the attractors: ``attractor_x``;
    ``attractor_state_type`` where the name is taken.
    """
    name = f"attractor_{state}"
    return f"attractor_state_{state}" if name in ATTRACTOR_VARIABLES else name


def orbit_name(state: str) -> str:
    """Name of the variable that holds the points of periodic orbits: ``orbit_x``;
    ``orbit_state_type`` where the name is taken.
    """
    name = f"orbit_{state}"
    return f"orbit_state_{state}" if name in ORBIT_VARIABLES else name


def equilibrium_name(state: str) -> str:
    """Name of the variable that holds a state at rest: ``equilibrium_x``;
    ``equilibrium_state_type`` where the name is taken.
    """
    name = f"equilibrium_{state}"
    return f"equilibrium_state_{state}" if name in EQUILIBRIA_VARIABLES else name


def response_name(name: str) -> str:
    """Name of the variable that holds a parameter, or the points of a state, of each response:
    ``response_frequency``, ``response_x``.

    ``response_own_peak`` where the name is taken.
    """
    return (
        f"response_own_{name}" if f"response_{name}" in RESPONSES_VARIABLES else f"response_{name}"
    )


def event_name(parameter: str) -> str:
    """Name of the variable that holds a parameter or a state at the events: ``event_frequency``;
    ``event_own_kind`` where the name is taken.
    """
    taken = (*RESPONSES_VARIABLES, *BRANCHES_VARIABLES)
    return f"event_own_{parameter}" if f"event_{parameter}" in taken else f"event_{parameter}"


def point_name(name: str) -> str:
    """Name of the variable that holds a parameter or a state at the points of branches:
    ``point_x``; ``point_own_period`` where the name is taken.
    """
    return f"point_own_{name}" if f"point_{name}" in BRANCHES_VARIABLES else f"point_{name}"


def sample_name(state: str) -> str:
    """Name of the variable that holds the sampled values of a state: ``sample_x``."""
    return f"sample_{state}"


def start_name(state: str) -> str:
    """Name of the coordinate that holds a state at the starts: ``start_x``; ``start_own_direction``
    where the name is taken.
    """
    return f"start_own_{state}" if f"start_{state}" in RESPONSES_VARIABLES else f"start_{state}"


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
    """A key of :data:`TABLES`, such as ``"trajectory"``; ``""`` for anything that isn't a result of
    saltus.
    """
    kind = ds.attrs.get("saltus_result", "") if isinstance(ds, xr.Dataset) else ""
    return kind if kind in TABLES else ""


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
    *makers, last = " or ".join(MAKERS[kind] for kind in kinds).split(" or ")
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
            f"{caller} takes what {wanted} returns; this Dataset is from {MAKERS[kind]}."
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
        SETTLED: ("response_period", "mismatch"),
        MODES: ("shape", "flexibility"),
        ORBITS: ("orbit_type", "orbit_stable"),
        EQUILIBRIA: ("equilibrium_type", "equilibrium_place"),
        BRANCHES: ("point_branch", "point_stable", "branch_periods"),
        CURVE: ("point_arclength", "codim2_kind"),
        BACKBONE: ("backbone_frequency", "point_output_peak"),
        WIDTHS: ("regularisation_error", "error", "steps_per_period"),
    }[kind]


# -- after reading a file --------------------------------------------------------------------------
def restore(ds: xr.Dataset) -> xr.Dataset:
    """The Dataset with the types of the tables: netCDF-3 keeps 32-bit integers, and readers differ
    on text and attributes.
    """
    table = TABLES[kind_of(ds)]
    dtypes = {name: table[name].dtype for name in map(str, ds.variables) if name in table}
    variables = {}
    for name, variable in ds.variables.items():
        dtype = dtypes.get(str(name), "f8")
        data = np.asarray(variable.values).astype(np.str_ if dtype == "str" else dtype)
        attrs = {key: _plain(value) for key, value in variable.attrs.items()}
        # a single number comes back as such, and the codes have the type of their variable
        if "flag_values" in attrs:
            attrs["flag_values"] = np.atleast_1d(np.asarray(attrs["flag_values"], dtype=data.dtype))
        variables[name] = xr.Variable(variable.dims, data, attrs)
    coords = {name: variables.pop(name) for name in ds.coords}
    return Result(variables, coords, {key: _plain(value) for key, value in ds.attrs.items()})


def _plain(value: Any) -> Any:
    """An attribute as a plain number or text."""
    return value.item() if isinstance(value, np.generic) else value
