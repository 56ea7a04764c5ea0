r"""Two blocks joined by a spring, each on a floor of two kinds: example 1 of DISODE45.

.. math::
    \ddot y_1 = -E\, (y_1 - y_2) - \mu_1 \operatorname{sign} \dot y_1, \qquad
    \ddot y_2 = -E\, (y_2 - y_1) - \mu_2 \operatorname{sign} \dot y_2

:math:`\mu_i` depends on the sign of :math:`y_i`.
"""

from __future__ import annotations

from saltus.contact import friction
from saltus.language import piecewise
from saltus.models.model import model


@model(
    states={"y1": "1", "y2": "1", "v1": "1", "v2": "1"},
    source="M. Calvo, J. I. Montijano, L. Randez, Algorithm 968: DISODE45, ACM Trans. Math. Softw. "
    "43(3), 25 (2016), example 1.",
)
def two_blocks(
    t,
    y1,
    y2,
    v1,
    v2,
    *,
    spring=1.0,
    first_right=1.0,
    first_left=0.6,
    second_right=0.2,
    second_left=0.5,
):
    r"""Two blocks joined by a spring on floors of two kinds (DISODE45, example 1).

    States are ``y1``, ``y2`` and their rates ``v1``, ``v2``; all is dimensionless. It isn't forced.

    ==========================  ========  =======================================================
    parameter                   default   meaning
    ==========================  ========  =======================================================
    spring                      1         E, between the blocks
    first_right, first_left     1, 0.6    friction of the first block where y1 > 0, y1 < 0
    second_right, second_left   0.2, 0.5  friction of the second block where y2 > 0, y2 < 0
    ==========================  ========  =======================================================

    Notes
    -----
    From (-2, 3, 0, 0) there are 18 switches up to t = 12, the first at 1.0524788191283, the last at
    10.8197283087107; the paper prints 1.05248095 and 10.82038526.
    """
    first = piecewise((first_right, y1 > 0), otherwise=first_left)
    second = piecewise((second_right, y2 > 0), otherwise=second_left)
    pull = spring * (y1 - y2)
    return v1, v2, -pull - friction(v1, slip=first), pull - friction(v2, slip=second)
