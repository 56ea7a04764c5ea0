r"""An oscillator that drifts: a mass pushes a slider on a viscoelastic foundation, and leaves it.

.. math::
    \dot p = y - v_r, \quad \dot y = a \cos \omega t + b - f, \quad \dot q = z_r - v_r, \quad
    \dot v = v_r
"""

from __future__ import annotations

from saltus.language import cos, piecewise
from saltus.models.model import model


@model(
    states={"p": "1", "y": "1", "q": "1", "v": "1"},
    forced_at="frequency",
    source="E. Pavlovskaia, M. Wiercigroch, C. Grebogi, Modeling of an impact system with a drift, "
    "Phys. Rev. E 64, 056224 (2001).",
)
def drifting_oscillator(
    t,
    p,
    y,
    q,
    v,
    *,
    damping_ratio=0.01,
    amplitude=0.3,
    static_force=0.1,
    gap=0.02,
    frequency="0.1 rad/s",
):
    r"""Oscillator with a drift (Pavlovskaia, Wiercigroch and Grebogi), in bounded coordinates.

    States are the places ``p`` of the mass and ``q`` of the top of the slider, both from the bottom
    of the slider, the velocity ``y`` of the mass, and the drift ``v``, the bottom's own place; all
    is dimensionless. It is forced at ``frequency``.

    =============  =======  ==========  ========================================================
    parameter      symbol   default     meaning
    =============  =======  ==========  ========================================================
    damping_ratio  xi       0.01        of the foundation
    amplitude      a        0.3         of the dynamic force, over the friction's limit
    static_force   b        0.1         over the friction's limit
    gap            g        0.02        between mass and slider
    frequency      omega    0.1 rad/s
    =============  =======  ==========  ========================================================

    Notes
    -----
    In contact, p - q >= g, the mass carries the top along: the gap stays zero until the force 2 xi
    y + q of the foundation is zero. Above 1 the bottom slides. From rest at the default values the
    mass meets the slider first at 0.31623764888605, and the drift is 16.143586421361 at t = 100
    and 841.4127487595 after 60 periods.
    """
    touch = p - q >= gap
    force = 2 * damping_ratio * y + q
    pressed = piecewise((1.0, touch & (force > 1)), (force, touch & (force > 0)), otherwise=0)
    drift = piecewise((y + (q - 1) / (2 * damping_ratio), touch & (force > 1)), otherwise=0)
    top = piecewise((y, touch & (force > 0)), otherwise=-q / (2 * damping_ratio))
    return y - drift, amplitude * cos(frequency * t) + static_force - pressed, top - drift, drift
