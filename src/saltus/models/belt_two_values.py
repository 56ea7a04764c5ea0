r"""A block on a moving belt whose static friction exceeds the kinetic one.

.. math::
    m \ddot x + k x + \mu(\dot x - u) = 0, \qquad
    |\mu| = \mu_k \text{ in slip}, \quad |\mu| \le \mu_s \text{ in stick}
"""

from __future__ import annotations

from saltus.contact import friction
from saltus.models.model import model


@model(
    states={"x": "1", "v": "1"},
    source="U. Galvanetto, S. R. Bishop, Dynamics of a simple damped oscillator undergoing "
    "stick-slip vibrations, Meccanica 34, 337-347 (1999); own values.",
)
def belt_two_values(t, x, v, *, mass=1.0, stiffness=1.0, speed=0.2, slip=0.5, stick=1.0):
    r"""Block on a moving belt, static friction above kinetic friction: stick and slip.

    States are ``x`` and ``v``; all is dimensionless. It isn't forced.

    ==========  =======  ========  ===============================================================
    parameter   symbol   default   meaning
    ==========  =======  ========  ===============================================================
    mass        m        1
    stiffness   k        1
    speed       u        0.2       of the belt
    slip        mu_k     0.5       kinetic friction force
    stick       mu_s     1         largest static friction force
    ==========  =======  ========  ===============================================================

    Notes
    -----
    It sticks until x = mu_s/k and slips along an arc about x = mu_k/k, in closed form: at the
    default values it sticks for 5 and slips for 3.902605407814523, up to x = 1.0385164807134504.
    """
    return v, -(stiffness * x + friction(v - speed, slip=slip, stick=stick)) / mass
