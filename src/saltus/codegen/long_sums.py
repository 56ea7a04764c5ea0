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
        self._uses = Counter(field)
        for node in ex.walk(*field, *gaps):
            self._uses.update(ex.operands(node))
        self._names = {name: i for i, name in enumerate(states)}
        self._sums: list[dict[int, float]] = []
        self._known: dict[tuple[tuple[int, float], ...], Expr] = {}
        self._new: dict[Expr, Expr] = {}

    def split(self) -> LongSums | None:
        """The equation split, or None."""
        terms = [self._terms(entry) for entry in self._field]
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

    def _terms(self, root: Expr) -> dict[Expr, float]:
        """A node as numbers times other nodes, which are no sums or serve several."""
        terms: dict[Expr, float] = {}
        stack = [(root, 1.0)]
        while stack:
            node, weight = stack.pop()
            inner, factor = _without_number(node)
            if node.op == "const":
                terms[_ONE] = terms.get(_ONE, 0.0) + weight * node.payload
            elif inner is not node and (self._is_inside(node, root) or inner.op == "state"):
                stack.append((inner, weight * factor))
            elif node.op in ("add", "sub") and self._is_inside(node, root):
                left, right = node.args
                stack += [(right, weight if node.op == "add" else -weight), (left, weight)]
            else:
                terms[node] = terms.get(node, 0.0) + weight
        return terms

    def _is_inside(self, node: Expr, root: Expr) -> bool:
        return node is root or self._uses[node] == 1

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
                named = self._named(self._terms(node))
            self._new[node] = ex.rebuild(node, args, node.payload) if named is None else named

    def _named(self, terms: Mapping[Expr, float]) -> Expr | None:
        """The name of the states' sum in some terms, and the others added; None if it is short."""
        long = {self._numbers[leaf]: w for leaf, w in terms.items() if leaf in self._numbers}
        if len(long) < LONG:
            return None
        key = tuple(sorted(long.items()))
        if key not in self._known:
            name = f"\0sum {len(self._sums)}"
            self._names[name] = len(self._numbers) + len(self._sums)
            self._sums.append(dict(key))
            self._known[key] = ex.state(name)
        total = self._known[key]
        for leaf, weight in terms.items():
            if leaf not in self._numbers:
                other = leaf if leaf is _ONE else self._new[leaf]
                total = (
                    ex.sub(total, ex.mul(-weight, other))
                    if weight < 0
                    else ex.add(total, ex.mul(weight, other))
                )
        return total


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
