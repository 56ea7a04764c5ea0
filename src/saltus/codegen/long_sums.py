"""Long sums over states, told from the rest of an equation, so that they can be loops.

An equation of many states is often sums of numbers times states, and a few terms more: a structure
by its modes is one. It is split into

- *sums*: numbers times states, such as the deflection at a contact,
- *parts*: what isn't a sum, such as the force of a contact,
- *rows*: the rate of each state, numbers times states, sums and parts.

docs/decisions/0066.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from saltus.language import expression as ex
from saltus.language.expression import Expr

#: Fewest states of an equation whose sums are loops.
LEAST_STATES = 32
#: Fewest products in sums and rows for each sum and part: with less, loops save nothing.
LEAST_PRODUCTS = 8
#: Fewest states in a sum within a part.
LONG = 8
#: Most uses of a sum that is written out where it is used; with more it is a part.
FEW_USES = 4
#: Most terms that the two sides of a condition don't share, for the others to be taken out of it.
MOST_APART = 8
_ONE = ex.constant(1.0)


@dataclass(frozen=True)
class LongSums:
    """An equation as sums, parts and rows. Each has a number: states come first, then sums, then
    parts.

    Attributes
    ----------
    size : int
        Number of states.
    names : dict of str to int
        Numbers of the sums, and of the states, by the names that they have in the parts.
    sums : list of dict
        The numbers of states, each with its coefficient.
    parts : tuple of Expr
        In states and sums.
    rows : list of dict
        For each state numbers, each with its coefficient in the rate.
    gaps : tuple of Expr
        The gaps, in states and sums.
    """

    size: int
    names: dict[str, int]
    sums: list[dict[int, float]]
    parts: tuple[Expr, ...]
    rows: list[dict[int, float]]
    gaps: tuple[Expr, ...]

    @property
    def first_part(self) -> int:
        """Number of the first part."""
        return self.size + len(self.sums)

    @property
    def count(self) -> int:
        """States, sums and parts together."""
        return self.first_part + len(self.parts)

    def table(self) -> tuple[list[int], list[int], list[float]]:
        """Sums, then rows: where the products of each begin, their numbers, and coefficients."""
        first, place, weight = [0], list[int](), list[float]()
        for products in (*self.sums, *self.rows):
            place += products
            weight += products.values()
            first.append(len(place))
        return first, place, weight


def long_sums(
    field: Sequence[Expr], gaps: Sequence[Expr], states: Sequence[str]
) -> LongSums | None:
    """Split an equation; None if it is small, or if there is little in it but parts."""
    return _Splitter(field, gaps, states).split() if len(states) >= LEAST_STATES else None


class _Splitter:
    """Splits one equation."""

    def __init__(self, field: Sequence[Expr], gaps: Sequence[Expr], states: Sequence[str]) -> None:
        self._field, self._gaps = field, gaps
        self._numbers = {ex.state(name): i for i, name in enumerate(states)}
        self._uses = Counter((*field, *gaps))
        nodes = list(ex.walk(*field, *gaps))
        for node in nodes:
            self._uses.update(ex.operands(node))
        self._terms: dict[Expr, dict[Expr, float]] = {}
        for node in nodes:
            self._terms[node] = self._flatten(node)
        self._names = {name: i for i, name in enumerate(states)}
        self._sums: list[dict[int, float]] = []
        self._known: dict[tuple[tuple[int, float], ...], Expr] = {}
        self._new: dict[Expr, Expr] = {}

    def split(self) -> LongSums | None:
        """The equation split, or None."""
        terms = [self._terms[entry] for entry in self._field]
        leaves = list(dict.fromkeys(leaf for row in terms for leaf in row))
        self._rewrite([leaf for leaf in leaves if leaf not in self._numbers], self._gaps)
        others = [leaf for leaf in leaves if leaf not in self._numbers]
        gaps = tuple(self._new[gap] for gap in self._gaps)
        self._keep(set(ex.walk(*(self._new[leaf] for leaf in others), *gaps)))
        numbers, parts = dict(self._numbers), list[Expr]()
        first = len(self._numbers) + len(self._sums)
        for leaf in others:
            new = self._new[leaf]
            if new.op == "state":
                numbers[leaf] = self._names[new.payload]
            else:
                numbers[leaf] = first + len(parts)
                parts.append(new)
        rows = [_merged(numbers, row) for row in terms]
        products = sum(map(len, self._sums)) + sum(map(len, rows))
        if products < LEAST_PRODUCTS * (len(self._sums) + len(parts)):
            return None
        return LongSums(len(self._numbers), self._names, self._sums, tuple(parts), rows, gaps)

    def _keep(self, nodes: set[Expr]) -> None:
        """Forget the sums that aren't among some nodes, and number the others."""
        size, sums = len(self._numbers), self._sums
        kept = [name for name, i in self._names.items() if i < size or ex.state(name) in nodes]
        self._sums = [sums[self._names[name] - size] for name in kept[size:]]
        self._names = {name: i for i, name in enumerate(kept)}

    def _flatten(self, node: Expr) -> dict[Expr, float]:
        """A node as numbers times other nodes, which are no sums or serve many; those that it is
        made of are known.
        """
        below = [self._below(child) for child in node.args]
        inner, factor = _without_number(node)
        if node.op == "const":
            return {_ONE: node.payload}
        if inner is not node:
            return {leaf: factor * weight for leaf, weight in self._below(inner).items()}
        if node.op in ("add", "sub"):
            left = node.args[0]
            # nobody else asks for the terms of a left side that is used once
            terms = below[0] if self._uses[left] == 1 else dict(below[0])
            for leaf, weight in below[1].items():
                terms[leaf] = terms.get(leaf, 0.0) + (weight if node.op == "add" else -weight)
            return terms
        if node.op == "select":
            return _apart(node, *below)
        return {node: 1.0}

    def _below(self, child: Expr) -> dict[Expr, float]:
        """The terms of an operand; itself if it serves many."""
        serves_many = self._uses[child] > FEW_USES and not _is_state(_without_number(child)[0])
        return {child: 1.0} if serves_many and child.op != "const" else self._terms[child]

    def _rewrite(self, parts: Sequence[Expr], gaps: Sequence[Expr]) -> None:
        """Put a name in place of every long sum over states below the parts and gaps."""
        tops = {*parts, *gaps}
        nodes = list(ex.walk(*parts, *gaps, conditions=False))
        for node in nodes:
            if node.op not in ("add", "sub"):
                tops.update(node.args)
        for node in nodes:
            args = tuple(self._new[child] for child in node.args)
            named = None
            if node.op in ("add", "sub") and (node in tops or self._uses[node] > 1):
                named = self._named(self._terms[node])
            self._new[node] = ex.rebuild(node, args, node.payload) if named is None else named

    def _named(self, terms: Mapping[Expr, float]) -> Expr | None:
        """The name of the states' sum in some terms, and the others added; None if it is short."""
        long = {self._numbers[leaf]: w for leaf, w in terms.items() if leaf in self._numbers}
        if len(long) < LONG:
            return None
        sign = 1.0 if next(iter(sorted(long.items())))[1] > 0 else -1.0
        key = tuple(sorted((i, sign * weight) for i, weight in long.items()))
        if key not in self._known:
            name = f"\0sum {len(self._sums)}"
            self._names[name] = len(self._numbers) + len(self._sums)
            self._sums.append(dict(key))
            self._known[key] = ex.state(name)
        total = self._known[key] if sign > 0 else ex.neg(self._known[key])
        for leaf, weight in terms.items():
            if leaf not in self._numbers:
                other = self._renamed(leaf)
                total = (
                    ex.sub(total, ex.mul(-weight, other))
                    if weight < 0
                    else ex.add(total, ex.mul(weight, other))
                )
        return total

    def _renamed(self, leaf: Expr) -> Expr:
        """A term in states and sums, which :func:`_apart` may have made."""
        if leaf.op == "const":
            return leaf
        if leaf not in self._new:
            args = tuple(map(self._renamed, leaf.args))
            self._new[leaf] = ex.rebuild(leaf, args, leaf.payload)
        return self._new[leaf]


def _is_state(node: Expr) -> bool:
    return node.op == "state"


def _apart(node: Expr, where: dict[Expr, float], otherwise: dict[Expr, float]) -> dict[Expr, float]:
    """The terms of a condition's value: those that both of its sides have, and a condition for each
    other, if these are few.
    """
    both = {**where, **otherwise}
    apart = [leaf for leaf in both if where.get(leaf, 0.0) != otherwise.get(leaf, 0.0)]
    if len(apart) > MOST_APART or len(apart) == len(both):
        return {node: 1.0}
    terms = {leaf: weight for leaf, weight in both.items() if leaf not in set(apart)}
    for leaf in apart:
        if leaf in where:
            terms[ex.select(node.payload, leaf, 0.0)] = where[leaf]
        if leaf in otherwise:
            terms[ex.select(node.payload, 0.0, leaf)] = otherwise[leaf]
    return terms


def _without_number(node: Expr) -> tuple[Expr, float]:
    """The operand of a product with a number, and the number; the node and one for any other."""
    match node.op, node.args:
        case "neg", (inner,):
            return inner, -1.0
        case "mul", (Expr(op="const", payload=number), inner):
            return inner, number
        case "mul", (inner, Expr(op="const", payload=number)):
            return inner, number
        case "div", (inner, Expr(op="const", payload=number)):
            return inner, 1.0 / number
    return node, 1.0


def _merged(numbers: Mapping[Expr, int], terms: Mapping[Expr, float]) -> dict[int, float]:
    """Coefficients by number, in ascending order."""
    found: dict[int, float] = {}
    for leaf, weight in terms.items():
        found[numbers[leaf]] = found.get(numbers[leaf], 0.0) + weight
    return dict(sorted(found.items()))
