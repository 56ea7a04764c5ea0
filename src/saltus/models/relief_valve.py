r"""A pressure relief valve: a spring-loaded disc over a chamber, with impacts on its seat.

.. math::
    \dot x &= v \\
    \dot v &= -\kappa v - (x + \delta) + p \\
    \dot p &= \beta \left(q - x \sqrt p\right), \qquad
    x \ge 0, \quad v^+ = -r\, v^- \text{ at } x = 0
"""

from __future__ import annotations

from saltus.contact import impact
from saltus.language import sqrt
from saltus.models.model import model


@model(
    states={"x": "1", "v": "1", "pressure": "1"},
    source="C. Hos, A. R. Champneys, Grazing bifurcations and chatter in a pressure relief valve "
    "model, Physica D 241, 2068-2076 (2012); values of an example of MPGOS.",
)
def relief_valve(
    t, x, v, pressure, *, flow=5.0, damping=1.25, inflow_gain=20.0, preload=10.0, restitution=0.8
):
    r"""Pressure relief valve that impacts on its seat (Hos and Champneys).

    States are the lift ``x``, ``v`` and the ``pressure``; all is dimensionless. It isn't forced.

    ============  =======  ========  =============================================================
    parameter     symbol   default   meaning
    ============  =======  ========  =============================================================
    flow          q        5         into the chamber
    damping       kappa    1.25
    inflow_gain   beta     20        of the chamber: small for a large one
    preload       delta    10        of the spring
    restitution   r        0.8       of the seat
    ============  =======  ========  =============================================================

    Notes
    -----
    The open valve is stable for large flows. It begins to oscillate, with angular frequency
    3.0907088479743406, as the flow falls below 8.4911176351833271; the limit cycle touches the seat
    at 7.557210972.
    """
    inflow = inflow_gain * (flow - x * sqrt(pressure))
    push = pressure - (x + preload) - damping * v
    return v, push, inflow, impact(x > 0, -v, restitution=restitution)
