"""Comparisons of roots, ``hypot(x, y) > gap``: boundaries with a Taylor series where the root is
zero.

The root of u has no series at u = 0, the state in which a rotor is at rest. Since ``z -> z*|z|``
rises everywhere, ``c*sqrt(u) > d`` and ``c*|c|*u > d*|d|`` are the same comparison, whatever the
signs of c and d are; the second has a series wherever u has one.
"""

from __future__ import annotations

from collections.abc import Callable

from saltus.system import expression as ex
from saltus.system.expression import Expr

#: Added to the square of a length of zero, which divides; nothing is added to any other.
_LEAST = 2.0**-200


def without_root(gap: Expr) -> Expr:
    """A gap that compares a root with numbers and parameters, or with another root, as one without
    roots: positive, zero and negative where the gap is.

    With numbers and parameters d it is ``(u - d*|d|)/(2*|d|)``, which differs from ``sqrt(u) - d``
    in the second order of the distance only: margins and speeds of contact stay what they were.
    Any other gap is returned as it is: d may change its sign while a motion goes on.
    """
    if (inner := _within_factor(gap, without_root)) is not None:
        return inner
    roots, level = _split(gap)
    zero = level.op == "const" and level.payload == 0
    if len(roots) == 2 and zero:
        (c, u), (b, w) = roots
        return ex.sub(_squared(c, u), _squared(ex.neg(b), w))
    if len(roots) != 1 or zero or ex.varies(level):
        return gap
    ((c, u),) = roots
    if c.op == "const" and c.payload < 0:
        return ex.neg(_regular(ex.neg(c), u, ex.neg(level)))
    return _regular(c, u, level)


def with_root(gap: Expr) -> Expr:
    """The gap of which :func:`without_root` made this one, ``sqrt(u) - d``; any other as it is."""
    if (inner := _within_factor(gap, with_root)) is not None:
        return inner
    match gap.op, gap.args:
        case "sub", (Expr(op="div", args=(above, _)), Expr(op="mul", args=(level, _)) as half):
            pass
        case "sub", (Expr(op="div", args=(above, _)), Expr(op="const") as half):
            level = ex.mul(half, 2.0)
        case _:
            return gap
    c: Expr = ex.constant(1.0)
    if above.op == "mul" and _is_square(above.args[0]):
        c, above = above.args[0].args[0], above.args[1]
    if _regular(c, above, level) is not gap:
        return gap
    return ex.sub(ex.mul(c, ex.elementary("sqrt", above)), level)


def _within_factor(gap: Expr, change: Callable[[Expr], Expr]) -> Expr | None:
    """A sign or factor that doesn't vary, and what it multiplies changed; None if there is none."""
    match gap.op, gap.args:
        case "neg", (inner,):
            return ex.neg(change(inner))
        case "mul", (factor, inner) if not ex.varies(factor):
            return ex.rebuild(gap, (factor, change(inner)), None)
        case "mul" | "div", (inner, factor) if not ex.varies(factor):
            return ex.rebuild(gap, (change(inner), factor), None)
    return None


def _regular(c: Expr, u: Expr, level: Expr) -> Expr:
    """``(c*|c|*u - level*|level|)/(2*|level|)``."""
    scale = ex.mul(2.0, ex.elementary("sqrt", ex.add(ex.mul(level, level), _LEAST)))
    return ex.sub(ex.div(_squared(c, u), scale), ex.mul(level, 0.5))


def _squared(c: Expr, u: Expr) -> Expr:
    """``c*|c|*u``."""
    return ex.mul(ex.mul(c, ex.absolute(c)), u)


def _is_square(node: Expr) -> bool:
    """Whether a node is ``c*|c|``."""
    return node.op == "mul" and node.args[1] is ex.absolute(node.args[0])


def _split(gap: Expr) -> tuple[list[tuple[Expr, Expr]], Expr]:
    """The terms ``c*sqrt(u)`` of a sum, as pairs (c, u), and minus the sum of all others."""
    roots: list[tuple[Expr, Expr]] = []
    level: Expr = ex.constant(0.0)
    stack = [(gap, 1.0)]
    while stack:
        node, sign = stack.pop()
        if node.op in ("add", "sub"):
            left, right = node.args
            stack += [(right, sign if node.op == "add" else -sign), (left, sign)]
        elif node.op == "neg":
            stack.append((node.args[0], -sign))
        elif found := _root(node):
            roots.append((ex.mul(found[0], sign), found[1]))
        else:
            level = ex.sub(level, node) if sign > 0 else ex.add(level, node)
    return roots, level


def _root(node: Expr) -> tuple[Expr, Expr] | None:
    """c and u of ``c*sqrt(u)``, u varying and c not; None of anything else."""
    match node.op, node.args:
        case "sqrt", (u,) if ex.varies(u):
            return ex.constant(1.0), u
        case "neg", (inner,) if found := _root(inner):
            return ex.neg(found[0]), found[1]
        case "mul", (a, b):
            for factor, inner in ((a, b), (b, a)):
                if not ex.varies(factor) and (found := _root(inner)):
                    return ex.mul(factor, found[0]), found[1]
        case "div", (inner, factor) if not ex.varies(factor) and (found := _root(inner)):
            return ex.div(found[0], factor), found[1]
    return None
