"""Long sums of states, such as the deflection of a sensor by many modes, at many points at once: a
product of matrices.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from saltus.language.expression import Expr, add, constant, mul, operands, rebuild, state, walk

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
    terms = _terms(expressions)
    leaves = {node for node, parts in terms.items() if node in parts}
    used = {below for leaf in leaves for below in operands(leaf)} | set(expressions)
    number, new = {name: i for i, name in enumerate(states)}, dict[Expr, Expr]()
    rows: dict[bytes, tuple[str, np.ndarray]] = {}
    for node, parts in terms.items():
        row = np.zeros(len(states))
        for leaf, factor in parts.items() if node in used else ():
            if leaf.op == "state":
                row[number[leaf.payload]] = factor
        if np.count_nonzero(row) < LONG:
            new[node] = rebuild(node, tuple(new[one] for one in node.args), node.payload)
            continue
        name, _ = rows.setdefault(row.tobytes(), (f"sum {len(rows)}", row))
        new[node] = state(name)
        for leaf, factor in parts.items():
            if leaf.op != "state":
                new[node] = add(new[node], mul(constant(factor), new[leaf]))
    names, table = tuple(name for name, _ in rows.values()), [row for _, row in rows.values()]
    return tuple(new[one] for one in expressions), names, np.reshape(table, (-1, len(states)))


def _terms(expressions: tuple[Expr, ...]) -> dict[Expr, dict[Expr, float]]:
    """Every node as numbers times others that are no sums, operands before what is made of them."""
    terms: dict[Expr, dict[Expr, float]] = {}
    for node in walk(*expressions):
        args, factor = node.args, None
        if node.op == "neg":
            factor, summed = -1.0, args[0]
        elif node.op == "mul" and args[1].op == "const":
            factor, summed = args[1].payload, args[0]
        elif node.op == "div" and args[1].op == "const" and args[1].payload != 0.0:
            factor, summed = 1.0 / args[1].payload, args[0]
        elif node.op == "mul" and args[0].op == "const":
            factor, summed = args[0].payload, args[1]
        if factor is not None:
            terms[node] = {leaf: factor * one for leaf, one in terms[summed].items()}
        elif node.op in ("add", "sub"):
            total, sign = dict(terms[args[0]]), 1.0 if node.op == "add" else -1.0
            for leaf, one in terms[args[1]].items():
                total[leaf] = total.get(leaf, 0.0) + sign * one
            terms[node] = total
        else:
            terms[node] = {node: 1.0}
    return terms


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
