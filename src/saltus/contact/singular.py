"""Laws that have no Taylor series on a boundary: ``d**1.5``, ``sqrt(d)``, ``d*log(d)`` where the
gap d is zero.

Such a term is analytic on either side of its boundary, and small near it. :func:`set_aside` finds
these terms and gives each a bit that switches it off: a step off the boundary, or onto it, uses the
rest of the equations only (kernels/taylor/singular.py). :func:`check_finite` refuses terms that are
infinite there. Both use the *order* of an expression on a boundary: the power of the gap with which
it goes to zero.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from functools import reduce
from itertools import count
from operator import or_
from typing import NamedTuple

from saltus.contact.guards import Guard, bits_in
from saltus.errors import TraceError
from saltus.language import expression as ex
from saltus.language.canonical import Canonical, is_multiple
from saltus.language.expression import And, Bit, Condition, Expr, Not, Or
from saltus.language.known_sides import all_assuming, assuming

_ZERO = ex.constant(0.0)
#: Order of a logarithm: below every power.
_LOG = -1e-9
#: Operations whose value has a series wherever their operands have one.
_REGULAR = ("add", "sub", "neg", "mul", "select")
#: Most branches of a function of pieces; a sum of k pieces has 2**k of them.
_MOST_BRANCHES = 256


class VanishingOrder(NamedTuple):
    """Order of an expression on a boundary: it is like gap**order, or smaller; ``singular`` if it
    has no Taylor series there.
    """

    order: float
    singular: bool


class SetAside(NamedTuple):
    """A field with terms that have no series, which can be switched off.

    Attributes
    ----------
    field, gaps : tuple of Expr
        The bit ``first + j`` switches off what has no series on the boundary ``guards[j]``.
    guards : tuple of int
        Numbers of those guards.
    first : int
        Number of guards of the system.
    """

    field: tuple[Expr, ...]
    gaps: tuple[Expr, ...]
    guards: tuple[int, ...]
    first: int

    def without(self, j: int, count: int | None = None) -> tuple[Expr, ...]:
        """The field, or its first entries, without the terms of ``guards[j]``."""
        return all_assuming(self.field[:count], [self.first + j], True)


def set_aside(field: Sequence[Expr], guards: Sequence[Guard]) -> SetAside:
    """Find the terms of a field and its gaps that have no Taylor series on a boundary; a bit for
    each such boundary switches them off.
    """
    boundaries = _Boundaries(guards)
    roots = (*field, *(guard.gap for guard in guards))
    if not _may_break(roots):
        return SetAside(tuple(field), roots[len(field) :], (), len(guards))
    functions = _functions(roots)
    broken = {
        number: nodes
        for number in range(len(guards))
        if (nodes := boundaries.singular_terms(functions, number))
    }
    terms: dict[Expr, list[int]] = {}
    for j, nodes in enumerate(broken.values()):
        for node in nodes:
            terms.setdefault(node, []).append(len(guards) + j)
    switched = _switched(roots, terms)
    return SetAside(switched[: len(field)], switched[len(field) :], tuple(broken), len(guards))


def check_finite(field: Sequence[Expr], guards: Sequence[Guard], states: Sequence[str]) -> None:
    """Raise a TraceError if a piece of the field is infinite on its own boundary: the motion isn't
    defined there.
    """
    if not _may_break(field):
        return
    boundaries, functions = _Boundaries(guards), _functions(field)
    for number, guard in enumerate(guards):
        orders = boundaries.orders(functions, number)
        if not any(orders[node].order < 0 for node in functions):
            continue
        orders = boundaries.orders(field, number)
        for name, entry in zip(states, field, strict=True):
            if orders[entry].singular and orders[entry].order < 0 and number in bits_in([entry]):
                worst = next(
                    node
                    for node in ex.walk(entry)
                    if orders[node].singular and orders[node].order < 0
                )
                raise TraceError(
                    f"d{name}/dt is infinite on the boundary {guard.name!r}, where its piece "
                    f"begins: {worst!r}. Write a law that is finite "
                    f"there, such as one of the depth plus a small length, or begin the piece a "
                    f"little further in."
                )


def is_steep(jacobian: Iterable[Expr], guards: Sequence[Guard]) -> bool:
    """True if a derivative of the field is infinite on a boundary where its piece begins, as that
    of ``d**0.25``: no tangent can be integrated through it.
    """
    entries = [entry for entry in jacobian if entry.op != "const"]
    if not _may_break(entries):
        return False
    boundaries = _Boundaries(guards)
    return any(
        orders[entry].singular and orders[entry].order < 0 and number in bits_in([entry])
        for number in range(len(guards))
        for orders in [boundaries.orders(entries, number)]
        for entry in entries
    )


def check_gaps(guards: Sequence[Guard]) -> None:
    """Raise a TraceError if a gap has a power, root or logarithm of a piece that vanishes: the gap
    is zero there, on neither side.
    """
    boundaries = _Boundaries(guards)
    for guard in guards:
        for node in ex.walk(guard.gap):
            whole_power = (
                node.op == "pow"
                and node.args[1].op == "const"
                and float(node.args[1].payload).is_integer()
            )
            if (
                node.op in ("pow", "sqrt", "log")
                and not whole_power
                and boundaries.lifted(node) is not node
            ):
                raise TraceError(
                    f"the boundary {guard.name!r} asks for the sign of a law that has no Taylor "
                    "series where its own piece begins. Write it as one piece with all of its "
                    "conditions: for a contact without tension, d = x - gap and ",
                    lambda say: f"{say.sl}piecewise((K*d**1.5*(1 + c*v), ",
                    "(d > 0) & (1 + c*v > 0)), otherwise=0).",
                )


def lifted(field: Iterable[Expr], guards: Sequence[Guard]) -> tuple[Expr, ...]:
    """The same field with powers, roots and logarithms of pieces, ``sl.max(d, 0)**1.5``, as pieces
    of powers.

    Only where a piece is zero on a boundary: the rest stays as it was written.
    """
    boundaries = _Boundaries(guards)
    memo: dict[Expr, Expr] = {}
    roots = tuple(field)
    for node in ex.walk(*roots):
        new = ex.rebuild(node, tuple(memo[child] for child in node.args), node.payload)
        memo[node] = boundaries.lifted(new) if new.op in ("pow", "sqrt", "log") else new
    return tuple(memo[root] for root in roots)


def _may_break(roots: Iterable[Expr]) -> bool:
    """True if any operation below the roots could have no Taylor series. This test is cheap;
    looking for zeros on every boundary takes long in a field of a thousand terms.
    """
    for node in ex.walk(*roots):
        match node.op:
            case "sqrt" | "log":
                return True
            case "pow" if not _is_whole(node.args[1]):
                return True
            case "div" if ex.depends_on(node.args[1], ("state",)):
                return True
    return False


def _is_whole(exponent: Expr) -> bool:
    """True if an exponent is a whole number, not negative."""
    return exponent.op == "const" and exponent.payload >= 0 and exponent.payload % 1 == 0


def _switched(roots: Sequence[Expr], terms: dict[Expr, list[int]]) -> tuple[Expr, ...]:
    """The expressions with zero in place of their singular terms where their bits are set."""
    memo: dict[Expr, Expr] = {}
    for node in ex.walk(*roots):
        new = ex.rebuild(node, tuple(memo[child] for child in node.args), node.payload)
        if node in terms:
            bits: list[Condition] = [Bit(number) for number in terms[node]]
            new = ex.select(reduce(Or, bits), 0.0, new)
        memo[node] = new
    return tuple(memo[root] for root in roots)


def _functions(roots: Iterable[Expr]) -> list[Expr]:
    """The nodes below the roots that could have no Taylor series: all but sums and products."""
    return [node for node in ex.walk(*roots) if node.args and node.op not in _REGULAR]


class _Boundaries:
    """Orders of expressions on the boundaries of a system."""

    def __init__(self, guards: Sequence[Guard]) -> None:
        self._canonical = Canonical()
        self._guards = tuple(guards)
        self._states: dict[Expr, int] = {}
        self._one_more = (1 << place for place in count())
        self._orders: list[dict[Expr, VanishingOrder]] = [{} for _ in guards]
        self._there: list[dict[Expr, Expr | None]] = [{} for _ in guards]

    def singular_terms(self, functions: Sequence[Expr], number: int) -> list[Expr]:
        """Those of some functions that have no Taylor series on a boundary: powers, roots,
        logarithms and quotients of something that vanishes there.
        """
        orders = self.orders(functions, number)
        return [node for node in functions if self._breaks(node, orders)]

    @staticmethod
    def _breaks(node: Expr, orders: dict[Expr, VanishingOrder]) -> bool:
        if not orders[node].singular or not node.args:
            return False
        match node.op:
            case "pow" | "sqrt" | "log":
                return 0 < orders[node.args[0]].order < math.inf
            case "div":
                return 0 < orders[node.args[1]].order < math.inf
            case "exp":
                return _exponent_of_power(node, orders)
        return False

    def orders(self, field: Sequence[Expr], number: int) -> dict[Expr, VanishingOrder]:
        """Order of every node on boundary ``number``, with those computed before."""
        orders = self._orders[number]
        for node in ex.walk(*field, known=orders):
            orders[node] = self._order(node, orders, number)
        return orders

    def _order(self, node: Expr, known: dict[Expr, VanishingOrder], number: int) -> VanishingOrder:
        if node.op == "const":
            return VanishingOrder(math.inf if node.payload == 0 else 0.0, False)
        if node.op in ("state", "add", "sub", "select") and self._vanishes(node, number):
            return VanishingOrder(1.0, False)
        if not node.args:
            return VanishingOrder(0.0, False)
        parts = [known[child] for child in node.args]
        singular = any(part.singular for part in parts)
        first = parts[0].order
        match node.op:
            case "add" | "sub" | "select":
                return VanishingOrder(min(part.order for part in parts), singular)
            case "neg":
                return parts[0]
            case "mul":
                if any(part.order == math.inf for part in parts):
                    return VanishingOrder(math.inf, False)
                return VanishingOrder(first + parts[1].order, singular)
            case "div":
                below = parts[1].order
                return (
                    VanishingOrder(math.inf, False)
                    if first == math.inf
                    else VanishingOrder(first - below, singular or below > 0)
                )
            case "pow":
                return _order_of_power(parts[0], node.args[1])
            case "exp" if _exponent_of_power(node, known):
                return VanishingOrder(-_LOG, True)
        return _order_of_function(node.op, parts[0])

    def _vanishes(self, node: Expr, number: int) -> bool:
        """True if a node is zero on a boundary: the gap times a factor, or zero once the state is
        substituted.
        """
        if not self._states_in(self._guards[number].gap) & self._states_in(node):
            return False
        if self._is_gap(node, number):
            return True
        there = self._on_boundary(node, number)
        return there is not None and not self._canonical.polynomial(there)

    def _states_in(self, root: Expr) -> int:
        """The states below a node, as bits of a number."""
        known = self._states
        if root in known:
            return known[root]
        for node in ex.walk(root, known=known):
            own = next(self._one_more) if node.op == "state" else 0
            known[node] = reduce(or_, (known[one] for one in ex.operands(node)), own)
        return known[root]

    def _on_boundary(self, root: Expr, number: int) -> Expr | None:
        """A node with the state of a boundary substituted; None if the boundary is no level, or the
        node no number there.
        """
        guard, known = self._guards[number], self._there[number]
        if guard.state is None or guard.boundary is None:
            return None
        state = ex.state(guard.state)
        for node in ex.walk(root, known=known):
            if any(known[one] is None for one in ex.operands(node)):
                known[node] = None
            elif node is state:
                known[node] = guard.boundary
            else:
                args = tuple(new for one in node.args if (new := known[one]) is not None)
                try:
                    known[node] = ex.rebuild(node, args, node.payload)
                except TraceError:
                    known[node] = None
        return known[root]

    def _is_gap(self, node: Expr, number: int) -> bool:
        """True if a node is the gap of a guard times a factor."""
        gap = self._canonical.polynomial(self._guards[number].gap)
        return is_multiple(self._canonical.polynomial(node), gap)

    def lifted(self, node: Expr) -> Expr:
        """A function of a piece as a piece of functions, if that shows a zero on a boundary."""
        try:
            new = self._spread(node, count(1))
        except _TooManyError:
            return _one_by_one(node)
        if new is node:
            return node
        for number in range(len(self._guards)):
            orders = self.orders([new], number)
            if any(
                below.op == node.op and orders[below.args[0]].order > 0
                for below in ex.walk(new)
                if below.args
            ):
                return new
        return (
            new
            if any(below.op == "const" and below.payload == 0 for below in ex.walk(new))
            else node
        )

    def _spread(self, node: Expr, branches: Iterator[int]) -> Expr:
        """Write a function of a piece as a piece of functions; raises _TooManyError if these are
        many.
        """
        if next(branches) > _MOST_BRANCHES:
            raise _TooManyError
        operand = node.args[0]
        if any(self._is_gap(operand, number) for number in range(len(self._guards))):
            return node
        outer = _outermost_bit(operand)
        if outer is None:
            return node
        both = []
        for value in (True, False):
            inner = assuming(operand, outer, value)
            new = ex.rebuild(node, (inner, *node.args[1:]), node.payload)
            both.append(self._spread(new, branches) if new.op == node.op else new)
        return ex.select(Bit(outer), *both)


def _one_by_one(node: Expr) -> Expr:
    """Split a function of a sum of many pieces, each zero on one side: the cases in which one piece
    acts alone, since only there it may vanish on a boundary, and the case in which none acts.
    """
    operand, acts = node.args[0], dict[Condition, None]()
    for below in ex.walk(operand):
        if (acting := _acting(below)) is not None:
            acts[acting] = None

    def where(condition: Condition | None) -> Expr:
        """The function where one of the pieces acts, or none."""
        new: dict[Expr, Expr] = {}
        for below in ex.walk(operand):
            acting, args = _acting(below), tuple(new[child] for child in below.args)
            if acting is None:
                new[below] = ex.rebuild(below, args, below.payload)
            else:
                new[below] = args[args[0] is _ZERO] if acting is condition else _ZERO
        return ex.rebuild(node, (new[operand], *node.args[1:]), node.payload)

    none = where(None)
    if none.op != "const":
        return node
    lifted = ex.select(reduce(Or, acts), node, none)
    for condition in acts:
        rest = [Not(other) for other in acts if other is not condition]
        lifted = ex.select(reduce(And, rest, condition), where(condition), lifted)
    return lifted


def _acting(node: Expr) -> Condition | None:
    """The condition under which a piece isn't zero, if it is zero elsewhere."""
    if node.op != "select" or all(one is not _ZERO for one in node.args):
        return None
    return node.payload if node.args[1] is _ZERO else Not(node.payload)


class _TooManyError(Exception):
    """A function has more branches than are tried."""


def _outermost_bit(node: Expr) -> int | None:
    """A bit of the first piece on the way down."""
    queue, seen = deque([node]), {node}
    while queue:
        top = queue.popleft()
        if top.op == "select" and top.payload.bits:
            bits: int = top.payload.bits
            return (bits & -bits).bit_length() - 1
        for child in top.args:
            if child.bits and child not in seen:
                seen.add(child)
                queue.append(child)
    return None


def _order_of_power(base: VanishingOrder, exponent: Expr) -> VanishingOrder:
    """Order of ``base**exponent``. An exponent that is a parameter is assumed positive and not
    whole.
    """
    if base.order == math.inf:
        return VanishingOrder(math.inf, False)
    if exponent.op != "const":
        return VanishingOrder(base.order, base.singular or base.order > 0)
    return VanishingOrder(
        base.order * exponent.payload,
        base.singular or (base.order > 0 and not _is_whole(exponent)),
    )


def _order_of_function(op: str, inner: VanishingOrder) -> VanishingOrder:
    if op in ("mod", "table"):  # of time alone
        return VanishingOrder(0.0, False)
    if inner.order == math.inf:
        return VanishingOrder(0.0 if op in ("exp", "cos") else math.inf, False)
    if op == "sqrt":
        return VanishingOrder(0.5 * inner.order, inner.singular or inner.order > 0)
    if op == "log":
        return (
            VanishingOrder(_LOG, True) if inner.order > 0 else VanishingOrder(0.0, inner.singular)
        )
    if inner.singular and inner.order < 0:
        return VanishingOrder(_LOG, True)  # a function of something infinite: its limit is unknown
    return VanishingOrder(0.0 if op in ("exp", "cos") else max(inner.order, 0.0), inner.singular)


def _exponent_of_power(node: Expr, orders: dict[Expr, VanishingOrder]) -> bool:
    """True if the node is ``exp(y*log(u))``, the form of ``u**y`` with an exponent that varies."""
    if node.op != "exp" or node.args[0].op != "mul":
        return False
    factor = node.args[0].args[1]
    return factor.op == "log" and 0 < orders[factor.args[0]].order < math.inf
