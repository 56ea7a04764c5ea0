"""Guards: the boundaries of a system's equations, and the laws of contact there.

boundaries.py finds them. Conditions hold their bits (:class:`~saltus.language.expression.Bit`), and
equations are smooth where the bits don't change.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import or_

from saltus.language import expression as ex
from saltus.language.expression import And, Bit, Condition, Expr, Not, Or, Relation
from saltus.language.text import Writer


@dataclass(frozen=True, eq=False)
class Law:
    """A contact that does more than change the equations: the state jumps, or the contact is held.

    A contact that can be held - at rest, stuck, sliding along its boundary - has a *hold guard*
    behind all others, whose bit says that it is. There the field is the reduced one.

    Attributes
    ----------
    kind : str
        ``impact``, ``jump``; ``surface``: both sides may push onto the boundary; ``hold``: the
        guard is the hold guard of another.
    side : int
        Sign of the gap on the side that an impact allows, or from which a jump happens; else 0.
    partner : int
        Number of the hold guard; of the owner, if this is one; -1 of a jump.
    reset : tuple of Expr
        The state after an impact or a jump.
    settled : tuple of Expr
        The state on the constraint, where the contact begins to be held.
    constraint : Expr or None
        w, zero while the contact is held: the closing velocity of an impact, the function of a
        surface.
    normal, direction : tuple of Expr
        Gradient of w with respect to the states; what a unit of the contact's own force adds to the
        field, that of others that are held eliminated.
    drive, pivot : Expr or None
        Rate of w without the contact's own force, and what a unit of it adds to that rate.
    limit : Expr or None
        Of a surface: static over kinetic force.
    restitution, friction : Expr or None
        Of an impact; its coefficient of friction while it rests, if it has any.
    levels : tuple of Expr
        Of a surface: the forces of friction in motion that are declared as such.
    remaining : Expr or None
        Of an impact with friction: its pivot over that without.
    mass : Expr or None
        Of an impact: its impulse for each unit by which the closing velocity changes, all other
        contacts free; of a system whose inertias aren't given relative to its mass.
    zeros : int
        Derivatives of the gap that are zero where holding fades out, the gap among them.
    support : int
        Of the friction of a contact: the hold guard of that contact, without which there is none;
        else -1.
    """

    kind: str
    side: int = 0
    partner: int = -1
    reset: tuple[Expr, ...] = ()
    settled: tuple[Expr, ...] = ()
    constraint: Expr | None = None
    normal: tuple[Expr, ...] = ()
    direction: tuple[Expr, ...] = ()
    drive: Expr | None = None
    pivot: Expr | None = None
    limit: Expr | None = None
    restitution: Expr | None = None
    friction: Expr | None = None
    levels: tuple[Expr, ...] = ()
    remaining: Expr | None = None
    mass: Expr | None = None
    zeros: int = 1
    support: int = -1

    def expressions(self) -> tuple[Expr, ...]:
        """All expressions of the law."""
        single = (
            self.constraint, self.drive, self.pivot, self.limit, self.restitution, self.friction,
            self.remaining, self.mass,
        )  # fmt: skip
        several = (*self.reset, *self.settled, *self.normal, *self.direction, *self.levels)
        return (*several, *(one for one in single if one is not None))

    def extended(self, states: Sequence[Expr]) -> Law:
        """The law for a system with more states, which it doesn't change."""
        none = (ex.constant(0.0),) * len(states)
        return replace(
            self,
            reset=self.reset and (*self.reset, *states),
            settled=self.settled and (*self.settled, *states),
            normal=self.normal and (*self.normal, *none),
            direction=self.direction and (*self.direction, *none),
        )


@dataclass(frozen=True, eq=False)
class Guard:
    """A boundary; side 1 is where ``gap > 0``.

    Attributes
    ----------
    name : str
        The parameter that sets the boundary, if there is just one; else the equation of the
        boundary.
    gap : Expr
        Distance from the boundary, signed. It may hold bits of guards earlier in the list (``abs(x)
        - gap``). A distance that holds a root is there as :func:`without_root` makes it.
    state : str or None
        The state that the boundary is a level of: ``gap = state - boundary``. None for any other
        boundary.
    boundary : Expr or None
        That level, an expression of parameters.
    law : Law or None
        None for a contact that only changes the equations.
    """

    name: str
    gap: Expr
    state: str | None = None
    boundary: Expr | None = None
    law: Law | None = None


def expressions_of(guards: Iterable[Guard]) -> list[Expr]:
    """Gaps of guards and the expressions of their laws."""
    return [
        root
        for guard in guards
        for root in (guard.gap, *(guard.law.expressions() if guard.law else ()))
    ]


def is_hold(guard: Guard) -> bool:
    """True if the guard says that the contact of another one is held."""
    return guard.law is not None and guard.law.kind == "hold"


def bits_in(roots: Iterable[Expr]) -> set[int]:
    """Numbers of the guards whose bits stand in conditions below the roots."""
    bits = functools.reduce(or_, (root.bits for root in roots), 0)
    return {number for number in range(bits.bit_length()) if bits >> number & 1}


def renumbered(root: Expr, new: Mapping[int, int]) -> Expr:
    """The expression with its bits renumbered."""

    def condition(old: Condition) -> Condition:
        match old:
            case Bit(guard):
                return Bit(new[guard])
            case Relation():
                return old
            case Not(inner):
                return Not(condition(inner))
            case And(left, right) | Or(left, right):
                return type(old)(condition(left), condition(right))
        raise TypeError(old)

    if all(old == number for old, number in new.items()):
        return root
    memo: dict[Expr, Expr] = {}
    for node in ex.walk(root):
        payload = condition(node.payload) if node.op == "select" else node.payload
        memo[node] = ex.rebuild(node, tuple(memo[child] for child in node.args), payload)
    return memo[root]


def equation_of(number: int, guards: Sequence[Guard]) -> str:
    """The equation of a boundary, such as ``x = -lower_gap``."""
    return at_equality(Writer(guards[: number + 1], limit=100).side(number))


def at_equality(side: str) -> str:
    """The comparison as the equation of its boundary; comparisons within brackets are kept."""
    depth = 0
    for place, sign in enumerate(side):
        depth += (sign == "(") - (sign == ")")
        if not depth and side.startswith(" > ", place):
            return f"{side[:place]} = {side[place + 3 :]}"
    return side
