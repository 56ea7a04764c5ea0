"""The language of equations: expressions, the functions that an equation may call, and properties
of an expression that need no system.

>>> from saltus.language import sin
>>> from saltus.language.derivatives import differentiate
>>> from saltus.language.expression import parameter, state
>>> differentiate(sin(parameter("w") * state("x")), state("x"))
cos(w*x)*w
"""

# Imported because they register their answers: see expression.answers.
from saltus.language import foreign, text  # noqa: F401
from saltus.language.clocks import mod
from saltus.language.compositions import (
    acos,
    asin,
    atan2,
    clip,
    cosh,
    heaviside,
    hypot,
    sign,
    sinh,
    where,
)
from saltus.language.dimensions import units_of
from saltus.language.functions import (
    abs,
    atan,
    cos,
    exp,
    log,
    max,
    min,
    pi,
    piecewise,
    sin,
    sqrt,
    tan,
    tanh,
)
from saltus.language.inputs import pulse, recorded, sawtooth, square
from saltus.language.known_sides import all_assuming, assuming
from saltus.language.names import why_no_title
from saltus.language.roots import root_name
from saltus.language.sums import dot, total
from saltus.language.sweeps import sweep
from saltus.language.tables import Table, curve, table

__all__ = [
    "Table", "abs", "acos", "all_assuming", "asin", "assuming", "atan", "atan2", "clip", "cos",
    "cosh", "curve", "dot", "exp", "heaviside", "hypot", "log", "max", "min", "mod", "pi",
    "piecewise", "pulse", "recorded", "root_name", "sawtooth", "sign", "sin", "sinh", "sqrt",
    "square", "sweep", "table", "tan", "tanh", "total", "units_of", "where", "why_no_title",
]  # fmt: skip
