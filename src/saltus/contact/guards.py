"""Guards: the boundaries found in a system's equations.

Every comparison in a condition is a boundary ``gap = 0``. Comparisons that mean the same boundary -
equal up to a non-zero number, however they are written - become one guard; conditions then hold
bits (:class:`~saltus.language.expression.Bit`), and equations are smooth where the bits don't
change.
"""

from __future__ import annotations

import functools
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import or_

from saltus.errors import TraceError
from saltus.language import expression as ex
from saltus.language.canonical import ONE, Canonical, Polynomial, is_multiple, proportion
from saltus.language.clocks import of_time_only, switch
from saltus.language.expression import And, Bit, Condition, Expr, Not, Or, Relation
from saltus.language.roots import without_root
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


def find_guards(field: Iterable[Expr]) -> tuple[tuple[Expr, ...], tuple[Guard, ...]]:
    """The guards of a traced field, and the field with bits in place of comparisons.

    Guards are listed in the order in which the equations name them first, a boundary inside a gap
    before that gap. A boundary on which nothing depends (equal values on both sides) is left out.

    Raises
    ------
    TraceError
        If a comparison depends on parameters only, compares equal things, or depends on time in a
        way that can't be solved.
    """
    return join_guards(field, ())


def join_guards(
    roots: Iterable[Expr], known: Sequence[Guard]
) -> tuple[tuple[Expr, ...], tuple[Guard, ...]]:
    """Extend known guards by those of expressions that join a system: known guards don't change,
    and new ones follow them. As :func:`find_guards` otherwise.

    Raises
    ------
    TraceError
        As :func:`find_guards`.
    """
    roots = tuple(roots)
    finder = _Finder(known)
    for relation in relations(roots):
        finder.add(relation)
    return _used_only(tuple(finder.rewrite(root) for root in roots), finder.guards, len(known))


def surface_guard(gap: Expr, name: str) -> Guard:
    """The guard of a surface. Its gap is the expression as it stands, with sign and scale, but
    without a root (:func:`without_root`); conditions in it hold bits.

    Raises
    ------
    TraceError
        If the expression doesn't depend on a state.
    """
    canonical, gap = Canonical(), without_root(gap)
    _check_moves(gap, canonical.kinds(canonical.polynomial(gap)))
    level, positive = _guard(gap, canonical)
    return replace(
        level if positive and canonical.level_of(gap)[1] == 1.0 else Guard("", gap), name=name
    )


def number_of(condition: Relation, guards: Sequence[Guard]) -> int | None:
    """Number of the guard that a comparison means, however it is written; None if it means none of
    them.

    ``x > gap`` also means ``k*(x - gap) = 0``, if that is the only multiple of it.

    Raises
    ------
    TraceError
        If it is no boundary at all: of parameters or time only, or of equal things.
    """
    finder = _Finder(guards)
    for relation in relations([ex.select(condition, 1, 0)]):
        finder.add(relation)
    found = finder.outcome[condition]
    found = found.inner if isinstance(found, Not) else found
    if not isinstance(found, Bit):
        return None
    if found.guard < len(guards):
        return found.guard
    meant = finder.polynomial(found.guard)
    multiples = [
        number for number in range(len(guards)) if is_multiple(finder.polynomial(number), meant)
    ]
    return multiples[0] if len(multiples) == 1 else None


def relations(roots: Sequence[Expr]) -> Iterator[Relation]:
    """Every relation below the roots in the order of reading, those inside a gap before it. A
    relation may come more than once.
    """
    seen: set[Expr] = set()
    stack: list[Expr | Relation] = list(reversed(roots))
    while stack:
        item = stack.pop()
        if isinstance(item, Relation):
            yield item
        elif item not in seen:
            seen.add(item)
            stack.extend(reversed(item.args))
            if item.op == "select":
                for relation in reversed(list(ex.relations_in(item.payload))):
                    stack.extend((relation, relation.gap))


class _Finder:
    """Collects guards and remembers the outcome of every relation."""

    def __init__(self, known: Sequence[Guard] = ()) -> None:
        self.guards: list[Guard] = list(known)
        self._canonical = Canonical()
        self._numbers: dict[Expr, int] = {}
        for number, guard in enumerate(known):
            if not is_hold(guard):
                self._numbers.setdefault(guard.gap, number)
        self.outcome: dict[Relation, Condition | bool] = {}
        self._rewritten: dict[Expr, Expr] = {}

    def add(self, relation: Relation) -> None:
        """Find the guard of a relation, or make one."""
        if relation in self.outcome:
            return
        gap = self.rewrite(relation.gap)
        if of_time_only(gap) and not bits_in([gap]):
            self.outcome[relation] = switch(gap)
            return
        gap = without_root(gap)
        same, positive = _oriented(gap)
        if same in self._numbers:  # a quick answer for what is written as the guard itself
            bit = Bit(self._numbers[same])
            self.outcome[relation] = bit if positive else Not(bit)
            return
        polynomial = self._canonical.polynomial(gap)
        if polynomial.keys() <= {ONE}:
            if not polynomial:
                raise TraceError(
                    f"an equation compares equal things: {gap!r} is always zero. "
                    f"Remove the comparison."
                )
            self.outcome[relation] = polynomial[ONE] > 0
            return
        for number in range(len(self.guards)):
            sign = proportion(polynomial, self.polynomial(number))
            if sign:
                self.outcome[relation] = Bit(number) if sign > 0 else Not(Bit(number))
                return
        _check_moves(gap, self._canonical.kinds(polynomial))
        guard, positive = _guard(gap, self._canonical)
        self.outcome[relation] = Bit(len(self.guards)) if positive else Not(Bit(len(self.guards)))
        self._numbers.setdefault(guard.gap, len(self.guards))
        self.guards.append(guard)

    def polynomial(self, number: int) -> Polynomial:
        """The normal form of a guard's gap; empty for a hold guard."""
        guard = self.guards[number]
        return {} if is_hold(guard) else self._canonical.polynomial(guard.gap)

    def rewrite(self, root: Expr) -> Expr:
        """The expression with bits in place of relations, all of which must be known."""
        memo = self._rewritten
        for node in ex.walk(root, known=memo):
            args = tuple(memo[child] for child in node.args)
            if node.op != "select":
                memo[node] = ex.rebuild(node, args, node.payload)
            else:
                condition = self._condition(node.payload)
                memo[node] = (
                    args[not condition]
                    if isinstance(condition, bool)
                    else ex.rebuild(node, args, condition)
                )
        return memo[root]

    def _condition(self, condition: Condition) -> Condition | bool:
        """The condition in terms of bits, or its value where that is certain."""
        match condition:
            case Bit():  # of a known guard: an expression of the system itself
                return condition
            case Relation():
                return self.outcome[condition]
            case Not(inner):
                value = self._condition(inner)
                return not value if isinstance(value, bool) else _opposite(value)
            case And(left, right) | Or(left, right):
                joint = type(condition)
                a, b = self._condition(left), self._condition(right)
                neutral = joint is And
                if isinstance(a, bool):
                    return b if a is neutral else a
                if isinstance(b, bool):
                    return a if b is neutral else b
                return a if a == b else joint(a, b)
        raise TypeError(condition)


def _opposite(condition: Condition) -> Condition:
    return condition.inner if isinstance(condition, Not) else Not(condition)


def _check_moves(gap: Expr, kinds: frozenset[str]) -> None:
    """Raise a TraceError unless the gap changes with a state inside a mode."""
    if "state" in kinds:
        return
    what = f"the boundary {gap!r} = 0"
    if "time" in kinds and "select" not in kinds:
        raise TraceError(
            f"{what} depends on time only, not on a state: no motion crosses it. A "
            f"surface is a function of the states."
        )
    if "select" in kinds:
        raise TraceError(
            f"{what} depends on a state only through another condition: it jumps and is never "
            f"crossed. Join the conditions with & or |, "
            f"or write one piecewise inside the other."
        )
    raise TraceError(
        f"{what} depends on parameters only, not on a state, so it is no contact. Make the choice "
        f"before: pass its result as a parameter, "
        f"or trace two systems."
    )


# -- the form of a guard ---------------------------------------------------------------------------
def _guard(gap: Expr, canonical: Canonical) -> tuple[Guard, bool]:
    """The guard of a gap, and True if both have the same sign. Guards get their names later."""
    gap, positive = _oriented(gap)
    name, factor = canonical.level_of(gap)
    if name is None:
        return Guard("", gap), positive
    state, at_zero = ex.state(name), ex.substituted(gap, {ex.state(name): ex.constant(0.0)})
    boundary = ex.div(_negated(at_zero) if factor > 0 else at_zero, abs(factor))
    if ex.varies(boundary):
        return Guard("", gap), positive
    return Guard("", ex.sub(state, boundary), name, boundary), positive == (factor > 0)


def _oriented(gap: Expr) -> tuple[Expr, bool]:
    """The gap without a numeric factor, what varies first in a difference; True if the sign is that
    of the gap.
    """
    gap, positive = _without_factor(gap)
    if gap.op == "sub" and not ex.varies(gap.args[0]):
        gap, positive = ex.sub(gap.args[1], gap.args[0]), not positive
    return gap, positive


def _without_factor(gap: Expr) -> tuple[Expr, bool]:
    """The gap without a numeric factor around it, and True if that factor is positive."""
    positive = True
    while True:
        match gap.op, gap.args:
            case "neg", (inner,):
                gap, positive = inner, not positive
            case "mul" | "div", (inner, Expr(op="const", payload=number)) if number:
                gap, positive = inner, positive == (number > 0)
            case "mul", (Expr(op="const", payload=number), inner) if number:
                gap, positive = inner, positive == (number > 0)
            case _:
                return gap, positive


def _negated(a: Expr) -> Expr:
    """``-a`` with the sign taken inside sums; equal to ``-a`` in every bit."""
    match a.op, a.args:
        case "sub", (left, right):
            return ex.add(left.args[0], right) if left.op == "neg" else ex.sub(right, left)
        case "add", (left, right) if left.op == "neg":
            return ex.sub(left.args[0], right)
    return ex.neg(a)


# -- numbering and names ---------------------------------------------------------------------------
def _used_only(
    field: tuple[Expr, ...], guards: Sequence[Guard], known: int
) -> tuple[tuple[Expr, ...], tuple[Guard, ...]]:
    """Drop guards on which nothing depends, renumber and name the others. The first ``known`` don't
    change.
    """
    used = bits_in(field) | set(range(known))
    for number in reversed(range(len(guards))):
        if number in used:
            used |= bits_in([guards[number].gap])
    new = {old: number for number, old in enumerate(sorted(used))}
    field = tuple(renumbered(root, new) for root in field)
    used_guards = [
        guards[old] if old < known else replace(guards[old], gap=renumbered(guards[old].gap, new))
        for old in new
    ]
    return field, tuple(_with_names(used_guards, known))


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


def _with_names(guards: Sequence[Guard], known: int) -> list[Guard]:
    """Guards named after their only parameter; after the boundary's equation if that isn't unique.
    The first ``known`` keep their names.
    """
    single: list[str | None] = []
    for guard in guards:
        where = guard.gap if guard.boundary is None else guard.boundary
        names = {node.payload for node in ex.walk(where) if node.op == "param"}
        single.append(names.pop() if len(names) == 1 else None)
    count = Counter(single)
    named = list(guards[:known])
    writer = functools.cache(lambda: Writer(guards, limit=100))
    taken = {guard.name for guard in named}
    for number, (guard, name) in list(enumerate(zip(guards, single, strict=True)))[known:]:
        if name is None or count[name] > 1:
            name = at_equality(writer().side(number))
        while name in taken:
            name += "'"
        taken.add(name)
        named.append(replace(guard, name=name))
    return named
