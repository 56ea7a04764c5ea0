r"""A driven oscillator against a Hertz stop that damps while it is compressed: example 4 of
DISODE45.

.. math::
    2 \ddot x = -4.1\, \dot x - 210.125\, x - u - 2 \sin 14 t, \qquad
    u = c\, d^{3/2} + \begin{cases} 1.98 \sqrt{2 c \sqrt d}\; \dot x & \dot x > 0 \\
    0 & \dot x < 0 \end{cases} \quad \text{for } d = x - g > 0
"""

from __future__ import annotations

from saltus.language import piecewise, sin, sqrt
from saltus.models.model import model


@model(
    states={"x": "1", "v": "1"},
    forced_at="frequency",
    source="M. Calvo, J. I. Montijano, L. Randez, Algorithm 968: DISODE45, ACM Trans. Math. Softw. "
    "43(3), 25 (2016), example 4.",
)
def hertz_stop(
    t,
    x,
    v,
    *,
    mass=2.0,
    damping=4.1,
    stiffness=210.125,
    stop_stiffness=2.47e6,
    loss=1.98,
    gap=0.005,
    force=2.0,
    frequency="14 rad/s",
):
    """Driven oscillator against a Hertz stop that damps on the way in (DISODE45, example 4).

    States are ``x`` and ``v``; the source names no units. It is forced at ``frequency``.

    ===============  =======  =========  =======================================================
    parameter        symbol   default    meaning
    ===============  =======  =========  =======================================================
    mass             m        2
    damping                   4.1
    stiffness                 210.125
    stop_stiffness   c        2.47e6     force over depth^1.5
    loss                      1.98       of the damper of the stop, in critical units
    gap              g        0.005
    force                     2
    frequency                 14 rad/s
    ===============  =======  =========  =======================================================

    Notes
    -----
    From rest at x = 0 the stop is met first at t = 0.4006647561. The damper acts while the depth
    grows, so each contact has a boundary inside: the instant at which it is deepest.
    """
    depth = x - gap
    spring = piecewise((stop_stiffness * depth**1.5, depth > 0), otherwise=0)
    damper = piecewise(
        (loss * sqrt(mass * stop_stiffness) * depth**0.25 * v, (depth > 0) & (v > 0)), otherwise=0
    )
    drive = force * sin(frequency * t)
    return v, -(damping * v + stiffness * x + spring + damper + drive) / mass
