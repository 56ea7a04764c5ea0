"""The functions that an equation may call, of traced values or plain numbers. Plain numbers give a
plain number.
"""

from __future__ import annotations

import builtins
import math
from collections.abc import Callable
from typing import Any

from saltus.arguments import written
from saltus.errors import TraceError, shown
from saltus.language.expression import (
    Condition,
    Expr,
    Operand,
    Relation,
    absolute,
    as_expr,
    elementary,
    select,
)
from saltus.language.expression import sub as _difference
from saltus.language.operations import FUNCTIONS

pi = math.pi


def of_numbers(name: str, function: Callable[..., Any], *numbers: Any) -> Any:
    """A function of plain numbers.

    Raises
    ------
    TraceError
        If one of them isn't a number, or the function has no value there.
    """
    for number in numbers:
        as_expr(number)  # refuses anything but a number
    try:
        return function(*numbers)
    except (TypeError, ValueError, ArithmeticError):
        given = ", ".join(map(shown, numbers))
        raise TraceError(
            lambda say: (
                f"{say.sl}{name}({given}) has no finite real value. Keep to the numbers where it "
                "has one."
            )
        ) from None


def _elementary(name: str) -> Callable[[Operand], Any]:
    on_numbers = getattr(math, name)

    def function(a: Operand) -> Any:
        return elementary(name, a) if isinstance(a, Expr) else of_numbers(name, on_numbers, a)

    function.__name__ = function.__qualname__ = name
    function.__doc__ = f"{FUNCTIONS[name].what} of a traced value or a number."
    return function


sqrt = _elementary("sqrt")
exp = _elementary("exp")
log = _elementary("log")
sin = _elementary("sin")
cos = _elementary("cos")
tan = _elementary("tan")
atan = _elementary("atan")
tanh = _elementary("tanh")


def abs(a: Operand) -> Any:
    """``|a|``; of a traced value a guard at ``a = 0``. The built-in ``abs`` does the same."""
    return absolute(a) if isinstance(a, Expr) else of_numbers("abs", builtins.abs, a)


def min(first: Operand, /, *others: Operand) -> Any:
    """The smallest of the values; a guard wherever two of them are equal."""
    return _extreme("min", (first, *others), builtins.min, lambda a, b: (b, a))


def max(first: Operand, /, *others: Operand) -> Any:
    """The largest of the values; a guard wherever two of them are equal."""
    return _extreme("max", (first, *others), builtins.max, lambda a, b: (a, b))


def _extreme(
    name: str,
    values: tuple[Operand, ...],
    on_numbers: Callable[..., Any],
    larger_first: Callable[[Expr, Expr], tuple[Expr, Expr]],
) -> Any:
    if not any(isinstance(value, Expr) for value in values):
        return of_numbers(name, lambda *numbers: on_numbers(numbers), *values)
    result = as_expr(values[0])
    for other in map(as_expr, values[1:]):
        if result.op == other.op == "const":
            result = as_expr(on_numbers(result.payload, other.payload))
        elif result is not other:
            result = select(Relation(_difference(*larger_first(result, other))), result, other)
    return result


@written("piecewise((value, condition), ..., otherwise=value)")
def piecewise(*pieces: tuple[Operand, Condition | bool], otherwise: Operand | None = None) -> Any:
    """A value that differs from region to region: each comparison in a condition is a boundary
    where a contact can begin or end.

    Parameters
    ----------
    *pieces : (value, condition)
        The first piece whose condition holds gives the value. A condition is a comparison of traced
        values such as ``x > gap``; join conditions with ``&``, ``|`` and ``~``. ``<`` and ``<=``
        mean the same: on the boundary itself the motion decides.
    otherwise : value
        The value where none holds.

    Returns
    -------
    Expr or float
        A float if all values and conditions are plain.

    Raises
    ------
    TraceError
        If a piece isn't a pair of a value and a condition, or ``otherwise`` is missing.

    Examples
    --------
    >>> piecewise((1.4e4 * (0.5e-3 - 0.4e-3), 0.5e-3 > 0.4e-3), otherwise=0.0)  # doctest: +ELLIPSIS
    1.4...
    """
    if otherwise is None:
        raise TraceError(
            lambda say: (
                f"{say.sl}piecewise needs otherwise=, the value where no condition holds: "
                f"{say.sl}piecewise((k*(x - gap), x > gap), otherwise=0)."
            )
        )
    result: Any = otherwise
    for piece in reversed(pieces):
        value, condition = _pair(piece)
        if isinstance(condition, Condition):
            result = select(condition, value, result)
        elif condition:
            result = value
    return as_expr(result) if isinstance(result, Expr) else of_numbers("piecewise", float, result)


def _pair(piece: Any) -> tuple[Operand, Condition | bool]:
    """A piece, checked."""
    if not (isinstance(piece, tuple | list) and len(piece) == 2):
        raise TraceError(
            lambda say: (
                f"a piece of {say.sl}piecewise is a pair (value, condition), not {shown(piece)}."
            )
        )
    value, condition = piece
    if isinstance(value, Condition):
        raise TraceError(
            lambda say: (
                f"a piece of {say.sl}piecewise begins with its value: write (value, condition), "
                "such as (k*(x - gap), x > gap)."
            )
        )
    if isinstance(condition, Condition):
        return value, condition
    if isinstance(condition, bool) or str(getattr(condition, "dtype", "")) == "bool":
        return value, bool(condition)
    raise TraceError(
        lambda say: (
            f"the condition of a piece of {say.sl}piecewise must be a comparison such as x > gap, "
            f"not {shown(condition)}."
        )
    )
