r"""A damped oscillator on a belt that changes its speed: example 2 of DISODE45.

.. math::
    \ddot x + c \dot x + x = \cos \omega t - \mu \operatorname{sign}(\dot x - \cos t - u)
"""

from __future__ import annotations

from saltus.contact import friction
from saltus.language import cos
from saltus.models.model import model


@model(
    states={"x": "1", "v": "1"},
    source="M. Calvo, J. I. Montijano, L. Randez, Algorithm 968: DISODE45, ACM Trans. Math. Softw. "
    "43(3), 25 (2016), example 2; example 0 without belt, damper and force.",
)
def shaken_belt(
    t, x, v, *, damping=0.4, friction_force=0.4, force=1.0, force_rate=0.7, speed=0.7, shake=1.0
):
    r"""Damped oscillator on a belt that changes its speed (DISODE45, example 2).

    States are ``x`` and ``v``; all is dimensionless. It has no period to be forced at: the force
    and the belt have one each.

    ===============  =======  ========  =========================================================
    parameter        symbol   default   meaning
    ===============  =======  ========  =========================================================
    damping          c        0.4
    friction_force   mu       0.4
    force                     1         amplitude
    force_rate       omega    0.7       angular frequency of the force
    speed            u        0.7       of the belt, mean
    shake                     1         amplitude of the belt's speed, at the angular frequency 1
    ===============  =======  ========  =========================================================

    Notes
    -----
    From (3, 0) it switches at 7.6055699647458 and, before t = 30, six times more; the second time
    it sticks to the belt. With damping = force = speed = shake = 0 this is example 0.
    """
    belt = speed + shake * cos(t)
    drive = force * cos(force_rate * t) - damping * v - x
    return v, drive - friction(v - belt, slip=friction_force)
