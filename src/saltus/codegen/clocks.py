"""The clocks of a system in generated code: the tables of kernels/clocks.py, and the code that
reads their state.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import numpy as np

from saltus.codegen.head import Constant
from saltus.codegen.scalar import ScalarCode, indented, parameter_leaf
from saltus.kernels.clocks_layout import (
    C0,
    CYCLE,
    HELD,
    LEVEL,
    NUMBERS,
    ON,
    PULSE,
    REF,
    TABLE,
    WAVE,
)
from saltus.language import Table
from saltus.language import expression as ex
from saltus.language.clocks import Level, Pulse, Wave, affine, switch_of
from saltus.language.derivatives import differentiate
from saltus.language.expression import Expr, Relation
from saltus.system import System

_TURN = ex.constant(2 * math.pi)


class Clocks:
    """Numbers the switches, remainders and tables of a system, in the order in which its equations
    name them.
    """

    def __init__(self, system: System) -> None:
        gaps = [guard.gap for guard in system.guards]
        self._system = system
        self._kinds: list[int] = []
        self._numbers: list[tuple[Expr, ...]] = []
        self.tables: list[Table] = []
        self._table_of: list[int] = []
        self._index: dict[Expr, int] = {}
        for node in _values([*system.field, *gaps, *(differentiate(gap, ex.TIME) for gap in gaps)]):
            if node.op == "select":
                for relation in ex.relations_in(node.payload):
                    self._add(relation.gap, *_switch_numbers(relation.gap))
            elif node.op == "mod":
                self._add(node, CYCLE, _cycle_numbers(node))
            elif node.op == "table":
                self._add(node, TABLE, _line(node), node.payload)

    def __len__(self) -> int:
        return len(self._kinds)

    def _add(
        self, key: Expr, kind: int, numbers: tuple[Expr, ...], table: Table | None = None
    ) -> None:
        if key in self._index:
            return
        self._index[key] = len(self._kinds)
        self._kinds.append(kind)
        self._numbers.append(numbers)
        if table is not None and table not in self.tables:
            self.tables.append(table)
        self._table_of.append(-1 if table is None else self.tables.index(table))

    # -- what a clock holds ------------------------------------------------------------------------
    def row_of_side(self, relation: Relation) -> int:
        """Row of the side of a switch, +1 or -1."""
        return HELD * self._index[relation.gap] + ON

    def row_of_reference(self, node: Expr) -> int:
        """Row of the phase that the polynomial of a remainder or table counts from."""
        return HELD * self._index[node] + REF

    def rows_of_coefficients(self, node: Expr) -> list[int]:
        """Rows of the coefficients of that polynomial, constant first."""
        first = HELD * self._index[node] + C0
        return [first + i for i in range(1 + (node.payload.degree if node.op == "table" else 1))]

    # -- scalar code -------------------------------------------------------------------------------
    def side(self, relation: Relation) -> str:
        """Code that is true where a switch is on."""
        return f"(h[{self.row_of_side(relation)}] > 0.0)"

    def value(self, node: Expr) -> str | None:
        """Code for a remainder or a table at ``t``; None for any other node."""
        if node.op not in ("mod", "table"):
            return None
        *rest, last = (f"h[{row}]" for row in self.rows_of_coefficients(node))
        code = last
        for coefficient in reversed(rest):
            code = f"({coefficient} + (t - h[{self.row_of_reference(node)}]) * {code})"
        return code

    # -- for the head ------------------------------------------------------------------------------
    def constants(self) -> dict[str, Constant]:
        """Number and kinds of clocks."""
        return {
            "NCLOCKS": len(self),
            "CLOCK_KIND": tuple(self._kinds) or (0,),
            "CLOCK_TABLE": tuple(self._table_of) or (0,),
        }

    def function(self) -> str:
        """Code of ``numbers_of_clocks(p, n)``: the numbers that depend on parameters only."""
        code = ScalarCode(parameter_leaf(self._system))
        for j, numbers in enumerate(self._numbers):
            for i, value in enumerate(code.values(numbers)):
                code.lines.append(f"n[{NUMBERS * j + i}] = {value}")
        return f"@kernel\ndef numbers_of_clocks(p, n):\n{indented(code.lines)}\n"


def _values(roots: Iterable[Expr]) -> Iterator[Expr]:
    """Every node that has a value in the code; conditions have none."""
    return ex.walk(*roots, conditions=False)


def _switch_numbers(gap: Expr) -> tuple[int, tuple[Expr, ...]]:
    match switch_of(gap):
        case Level(rate, offset):
            return LEVEL, (rate, offset)
        case Wave(rate, offset, factor, shift):
            return WAVE, (ex.div(rate, _TURN), ex.div(offset, _TURN), factor, shift)
        case Pulse(rate, offset, cycle, factor, shift):
            return PULSE, (ex.div(rate, cycle), ex.div(offset, cycle), ex.mul(factor, cycle), shift)
    raise TypeError(gap)


def _line(node: Expr) -> tuple[Expr, Expr]:
    """Rate and offset of the argument of a remainder or table."""
    line = affine(node.args[0])
    assert line is not None, "a system holds remainders and tables of rate*t + offset only"
    return line


def _cycle_numbers(node: Expr) -> tuple[Expr, ...]:
    (rate, offset), cycle = _line(node), node.args[1]
    return ex.div(rate, cycle), ex.div(offset, cycle), rate, cycle


def table_data(system: System) -> np.ndarray:
    """The tables of a system as one array, as kernels/clocks.py reads it. float64[n],
    at least one.
    """
    tables = Clocks(system).tables if _has_tables(system) else []
    parts = [
        np.array([float(len(t.points)), float(t.periodic), *t.points, *t.pieces.ravel()])
        for t in tables
    ]
    begins = len(tables) + np.cumsum([0, *map(len, parts)])[: len(tables)]
    return np.concatenate([begins.astype(float), *parts, np.zeros(1)])


def _has_tables(system: System) -> bool:
    return any(
        node.op == "table"
        for node in ex.walk(*system.field, *(guard.gap for guard in system.guards))
    )
