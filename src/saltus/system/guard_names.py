"""Names that a user gives to guards."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from saltus.contact.boundaries import number_of
from saltus.contact.contacts import renamed
from saltus.contact.guards import equation_of, is_hold
from saltus.errors import TraceError, shown
from saltus.language.expression import Condition, Relation
from saltus.language.names import why_no_title
from saltus.system.read_off import Quantity, called
from saltus.system.system import System


def with_guard_names(system: System, names: Mapping[str, Quantity]) -> System:
    """The system with some of its guards renamed.

    Parameters
    ----------
    system : System
        Whose guards are named.
    names : mapping of str to callable
        By the new name, a function of (t, states, parameters), each argument by its name, that
        returns a comparison. It may be written in any way that means the boundary: ``lambda x, gap:
        x > gap``, ``lambda x, gap: gap - x > 0``.

    Returns
    -------
    System
        Guards that aren't mentioned keep their names.

    Raises
    ------
    TraceError
        If a function isn't a comparison, means no guard of the system, or two names are the same or
        mean the same guard.
    """
    new: dict[int, str] = {}
    for name, function in names.items():
        if (why := why_no_title(name)) is not None:
            raise TraceError(
                f"{system.name}: {shown(name)} can't be the name of a boundary: {why}."
            )
        number = _meant(system, name, function)
        if number in new:
            raise TraceError(
                f"{system.name}: one boundary is called both {new[number]!r} and "
                f"{shown(name)}. Keep one of the two."
            )
        new[number] = name
    guards = renamed(system.guards, new)
    taken = {*system.states, *(f"{state} turns" for state in system.states)}
    for number, guard in enumerate(guards):
        if guard.name in taken:
            what = (
                "another boundary"
                if guard.name in [other.name for other in guards[:number]]
                else ("a state or of its turning points")
            )
            raise TraceError(
                f"{system.name}: {shown(guard.name)} is the name of {what}. Choose another one."
            )
        taken.add(guard.name)
    return replace(system, guards=guards)


def _meant(system: System, name: str, function: Quantity) -> int:
    """Number of the guard that a comparison means."""
    what = f"the boundary {shown(name)}"
    condition = called(system, function, what)
    if not isinstance(condition, Relation):
        given = "several joined" if isinstance(condition, Condition) else shown(condition)
        raise TraceError(
            f"{system.name}: {what} must be one comparison, such as x > gap, not {given}."
        )
    number = number_of(condition, system.guards)
    if number is None:
        have = (
            ", ".join(
                equation_of(each, system.guards)
                for each, guard in enumerate(system.guards)
                if not is_hold(guard)
            )
            or "none"
        )
        raise TraceError(
            f"{system.name}: {what} means no boundary of the equations. They have: {have}."
        )
    return number
