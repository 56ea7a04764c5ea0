"""Find the boundaries of a traced field: comparisons that mean the same boundary - equal up to a
non-zero number, however they are written - become one guard, and conditions then hold bits.
"""

from __future__ import annotations

import functools
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

from saltus.contact.guards import Guard, at_equality, bits_in, is_hold, renumbered
from saltus.errors import TraceError
from saltus.language import expression as ex
from saltus.language.canonical import ONE, Canonical, Polynomial, is_multiple, proportion
from saltus.language.clocks import of_time_only, switch
from saltus.language.expression import And, Bit, Condition, Expr, Not, Or, Relation
from saltus.language.roots import without_root
from saltus.language.text import Writer
from saltus.units import dimension


def find_guards(
    field: Iterable[Expr], units: Mapping[str, str] | None = None
) -> tuple[tuple[Expr, ...], tuple[Guard, ...]]:
    """The guards of a traced field, and the field with bits in place of comparisons. Units are
    those of states and parameters that have one.

    Guards are listed in the order in which the equations name them first, a boundary inside a gap
    before that gap. A boundary on which nothing depends (equal values on both sides) is left out.

    Raises
    ------
    TraceError
        If a comparison depends on parameters only, compares equal things, or depends on time in a
        way that can't be solved.
    """
    return join_guards(field, (), units)


def join_guards(
    roots: Iterable[Expr], known: Sequence[Guard], units: Mapping[str, str] | None = None
) -> tuple[tuple[Expr, ...], tuple[Guard, ...]]:
    """Extend known guards by those of expressions that join a system: known guards don't change,
    and new ones follow them. As :func:`find_guards` otherwise.

    Raises
    ------
    TraceError
        As :func:`find_guards`.
    """
    roots = tuple(roots)
    finder = _Finder(known, units)
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
    _check_moves(gap, kinds_of(gap))
    level, positive = _guard(gap, canonical)
    return replace(
        level if positive and canonical.level_of(gap)[1] == 1.0 else Guard("", gap), name=name
    )


def kinds_of(gap: Expr) -> frozenset[str]:
    """The kinds of leaves that the gap of a surface depends on, once terms have cancelled: of
    ``state``, ``time``, ``param`` and ``select``.
    """
    canonical = Canonical()
    return canonical.kinds(canonical.polynomial(gap))


def number_of(condition: Relation, guards: Sequence[Guard]) -> int | None:
    """Number of the guard that a comparison means, however it is written; None if it means none of
    them.

    ``x > gap`` also means ``k*(x - gap) = 0``, if that is the only multiple of it.

    Raises
    ------
    TraceError
        If it is no boundary at all: of parameters or time only, or of equal things.
    """
    return numbers_of([condition], guards)[0]


def numbers_of(conditions: Iterable[Relation], guards: Sequence[Guard]) -> list[int | None]:
    """:func:`number_of` several comparisons."""
    finder, numbers = _Finder(guards), list[int | None]()
    for condition in conditions:
        for relation in relations([ex.select(condition, 1, 0)]):
            finder.add(relation)
        found = finder.outcome[condition]
        found = found.inner if isinstance(found, Not) else found
        numbers.append(finder.meant(found.guard, len(guards)) if isinstance(found, Bit) else None)
    return numbers


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

    def __init__(self, known: Sequence[Guard] = (), units: Mapping[str, str] | None = None) -> None:
        self.guards: list[Guard] = list(known)
        self._units = units or {}
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
        guard, positive = _guard(gap, self._canonical, self._units)
        self.outcome[relation] = Bit(len(self.guards)) if positive else Not(Bit(len(self.guards)))
        self._numbers.setdefault(guard.gap, len(self.guards))
        self.guards.append(guard)

    def polynomial(self, number: int) -> Polynomial:
        """The normal form of a guard's gap; empty for a hold guard."""
        guard = self.guards[number]
        return {} if is_hold(guard) else self._canonical.polynomial(guard.gap)

    def meant(self, number: int, known: int) -> int | None:
        """The one among the first guards, that many, of whose gap a guard's is a multiple."""
        if number < known:
            return number
        own = self.polynomial(number)
        multiples = [one for one in range(known) if is_multiple(self.polynomial(one), own)]
        return multiples[0] if len(multiples) == 1 else None

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
def _guard(
    gap: Expr, canonical: Canonical, units: Mapping[str, str] | None = None
) -> tuple[Guard, bool]:
    """The guard of a gap, and True if both have the same sign. Guards get their names later."""
    gap, positive = _oriented(gap)
    name, factor = canonical.level_of(gap)
    if name is None:
        return Guard("", gap), positive
    state, at_zero = ex.state(name), ex.substituted(gap, {ex.state(name): ex.constant(0.0)})
    boundary = ex.div(_negated(at_zero) if factor > 0 else at_zero, abs(factor))
    if ex.varies(boundary) or _in_another_unit(name, boundary, units or {}):
        return Guard("", gap), positive
    return Guard("", ex.sub(state, boundary), name, boundary), positive == (factor > 0)


def _in_another_unit(name: str, boundary: Expr, units: Mapping[str, str]) -> bool:
    """True if the only parameter of a level has another unit than the state: the number beside the
    state, such as the shape of a mode, carries a unit, and the gap is physical as it is written.
    """
    names = {node.payload for node in ex.walk(boundary) if node.op == "param"}
    own = units.get(name, "")
    other = units.get(names.pop(), "") if len(names) == 1 else ""
    return bool(own and other) and dimension(own) != dimension(other)


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
