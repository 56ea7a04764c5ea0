r"""A slender block that rocks on a floor at rest: Housner's block.

.. math::
    \ddot \theta = p^2 (\theta - \alpha), \quad \theta \ge 0, \qquad
    \dot \theta^+ = -r\, \dot \theta^- \text{ at } \theta = 0

:math:`\theta` is the tilt, counted from the side to which the block leans: on a floor at rest both
sides are alike, and the block that passes through the upright position is the block that is thrown
back at it.
"""

from __future__ import annotations

from saltus.contact import impact
from saltus.models.model import model


@model(
    states={"tilt": "1", "rate": "1"},
    source="G. W. Housner, The behavior of inverted pendulum structures during earthquakes, Bull. "
    "Seism. Soc. Am. 53, 403-417 (1963); own values.",
)
def rocking_block(t, tilt, rate, *, frequency_parameter=2.0, slenderness=0.25, restitution=0.9):
    r"""Slender block that rocks on a floor at rest until it stands still (Housner).

    States are the ``tilt`` [rad], which is never negative, and its ``rate``. It isn't forced.

    ===================  =======  ========  ======================================================
    parameter            symbol   default   meaning
    ===================  =======  ========  ======================================================
    frequency_parameter  p        2         of the block as a pendulum [1/s]
    slenderness          alpha    0.25      tilt at which it overturns [rad]
    restitution          r        0.9       rate after over rate before, from one edge to the other
    ===================  =======  ========  ======================================================

    Notes
    -----
    Tilted to 0.1 and released, it stands upright first at
    :math:`\operatorname{arcosh}(1/(1 - \theta_0/\alpha))/p` = 0.54930614433405485 and has stopped
    rocking, after infinitely many impacts, at 8.3459087705189705.
    """
    fall = frequency_parameter**2 * (tilt - slenderness)
    return rate, fall, impact(tilt > 0, -rate, restitution=restitution)
