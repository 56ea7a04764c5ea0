"""A normal form of expressions, used only to find out whether two of them are the same boundary.

An expression is expanded to a sum of monomials over atoms (states, parameters, functions of normal
forms), with rational coefficients. Nothing that is computed with a normal form reaches a
trajectory.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from saltus.language.expression import Expr, constant, mul, parameter, power, walk
from saltus.language.roots import with_root

#: A monomial: numbers of atoms with their exponents.
Monomial = frozenset[tuple[int, int]]
#: A sum of monomials with non-zero coefficients.
Polynomial = dict[Monomial, Fraction]

ONE: Monomial = frozenset()
_MOST_TERMS = 200  # beyond this an expanded product stays one atom
_MOST_POWER = 12
# ratios of coefficients that differ by less are equal: 0.1*x > g/10 is x > g
_SAME = Fraction(1, 10**14)


class Canonical:
    """Normal forms of expressions whose conditions hold bits."""

    def __init__(self) -> None:
        self._memo: dict[Expr, Polynomial] = {}
        self._atoms: dict[tuple[Any, ...], int] = {}
        self._kinds: list[frozenset[str]] = []

    def polynomial(self, root: Expr) -> Polynomial:
        """The normal form of ``root``."""
        if root in self._memo:
            return self._memo[root]
        for node in walk(root, known=self._memo):
            self._memo[node] = self._normal(node)
        return self._memo[root]

    def kinds(self, polynomial: Polynomial) -> frozenset[str]:
        """Kinds of leaves that the value depends on: ``state``, ``time``, ``param``, ``select``. A
        condition counts as ``select`` only.
        """
        return frozenset().union(
            *(self._kinds[atom] for monomial in polynomial for atom, _ in monomial)
        )

    def level_of(self, root: Expr) -> tuple[str | None, float]:
        """``(state, c)`` if the value is ``c*state`` and something that depends on parameters only;
        else ``(None, 0.0)``.
        """
        polynomial = self.polynomial(root)
        moving = [
            monomial
            for monomial in polynomial
            if self.kinds({monomial: polynomial[monomial]}) - {"param"}
        ]
        if len(moving) == 1:
            for key, number in self._atoms.items():
                if key[0] == "state" and moving[0] == frozenset([(number, 1)]):
                    return key[1], float(polynomial[moving[0]])
        return None, 0.0

    def share(self, a: Expr, b: Expr) -> Expr | None:
        """c in ``a = c b``, a number times powers of parameters; None if there is none."""
        first, second = self.polynomial(a), self.polynomial(b)
        factor = common_factor(first, second)
        if factor is None:
            return None
        names = {number: key for key, number in self._atoms.items()}
        whole = {_merged(monomial, factor): value for monomial, value in second.items()}
        if proportion(first, whole) == 0:
            return None
        monomial = next(iter(first))
        found = constant(float(first[monomial] / whole[monomial]))
        for atom, exponent in sorted(factor):
            kind, name = names[atom][:2]
            if kind != "param":
                return None
            found = mul(found, power(parameter(name), float(exponent)))
        return found

    # -- one node ----------------------------------------------------------------------------------
    def _normal(self, node: Expr) -> Polynomial:
        if (rooted := with_root(node)) is not node:
            return self.polynomial(rooted)
        parts = [self._memo[child] for child in node.args]
        match node.op:
            case "const":
                return {ONE: Fraction(node.payload)} if node.payload else {}
            case "param" | "state" | "time":
                return self._atom((node.op, node.payload), frozenset([node.op]))
            case "add":
                return _sum(*parts)
            case "sub":
                return _sum(parts[0], _scaled(parts[1], -1))
            case "neg":
                return _scaled(parts[0], -1)
            case "mul":
                return self._product(*parts)
            case "div":
                return self._product(parts[0], self._inverse(parts[1]))
            case "pow":
                return self._power(node, *parts)
        extra = frozenset(["select"]) if node.op == "select" else frozenset()
        return self._function((node.op, node.payload), parts, extra)

    def _atom(self, key: tuple[Any, ...], kinds: frozenset[str]) -> Polynomial:
        number = self._atoms.setdefault(key, len(self._atoms))
        if number == len(self._kinds):
            self._kinds.append(kinds)
        return {frozenset([(number, 1)]): Fraction(1)}

    def _function(
        self, name: tuple[Any, ...], parts: list[Polynomial], extra: frozenset[str] = frozenset()
    ) -> Polynomial:
        """An atom that is a function of normal forms."""
        key = (name, *(frozenset(part.items()) for part in parts))
        return self._atom(key, extra.union(*(self.kinds(part) for part in parts)))

    def _product(self, a: Polynomial, b: Polynomial) -> Polynomial:
        if len(a) * len(b) > _MOST_TERMS:
            return self._function(("mul", None), [a, b])
        total: Polynomial = {}
        for left, p in a.items():
            for right, q in b.items():
                _add(total, _merged(left, right), p * q)
        return total

    def _inverse(self, a: Polynomial) -> Polynomial:
        if len(a) == 1:
            ((monomial, coefficient),) = a.items()
            return {frozenset((atom, -exponent) for atom, exponent in monomial): 1 / coefficient}
        return self._function(("inverse", None), [a])

    def _power(self, node: Expr, base: Polynomial, exponent: Polynomial) -> Polynomial:
        constant = node.args[1].payload if node.args[1].op == "const" else None
        if constant is None or constant != int(constant) or abs(constant) > _MOST_POWER:
            return self._function(("pow", None), [base, exponent])
        result: Polynomial = {ONE: Fraction(1)}
        for _ in range(abs(int(constant))):
            result = self._product(result, base)
        return result if constant > 0 else self._inverse(result)


def _sum(a: Polynomial, b: Polynomial) -> Polynomial:
    total = dict(a)
    for monomial, coefficient in b.items():
        _add(total, monomial, coefficient)
    return total


def _add(total: Polynomial, monomial: Monomial, coefficient: Fraction) -> None:
    """Add one term to a sum, in place."""
    value = total.pop(monomial, Fraction(0)) + coefficient
    if value:
        total[monomial] = value


def _scaled(a: Polynomial, factor: int) -> Polynomial:
    return {monomial: factor * coefficient for monomial, coefficient in a.items()}


def _merged(a: Monomial, b: Monomial) -> Monomial:
    exponents = dict(a)
    for atom, exponent in b:
        exponents[atom] = exponents.get(atom, 0) + exponent
    return frozenset((atom, exponent) for atom, exponent in exponents.items() if exponent)


def proportion(a: Polynomial, b: Polynomial) -> int:
    """The sign of the number c with ``a = c b``; 0 if there is none."""
    if a.keys() != b.keys() or not a:
        return 0
    ratios = (a[monomial] / b[monomial] for monomial in a)
    first = next(ratios)
    if any(abs(ratio - first) > _SAME * abs(first) for ratio in ratios):
        return 0
    return 1 if first > 0 else -1


def common_factor(a: Polynomial, b: Polynomial) -> Monomial | None:
    """The monomial m if there is a number c with ``a = c m b``; None if there can't be one."""
    if len(a) != len(b) or not a:
        return None
    apart: dict[int, int] = {}  # exponents in all of a, less those in all of b: len(a) times m
    for polynomial, sign in ((a, 1), (b, -1)):
        for monomial in polynomial:
            for atom, exponent in monomial:
                apart[atom] = apart.get(atom, 0) + sign * exponent
    if any(exponent % len(a) for exponent in apart.values()):
        return None
    return frozenset((atom, total // len(a)) for atom, total in apart.items() if total)


def is_multiple(a: Polynomial, b: Polynomial) -> bool:
    """True if ``a = m b`` with a monomial m: a gap times, or over, quantities that it doesn't
    hold.
    """
    factor = common_factor(a, b)
    if factor is None:
        return False
    atoms = {atom for monomial in b for atom, _ in monomial}
    if not all(exponent > 0 or atom not in atoms for atom, exponent in factor):
        return False
    multiple = {_merged(monomial, factor): coefficient for monomial, coefficient in b.items()}
    return proportion(a, multiple) != 0
