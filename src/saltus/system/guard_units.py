"""Units of the gaps of a system's guards."""

from __future__ import annotations

from functools import lru_cache

from saltus.contact.guards import is_hold
from saltus.contact.reduction import free_field
from saltus.language.dimensions import units_of
from saltus.language.expression import Expr
from saltus.language.roots import with_root
from saltus.system.system import System


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
