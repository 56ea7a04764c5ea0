r"""A ball between two walls that shake: the impact damper.

.. math::
    \ddot x = 0, \quad |x - Z \sin \omega t| \le L/2, \qquad
    \dot x^+ - \dot w = -e\, (\dot x^- - \dot w) \text{ at a wall}, \quad w = Z \sin \omega t
"""

from __future__ import annotations

from saltus.contact import impact
from saltus.language import cos, sin
from saltus.models.model import model


@model(
    states={"x": "1", "v": "1"},
    forced_at="frequency",
    source="S. F. Masri, T. K. Caughey, On the stability of the impact damper, J. Appl. Mech. 33, "
    "586-592 (1966): the primary mass moves as given; own values.",
)
def ball_in_box(t, x, v, *, amplitude=1.0, length=3.0, restitution=0.6, frequency="1 rad/s"):
    r"""Ball between two walls that shake: impact damper, rattling gear (Masri and Caughey).

    States are ``x`` and ``v``, in a frame that doesn't shake; all is dimensionless. It is forced at
    ``frequency``.

    ============  =======  ========  =============================================================
    parameter     symbol   default   meaning
    ============  =======  ========  =============================================================
    amplitude     Z        1         of both walls
    length        L        3         clear distance of the walls
    restitution   e        0.6
    frequency     omega    1 rad/s
    ============  =======  ========  =============================================================

    Notes
    -----
    With omega = 1 the symmetric orbit with an impact on either wall in each period exists up to
    :math:`L = 2 Z \sqrt{1 + 1/a^2}`, :math:`a = 2 (1 - e)/((1 + e) \pi)`: 12.724530263134657. At L
    = 3 the ball flies at 1.5423222787291278.
    """
    wall, rate = amplitude * sin(frequency * t), amplitude * frequency * cos(frequency * t)
    return (
        v,
        0.0,
        impact(x < wall + length / 2, v - rate, restitution=restitution),
        impact(x > wall - length / 2, rate - v, restitution=restitution),
    )
