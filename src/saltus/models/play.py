r"""A load that an actuator drives through a play.

.. math::
    \ddot x + c \dot x + k (x - y) = 0, \qquad y = \text{play of } A \cos \omega t
"""

from __future__ import annotations

from saltus.contact import play as carried
from saltus.language import cos
from saltus.models.model import model


@model(
    states={"x": "1", "v": "1"},
    forced_at="frequency",
    source="A. Visintin, Differential Models of Hysteresis, Springer (1994), section III.2; M. "
    "Nordin, P.-O. Gutman, Controlling mechanical systems with backlash - a survey, Automatica 38, "
    "1633-1649 (2002).",
)
def play(t, x, v, *, damping=0.1, stiffness=4.0, stroke=1.0, gap=0.3, frequency="1.3 rad/s"):
    r"""Load behind an actuator with play (backlash).

    States are the place ``x`` of the load, ``v``, and ``play``, the place of the actuator within
    its clearance; all is dimensionless. It is forced at ``frequency``. The part that the actuator
    carries along stands at ``stroke*cos(frequency*t) - play``; a spring joins the load to it.

    =========  =======  ==========  ============================================================
    parameter  symbol   default     meaning
    =========  =======  ==========  ============================================================
    damping    c        0.1
    stiffness  k        4           of the spring between part and load
    stroke     A        1           amplitude of the actuator
    gap        g        0.3         clearance on either side
    frequency  omega    1.3 rad/s
    =========  =======  ==========  ============================================================

    Notes
    -----
    Where A > g the part goes between -(A - g) and A - g, and rests at each end for the time
    :math:`\arccos(1 - 2g/A)/\omega`. Two multipliers are those of the load alone, of size
    :math:`e^{-\pi c/\omega}`; the third is zero: the play forgets where it began.
    """
    part = carried(stroke * cos(frequency * t), gap=gap)
    return v, -damping * v - stiffness * (x - part)
