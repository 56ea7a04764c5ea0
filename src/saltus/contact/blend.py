"""Blends in place of pieces: each side of a guard gets a weight, a smoothed step of its gap."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from saltus.contact.boundaries import number_of
from saltus.contact.contacts import find_contacts, renamed
from saltus.contact.guards import Guard, Law
from saltus.language import expression as ex
from saltus.language.expression import And, Bit, Condition, Expr, Friction, Not, Or, Relation
from saltus.language.functions import atan, piecewise, sqrt, tanh
from saltus.language.known_sides import assuming

#: A smoothed step of a gap and a width, from 0 far below the boundary to 1 far above.
Step = Callable[[Any, Any], Any]


def _tanh(gap: Any, width: Any) -> Any:
    return 0.5 * (1.0 + tanh(gap / width))


def _sigmoid(gap: Any, width: Any) -> Any:
    return 0.5 * (1.0 + tanh(gap / (2.0 * width)))  # 1/(1 + exp(-u)), without its overflow


def _polynomial(gap: Any, width: Any) -> Any:
    u = gap / width
    inside = 0.5 + 0.75 * u - 0.25 * u * u * u
    return piecewise((0.0, gap + width < 0), (1.0, gap - width > 0), otherwise=inside)


def _rational(gap: Any, width: Any) -> Any:
    u = gap / width
    return 0.5 * (1.0 + u / sqrt(1.0 + u * u))


def _arctan(gap: Any, width: Any) -> Any:
    return 0.5 + atan(gap / width) / math.pi


#: The smoothed steps by their names.
STEPS: dict[str, Step] = {
    "tanh": _tanh,
    "sigmoid": _sigmoid,
    "polynomial": _polynomial,
    "rational": _rational,
    "arctan": _arctan,
}


def blended(
    field: Sequence[Expr],
    guards: Sequence[Guard],
    states: Sequence[str],
    step: Step,
    parameters: Mapping[int, str],
    units: Mapping[str, str],
    outputs: tuple[Sequence[Expr], Sequence[Guard]] = ((), ()),
) -> tuple[tuple[Expr, ...], tuple[Guard, ...], list[Expr]]:
    """Return field and guards of a regularised system, and the formulas of its outputs, which are
    given with the guards that only they need, with comparisons of the boundaries that stay.
    ``parameters`` holds the width of each blended guard, by number. Raises TraceError if the blends
    can't be equations.
    """
    blend = _Blend(step, parameters)
    for guard in guards:
        blend.add(guard)
    for number, guard in enumerate(guards):
        if guard.law is not None:
            blend.keep_friction(number, guard.law)
    rates = [blend.rewrite(entry) for entry in field]
    new, found = find_contacts(rates, (), states, units)
    named = _with_old_names(guards, blend.sides, found)
    formulas, more = outputs
    for guard in more:
        blend.add(guard)
    return new, named, [blend.rewrite(one) for one in formulas]


def _with_old_names(
    old: Sequence[Guard], sides: Sequence[Any], guards: Sequence[Guard]
) -> tuple[Guard, ...]:
    """The guards; those that stay keep the names they had."""
    kept = {
        number: guard.name
        for guard, side in zip(old, sides, strict=True)
        if isinstance(side, Relation) and (number := number_of(side, guards)) is not None
    }
    return renamed(guards, kept)


class _Blend:
    """Weights in place of the bits of guards."""

    def __init__(self, step: Step, parameters: Mapping[int, str]) -> None:
        self._step, self._parameters = step, parameters
        self.sides: list[Expr | Relation] = []
        self._rewritten: dict[Expr, Expr] = {}

    def add(self, guard: Guard) -> None:
        """Add the next guard: its weight, or its comparison if it stays."""
        number, gap = len(self.sides), self.rewrite(guard.gap)
        name = self._parameters.get(number)
        if name is not None:
            self.sides.append(ex.as_expr(self._step(gap, ex.parameter(name))))
        else:
            self.sides.append(Relation(gap))

    def keep_friction(self, number: int, law: Law) -> None:
        """Decide friction by the comparison of a guard that stays, as its law does."""
        side = self.sides[number]
        if isinstance(side, Relation) and law.limit is not None:
            # both sides have one limit on the boundary itself
            limit = self.rewrite(assuming(law.limit, number, True))
            levels = tuple(self.rewrite(level) for level in law.levels)
            self.sides[number] = Friction(side.gap, limit, levels)

    def rewrite(self, root: Expr) -> Expr:
        """The expression with blends in place of pieces."""
        memo = self._rewritten
        for node in ex.walk(root):
            if node in memo:
                continue
            args = tuple(memo[child] for child in node.args)
            if node.op != "select":
                memo[node] = ex.rebuild(node, args, node.payload)
                continue
            side = self._side(node.payload)
            if isinstance(side, Condition):
                memo[node] = ex.select(side, *args)
            else:
                memo[node] = ex.add(args[1], ex.mul(side, ex.sub(args[0], args[1])))
        return memo[root]

    def _side(self, condition: Condition) -> Expr | Condition:
        """The weight of a condition; a condition of boundaries that stay is kept."""
        match condition:
            case Bit(number):
                return self.sides[number]
            case Relation():
                return condition
            case Not(inner):
                side = self._side(inner)
                return Not(side) if isinstance(side, Condition) else 1.0 - side
            case And(left, right) | Or(left, right):
                a, b = self._side(left), self._side(right)
                if isinstance(a, Condition) and isinstance(b, Condition):
                    return type(condition)(a, b)
                a, b = (ex.select(c, 1, 0) if isinstance(c, Condition) else c for c in (a, b))
                return a * b if isinstance(condition, And) else 1.0 - (1.0 - a) * (1.0 - b)
        raise TypeError(condition)
