r"""A Duffing oscillator under bang-bang excitation: Dankowicz and Schilder's example 17.3.

.. math::
    \ddot x + \lambda \dot x + \alpha x + \varepsilon x^3 = \pm A

The force is :math:`+A` in the first half of each period, :math:`-A` in the second.
"""

from __future__ import annotations

from saltus.language import square
from saltus.models.model import model


@model(
    states={"x": "1", "v": "1"},
    forced_at="frequency",
    source="H. Dankowicz, F. Schilder, Recipes for Continuation, SIAM (2013), example 17.3; the "
    "demo `bangbang` of COCO.",
)
def bang_bang(t, x, v, *, damping=0.2, stiffness=1.0, cubic=1.0, force=26.0, frequency="1 rad/s"):
    """Duffing oscillator under a force that is constant but for its sign (COCO, bangbang).

    States are ``x`` and ``v``; all is dimensionless. It is forced at ``frequency``.

    ===========  =======  ========  ============================================================
    parameter    symbol   default   meaning
    ===========  =======  ========  ============================================================
    damping      lambda   0.2
    stiffness    alpha    1
    cubic        eps      1
    force        A        26
    frequency    omega    1 rad/s   of the change of sign; the example varies it
    ===========  =======  ========  ============================================================

    Notes
    -----
    The force flips at instants that are known, so there are no contacts. Without the cubic term
    each half period is an arc of a damped oscillation, and the response is a closed form. Each
    response has a mirror twin, half a period later, unless it is its own.
    """
    drive = force * square(frequency * t)
    return v, drive - damping * v - stiffness * x - cubic * x**3
