"""Functions of other packages in an equation: their equivalents in saltus, and advice on those
without one.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from saltus.errors import TraceError
from saltus.language import compositions as made
from saltus.language import functions as own
from saltus.language.clocks import mod
from saltus.language.expression import OWN_FUNCTIONS, answers, as_expr
from saltus.language.operations import ARITHMETIC, FUNCTIONS

#: NumPy's ufuncs that an equation may call, by name, and the traced function for each.
UFUNCS: dict[str, Callable[..., Any]] = {
    **{one.numpy: one.python for one in ARITHMETIC.values() if one.python},
    **{one.numpy: getattr(own, name, None) or getattr(made, name)
        for name, one in FUNCTIONS.items() if one.numpy},
    "float_power": operator.pow, "positive": operator.pos, "fabs": own.abs,
    "square": lambda a: a * a, "reciprocal": lambda a: 1.0 / a,
    "greater": operator.gt, "greater_equal": operator.ge, "less": operator.lt,
    "less_equal": operator.le,
    "equal": operator.eq, "not_equal": operator.ne, "fmax": own.max, "fmin": own.min,
    "remainder": mod,
    "deg2rad": lambda a: a * (own.pi / 180),
    "radians": lambda a: a * (own.pi / 180), "rad2deg": lambda a: a * (180 / own.pi),
    "degrees": lambda a: a * (180 / own.pi),
}  # fmt: skip

#: Names of other packages, and their equivalents here.
ADVICE: dict[str, str] = {
    **{one.numpy: f"Write sl.{name}." for name, one in FUNCTIONS.items() if one.numpy not in
        ("", name)},
    "arctan2": "Write sl.atan2(y, x).", "absolute": "Write sl.abs or abs.",
    "fabs": "Write sl.abs or abs.",
    "pow": "Write x**2.", "power": "Write x**2.",
    "signum": "Write sl.sign.",
    "step": "Write sl.heaviside(t - t0).",
    "select": "Write sl.where or sl.piecewise.", "Piecewise": "Write sl.piecewise((value, "
        "condition), otherwise=...).",
    "interp": "Write sl.table(x, points, values).", "CubicSpline": "Write sl.table(x, points, "
        "values, kind='spline').",
    "remainder": "Write sl.mod(t, T).", "fmod": "Write sl.mod(t, T).", "floor": "Of a time it is "
        "(t - sl.mod(t, T))/T.",
    "erf": "There is none; sl.tanh is the nearest smooth step.",
    "log10": "Write sl.log(x)/math.log(10).",
    "expm1": "Write sl.exp(x) - 1.", "log1p": "Write sl.log(1 + x).",
    "restitution": "Return sl.impact(x < gap, v, restitution=0.8) after the rates.",
    "delay": "There are no delays: a rate depends on the states at the time t only.",
    **dict.fromkeys(("interp1d", "interp1", "lookup"), "Write sl.table(x, points, values)."),
    "chirp": "Write sl.sin(2*sl.pi*(f0*t + rate*t**2/2)) in the equation.",
}  # fmt: skip


@answers("__array_ufunc__")
def traced_ufunc(ufunc: Any, method: str, inputs: tuple[Any, ...], keywords: dict[str, Any]) -> Any:
    """The result of a NumPy ufunc for traced values.

    Raises
    ------
    TraceError
        If saltus has no such function, or the call asks for more than the function of its operands.
    """
    name = ufunc.__name__
    if method != "__call__" or keywords or name not in UFUNCS:
        raise TraceError(
            f"an equation called np.{name}{'' if method == '__call__' else '.' + method} on a "
            f"traced value, which can't be traced. "
            f"{ADVICE.get(name, OWN_FUNCTIONS)}"
        )
    if name == "heaviside":
        inputs = inputs[:1]
    return UFUNCS[name](*map(as_expr, inputs))
