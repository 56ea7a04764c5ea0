"""Substitute a known bit into expressions."""

from __future__ import annotations

from saltus.language import expression as ex
from saltus.language.expression import And, Bit, Condition, Expr, Not, Or, Relation


def assuming(root: Expr, bit: int, value: bool) -> Expr:
    """Substitute one bit. Branches it rules out are dropped unevaluated: they may divide by zero. A
    quotient by something that the bit makes zero is zero: it is the force of a contact that can't
    be held then, and is released.
    """
    memo: dict[Expr, Expr] = {}
    stack = [root]
    while stack:
        node = stack[-1]
        if not node.bits >> bit & 1:
            memo[node] = node
            stack.pop()
            continue
        condition = _knowing(node.payload, bit, value) if node.op == "select" else None
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
    return memo[root]


def _knowing(condition: Condition, bit: int, value: bool) -> Condition | bool:
    if not condition.bits >> bit & 1:
        return condition
    match condition:
        case Bit(number):
            return value if number == bit else condition
        case Relation():  # a switch of time
            return condition
        case Not(inner):
            inside = _knowing(inner, bit, value)
            return (
                not inside
                if isinstance(inside, bool)
                else (condition if inside is inner else Not(inside))
            )
        case And(left, right) | Or(left, right):
            neutral = isinstance(condition, And)
            a, b = _knowing(left, bit, value), _knowing(right, bit, value)
            if isinstance(a, bool):
                return b if a is neutral else a
            if isinstance(b, bool):
                return a if b is neutral else b
            return condition if a is left and b is right else type(condition)(a, b)
    raise TypeError(condition)
