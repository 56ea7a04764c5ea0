"""Long sums of states, such as the deflection of a sensor by many modes, at many points at once: a
product of matrices.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from saltus.language.expression import Expr, all_substituted, operands, state, walk

#: Fewest states in a sum that becomes a row.
LONG = 16
#: Points of one product: all products have one shape, so a value doesn't depend on how many other
#: points there are.
BLOCK = 64


@lru_cache(maxsize=64)
def split_rows(
    expressions: tuple[Expr, ...], states: tuple[str, ...]
) -> tuple[tuple[Expr, ...], tuple[str, ...], np.ndarray]:
    """Expressions with a new state in place of each long sum of numbers times states; the names of
    these, and the numbers, float64[sums, D].
    """
    rows = _rows(expressions, states)
    used = {below for node in walk(*expressions) if node not in rows for below in operands(node)}
    used |= set(expressions)
    long = [node for node, row in rows.items() if node in used and np.count_nonzero(row) >= LONG]
    names = tuple(f"sum {i}" for i in range(len(long)))
    new = {node: state(name) for node, name in zip(long, names, strict=True)}
    table = np.array([rows[node] for node in long]).reshape(len(long), len(states))
    return all_substituted(expressions, new), names, table


def _rows(expressions: tuple[Expr, ...], states: tuple[str, ...]) -> dict[Expr, np.ndarray]:
    """The factors float64[D] of the nodes that are sums of numbers times states."""
    rows = {state(name): row for name, row in zip(states, np.eye(len(states)), strict=True)}
    for node in walk(*expressions):
        known = [rows.get(one) for one in node.args]
        match node.op, known:
            case "neg", [np.ndarray() as a]:
                rows[node] = -a
            case "add", [np.ndarray() as a, np.ndarray() as b]:
                rows[node] = a + b
            case "sub", [np.ndarray() as a, np.ndarray() as b]:
                rows[node] = a - b
            case "mul", [np.ndarray() as a, None] if node.args[1].op == "const":
                rows[node] = a * node.args[1].payload
            case "mul", [None, np.ndarray() as b] if node.args[0].op == "const":
                rows[node] = b * node.args[0].payload
            case "div", [np.ndarray() as a, None] if node.args[1].op == "const":
                rows[node] = a / node.args[1].payload
    return rows


def products(states: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Sums of numbers float64[sums, D] times states float64[..., D]: float64[sums, ...]."""
    size = states.shape[-1]
    flat = states.reshape(-1, size)
    whole = len(flat) // BLOCK * BLOCK
    last = np.zeros((BLOCK, size))
    last[: len(flat) - whole] = flat[whole:]
    found = np.empty((len(flat), len(rows)))
    with np.errstate(all="ignore"):
        blocks = np.matmul(flat[:whole].reshape(-1, BLOCK, size), rows.T)
        found[:whole] = blocks.reshape(whole, len(rows))
        found[whole:] = (last @ rows.T)[: len(flat) - whole]
    return np.moveaxis(found.reshape(*states.shape[:-1], len(rows)), -1, 0)
