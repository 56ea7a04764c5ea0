"""Substitute a known bit into expressions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from saltus.language import expression as ex
from saltus.language.expression import And, Bit, Condition, Expr, Not, Or, Relation


def assuming(root: Expr, bit: int, value: bool) -> Expr:
    """Substitute one bit. Branches it rules out are dropped unevaluated: they may divide by zero. A
    quotient by something that the bit makes zero is zero: it is the force of a contact that can't
    be held then, and is released.
    """
    return all_assuming((root,), (bit,), value)[0]


def all_assuming(roots: Sequence[Expr], bits: Iterable[int], value: bool) -> tuple[Expr, ...]:
    """Substitute bits of one value in several expressions; what they share is substituted once."""
    known = sum(1 << bit for bit in set(bits))
    memo: dict[Expr, Expr] = {}
    stack = [*roots]
    while stack:
        node = stack[-1]
        if node in memo or not node.bits & known:
            memo.setdefault(node, node)
            stack.pop()
            continue
        condition = _knowing(node.payload, known, value) if node.op == "select" else None
        decided = isinstance(condition, bool)
        args = (node.args[not condition],) if decided else node.args
        if missing := [child for child in args if child not in memo]:
            stack += missing
            continue
        stack.pop()
        new = tuple(memo[child] for child in args)
        if decided:
            memo[node] = new[0]
        elif node.op == "div" and new[1].op == "const" and new[1].payload == 0:
            memo[node] = ex.constant(0.0)
        else:
            memo[node] = ex.rebuild(node, new, node.payload if condition is None else condition)
    return tuple(memo[root] for root in roots)


def _knowing(condition: Condition, known: int, value: bool) -> Condition | bool:
    if not condition.bits & known:
        return condition
    match condition:
        case Bit():
            return value
        case Relation():  # a switch of time
            return condition
        case Not(inner):
            inside = _knowing(inner, known, value)
            return (
                not inside
                if isinstance(inside, bool)
                else (condition if inside is inner else Not(inside))
            )
        case And(left, right) | Or(left, right):
            neutral = isinstance(condition, And)
            a, b = _knowing(left, known, value), _knowing(right, known, value)
            if isinstance(a, bool):
                return b if a is neutral else a
            if isinstance(b, bool):
                return a if b is neutral else b
            return condition if a is left and b is right else type(condition)(a, b)
    raise TypeError(condition)
