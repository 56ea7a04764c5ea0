r"""An oscillator with a rigid stop on one side.

.. math::
    \ddot x + c \dot x + k x = A \cos \omega t, \quad x \le d, \qquad
    \dot x^+ = -e\, \dot x^- \text{ at } x = d
"""

from __future__ import annotations

from saltus.contact import impact
from saltus.language import cos
from saltus.models.model import model

#: Values of publications.
CASES = {
    "recipes": {},
    "thompson": {"damping": 0.0, "gap": 0.0, "frequency": "2.7 rad/s"},
    "chatter": {"restitution": 0.6, "gap": 0.2, "frequency": "0.3 rad/s"},
}


@model(
    states={"x": "1", "v": "1"},
    forced_at="frequency",
    source="H. Dankowicz, F. Schilder, Recipes for Continuation, SIAM (2013), example 15.2; J. M. "
    "T. Thompson, R. Ghaffari, Phys. Lett. A 91, 5-8 (1982); C. Budd, F. Dux, Phil. Trans. R. Soc. "
    "A 347, 365-389 (1994).",
    cases=CASES,
    case="recipes",
)
def impact_oscillator(
    t, x, v, *, stiffness=1.0, damping=0.1, force=1.0, gap=1.0, restitution=0.8, frequency="1 rad/s"
):
    r"""Oscillator with a rigid stop on one side (COCO; Thompson and Ghaffari; Budd and Dux).

    States are ``x`` and ``v``; all is dimensionless. It is forced at ``frequency``.

    ============  =======  =========  ============================================================
    parameter     symbol   default    meaning
    ============  =======  =========  ============================================================
    stiffness     k        1
    damping       c        by case
    force         A        1          amplitude
    gap           d        by case    the stop is at x = d
    restitution   e        by case
    frequency     omega    by case
    ============  =======  =========  ============================================================

    Parameters
    ----------
    case : {"recipes", "thompson", "chatter"}
        (damping, gap, restitution, frequency): recipes = (0.1, 1, 0.8, 1), of COCO's demo `impact`;
        thompson = (0, 0, 0.8, 2.7), the stop at the place of rest, no damping; chatter = (0.1, 0.2,
        0.6, 0.3), where impacts accumulate and the mass then rests on the stop.

    Notes
    -----
    An orbit with one impact in n forcing periods is a closed form. Recipes: one impact a period
    with the velocity 1.695732937594882 before it. Thompson: that with one impact a period doubles
    its period at omega = 2.6533477278553229, whatever the force; the paper prints 2.653. Chatter:
    the mass leaves the stop at acos(k d/A)/omega = 4.5647946866818861 and is at rest on it again at
    20.0978528953867.
    """
    push = force * cos(frequency * t) - damping * v - stiffness * x
    return v, push, impact(x < gap, v, restitution=restitution)
