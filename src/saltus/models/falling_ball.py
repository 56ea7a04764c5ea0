r"""A ball that bounces on the ground until it rests.

.. math::
    \ddot x = -g, \quad x \ge 0, \qquad \dot x^+ = -e\, \dot x^- \text{ at } x = 0
"""

from __future__ import annotations

from saltus.contact import impact
from saltus.models.model import model


@model(
    states={"x": "m", "v": "m/s"},
    source="Siconos, example BouncingBallED; M. Calvo, J. I. Montijano, L. Randez, Algorithm 968: "
    "DISODE45, ACM Trans. Math. Softw. 43(3), 25 (2016), example 5.",
)
def falling_ball(t, x, v, *, gravity="9.81 m/s^2", restitution=0.9):
    r"""Ball that bounces on the ground until it rests (Siconos; DISODE45, example 5).

    States are the height ``x`` [m] and ``v`` [m/s]. It isn't forced.

    ============  =======  ===========  ==========================================================
    parameter     symbol   default      meaning
    ============  =======  ===========  ==========================================================
    gravity       g        9.81 m/s^2
    restitution   e        0.9
    ============  =======  ===========  ==========================================================

    Notes
    -----
    Released at height h it hits the ground at :math:`t_1 = \sqrt{2 h/g}`, for the n-th time after
    it at :math:`t_1 (1 + 2 (e + \dots + e^n))`, and rests from :math:`t_1 (1 + e)/(1 - e)` on.
    """
    return v, -gravity, impact(x > 0, -v, restitution=restitution)
