"""Contact laws: short forms of the most common piecewise forces."""

from __future__ import annotations

from typing import Any

from saltus.arguments import written
from saltus.errors import TraceError
from saltus.language.expression import Expr, Operand, as_expr
from saltus.language.functions import piecewise


@written(
    "freeplay(x, stiffness=..., gap=...),"
    " or lower_gap= and upper_gap=, damping= with velocity=, preload="
)
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
    no_tension: bool = False,
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
    no_tension : bool
        Whether contact ends where its force is zero, in place of where the gap is: the damper then
        never pulls.

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
                lambda say: (
                    f"{say.sl}freeplay got gap= besides lower_gap= or upper_gap=. gap= means the "
                    "same clearance on both sides."
                )
            )
        lower_gap = upper_gap = gap
    if lower_gap is None and upper_gap is None:
        raise TraceError(
            lambda say: f"{say.sl}freeplay needs gap=, or lower_gap= or upper_gap= or both."
        )
    x, stiffness, damping, preload = map(_number, (x, stiffness, damping, preload))
    lower_gap, upper_gap, velocity = (
        None if one is None else _number(one) for one in (lower_gap, upper_gap, velocity)
    )
    damped = isinstance(damping, Expr) or damping != 0
    if damped and velocity is None:
        raise TraceError(
            lambda say: (
                f"{say.sl}freeplay got damping= but no velocity=. Give the time derivative of x."
            )
        )

    def spring(deflection: Operand) -> Any:
        force = stiffness * deflection
        return force + damping * velocity if damped else force  # type: ignore[operator]

    pieces = []
    if lower_gap is not None:
        force, touches = spring(x + lower_gap), x < -lower_gap
        pieces.append((force, touches & (force < 0) if no_tension and damped else touches))
    if upper_gap is not None:
        force, touches = spring(x - upper_gap), x > upper_gap
        pieces.append((force, touches & (force > 0) if no_tension and damped else touches))
    force = piecewise(*pieces, otherwise=0.0)
    return force + preload if isinstance(preload, Expr) or preload != 0 else force


def hertz(depth: Operand, *, stiffness: Operand, exponent: Operand = 1.5) -> Any:
    """The force of two bodies that are pressed together, ``stiffness*depth**exponent`` where the
    depth is positive, else 0.

    Parameters
    ----------
    depth : Expr or float
        Compression [m], such as ``x - gap``; negative where they don't touch.
    stiffness : Expr or float
        [N/m**exponent].
    exponent : Expr or float
        3/2 for curved surfaces (Hertz), 1 for a spring [1].

    Returns
    -------
    Expr or float
        Force [N] against the depth: it stands with a minus in the equation of motion.

    Raises
    ------
    TraceError
        If an argument is neither a number nor traced.

    References
    ----------
    H. Hertz, Ueber die Beruehrung fester elastischer Koerper, J. reine angew. Math. 92 (1882)
    156-171.

    Examples
    --------
    >>> hertz(0.25, stiffness=8.0), hertz(-0.25, stiffness=8.0)
    (1.0, 0.0)
    """
    return _hysteretic(depth, 0.0, stiffness, exponent, 0.0)


def hunt_crossley(
    depth: Operand,
    velocity: Operand,
    *,
    stiffness: Operand,
    restitution: Operand,
    speed: Operand,
    exponent: Operand = 1.5,
) -> Any:
    """The force of a contact with hysteresis after Hunt and Crossley.

    It is ``stiffness*depth**exponent*(1 + c*velocity)`` where the depth is positive, else 0, with
    the factor ``c = 3*(1 - restitution)/(2*speed)``.

    Its loss is that of ``restitution`` in the limit of small losses; at larger ones the rebound is
    faster (:func:`flores` keeps to it). It vanishes with the depth, so it doesn't jump at contact.

    Parameters
    ----------
    depth : Expr or float
        Compression [m], such as ``x - gap``; negative where they don't
        touch.
    velocity : Expr or float
        Time derivative of the depth [m/s].
    stiffness : Expr or float
        [N/m**exponent].
    restitution : Expr or float
        Coefficient of restitution at the impact speed ``speed`` [1], above 0 and at most 1. With
        another speed the loss is another: it rises with the speed, as that of metals does.
    speed : Expr or float
        Speed at which the bodies meet [m/s].
    exponent : Expr or float
        3/2 for curved surfaces (Hertz), 1 for a spring [1].

    Returns
    -------
    Expr or float
        Force [N] against the depth: it stands with a minus in the equation of motion.

    Raises
    ------
    TraceError
        If the restitution is outside (0, 1].

    Notes
    -----
    With the factor c of the velocity, a mass that meets it with the speed v leaves with e*v, where
    ``c*v*(1 + e) = log((1 + c*v)/(1 - c*e*v))``, whatever stiffness and exponent are.

    References
    ----------
    K. H. Hunt, F. R. E. Crossley, Coefficient of restitution interpreted as damping in vibroimpact,
    J. Appl. Mech. 42 (1975) 440-445.

    Examples
    --------
    >>> hunt_crossley(0.25, 1.0, stiffness=8.0, restitution=0.5, speed=1.5)
    1.5
    """
    factor = 1.5 * (1.0 - _restitution("hunt_crossley", restitution)) / _number(speed)
    return _hysteretic(depth, velocity, stiffness, exponent, factor)


def lankarani_nikravesh(
    depth: Operand,
    velocity: Operand,
    *,
    stiffness: Operand,
    restitution: Operand,
    speed: Operand,
    exponent: Operand = 1.5,
) -> Any:
    """The force of a contact with hysteresis after Lankarani and Nikravesh: as
    :func:`hunt_crossley`, with the factor ``3*(1 - restitution**2)/(4*speed)``.

    Parameters
    ----------
    depth, velocity, stiffness, restitution, speed, exponent
        As for :func:`hunt_crossley`.

    Returns
    -------
    Expr or float
        Force [N] against the depth: it stands with a minus in the equation of motion.

    Raises
    ------
    TraceError
        If the restitution is outside (0, 1].

    References
    ----------
    H. M. Lankarani, P. E. Nikravesh, A contact force model with hysteresis damping for impact
    analysis of multibody systems, J. Mech. Des. 112 (1990) 369-376.

    Examples
    --------
    >>> lankarani_nikravesh(0.25, 1.0, stiffness=8.0, restitution=0.5, speed=1.125)
    1.5
    """
    bounce = _restitution("lankarani_nikravesh", restitution)
    factor = 0.75 * (1.0 - bounce * bounce) / _number(speed)
    return _hysteretic(depth, velocity, stiffness, exponent, factor)


def flores(
    depth: Operand,
    velocity: Operand,
    *,
    stiffness: Operand,
    restitution: Operand,
    speed: Operand,
    exponent: Operand = 1.5,
) -> Any:
    """The force of a contact with hysteresis after Flores and others: as :func:`hunt_crossley`,
    with the factor ``8*(1 - restitution)/(5*restitution*speed)``, made for soft bodies too.

    Parameters
    ----------
    depth, velocity, stiffness, restitution, speed, exponent
        As for :func:`hunt_crossley`.

    Returns
    -------
    Expr or float
        Force [N] against the depth: it stands with a minus in the equation of motion.

    Raises
    ------
    TraceError
        If the restitution is outside (0, 1].

    References
    ----------
    P. Flores, M. Machado, M. T. Silva, J. M. Martins, On the continuous contact force models for
    soft materials in multibody dynamics, Multibody Syst. Dyn. 25 (2011) 357-375.

    Examples
    --------
    >>> flores(0.25, 1.0, stiffness=8.0, restitution=0.5, speed=3.2)
    1.5
    """
    bounce = _restitution("flores", restitution)
    factor = 1.6 * (1.0 - bounce) / (bounce * _number(speed))
    return _hysteretic(depth, velocity, stiffness, exponent, factor)


def _hysteretic(
    depth: Operand, velocity: Operand, stiffness: Operand, exponent: Operand, factor: Operand
) -> Any:
    """``stiffness*depth**exponent*(1 + factor*velocity)`` in contact."""
    depth, velocity, stiffness, exponent = map(_number, (depth, velocity, stiffness, exponent))
    if not isinstance(depth, Expr) and depth <= 0:
        return 0.0
    force = stiffness * depth**exponent
    if isinstance(factor, Expr) or factor != 0:
        force = force * (1.0 + factor * velocity)
    return piecewise((force, depth > 0), otherwise=0.0)


def _restitution(name: str, restitution: Operand) -> Any:
    """A coefficient of restitution that a damper can have. Raises TraceError for others."""
    bounce = _number(restitution)
    if not isinstance(bounce, Expr) and not 0 < bounce <= 1:
        raise TraceError(
            lambda say: (
                f"{say.sl}{name}: the restitution {bounce:g} is outside (0, 1]: 1 is a contact "
                f"without a loss. For a contact without a rebound take {say.sl}impact with "
                "restitution=0."
            )
        )
    return bounce


def _number(operand: Operand) -> Operand:
    """Return an expression as it is, any other number as a float. Raises TraceError for anything
    else.
    """
    found = as_expr(operand)
    return operand if isinstance(operand, Expr) else float(found.payload)
