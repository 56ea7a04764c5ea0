"""Dry friction."""

from __future__ import annotations

import math
from typing import Any

from saltus.arguments import written
from saltus.errors import TraceError
from saltus.language.compositions import sign
from saltus.language.expression import Expr, Friction, Operand, as_expr, select


@written("friction(v, slip=..., stick=...)")
def friction(velocity: Operand, *, slip: Operand, stick: Operand | None = None) -> Any:
    """The force of dry friction, ``slip*sign(velocity)``: it sticks where the force that this needs
    is smaller than ``stick``.

    Parameters
    ----------
    velocity : Expr or float
        Sliding velocity [m/s, or any], zero where it sticks.
    slip : Expr or float
        Force in motion [N, or any], at least 0; it may depend on the velocity (Stribeck). A motion
        on which it becomes negative ends with status ``invalid_friction``.
    stick : Expr or float, optional
        Largest force at rest [as slip], at least ``slip`` at rest; default: the same.

    Returns
    -------
    Expr or float
        Force in the direction of the velocity: it stands with a minus in the equation of motion.

    Raises
    ------
    TraceError
        If ``slip`` is negative, or ``stick`` is smaller than it.

    Examples
    --------
    >>> friction(-2.0, slip=0.3)
    -0.3
    """
    if not isinstance(velocity, Expr):
        return slip * sign(velocity)
    level, limit = as_expr(slip), None
    if level.op == "const" and level.payload < 0:
        raise TraceError(drives(level.payload))
    if stick is not None:
        limit, least = as_expr(stick) / level, as_expr(stick) - level
        if least.op == "const" and least.payload < 0:
            raise TraceError(sticks_less(as_expr(stick).payload / level.payload))
    return slip * select(Friction(as_expr(velocity), limit, (level,)), 1.0, -1.0)


def drives(force: float) -> str:
    """The message about a negative friction force."""
    return (
        f"the friction force slip = {force:g} is negative: friction never pushes on. Give its "
        f"size, and subtract sl.friction(...) in the equation of motion."
    )


def sticks_less(limit: float) -> str:
    """The message about a friction force that is smaller at rest than in motion, or has no
    ratio.
    """
    if not math.isfinite(limit):
        return (
            "slip is 0, and what a contact holds at rest is a multiple of it, stick/slip. Leave "
            "stick= out where there is no friction, or let slip be greater than 0."
        )
    return (
        f"stick is {limit:g} times slip: a friction that holds less at rest than in motion has no "
        f"motion at all where it reverses. Let stick be at least slip."
    )
