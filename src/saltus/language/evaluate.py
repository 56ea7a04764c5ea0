"""Evaluate expressions by NumPy, for tests, checks and pictures. Trajectories are computed by
generated code.
"""

from __future__ import annotations

import operator
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from saltus.language.expression import And, Bit, Condition, Expr, Not, Or, Relation, walk
from saltus.language.operations import ARITHMETIC, FUNCTIONS

_OPERATIONS: dict[str, Any] = {
    name: getattr(np, one.numpy) for name, one in (ARITHMETIC | FUNCTIONS).items() if one.operands
}
_OPERATIONS["mod"] = np.mod
# the same on arrays, and on scalars in a fifth of the time
_OPERATIONS |= {
    "add": operator.add, "sub": operator.sub, "mul": operator.mul, "div": operator.truediv,
    "neg": operator.neg,
}  # fmt: skip


def evaluate(
    expressions: Iterable[Expr],
    *,
    t: Any = 0.0,
    states: Mapping[str, Any] | None = None,
    values: Mapping[str, Any] | None = None,
    bits: Sequence[Any] | Mapping[int, Any] = (),
) -> list[Any]:
    """Values of expressions.

    Parameters
    ----------
    expressions : iterable of Expr
        The expressions; parts that they share are computed once.
    t : float or array
        Time [s].
    states, values : mapping of str to float or array
        States and parameters [SI]. All arrays must broadcast.
    bits : sequence of bool or array of bool, or mapping
        Side of each guard, by its number: True where its gap is positive. Those that aren't used
        may be missing.

    Returns
    -------
    list of float64 scalars or arrays
        One for each expression. Where an operation isn't defined the value is nan or inf, without a
        warning.
    """
    constants, steps, places, wanted = _program(tuple(expressions))
    known = list(constants)
    leaves = {"state": states or {}, "param": values or {}}

    def truth(condition: Condition) -> Any:
        match condition:
            case Bit(guard):
                return bits[guard]
            case Relation(gap):
                return known[places[gap]] > 0
            case Not(inner):
                return np.logical_not(truth(inner))
            case And(left, right):
                return np.logical_and(truth(left), truth(right))
            case Or(left, right):
                return np.logical_or(truth(left), truth(right))
        raise TypeError(condition)

    with np.errstate(all="ignore"):
        for place, op, payload, args in steps:
            if op == "time":
                known[place] = np.asarray(t, dtype=np.float64)[()]
            elif op in leaves:
                known[place] = np.asarray(leaves[op][payload], dtype=np.float64)[()]
            elif op == "select":
                where, otherwise = (known[i] for i in args)
                known[place] = np.where(truth(payload), where, otherwise)[()]
            else:
                known[place] = payload(*[known[i] for i in args])
    return [known[place] for place in wanted]


@lru_cache(maxsize=512)
def _program(
    expressions: tuple[Expr, ...],
) -> tuple[
    list[Any], list[tuple[int, str, Any, tuple[int, ...]]], dict[Expr, int], list[int]
]:  # fmt: skip
    """The program of some expressions: the constants in their places; the other operations, each
    with its place, its payload (a function, if it has operands) and the places of its operands; the
    place of each node's value; and the wanted places.
    """
    places: dict[Expr, int] = {}
    constants: list[Any] = []
    steps: list[tuple[int, str, Any, tuple[int, ...]]] = []
    for node in walk(*expressions):
        place = places[node] = len(places)
        constants.append(np.float64(node.payload) if node.op == "const" else None)
        if node.op != "const":
            payload = _OPERATIONS.get(node.op, node.payload)
            steps.append((place, node.op, payload, tuple(places[child] for child in node.args)))
    return constants, steps, places, [places[one] for one in expressions]
