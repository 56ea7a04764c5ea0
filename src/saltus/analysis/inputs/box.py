"""Boxes of starts: a range for each state that varies."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from saltus.errors import ParameterError, listed, must_be, shown
from saltus.system import System
from saltus.units import to_si


def box_ranges(system: System, box: Mapping[str, Any]) -> dict[str, tuple[float, float]]:
    """The ends of each range of a box [SI]. Raises ParameterError, UnitError."""
    ranges = {}
    for name, given in box.items():
        try:
            low, high = given
        except (TypeError, ValueError):
            unit = system.units[name]
            raise must_be(
                name, f'(low, high), such as {name}=("-1 {unit}", "1 {unit}")', given
            ) from None
        low, high = (to_si(value, system.units[name], name) for value in (low, high))
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
