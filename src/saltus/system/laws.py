"""Contact laws: short-hands for the piecewise forces that come up most, friction that sticks,
impacts, jumps.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from saltus.errors import TraceError, shown
from saltus.system.expression import Condition, Expr, Operand, Relation, as_expr, div, select
from saltus.system.functions import of_numbers, piecewise


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


# -- friction --------------------------------------------------------------------------------------
def friction(velocity: Operand, *, slip: Operand, stick: Operand | None = None) -> Any:
    """The force of dry friction, positive in the direction of ``velocity``; at rest it is whatever
    keeps the velocity zero, up to its limit.

    It stands with a minus in the equation of motion: ``mass*dv/dt = drive - friction(v, ...)``. The
    motion sticks as long as the force needed for that is below the limit; that is located as a
    contact is, and nothing is made smooth.

    Parameters
    ----------
    velocity : Expr or float
        Relative velocity of the two surfaces [m/s, or rad/s].
    slip : Expr or float
        Kinetic friction [N, or N*m], > 0; it may depend on the velocity (Stribeck).
    stick : Expr or float, optional
        Largest static friction [N, or N*m], at least ``slip`` at rest. Default: as ``slip``
        (Coulomb).

    Returns
    -------
    Expr or float
        Force [N], or moment [N*m].

    Raises
    ------
    TraceError
        If ``stick`` is below ``slip``.

    References
    ----------
    Leine & Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems (2004), section
    5.3.

    Examples
    --------
    >>> friction(-0.3, slip=2.0)
    -2.0
    """
    limit = None if stick is None else div(as_expr(stick), as_expr(slip))
    if limit is not None and limit.op == "const" and limit.payload < 1.0:
        raise TraceError(
            f"sl.friction got stick={shown(stick)} below slip={shown(slip)}. Static friction is at "
            f"least as large as kinetic friction."
        )
    if not isinstance(velocity, Expr):
        sign = of_numbers("friction", lambda v: 1.0 if v > 0 else -1.0 if v < 0 else 0.0, velocity)
        return slip * sign
    return slip * select(Relation(velocity, limit), 1.0, -1.0)


# -- laws that change the state --------------------------------------------------------------------
@dataclass(frozen=True, eq=False)
class Impact:
    """What :func:`impact` returns: a law, to be returned behind the rates."""

    allowed: Relation
    velocity: Expr
    restitution: Expr
    inertia: Any


@dataclass(frozen=True, eq=False)
class Jump:
    """What :func:`jump` returns: a law, to be returned behind the rates."""

    condition: Relation
    values: Mapping[str, Expr]


def impact(
    allowed: Any,
    velocity: Operand,
    *,
    restitution: Operand,
    inertia: Operand | Sequence[Operand] | Mapping[str, Operand] | None = None,
) -> Impact:
    """A stop that can't be passed: Newton's law of impact, and rest.

    The law is returned behind the rates: ``return v, force/mass, sl.impact(x < gap, v,
    restitution=0.8)``. At the stop the velocity v becomes -restitution*v. Impacts that follow each
    other ever faster end at rest on the stop; the motion leaves it when the contact force is zero.

    Parameters
    ----------
    allowed : comparison
        What always holds: ``x < gap``. The boundary may depend on time: ``x < wall(t)``.
    velocity : Expr
        Closing velocity of the contact [m/s]: minus the rate of the gap, ``v - wall_rate``.
    restitution : Expr or float
        Ratio of the velocities after and before, 0 to 1; it may depend on the velocity.
    inertia : Expr or float, or sequence or mapping of them, optional
        Masses, where the velocity is that of several states against each other: one for each of
        these states, in the order of ``states=``, or by their names. ``sl.impact(x1 < x2, v1 - v2,
        restitution=0.8, inertia=(m1, m2))``.

    Returns
    -------
    Impact
        For the return value of the equation.

    Raises
    ------
    TraceError
        If ``allowed`` isn't a comparison, or a number is out of range.

    References
    ----------
    Brogliato, Nonsmooth Mechanics (2016), section 4.1; the end of a chatter: Nordmark & Piiroinen,
    Nonlinear Dynamics 58 (2009) 85-106.

    Examples
    --------
    A ball that falls from 10 m comes to rest after 3 times the time of its first impact.

    >>> import saltus as sl
    >>> @sl.system(states="x v")
    ... def ball(t, x, v, *, gravity=9.81, restitution=0.5):
    ...     return v, -gravity, sl.impact(x > 0, -v, restitution=restitution)
    >>> fall = sl.simulate(ball, (10.0, 0.0), t_end=5.0)
    >>> round(float(fall["contact_time"][-1] / fall["contact_time"][0]), 12), float(fall["end_v"])
    (3.0, 0.0)
    """
    if not isinstance(allowed, Relation):
        raise TraceError(
            f"sl.impact takes the comparison that always holds, such as x < gap, not "
            f"{shown(allowed)}."
        )
    ratio = as_expr(restitution)
    if ratio.op == "const" and not 0.0 <= ratio.payload <= 1.0:
        raise TraceError(
            f"sl.impact got restitution={shown(restitution)}: the ratio of the velocities after "
            f"and before an impact is between 0 and 1."
        )
    return Impact(allowed, as_expr(velocity), ratio, inertia)


def jump(condition: Any, **values: Operand) -> Jump:
    """The states that are named take other values at the moment in which a comparison becomes true.

    The law is returned behind the rates: ``return v, -x, sl.jump(x > 1, v=-0.9*v)``. No rest
    follows from it: for a stop write :func:`impact`.

    Parameters
    ----------
    condition : comparison
        Such as ``temperature > 23.5``.
    **values : Expr or float
        New values of states by their names, of time, states before the jump, and parameters.

    Returns
    -------
    Jump
        For the return value of the equation.

    Raises
    ------
    TraceError
        If ``condition`` isn't a comparison, or no state is named.

    Examples
    --------
    >>> import saltus as sl
    >>> @sl.system(states="x v")
    ... def kicked(t, x, v, *, level=1.0, kick=0.5):
    ...     return v, -x, sl.jump(x > level, v=v + kick)
    >>> run = sl.simulate(kicked, (0.0, 2.0), t_end=1.0)
    >>> round(float(run["end_x"] ** 2 + run["end_v"] ** 2), 12), round((3**0.5 + 0.5) ** 2 + 1, 12)
    (5.982050807569, 5.982050807569)
    """
    if not isinstance(condition, Relation):
        given = "several joined" if isinstance(condition, Condition) else shown(condition)
        raise TraceError(f"sl.jump takes one comparison, such as x > gap, not {given}.")
    if not values:
        raise TraceError("sl.jump names no state. Write sl.jump(x > gap, v=-0.9*v).")
    return Jump(condition, {name: as_expr(value) for name, value in values.items()})


def _number(operand: Operand) -> Operand:
    """An expression as it is, any other number as a plain one. Raises TraceError for
    anything else.
    """
    found = as_expr(operand)
    return operand if isinstance(operand, Expr) else float(found.payload)
