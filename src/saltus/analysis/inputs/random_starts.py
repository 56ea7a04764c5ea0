"""Random starts from a box of states: ``start="random 20"``, ``box={...}``."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from saltus.analysis.inputs.box import box_ranges, draw, fixed_of, states_at, units_of
from saltus.errors import ParameterError, UnitError, must_be, nearest, shown, unknown
from saltus.flow.counts import whole
from saltus.flow.room import check_room
from saltus.sentences import Given
from saltus.system import System
from saltus.system.structures.told import by_modes
from saltus.units import to_si

_COUNT = re.compile("0*[1-9][0-9]{0,11}")


def random_starts(
    system: System, start: str, box: Any, seed: int, others: Sequence[str] = ()
) -> np.ndarray:
    """Starts uniform in a box, float64[n, D]; states without a range start at zero. Of a structure
    by its modes the box may be over what sensors show: of all states that show it, each start is
    that of least energy.

    Parameters
    ----------
    system : System
        Names of states and their units.
    start : str
        ``"random 20"``.
    box : mapping
        Range (low, high) of each state, or sensor, that varies [SI or text with a unit].
    seed : int
        Of the random numbers.
    others : sequence of str
        Words that the caller knows besides, for its message.

    Raises
    ------
    ParameterError, UnitError
        If that is no such word, or no such box.
    """
    count = random_count(start)
    if not count:
        raise ParameterError(
            lambda say: (
                f"{say.key(start=Given(start))} isn't known. "
                f"{nearest(start, (*others, 'random 20'))} Or give states."
            )
        )
    if not isinstance(box, Mapping) or not box:
        known = units_of(system)
        units = {name: known[name] for name in list(known)[:2]}
        example = {name: (f"-1 {unit}", f"1 {unit}") for name, unit in units.items()}
        raise ParameterError(
            lambda say: f"random starts need a box to be drawn from: {say.key(box=example)}."
        )
    check_room(16.0 * count * len(system.states), f"{count} random starts", "Draw fewer.")
    unit = np.random.default_rng(whole(seed, "seed", 0)).random((count, len(system.states)))
    if by_modes(system) and not any(name in system.states for name in box):
        fixed = fixed_of(system, None, box)
        ranges = box_ranges(system, box)
        return states_at(system, draw(ranges, unit[:, : len(ranges)]), fixed)
    starts = np.zeros((count, len(system.states)))
    for name, ends in box.items():
        low, high = _range(system, name, ends)
        column = system.states.index(name)
        starts[:, column] = low + (high - low) * unit[:, column]
    return starts


def random_count(start: str) -> int:
    """Number of starts that ``"random 20"`` asks for; 0 for any other word."""
    word, _, number = start.partition(" ")
    return int(number) if word == "random" and _COUNT.fullmatch(number.strip()) else 0


def _range(system: System, name: str, ends: Any) -> tuple[float, float]:
    """The range of a state [SI]."""
    if name not in system.states:
        raise unknown(f"{system.name} has no state", name, system.states)
    try:
        low, high = (to_si(end, system.units[name], name) for end in ends)
    except UnitError:
        raise
    except (TypeError, ValueError):
        raise must_be(f"the range of {name}", "(low, high)", ends) from None
    if not (np.isfinite([low, high]).all() and low < high):
        raise ParameterError(f"the range of {name} must ascend and be finite, not {shown(ends)}.")
    return low, high
