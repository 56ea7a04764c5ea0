"""Sums, products and quotients without the terms that are zero and the factors that are one."""

from __future__ import annotations

from collections.abc import Sequence

from saltus.language import expression as ex
from saltus.language.expression import Expr

_ZERO = ex.constant(0.0)


def total(terms: Sequence[Expr]) -> Expr:
    """The sum of terms, without those that are zero."""
    result = _ZERO
    for term in terms:
        result = ex.add(result, term)
    return result


def dot(a: Sequence[Expr], b: Sequence[Expr]) -> Expr:
    """Sum of products, without those that are zero."""
    return total(
        [ex.mul(x, y) for x, y in zip(a, b, strict=True) if x is not _ZERO and y is not _ZERO]
    )


def ratio(a: Expr, b: Expr) -> Expr:
    """``a / b``, the sign of a unit taken out."""
    if b.op == "const" and b.payload in (1.0, -1.0):
        return a if b.payload > 0 else ex.neg(a)
    return ex.div(a, b)
