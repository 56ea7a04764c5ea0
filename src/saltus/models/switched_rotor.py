r"""A planar rotation whose radius and rate depend on the side of a line: Dankowicz and Schilder's
example of a periodic orbit of two segments.

.. math::
    \dot x &= (1 - r)\, x - y, &\quad
    \dot y &= x + (1 - r)\, y &\quad& \text{for } x < 0 \\
    \dot x &= \alpha (\beta - r)\, x - (\gamma + \beta - r)\, y, &\quad
    \dot y &= \alpha (\beta - r)\, y + (\gamma + \beta - r)\, x && \text{for } x > 0

with :math:`r = \sqrt{x^2 + y^2}`. In polar coordinates both sides have closed solutions.
"""

from __future__ import annotations

from saltus.language import hypot, piecewise
from saltus.models.model import model


@model(
    states={"x": "1", "y": "1"},
    source="H. Dankowicz, F. Schilder, Recipes for Continuation, SIAM (2013), example 10.3; "
    "the demo `piecewise` of COCO.",
)
def switched_rotor(t, x, y, *, attraction=1.0, radius=2.0, excess_rate=1.5):
    r"""Planar rotation that is drawn to another circle on either side of a line (COCO, piecewise).

    States are ``x`` and ``y``; all is dimensionless. It isn't forced.

    ============  =======  =======  ==========================================================
    parameter     symbol   default  meaning
    ============  =======  =======  ==========================================================
    attraction    alpha    1        to the circle, for x > 0
    radius        beta     2        of the circle, for x > 0
    excess_rate   gamma    1.5      rate of rotation on that circle
    ============  =======  =======  ==========================================================

    Notes
    -----
    At the default values there is a limit cycle of period 4.810271605994165 with the multiplier
    0.002430511420186203: for x < 0, :math:`\dot r = r (1 - r)` lasts :math:`\pi`; for x > 0,
    :math:`\dot r = \alpha r (\beta - r)` lasts until the angle has grown by :math:`\pi`.
    """
    r, right = hypot(x, y), x > 0
    pull = piecewise((attraction * (radius - r), right), otherwise=1 - r)
    turn = piecewise((excess_rate + radius - r, right), otherwise=1)
    return pull * x - turn * y, pull * y + turn * x
