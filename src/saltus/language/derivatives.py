"""Derivatives of expressions, taken on the graph.

The mode is frozen: the derivative of a ``select`` is the select of the derivatives. What happens at
the boundary itself (the saltation) is the business of whoever crosses it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from saltus.language.expression import (
    TIME,
    Expr,
    add,
    constant,
    depends_on,
    div,
    elementary,
    mul,
    neg,
    power,
    select,
    sub,
    walk,
)
from saltus.language.operations import FUNCTIONS

_ZERO = constant(0.0)


def differentiate(expression: Expr, with_respect_to: Expr) -> Expr:
    """The partial derivative in a frozen mode.

    Parameters
    ----------
    expression : Expr
        Conditions may hold bits or relations.
    with_respect_to : Expr
        A state, a parameter or the time.

    Returns
    -------
    Expr
        Zero terms and factors of one are dropped; nothing else is simplified.

    Raises
    ------
    ValueError
        If ``with_respect_to`` isn't a leaf.
    """
    if with_respect_to.op not in ("state", "param", "time"):
        raise ValueError(
            f"derivatives are taken with respect to a state, a parameter or t, not "
            f"{with_respect_to!r}"
        )
    derivatives: dict[Expr, Expr] = {}
    for node in walk(expression):
        inner = [derivatives[child] for child in node.args]
        if node is with_respect_to:
            derivatives[node] = constant(1.0)
        elif all(d is _ZERO for d in inner):
            derivatives[node] = _ZERO
        else:
            derivatives[node] = _rule(node, inner)
    return derivatives[expression]


def _rule(node: Expr, inner: list[Expr]) -> Expr:
    """The derivative of one operation, from the derivatives of its operands."""
    match node.op, node.args, inner:
        case "add", _, (da, db):
            return add(da, db)
        case "sub", _, (da, db):
            return sub(da, db)
        case "neg", _, (da,):
            return neg(da)
        case "mul", (a, b), (da, db):
            return add(mul(da, b), mul(a, db))
        case "div", (_, b), (da, db):
            return div(sub(da, mul(node, db)), b)
        case "pow", (a, n), (da, dn):
            by_base = mul(mul(n, power(a, sub(n, 1.0))), da)
            return (
                by_base if dn is _ZERO else add(by_base, mul(mul(node, elementary("log", a)), dn))
            )
        case "select", _, (da, db):
            return select(node.payload, da, db)
        case "mod", _, (da, _):
            return da
        case "table", (u,), (du,):
            return mul(Expr("table", (u,), node.payload.derivative()), du)
        case op, (u,), (du,) if slope := FUNCTIONS[op].slope:
            return mul(slope(u, node, elementary), du)
    raise TypeError(node.op)


def gradient(expression: Expr, states: Sequence[str]) -> tuple[Expr, ...]:
    """Derivatives with respect to each state, in a frozen mode."""
    return gradients([expression], states)[0]


def gradients(expressions: Sequence[Expr], states: Sequence[str]) -> tuple[tuple[Expr, ...], ...]:
    """Derivatives of several expressions, one row each, with respect to each state, in a frozen
    mode: those of :func:`differentiate`.

    One pass over all nodes, each with its derivatives that aren't zero. A sum goes on with those of
    its left side where nothing else needs them, so a sum of n terms takes n steps.
    """
    nodes = list(walk(*expressions, conditions=False))
    uses = Counter(expressions)
    for node in nodes:
        uses.update(node.args)
    slopes: dict[Expr, dict[str, Expr]] = {}
    for node in nodes:
        below = [slopes[child] for child in node.args]
        if node.op in ("add", "sub"):
            names, found = below[1], below[0] if uses[node.args[0]] == 1 else dict(below[0])
        else:
            names, found = dict(pair for one in below for pair in one.items()), {}
        if node.op == "state":
            found[node.payload] = constant(1.0)
        for name in names:
            slope = _rule(node, [one.get(name, _ZERO) for one in below])
            if slope is not _ZERO:
                found[name] = slope
            else:
                found.pop(name, None)
        slopes[node] = found
    return tuple(tuple(slopes[one].get(name, _ZERO) for name in states) for one in expressions)


def time_derivative(expression: Expr) -> Expr:
    """The partial derivative with respect to t, in a frozen mode."""
    return differentiate(expression, TIME) if depends_on(expression, ("time",)) else _ZERO
