r"""Two rates that depend on which of two states is ahead: a test of chattering.

.. math::
    \dot x = \begin{cases} -2 & x > y \\ 2 & x < y \end{cases}, \qquad
    \dot y = \begin{cases} 1.5 & x > y \\ -3 & x < y \end{cases}
"""

from __future__ import annotations

from saltus.language import piecewise
from saltus.models.model import model


@model(
    states={"x": "1", "y": "1"},
    source="OpenModelica, issue 12190, TestChattering.Test1.",
)
def chattering_pair(t, x, y, *, x_ahead=-2.0, x_behind=2.0, y_behind=1.5, y_ahead=-3.0):
    r"""Two rates that depend on which of two states is ahead (OpenModelica, TestChattering).

    States are ``x`` and ``y``; all is dimensionless. It isn't forced.

    =================  =========  ================================================================
    parameter          default    meaning
    =================  =========  ================================================================
    x_ahead, x_behind  -2, 2      rate of x where x > y, x < y
    y_behind, y_ahead  1.5, -3    rate of y where x > y, x < y
    =================  =========  ================================================================

    Notes
    -----
    From (1.5, 1) the two meet at t = 1/7, and from then on slide together at the rate -3/8.5. Steps
    in time that evaluate one side or the other never get past it.
    """
    ahead = x > y
    return piecewise((x_ahead, ahead), otherwise=x_behind), piecewise(
        (y_behind, ahead), otherwise=y_ahead
    )
