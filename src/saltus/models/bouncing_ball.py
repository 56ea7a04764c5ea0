r"""A ball that falls onto a table which moves up and down.

.. math::
    \ddot x = -g, \quad x \ge G \sin \omega t, \qquad
    \dot x^+ - \dot w = -e\, (\dot x^- - \dot w) \text{ at } x = w = G \sin \omega t
"""

from __future__ import annotations

from saltus.contact import impact
from saltus.language import cos, sin
from saltus.models.model import model


@model(
    states={"x": "1", "v": "1"},
    forced_at="frequency",
    source="J. M. Luck, A. Mehta, Bouncing ball with a finite restitution: chattering, locking, "
    "and chaos, Phys. Rev. E 48, 3988 (1993); J. J. Barroso, M. V. Carneiro, E. E. N. Macau, Phys. "
    "Rev. E 79, 026206 (2009).",
)
def bouncing_ball(t, x, v, *, amplitude=1.2, restitution=0.5, gravity=1.0, frequency="1 rad/s"):
    r"""Ball on a table that moves up and down (Luck and Mehta).

    States are the height ``x`` and ``v``; all is dimensionless. It is forced at ``frequency``.

    ============  =======  ========  =============================================================
    parameter     symbol   default   meaning
    ============  =======  ========  =============================================================
    amplitude     G        1.2       of the table
    restitution   e        0.5
    gravity       g        1
    frequency     omega    1 rad/s   of the table
    ============  =======  ========  =============================================================

    Notes
    -----
    With g = omega = 1 the orbit of one impact in n periods is born at
    :math:`G_f = n \pi (1 - e)/(1 + e)` and doubles its period at
    :math:`\sqrt{G_f^2 + (2 (1 + e^2)/(1 + e)^2)^2}`. At the default values the ball chatters to
    rest on the table, which throws it off at asin(1/G) in each period: it lands first at
    3.3874157078481649 and rests from 4.13360620053988 on.
    """
    table, rate = amplitude * sin(frequency * t), amplitude * frequency * cos(frequency * t)
    return v, -gravity, impact(x > table, rate - v, restitution=restitution)
