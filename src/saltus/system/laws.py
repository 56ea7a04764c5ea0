"""Contact laws: short-hands for the piecewise forces that come up most."""

from __future__ import annotations

from typing import Any

from saltus.errors import TraceError
from saltus.system.expression import Expr, Operand, as_expr
from saltus.system.functions import piecewise


def freeplay(
    x: Operand,
    *,
    stiffness: Operand,
    gap: Operand | None = None,
    lower_gap: Operand | None = None,
    upper_gap: Operand | None = None,
    damping: Operand = 0.0,
    velocity: Operand | None = None,
    preload: Operand = 0.0,
) -> Any:
    """The force of springs behind a clearance, positive in the direction of ``x``::

        stiffness*(x - upper_gap) + damping*velocity    where x > upper_gap
        stiffness*(x + lower_gap) + damping*velocity    where x < -lower_gap
        0                                               between
        + preload                                       everywhere

    It is what the moving part exerts on the springs: it has the sign of ``x``, and stands with a
    minus in the equation of motion, ``mass*dv/dt = drive - freeplay(x, ...)``.

    Parameters
    ----------
    x : Expr or float
        Displacement, or relative displacement of two parts [m, or rad for a rotation].
    stiffness : Expr or float
        Spring rate in contact [N/m, or N*m/rad], the same on both sides.
    gap : Expr or float, optional
        Clearance on either side [as x], >= 0. In place of ``lower_gap`` and ``upper_gap``.
    lower_gap, upper_gap : Expr or float, optional
        Clearance below and above [as x]; contact begins at ``x = -lower_gap`` and ``x =
        upper_gap``. A side that isn't given has no contact. One of them may be negative, as that of
        a preloaded stop is; their sum may not: springs that touch on both sides at once are the sum
        of two one-sided contacts.
    damping : Expr or float, optional
        Viscous damping in contact only [N*s/m, or N*m*s/rad]. The force then jumps at the boundary,
        and may pull shortly before contact ends.
    velocity : Expr or float, optional
        Time derivative of ``x`` [m/s, or rad/s]; needed with damping.
    preload : Expr or float, optional
        Constant force [N, or N*m] added everywhere.

    Returns
    -------
    Expr or float
        Force [N], or moment [N*m].

    Raises
    ------
    TraceError
        If no gap is given, or ``gap`` besides another, or damping without a velocity.

    Examples
    --------
    >>> freeplay(0.5, stiffness=2.0, gap=0.25)
    0.5
    >>> freeplay(-0.5, stiffness=2.0, upper_gap=0.25)
    0.0
    """
    if gap is not None:
        if lower_gap is not None or upper_gap is not None:
            raise TraceError(
                "sl.freeplay got gap= besides lower_gap= or upper_gap=. gap= means "
                "the same clearance on both sides."
            )
        lower_gap = upper_gap = gap
    if lower_gap is None and upper_gap is None:
        raise TraceError("sl.freeplay needs gap=, or lower_gap= or upper_gap= or both.")
    x, stiffness, damping, preload = map(_number, (x, stiffness, damping, preload))
    lower_gap, upper_gap, velocity = (
        None if one is None else _number(one) for one in (lower_gap, upper_gap, velocity)
    )
    damped = isinstance(damping, Expr) or damping != 0
    if damped and velocity is None:
        raise TraceError(
            "sl.freeplay got damping= but no velocity=. Give the time derivative of x."
        )

    def spring(deflection: Operand) -> Any:
        force = stiffness * deflection
        return force + damping * velocity if damped else force  # type: ignore[operator]

    pieces = []
    if lower_gap is not None:
        pieces.append((spring(x + lower_gap), x < -lower_gap))
    if upper_gap is not None:
        pieces.append((spring(x - upper_gap), x > upper_gap))
    force = piecewise(*pieces, otherwise=0.0)
    return force + preload if isinstance(preload, Expr) or preload != 0 else force


def _number(operand: Operand) -> Operand:
    """An expression as it is, any other number as a plain one. Raises TraceError for
    anything else.
    """
    found = as_expr(operand)
    return operand if isinstance(operand, Expr) else float(found.payload)
