r"""An oscillator with a secondary spring on one side: the bilinear rig of Ing, Pavlovskaia and
Wiercigroch.

.. math::
    \ddot x + 2 \zeta \dot x + x + \beta\, (x - e)\, H(x - e) = a\, \omega^2 \sin \omega t

Time is in units of the reciprocal natural frequency, lengths in units of a reference length.
"""

from __future__ import annotations

from saltus.contact import freeplay
from saltus.language import sin
from saltus.models.model import model


@model(
    states={"x": "1", "v": "1"},
    forced_at="frequency",
    source="J. Ing, E. Pavlovskaia, M. Wiercigroch, S. Banerjee, Experimental study of impact "
    "oscillator with one-sided elastic constraint, Phil. Trans. R. Soc. A 366, 679-705 (2008).",
)
def bilinear_rig(
    t,
    x,
    v,
    *,
    damping_ratio=0.01,
    stiffness_ratio=29.0,
    gap=1.26,
    amplitude=0.7,
    frequency="0.85 rad/s",
):
    r"""Oscillator on a shaken base with a stiff spring behind a gap on one side (Ing et al.).

    States are ``x`` and ``v``; all is dimensionless. It is forced at ``frequency``.

    ================  =======  ===========  ====================================================
    parameter         symbol   default      meaning
    ================  =======  ===========  ====================================================
    damping_ratio     zeta     0.01
    stiffness_ratio   beta     29           of the secondary spring to the primary one
    gap               e        1.26
    amplitude         a        0.7          of the base
    frequency         omega    0.85 rad/s   of the base, over the natural frequency
    ================  =======  ===========  ====================================================

    Notes
    -----
    The response without contact grazes the secondary spring where
    :math:`a \omega^2 = e\,|1 - \omega^2 + 2 i \zeta \omega|`: at the default values at
    omega = 0.80192810659323548.
    """
    spring = freeplay(x, stiffness=stiffness_ratio, upper_gap=gap)
    shaking = amplitude * frequency**2 * sin(frequency * t)
    return v, shaking - 2 * damping_ratio * v - x - spring
