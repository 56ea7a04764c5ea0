"""Comparisons of roots, ``hypot(x, y) > gap``: boundaries with a Taylor series where the root is
zero.

The root of u has no series at u = 0, the state in which a rotor is at rest. Since ``z -> z*|z|``
rises everywhere, ``c*sqrt(u) > d`` and ``c*|c|*u > d*|d|`` are the same comparison, whatever the
signs of c and d are; the second has a series wherever u has one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from saltus.language import expression as ex
from saltus.language.expression import Expr

#: Added to the square of a length of zero, by which is divided; nothing is added to any other.
_LEAST = 2.0**-200


def without_root(gap: Expr) -> Expr:
    """Replace a gap that compares a root with numbers and parameters, or with another root, by one
    of the same sign without roots.

    With numbers and parameters d it is ``(u - d*|d|)/(2*|d|)``, which differs from ``sqrt(u) - d``
    in the second order of the distance only: margins and speeds of contact stay what they were.
    ``1 - d/sqrt(u)`` and ``(sqrt(u) - d)/sqrt(u)`` have the sign of ``sqrt(u) - d``.
    Any other gap is returned as it is: d may change its sign while a motion goes on.
    """
    if (inner := _within_factor(gap, without_root)) is not None:
        return inner
    match gap.op, gap.args:  # a root is positive
        case "div", (inner, Expr(op="sqrt")):
            return without_root(inner)
        case "sub", (c, Expr(op="div", args=(d, Expr(op="sqrt") as root))) if not ex.varies(c):
            return without_root(ex.sub(ex.mul(c, root), d))
    roots, level = _split(gap)
    zero = level.op == "const" and level.payload == 0
    if len(roots) == 2 and zero:
        (c, u), (b, w) = roots
        return ex.sub(_squared(c, u), _squared(ex.neg(b), w))
    if len(roots) != 1 or zero or ex.varies(level):
        return gap
    ((c, u),) = roots
    if c.op != "const":
        return _regular(c, u, level)
    one, size, positive = ex.constant(1.0), abs(c.payload), c.payload > 0
    if not positive:
        _, level = _split(gap, -1.0)
    regular = ex.mul(size, _regular(one, u, ex.div(level, size)))
    return regular if positive else ex.neg(regular)


def with_root(gap: Expr) -> Expr:
    """The original ``sqrt(u) - d`` of a gap made by :func:`without_root`; any other gap
    unchanged.
    """
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


def root_name(root: Expr) -> str:
    """A root as people write it, such as ``hypot(x, y)``."""
    match root.args[0]:
        case Expr(op="add", args=(Expr(op="mul", args=(a, b)), Expr(op="mul", args=(c, d)))) if (
            a is b and c is d
        ):
            return f"hypot({a!r}, {c!r})"
    return repr(root)


def _within_factor(gap: Expr, change: Callable[[Expr], Expr]) -> Expr | None:
    """A constant sign or factor, and the changed operand that it multiplies; None if there is
    none.
    """
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
    """True if a node is ``c*|c|``."""
    return node.op == "mul" and node.args[1] is ex.absolute(node.args[0])


def _split(gap: Expr, sign: float = 1.0) -> tuple[list[tuple[Expr, Expr]], Expr]:
    """The terms ``c*sqrt(u)`` of a sum, or of its negative, as pairs (c, u), and minus all
    others.
    """
    roots: list[tuple[Expr, Expr]] = []
    level: Expr = ex.constant(0.0)
    stack = [(gap, sign)]
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
    """c and u of ``c*sqrt(u)`` with varying u and constant c; None for anything else."""
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


def zero_where_idle(field: Iterable[Expr]) -> tuple[Expr, ...]:
    """The same field with each product that divides by a root, and has a factor that is a piece
    with a zero side, as a piece of products. ``sl.max(r - gap, 0)*x/r`` is zero within the gap, at
    r = 0 too.
    """
    memo: dict[Expr, Expr] = {}
    rooted, divided = set[Expr](), set[Expr]()  # nodes that hold roots, and quotients by such
    roots = tuple(field)
    for node in ex.walk(*roots):
        if not rooted.isdisjoint(node.args) or (node.op == "sqrt" and ex.varies(node)):
            rooted.add(node)
        if not divided.isdisjoint(node.args) or (node.op == "div" and node.args[1] in rooted):
            divided.add(node)
        new = ex.rebuild(node, tuple(memo[child] for child in node.args), node.payload)
        memo[node] = _spread(new) if node in divided and new.op in ("mul", "div") else new
    return tuple(memo[root] for root in roots)


def _spread(product: Expr) -> Expr:
    """A product as a piece of products, if one of its factors is a piece with a zero side."""
    piece = _idle_factor(product)
    if piece is None:
        return product
    branches = (_spread(ex.substituted(product, {piece: branch})) for branch in piece.args)
    return ex.select(piece.payload, *branches)


def _idle_factor(product: Expr) -> Expr | None:
    """A factor of a product that is a piece with a zero side."""
    stack = [product]
    while stack:
        node = stack.pop()
        if node.op in ("mul", "div", "neg"):
            stack += node.args if node.op == "mul" else node.args[:1]
        elif node.op == "select" and _is_zero_somewhere(node):
            return node
    return None


def _is_zero_somewhere(node: Expr) -> bool:
    if node.op == "select":
        return any(map(_is_zero_somewhere, node.args))
    return node.op == "const" and node.payload == 0
