"""RK4 with tiny steps of an equation of motion as its user wrote it.

The text of the equation is read by Python's own parser and becomes a tape of operations on numbered
registers, which one compiled loop runs: no equation is compiled, and nothing is located. A
comparison picks its side at every stage; a jump happens at the end of the step in which its
condition becomes true. The error is of first order where rates jump: two steps tell how large.
"""

from __future__ import annotations

import ast
import math
from dataclasses import dataclass, field

import numpy as np
from numba import njit

(ADD, SUB, MULT, DIV, NEG, SIN, COS, ABS, SQRT, MAX, MIN) = range(11)
(GT, GTE, LT, LTE, AND, OR, NOT, SELECT) = range(11, 19)
_BINARY = {ast.Add: ADD, ast.Sub: SUB, ast.Mult: MULT, ast.Div: DIV, ast.BitAnd: AND, ast.BitOr: OR}
_COMPARED = {ast.Gt: GT, ast.GtE: GTE, ast.Lt: LT, ast.LtE: LTE}
_CALLED = {"sin": SIN, "cos": COS, "abs": ABS, "sqrt": SQRT, "max": MAX, "min": MIN}


@dataclass
class Tape:
    """An equation as operations on registers.

    Attributes
    ----------
    code : list of tuple (operation, a, b, c)
        Operation i writes register ``first + i`` from the registers a, b, c.
    values : list of float
        Registers before the first operation: time, states, numbers.
    rates : list of int
        Registers of the rates.
    jumps : list of tuple (condition, state, new value)
        Registers of conditions and new values, and the state's number.
    """

    code: list[tuple[int, int, int, int]] = field(default_factory=list)
    values: list[float] = field(default_factory=list)
    rates: list[int] = field(default_factory=list)
    jumps: list[tuple[int, int, int]] = field(default_factory=list)


def read(source: str) -> Tape:
    """The tape of the function in a text, whose arguments are the time, states and parameters with
    defaults.
    """
    (function,) = (n for n in ast.parse(source).body if isinstance(n, ast.FunctionDef))
    return _Reader(function).tape


class _Reader:
    def __init__(self, function: ast.FunctionDef):
        arguments = function.args
        given = zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True)
        numbers = {a.arg: float(ast.literal_eval(d)) for a, d in given}
        states = [a.arg for a in arguments.args]
        written = (n.value for n in ast.walk(function) if isinstance(n, ast.Constant))
        constants = sorted(
            {float(v) for v in written if not isinstance(v, str)} | {0.0, *numbers.values()}
        )
        self.place = {name: i for i, name in enumerate(states)}
        base = len(states)
        self.constants = {value: base + i for i, value in enumerate(constants)}
        self.tape = Tape(values=[0.0] * base + list(self.constants))
        self.first = len(self.tape.values)
        self.named = dict(self.place) | {n: self.constants[v] for n, v in numbers.items()}
        for line in function.body:
            if isinstance(line, ast.Assign):
                (target,) = line.targets
                self.named[target.id] = self.at(line.value)
            elif isinstance(line, ast.Return):
                for part in getattr(line.value, "elts", [line.value]):
                    self.returned(part)

    def returned(self, node):
        if not (isinstance(node, ast.Call) and node.func.attr == "jump"):
            self.tape.rates.append(self.at(node))
            return
        condition = self.at(node.args[0])
        for key in node.keywords:
            self.tape.jumps.append((condition, self.place[key.arg] - 1, self.at(key.value)))

    def emit(self, operation, a, b=0, c=0):
        self.tape.code.append((operation, a, b, c))
        return self.first + len(self.tape.code) - 1

    def at(self, node) -> int:
        """Register of an expression."""
        match node:
            case ast.Constant():
                return self.constants[float(node.value)]
            case ast.Name():
                return self.named[node.id]
            case ast.BinOp():
                return self.emit(_BINARY[type(node.op)], self.at(node.left), self.at(node.right))
            case ast.UnaryOp():
                operation = NOT if isinstance(node.op, ast.Invert) else NEG
                return self.emit(operation, self.at(node.operand))
            case ast.Compare():
                (operator,), (right,) = node.ops, node.comparators
                return self.emit(_COMPARED[type(operator)], self.at(node.left), self.at(right))
            case ast.Call():
                return self.called(node)
        raise NotImplementedError(ast.dump(node))

    def called(self, node):
        name = node.func.attr
        if name == "piecewise":
            result = self.at(node.keywords[0].value)
            for row in reversed(node.args):
                value, condition = (self.at(part) for part in row.elts)
                result = self.emit(SELECT, condition, value, result)
            return result
        if name == "friction":
            slip = self.at(node.keywords[0].value)
            ahead = self.emit(GT, self.at(node.args[0]), self.constants[0.0])
            return self.emit(SELECT, ahead, slip, self.emit(NEG, slip))
        if name == "where":
            return self.emit(SELECT, *(self.at(part) for part in node.args))
        return self.emit(_CALLED[name], *(self.at(part) for part in node.args))


def run(tape: Tape, start, t_end: float, steps: int, t_start: float = 0.0) -> np.ndarray:
    """State at the end, by RK4 with equal steps.

    Parameters
    ----------
    tape : Tape
        The equation.
    start : sequence of float (states,)
        State at the start.
    t_end, t_start : float
        Times.
    steps : int
        How many.

    Returns
    -------
    float array (states,)
    """
    state = np.array(start, float)
    jumps = np.array(tape.jumps, np.int64).reshape(-1, 3)
    code = np.array(tape.code, np.int64).reshape(-1, 4)
    registers = np.r_[tape.values, np.zeros(len(code))]
    rates = np.array(tape.rates, np.int64)
    _steps(code, registers, len(tape.values), rates, jumps, state, t_start, t_end, steps)
    return state


@njit(cache=False)
def _evaluate(code, r, first, t, state):  # noqa: C901
    r[0] = t
    for j in range(state.size):
        r[1 + j] = state[j]
    for i in range(code.shape[0]):
        op, x, y = code[i, 0], r[code[i, 1]], r[code[i, 2]]
        if op == ADD:
            x = x + y
        elif op == SUB:
            x = x - y
        elif op == MULT:
            x = x * y
        elif op == SELECT:
            x = y if x != 0.0 else r[code[i, 3]]
        elif op == GT:
            x = 1.0 if x > y else 0.0
        elif op == GTE:
            x = 1.0 if x >= y else 0.0
        elif op == LT:
            x = 1.0 if x < y else 0.0
        elif op == LTE:
            x = 1.0 if x <= y else 0.0
        elif op == AND:
            x = x * y
        elif op == OR:
            x = max(x, y)
        elif op == NOT:
            x = 1.0 - x
        elif op == NEG:
            x = -x
        elif op == DIV:
            x = x / y
        elif op == SIN:
            x = math.sin(x)
        elif op == COS:
            x = math.cos(x)
        elif op == ABS:
            x = abs(x)
        elif op == SQRT:
            x = math.sqrt(x)
        elif op == MAX:
            x = max(x, y)
        elif op == MIN:
            x = min(x, y)
        r[first + i] = x


@njit(cache=False)
def _jumped(jumps, r, true, state, at_start):
    """Let states jump where conditions have become true; says whether any did."""
    any_did = False
    for j in range(jumps.shape[0]):
        now = r[jumps[j, 0]]
        if now and not true[j] and not at_start:
            state[jumps[j, 1]] = r[jumps[j, 2]]
            any_did = True
        true[j] = now
    return any_did


@njit(cache=False)
def _steps(code, r, first, rates, jumps, state, t_start, t_end, steps):
    n, h = state.size, (t_end - t_start) / steps
    k, y = np.zeros((4, n)), state.copy()
    share = (0.0, 0.5, 0.5, 1.0)
    true = np.ones(jumps.shape[0])
    for i in range(steps):
        t = t_start + i * h
        for stage in range(4):
            for j in range(n):
                y[j] = state[j] + (share[stage] * h * k[stage - 1, j] if stage else 0.0)
            _evaluate(code, r, first, t + share[stage] * h, y)
            if stage == 0 and _jumped(jumps, r, true, state, i == 0):
                y[:] = state
                _evaluate(code, r, first, t, y)
            for j in range(n):
                k[stage, j] = r[rates[j]]
        for j in range(n):
            state[j] += h / 6.0 * (k[0, j] + 2.0 * k[1, j] + 2.0 * k[2, j] + k[3, j])
