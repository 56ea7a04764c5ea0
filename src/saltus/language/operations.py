"""The operations and functions of equations, a row each: whoever folds, writes, differentiates,
evaluates or reads an expression looks here.

Codegen keeps its own rules, which are recurrences of series.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

#: Strengths with which a text holds together: one weaker than asked for is bracketed.
ATOM, POWER, NEGATIVE, PRODUCT, SUM = 5, 4, 3, 2, 1


@dataclass(frozen=True, kw_only=True)
class Operation:
    """One operation or function.

    Attributes
    ----------
    operands : int
        Of its node in a graph; 0 of a function that is made of others and has no node.
    numpy : str
        NumPy's function of the same meaning; "" if it has none.
    python : callable, optional
        Python's operator; None of functions.
    sign, strength : str, int
        What stands between two operands, and how strongly it binds.
    latex : str
        Name in LaTeX, where that isn't its own.
    what : str
        What it is, of functions that have a node.
    slope : callable, optional
        Derivative of a function that has a node, from its operand u, its value y and a function
        that applies one by name.
    """

    operands: int = 0
    numpy: str = ""
    python: Callable[..., Any] | None = None
    sign: str = ""
    strength: int = ATOM
    latex: str = ""
    what: str = ""
    slope: Callable[[Any, Any, Callable[[str, Any], Any]], Any] | None = None


#: Arithmetic, by the names of nodes.
ARITHMETIC: dict[str, Operation] = {
    "add": Operation(operands=2, numpy="add", python=operator.add, sign=" + ", strength=SUM),
    "sub": Operation(operands=2, numpy="subtract", python=operator.sub, sign=" - ", strength=SUM),
    "mul": Operation(operands=2, numpy="multiply", python=operator.mul, sign="*", strength=PRODUCT),
    "div": Operation(
        operands=2, numpy="divide", python=operator.truediv, sign="/", strength=PRODUCT
    ),
    "neg": Operation(operands=1, numpy="negative", python=operator.neg, strength=NEGATIVE),
    "pow": Operation(operands=2, numpy="power", python=operator.pow, strength=POWER),
}

#: Functions that an equation and a formula may call, by name, in the order in which messages list
#: them.
FUNCTIONS: dict[str, Operation] = {
    "sqrt": Operation(
        operands=1, numpy="sqrt", what="Square root", slope=lambda _u, y, _call: 0.5 / y
    ),
    "exp": Operation(operands=1, numpy="exp", what="Exponential", slope=lambda _u, y, _call: y),
    "log": Operation(
        operands=1, numpy="log", what="Natural logarithm", slope=lambda u, _y, _call: 1.0 / u
    ),
    "sin": Operation(
        operands=1, numpy="sin", what="Sine [of rad]", slope=lambda u, _y, call: call("cos", u)
    ),
    "cos": Operation(
        operands=1, numpy="cos", what="Cosine [of rad]", slope=lambda u, _y, call: -call("sin", u)
    ),
    "tan": Operation(
        operands=1, numpy="tan", what="Tangent [of rad]", slope=lambda _u, y, _call: 1.0 + y * y
    ),
    "asin": Operation(numpy="arcsin"),
    "acos": Operation(numpy="arccos"),
    "atan": Operation(
        operands=1,
        numpy="arctan",
        latex="arctan",
        what="Inverse tangent [rad]",
        slope=lambda u, _y, _call: 1.0 / (1.0 + u * u),
    ),
    "atan2": Operation(numpy="arctan2"),
    "sinh": Operation(numpy="sinh"),
    "cosh": Operation(numpy="cosh"),
    "tanh": Operation(
        operands=1, numpy="tanh", what="Hyperbolic tangent", slope=lambda _u, y, _call: 1.0 - y * y
    ),
    "hypot": Operation(numpy="hypot"),
    "abs": Operation(numpy="absolute"),
    "sign": Operation(numpy="sign"),
    "heaviside": Operation(numpy="heaviside"),
    "min": Operation(numpy="minimum"),
    "max": Operation(numpy="maximum"),
    "clip": Operation(),
    "where": Operation(),
    "piecewise": Operation(),
}

#: Functions that have a node: all others are made of them, of arithmetic and of pieces.
ELEMENTARY = tuple(name for name, one in FUNCTIONS.items() if one.operands)
