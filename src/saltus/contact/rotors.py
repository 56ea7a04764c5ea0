"""The contact of a rotor with the ring around it."""

from __future__ import annotations

from typing import Any

from saltus.contact.dry_friction import friction as dry_friction
from saltus.language.compositions import hypot, sign
from saltus.language.expression import Expr, Operand, absolute, as_expr, varies
from saltus.language.functions import piecewise


def clearance(
    x: Operand,
    y: Operand,
    *,
    stiffness: Operand,
    gap: Operand,
    friction: Operand = 0.0,
    slip: Operand = 1.0,
) -> tuple[Any, Any]:
    """The force of a rotor on the stator that it rubs, in two components::

        n*(x - friction*y), n*(y + friction*x)    n = stiffness*(r - gap)/r, where r > gap
        0, 0                                      elsewhere

    with ``r = hypot(x, y)``. It is what the rotor exerts on the stator, outwards and in the
    direction in which its surface slides: it has the sign of ``x`` and ``y``, and stands with a
    minus in the equations of motion, ``mass*du/dt = drive - force``. The rotor may start at rest,
    at x = y = 0.

    Parameters
    ----------
    x, y : Expr or float
        Place of the rotor's centre, from that of the stator [m].
    stiffness : Expr or float
        Of the stator, radially [N/m].
    gap : Expr or float
        Clearance between rotor and stator, radially [m].
    friction : Expr or float
        Coefficient of friction [1], at least 0.
    slip : Expr or float
        Velocity at which the rotor's surface slides over the stator, positive from x to y [m/s]:
        the friction has its sign. Default 1: a rotor that turns from x to y so fast that the slip
        never reverses, as the literature has it; -1 for one that turns the other way. Of a slow
        rotor it is ``spin*radius + (x*v - y*u)/gap``, with the velocity (u, v) of its centre; where
        that is zero the rotor may stick, and roll. (Divided by ``sl.hypot(x, y)`` in place of the
        gap it isn't a number at rest.)

    Returns
    -------
    tuple of Expr or float
        The two components [N].

    Raises
    ------
    TraceError
        If an argument is neither a number nor traced.

    References
    ----------
    F. Chu, Z. Zhang, Bifurcation and chaos in a rub-impact Jeffcott rotor system, J. Sound Vib.
    210(1) (1998) 1-18.

    Examples
    --------
    >>> clearance(3.0, 4.0, stiffness=10.0, gap=4.0)
    (6.0, 8.0)
    >>> clearance(3.0, 4.0, stiffness=10.0, gap=4.0, friction=0.5)
    (2.0, 11.0)
    >>> clearance(0.0, 0.0, stiffness=10.0, gap=4.0)
    (0.0, 0.0)
    """
    for operand in (x, y, stiffness, gap, friction, slip):
        as_expr(operand)  # refuses anything that is neither a number nor traced
    r = hypot(x, y)
    if not isinstance(r, Expr) and not isinstance(gap, Expr) and r <= gap:
        return 0.0, 0.0
    press = piecewise((stiffness * (r - gap) / r, r > gap), otherwise=0.0)
    if not isinstance(friction, Expr) and friction == 0:
        return press * x, press * y
    if not isinstance(slip, Expr):
        rub = friction * sign(slip) * press
    elif varies(slip):
        rub = dry_friction(slip, slip=friction * press)
    else:
        rub = friction * (slip / absolute(slip)) * press
    return press * x - rub * y, press * y + rub * x
