"""Units of the gaps of a system's guards."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from saltus.contact.guards import is_hold
from saltus.contact.reduction import free_field
from saltus.language.dimensions import units_of
from saltus.language.evaluate import evaluate
from saltus.language.expression import Expr, walk
from saltus.language.roots import with_root
from saltus.system.system import System
from saltus.units import dimension


def gap_units(system: System) -> list[str]:
    """Unit of the gap of each guard of a system, ``""`` where it isn't known."""
    return list(_gap_units(system.origin))


@lru_cache(maxsize=256)  # the same for all values, and as slow to find as a short run
def _gap_units(system: System) -> tuple[str, ...]:
    gaps = [with_root(guard.gap) for guard in system.guards]
    found = units_of(system.states, system.units, free_field(system.field, system.guards), gaps)
    return tuple(
        (unit or _of_summand(system, guard.gap))
        if guard.state is None
        else system.units[guard.state]
        for guard, unit in zip(system.guards, found, strict=True)
    )


def margin_gaps(system: System) -> tuple[tuple[int, ...], str]:
    """Numbers of the guards whose gaps a margin to the next graze is the smallest of, and their
    unit: all lengths if there are any, else those in the unit of the first. What holds a contact is
    a force or an acceleration and never counts. Without units all others do.
    """
    return _margin_gaps(system.origin)


@lru_cache(maxsize=256)
def _margin_gaps(system: System) -> tuple[tuple[int, ...], str]:
    units = _gap_units(system)
    free = [number for number, guard in enumerate(system.guards) if not is_hold(guard)]
    own = [units[number] for number in free]
    unit = "m" if "m" in own else own[0] if own else ""
    return tuple(number for number in free if units[number] == unit), unit


def _of_summand(system: System, gap: Expr) -> str:
    """The unit that the parameters among the summands of a gap share: deflections of structures are
    sums of modes, whose units aren't known.
    """
    found, waiting = set(), [gap]
    while waiting:
        node = waiting.pop()
        if node.op in ("add", "sub", "neg"):
            waiting += node.args
        elif node.op == "param":
            found.add(system.units[node.payload])
    return found.pop() if len(found) == 1 else ""


def written_gaps(system: System) -> tuple[np.ndarray, list[str]]:
    """Ratio of each gap as it was written to that of its guard, float64[guard], and its unit.

    The guard of ``0.5*q - gap > 0`` is that of ``q > gap/0.5``. Where the coordinate q of a mode
    has a unit of its own, the gap is as large as written in the unit of its parameter.
    """
    scales, units = np.ones(len(system.guards)), gap_units(system)
    for number, guard in enumerate(system.guards):
        if guard.state is None or guard.boundary is None:
            continue
        names = {node.payload for node in walk(guard.boundary) if node.op == "param"}
        own = system.units[guard.state]
        if len(names) != 1 or not own or not (unit := system.units[name := names.pop()]):
            continue
        if dimension(unit) != dimension(own):
            scales[number] = 1.0 / abs(float(evaluate([guard.boundary], values={name: 1.0})[0]))
            units[number] = unit
    return scales, units
