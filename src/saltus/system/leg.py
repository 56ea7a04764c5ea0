"""Segments of trajectories in one mode: its equations without boundaries, from any time on and for
any time span.

A leg begins at the time START and lasts SPAN, both of which are states that don't change; its own
time runs from 0 to 1. A tangent flow over that time holds the derivatives with respect to both, and
a leg may last a negative time: it has no boundaries, so it is smooth in all that it begins with.
"""

from __future__ import annotations

import functools

from saltus.errors import ParameterError
from saltus.language import expression as ex
from saltus.language.expression import Expr
from saltus.language.known_sides import all_assuming
from saltus.system.system import System

#: Most states of a system whose segments are followed, parameters that vary included.
MOST_STATES = 14
#: States that a segment adds, in their order.
START, SPAN = "start of the leg", "span of the leg"


@functools.lru_cache(maxsize=256)
def leg(system: System, mode: int) -> System:
    """The system of one mode, bit i the side of guard i, with two more states: START and SPAN, in
    the time unit of the system.

    Raises
    ------
    ParameterError
        If the equations switch at instants, or hold a remainder or a table of time.
    """
    if system.origin is not system:
        return leg(system.origin, mode).with_values(**system.values)
    start, span = ex.state(START), ex.state(SPAN)
    time = ex.add(start, ex.mul(span, ex.TIME))
    rates = []
    for entry in frozen(system, system.field, mode):
        if not _smooth_in_time(entry):
            raise ParameterError(
                f"{system.name} switches at instants, or has a remainder or a table of time. Its "
                "contacts can't be followed one by one along a branch."
            )
        rates.append(ex.mul(ex.substituted(entry, {ex.TIME: time}), span))
    zero = ex.constant(0.0)
    states = (*system.states, START, SPAN)
    return System(
        name=f"{system.name} in mode {mode}",
        states=states,
        field=(*rates, zero, zero),
        guards=(),
        values=system.values,
        units={START: "", SPAN: "", **system.units},
    )


def has_legs(system: System) -> bool:
    """True if the system has segments: its equations are smooth in time within every mode, up to
    its boundaries, and its states are few enough for a compiled flow of each mode.
    """
    if len(system.states) > MOST_STATES:
        return False
    return not system.is_steep and all(_smooth_in_time(entry) for entry in system.field)


def _smooth_in_time(entry: Expr) -> bool:
    """True if no condition, remainder or table depends on the time."""
    return not any(
        node.op in ("mod", "table") and ex.depends_on(node, ("time",)) for node in ex.walk(entry)
    ) and not any(
        ex.depends_on(relation.gap, ("time",))
        for node in ex.walk(entry)
        if node.op == "select"
        for relation in ex.relations_in(node.payload)
    )


def frozen(system: System, expressions: tuple[Expr, ...], mode: int) -> tuple[Expr, ...]:
    """Expressions in one mode; bit i is the side of guard i."""
    guards = range(len(system.guards))
    above = [number for number in guards if mode >> number & 1]
    return all_assuming(
        all_assuming(expressions, above, True), set(guards).difference(above), False
    )
