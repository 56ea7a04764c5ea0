"""Functions composed of elementary functions and pieces, written so that no digits are lost near
special points.

Derivatives and Taylor series follow from the parts. A function with a kink or a jump has its
boundaries there, as `sl.piecewise` would.
"""

from __future__ import annotations

import math
from typing import Any

from saltus.arguments import written
from saltus.language.expression import Condition, Expr, Operand
from saltus.language.functions import atan, exp, max, min, of_numbers, pi, piecewise, sqrt, tanh


def _traced(*values: object) -> bool:
    return any(isinstance(value, Expr) for value in values)


@written("where(condition, value, otherwise)")
def where(condition: Condition | bool, value: Operand, otherwise: Operand) -> Any:
    """``value`` where the condition holds, ``otherwise`` elsewhere: short for
    ``sl.piecewise((value, condition), otherwise=otherwise)``.
    """
    return piecewise((value, condition), otherwise=otherwise)


def sign(a: Operand) -> Any:
    """1 where ``a > 0``, -1 where ``a < 0``; a boundary at ``a = 0``. Of the number 0 it is 0.

    At ``a = 0`` it is any value between: where both sides push onto ``a = 0`` the motion stays
    there, and the sign takes the value that this needs (Filippov's rule). So ``mu*sl.sign(v)`` is
    Coulomb friction, which sticks. ``sl.tanh(a/width)`` is its smooth stand-in.
    """
    if _traced(a):
        return piecewise((1.0, a > 0), otherwise=-1.0)
    return of_numbers("sign", lambda a: 1.0 if a > 0 else -1.0 if a < 0 else 0.0, a)


def heaviside(a: Operand, at_zero: float = 0.5) -> Any:
    """1 where ``a > 0``, 0 where ``a < 0``; a boundary at ``a = 0``. Of the number 0 it is
    ``at_zero``.
    """
    if _traced(a):
        return piecewise((1.0, a > 0), otherwise=0.0)
    return of_numbers(
        "heaviside",
        lambda a, at_zero: 1.0 if a > 0 else float(at_zero) if a == 0 else 0.0,
        a,
        at_zero,
    )


@written("clip(x, low, high)")
def clip(a: Operand, low: Operand, high: Operand) -> Any:
    """``a`` held between ``low`` and ``high``: ``sl.min(sl.max(a, low), high)``, with a boundary at
    each end.
    """
    return min(max(a, low), high)


def cosh(a: Operand) -> Any:
    """Hyperbolic cosine."""
    return (exp(a) + exp(-a)) * 0.5 if _traced(a) else of_numbers("cosh", math.cosh, a)


def sinh(a: Operand) -> Any:
    """Hyperbolic sine, to a few ulp of its value near zero too (the difference of two exponentials
    has no digits there).
    """
    return tanh(a) * cosh(a) if _traced(a) else of_numbers("sinh", math.sinh, a)


def asin(a: Operand) -> Any:
    """Inverse sine [rad], in [-pi/2, pi/2]. Its rate is infinite at -1 and 1; beyond them it isn't
    a number.
    """
    if not _traced(a):
        return of_numbers("asin", math.asin, a)
    return 2.0 * atan(a / (1.0 + sqrt((1.0 - a) * (1.0 + a))))


def acos(a: Operand) -> Any:
    """Inverse cosine [rad], in [0, pi]. Its rate is infinite at -1 and 1; beyond them it isn't a
    number.
    """
    return (
        2.0 * atan(sqrt((1.0 - a) / (1.0 + a))) if _traced(a) else of_numbers("acos", math.acos, a)
    )


def hypot(a: Operand, b: Operand) -> Any:
    """``sqrt(a**2 + b**2)``, a cone: it has no derivative where both are zero."""
    return sqrt(a * a + b * b) if _traced(a, b) else of_numbers("hypot", math.hypot, a, b)


def atan2(y: Operand, x: Operand) -> Any:
    """Angle of the point (x, y) from the x axis [rad], in (-pi, pi].

    Boundaries at ``x = 0``, where it is smooth, and at ``y = 0``, where it jumps by 2 pi if x is
    negative. It is half-angle formulas inside, for which no two terms cancel.
    """
    if not _traced(y, x):
        return of_numbers("atan2", math.atan2, y, x)
    if not _traced(x):
        return _at_distance(y, x)
    r = hypot(y, x)
    above = piecewise((pi, y > 0), otherwise=-pi)
    return piecewise((2.0 * atan(y / (r + x)), x > 0), otherwise=above - 2.0 * atan(y / (r - x)))


def _at_distance(y: Any, x: Any) -> Any:
    """The angle for a number x."""
    if x > 0:
        return atan(y / x)
    above = piecewise((pi, y > 0), otherwise=-pi)
    return above / 2 if x == 0 else above + atan(y / x)
