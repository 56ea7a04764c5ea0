"""Starts of maps and boxes: a range for each state, or sensor of a structure, that varies."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from saltus.analysis.inputs.sensed import sensed
from saltus.analysis.inputs.starts import fill, fixed_states
from saltus.errors import ParameterError, listed, must_be, shown, unknown
from saltus.system import System
from saltus.system.structures.told import by_modes
from saltus.units import to_si


def units_of(system: System) -> dict[str, str]:
    """The units of all states and outputs."""
    return {**dict(zip(system.outputs.names, system.outputs.units, strict=True)), **system.units}


def box_ranges(system: System, box: Mapping[str, Any]) -> dict[str, tuple[float, float]]:
    """The ends of each range of a box [SI]. Raises ParameterError, UnitError."""
    ranges, units = {}, units_of(system)
    for name, given in box.items():
        try:
            low, high = given
        except (TypeError, ValueError):
            unit = units[name]
            raise must_be(
                name, f'(low, high), such as {name}=("-1 {unit}", "1 {unit}")', given
            ) from None
        low, high = (to_si(value, units[name], name) for value in (low, high))
        if not low < high:
            raise ParameterError(f"the range of {name} is empty: {shown(low)} to {shown(high)}.")
        ranges[name] = (low, high)
    if not ranges:
        raise ParameterError(
            f"give a range for at least one state of {listed(system.states)}: "
            f'{system.states[0]}=("-1 mm", "1 mm").'
        )
    return ranges


def draw(ranges: Mapping[str, tuple[float, float]], unit: np.ndarray) -> dict[str, np.ndarray]:
    """Starts of the states that have a range, from numbers in [0, 1), one column for each state."""
    return {
        name: low + (high - low) * column
        for (name, (low, high)), column in zip(ranges.items(), unit.T, strict=True)
    }


def fixed_of(system: System, at: Any, moving: Iterable[str]) -> dict[str, float]:
    """Starts [SI] of the states that aren't varied in a map or a box, or what other sensors of a
    structure by its modes show where it is over sensors. Raises ParameterError, UnitError.
    """
    moving = list(moving)
    if not by_modes(system) or any(name in system.states for name in moving):
        return fixed_states(system, at, moving)
    units, given = units_of(system), at or {}
    for name in (*moving, *given):
        if name not in system.outputs.names:
            raise unknown(f"{system.name} has no state and no sensor", name, system.outputs.names)
    return {
        name: to_si(value, units[name], name) for name, value in given.items() if name not in moving
    }


def states_at(
    system: System, columns: Mapping[str, np.ndarray], fixed: Mapping[str, float]
) -> np.ndarray:
    """States float64[k, D] from float64[k] for some of them, or for what sensors show; the others
    are those of :func:`fixed_of`.
    """
    if set(columns) <= set(system.states):
        return fill(system, columns, fixed)
    count = len(next(iter(columns.values())))
    given = {name: np.full(count, value) for name, value in fixed.items()}
    found = sensed(system, {**columns, **given})
    return np.stack([found[name] for name in system.states], axis=1)
