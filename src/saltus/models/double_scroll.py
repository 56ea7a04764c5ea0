r"""Chua's circuit.

.. math::
    \dot x = \alpha\, (y - x - h(x)), \qquad \dot y = x - y + z, \qquad \dot z = -\beta y, \qquad
    h = m_1 x + \tfrac12 (m_0 - m_1) \left(|x + 1| - |x - 1|\right)
"""

from __future__ import annotations

from saltus.contact import freeplay
from saltus.models.model import model


@model(
    states={"x": "1", "y": "1", "z": "1"},
    source="T. Matsumoto, L. O. Chua, M. Komuro, The double scroll, IEEE Trans. Circuits Syst. "
    "32(8), 797-818 (1985).",
)
def double_scroll(t, x, y, z, *, alpha=9.0, beta=100 / 7, inner_slope=-8 / 7, outer_slope=-5 / 7):
    """Chua's circuit, the double scroll: a resistor of three slopes, and chaos (Matsumoto et al.).

    States are ``x``, ``y`` (voltages) and ``z`` (a current); all is dimensionless. It isn't forced.

    ============  =======  ========  ===========================================================
    parameter     symbol   default   meaning
    ============  =======  ========  ===========================================================
    alpha         alpha    9
    beta          beta     100/7
    inner_slope   m_0      -8/7      of the resistor for abs(x) < 1
    outer_slope   m_1      -5/7      beyond
    ============  =======  ========  ===========================================================

    Notes
    -----
    It rests at x = -1.5, 0 and 1.5, all unstable. The three exponents add up to the divergence, in
    the mean: alpha*(-1 - slope) - 1, inside and beyond.
    """
    resistor = inner_slope * x + freeplay(x, stiffness=outer_slope - inner_slope, gap=1.0)
    return alpha * (y - x - resistor), x - y + z, -beta * y
