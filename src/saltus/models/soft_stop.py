r"""An oscillator between two soft stops.

.. math::
    \ddot x + c \dot x + x + k\, f(x) = F \cos \omega t, \qquad
    f = x - g \text{ for } x > g, \qquad x + g \text{ for } x < -g, \qquad 0 \text{ between}
"""

from __future__ import annotations

from saltus.contact import freeplay
from saltus.language import cos
from saltus.models.model import model


@model(
    states={"x": "1", "v": "1"},
    forced_at="frequency",
    source="S. W. Shaw, P. J. Holmes, A periodically forced piecewise linear oscillator, J. Sound "
    "Vib. 90(1), 129-155 (1983), with a stop on either side; own values.",
)
def soft_stop(
    t, x, v, *, damping=0.1, stiffness_ratio=9.0, gap=1.0, force=1.0, frequency="1.5 rad/s"
):
    """Oscillator between two soft stops: the resonance leans over, and begins at a graze.

    States are ``x`` and ``v``; all is dimensionless. It is forced at ``frequency``.

    ================  =======  ==========  ======================================================
    parameter         symbol   default     meaning
    ================  =======  ==========  ======================================================
    damping           c        0.1
    stiffness_ratio   k        9           of the stops to the spring that always acts
    gap               g        1           of either stop
    force             F        1           amplitude
    frequency         omega    1.5 rad/s
    ================  =======  ==========  ======================================================

    Notes
    -----
    At the default values but for the frequency, the response without contact grazes both stops at
    omega = sqrt(2 - c^2) = 1.4106735979665884. The symmetric response with contact exists between
    two folds, at 1.41029487283056 and at 2.64776845463872.
    """
    stops = freeplay(x, stiffness=stiffness_ratio, gap=gap)
    return v, force * cos(frequency * t) - damping * v - x - stops
