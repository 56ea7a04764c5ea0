"""Sums, products and quotients without terms of zero and factors of one."""

from __future__ import annotations

from collections.abc import Sequence

from saltus.language import expression as ex
from saltus.language.expression import Expr

_ZERO = ex.constant(0.0)


def total(terms: Sequence[Expr]) -> Expr:
    """The sum of terms, without zeros."""
    result = _ZERO
    for term in terms:
        result = ex.add(result, term)
    return result


def dot(a: Sequence[Expr], b: Sequence[Expr]) -> Expr:
    """The sum of products, without zeros."""
    return total(
        [ex.mul(x, y) for x, y in zip(a, b, strict=True) if x is not _ZERO and y is not _ZERO]
    )


def ratio(a: Expr, b: Expr) -> Expr:
    """``a / b``, simplified for a ``b`` of 1 or -1."""
    if b.op == "const" and b.payload in (1.0, -1.0):
        return a if b.payload > 0 else ex.neg(a)
    return ex.div(a, b)
