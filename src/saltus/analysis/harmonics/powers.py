"""Powers of moving states in expressions: they say how many nodes integrate them."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence

from saltus.language import expression as ex
from saltus.language.evaluate import evaluate
from saltus.language.expression import Expr


def bends(roots: Sequence[Expr], values: Mapping[str, float]) -> int:
    """Number of times that a sine bends the angle so that powers of a depth, and their slopes, are
    smooth in it: once for square roots, and powers like 3/2; twice for others, such as 1/4.
    """
    powers = [node.args[1] for node in ex.walk(*roots) if node.op == "pow"]
    known = [one for one in powers if not ex.depends_on(one, ("state", "time", "select"))]
    halves = len(known) == len(powers) and all(
        float(2 * one) % 1 == 0 for one in evaluate(known, values=values)
    )
    return 1 if halves else 2


def degree(roots: Sequence[Expr], moving: Collection[str], state: int, drive: int) -> float:
    """The highest harmonic in expressions of moving states whose highest is ``state``, ``drive``
    being that of what time alone makes; inf if they are no polynomials of the states.
    """
    known: dict[Expr, float] = {}
    timed: set[Expr] = set()
    for node in ex.walk(*roots, conditions=False):
        below = [known[one] for one in node.args]
        moves = any(known[one] for one in node.args if one not in timed)
        if ex.depends_on(node, ("time",)) and not moves:
            timed.add(node)
            known[node] = drive
            continue
        match node.op:
            case "state":
                known[node] = state if node.payload in moving else 0
            case "add" | "sub" | "neg" | "select":
                known[node] = max(below)
            case "mul":
                known[node] = sum(below)
            case "div":
                known[node] = below[0] if below[1] == 0 else math.inf
            case "pow":
                whole = node.args[1].op == "const" and float(node.args[1].payload) % 1 == 0
                power = float(node.args[1].payload) if whole else math.inf
                known[node] = 0 if not any(below) else below[0] * power if power > 0 else math.inf
            case _:
                known[node] = math.inf if any(below) else 0
    return max((known[root] for root in roots), default=0)
