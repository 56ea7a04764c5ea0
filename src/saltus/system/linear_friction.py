"""Friction of systems that are linear between their contacts: what holds a surface, and how much of
its limit is left, as linear functions of the states.

Where both sides push onto the boundary ``w = 0`` of a friction, w' without its force is the *drive*
N, and the largest force changes w' by P. The surface is held while both *margins* are positive, ``P
- N`` and ``P + N``: it slides upwards where the first one ends, downwards where the second does.
The hold guard of a system has the product of both as its gap, which isn't linear; here it has the
first, and a gap of its own behind those of all guards is minus the second.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

from saltus.contact.guards import Guard, bits_in
from saltus.contact.signs import never_negative_if
from saltus.language import expression as ex
from saltus.language.canonical import Canonical
from saltus.language.expression import Expr
from saltus.language.known_sides import assuming
from saltus.system.system import System

#: Conditions in what holds a surface, of which all cases are looked at.
_MOST_BITS = 10


@dataclass(frozen=True)
class Sticking:
    """A boundary on which friction holds the motion.

    Attributes
    ----------
    guard, hold : int
        Its guard, and the hold guard of this.
    second : int
        Number of the gap that is minus its second margin.
    margins : tuple of Expr
        P - N and P + N.
    limit : Expr
        Its largest force at rest, as a multiple of that in motion.
    """

    guard: int
    hold: int
    second: int
    margins: tuple[Expr, Expr]
    limit: Expr


def sticking_of(system: System) -> tuple[Sticking, ...]:
    """The boundaries of a system on which friction may hold the motion."""
    found = list[Sticking]()
    for number, guard in enumerate(system.guards):
        law = guard.law
        if law is None or law.kind != "surface" or limit_side(guard) != 0:
            continue
        assert law.drive is not None
        assert law.pivot is not None
        limit = ex.constant(1.0) if law.limit is None else law.limit
        most = ex.neg(ex.mul(limit, law.pivot))
        margins = ex.sub(most, law.drive), ex.add(most, law.drive)
        second = len(system.guards) + len(found)
        found.append(Sticking(number, law.partner, second, margins, limit))
    return tuple(found)


def gaps_of(system: System, sticking: Sequence[Sticking]) -> tuple[Expr, ...]:
    """The gaps of a system's guards, with a margin for each hold guard of a friction; behind them
    minus the second margin of each.
    """
    gaps = [
        ex.constant(0.0) if is_idle(system.guards, guard) else guard.gap for guard in system.guards
    ]
    for one in sticking:
        gaps[one.hold] = one.margins[0]
    return (*gaps, *(ex.neg(one.margins[1]) for one in sticking))


def levels_of(system: System) -> tuple[Expr, ...] | None:
    """Expressions of parameters of which one is negative if a friction becomes so; None if that
    depends on the motion.
    """
    found = list[Expr]()
    for guard in system.guards:
        for level in guard.law.levels if guard.law else ():
            conditions = never_negative_if(level, system.guards)
            if conditions is None:
                return None
            found += conditions
    return tuple(found)


def limit_side(guard: Guard) -> int:
    """1 or -1 for the limit of a memory, on which it stays while its input pushes on: the side of
    the boundary to which that leads; 0 for any other boundary.
    """
    law = guard.law
    if law is None or law.kind != "surface":
        return 0
    assert law.drive is not None
    assert law.pivot is not None
    bits, found, canonical = sorted(bits_in([law.drive, law.pivot])), set[int](), Canonical()
    if len(bits) > _MOST_BITS:
        return 0
    for sides in itertools.product((False, True), repeat=len(bits)):
        drive, pivot = law.drive, law.pivot
        for bit, side in zip(bits, sides, strict=True):
            drive, pivot = assuming(drive, bit, side), assuming(pivot, bit, side)
        if canonical.polynomial(pivot):
            rests = [not canonical.polynomial(one(drive, pivot)) for one in (ex.add, ex.sub)]
            found.add(rests[0] - rests[1])
    return found.pop() if len(found) == 1 else 0


def is_idle(guards: Sequence[Guard], guard: Guard) -> bool:
    """True for the hold guard of the limit of a memory, on which nothing is held."""
    law = guard.law
    return law is not None and law.kind == "hold" and limit_side(guards[law.partner]) != 0
