"""From a family of vibrations to its Dataset: the numbers of every orbit in it."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.branches.branch_table import numbers_of, stacked
from saltus.analysis.branches.forced_vibration import QuadratureOrbits
from saltus.analysis.branches.free_harmonics import BesideFamily
from saltus.analysis.branches.free_vibration import FreeOrbits
from saltus.analysis.dataset_parts import provenance, subject
from saltus.analysis.inputs.outputs import outputs_of
from saltus.errors import ParameterError
from saltus.flow.methods import Method
from saltus.results import build
from saltus.results.dataset import schema
from saltus.system import System

Orbits = FreeOrbits | QuadratureOrbits | BesideFamily
#: Largest fictitious damping, in units of the frequency, that is rounding.
CONSERVED = 1e-7
#: A vibration is stable if no multiplier is larger than this.
STABLE = 1.0 + 1e-6


def backbone_dataset(
    system: System,
    moving: System,
    orbits: Orbits,
    z: np.ndarray,
    method: Method,
    attrs: dict[str, Any],
) -> xr.Dataset:
    """The Dataset of a family."""
    period, outputs = orbits.period(z), outputs_of(moving, None)
    numbers = numbers_of(moving, [(orbits, one) for one in z], outputs, method)
    rows = np.zeros(len(z), np.int64)
    found = orbits.multipliers(z, orbits.evaluate(z, rows)[1], rows)
    multipliers = stacked([found], len(moving.states))
    by_name = numbers.by_name()
    data: dict[str, Any] = {
        "point": np.arange(len(z)),
        "backbone_frequency": 1 / period,
        "point_period": period,
        "point_stable": np.nanmax(np.abs(multipliers), axis=1, initial=0.0) < STABLE,
        "point_itinerary": list(numbers.itinerary),
        "point_multiplier_real": multipliers.real,
        "point_multiplier_imag": multipliers.imag,
        "point_<state>": orbits.points(z)[:, 0],
        "output": list(outputs.names),
        "output_units": list(outputs.units),
        **{f"point_output_{key}": by_name[key] for key in ("maximum", "minimum", "peak", "rms")},
    }
    if isinstance(orbits, BesideFamily):
        data |= orbits.told(z)
    if attrs["phase"] == "free":
        data["fictitious_damping"] = _conserved(system, z[:, -1], period)
        about, when = (
            provenance(system, method, system.values),
            "where the vibration passes its rest",
        )
    else:
        data["point_<parameter>"] = dict(zip(orbits.names, z[:, -2:].T, strict=True))
        fixed = {key: one for key, one in system.values.items() if key not in orbits.names}
        about, when = provenance(system, method, fixed, orbits.names), "at whole forcing periods"
    unit = outputs.units[0] if len(set(outputs.units)) == 1 else ""
    words = {"<output>": unit, "<when>": when}
    return build(schema.BACKBONE, subject(system, about | attrs), data, words=words)


def _conserved(system: System, damping: np.ndarray, period: np.ndarray) -> np.ndarray:
    """The fictitious damping of orbits, which must be rounding."""
    if np.abs(damping * period).max() > CONSERVED:
        raise ParameterError(
            lambda say: (
                f"{system.name} doesn't conserve energy: its vibrations need a damping of "
                f"{damping[np.argmax(np.abs(damping))]:.3g} /s to close. Set what damps to zero by "
                f"{say.key('values')}, and the restitution of impacts to 1: "
                f"{say.key(values={'damping': 0, 'restitution': 1})}."
            )
        )
    return damping
