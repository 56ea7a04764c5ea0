r"""A block on a moving belt whose friction falls with the sliding speed.

.. math::
    m \ddot x + k x = \mu, \qquad
    \mu = -\frac{F_s \operatorname{sign} w}{1 + \delta |w|} \text{ for } w = \dot x - u \ne 0,
    \quad |\mu| \le F_s \text{ in stick}
"""

from __future__ import annotations

from saltus.contact import friction
from saltus.language import abs
from saltus.models.model import model


@model(
    states={"x": "1", "v": "1"},
    source="R. I. Leine, D. H. van Campen, A. de Kraker, L. van den Steen, Stick-slip vibrations "
    "induced by alternate friction models, Nonlinear Dyn. 16, 41-54 (1998).",
)
def belt_stribeck(t, x, v, *, mass=1.0, stiffness=1.0, speed=0.2, stick=1.0, fading=3.0):
    r"""Block on a moving belt whose friction falls with the speed: stick and slip (Leine et al.).

    States are ``x`` and ``v``; all is dimensionless. It isn't forced.

    ==========  =======  ========  ===============================================================
    parameter   symbol   default   meaning
    ==========  =======  ========  ===============================================================
    mass        m        1
    stiffness   k        1
    speed       u        0.2       of the belt
    stick       F_s      1         largest static friction force
    fading      delta    3         of the friction with the sliding speed
    ==========  =======  ========  ===============================================================

    Notes
    -----
    At the default values the period of stick and slip is 12.0010312948306; a slip lasts
    4.29599952548015.
    """
    sliding = v - speed
    return v, -(stiffness * x + friction(sliding, slip=stick / (1 + fading * abs(sliding)))) / mass
