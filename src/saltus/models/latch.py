r"""An oscillator that a latch holds: a spring engages above one place, and lets go below another.

.. math::
    \ddot x + c \dot x + x + k\, m\, x = F \cos \omega t, \qquad
    m: 0 \to 1 \text{ at } x = h \text{ upwards}, \quad 1 \to 0 \text{ at } x = l \text{ downwards}
"""

from __future__ import annotations

from saltus.contact import jump
from saltus.language import cos
from saltus.models.model import model


@model(
    states={"x": "1", "v": "1", "m": "1"},
    forced_at="frequency",
    source="M. A. Krasnosel'skii, A. V. Pokrovskii, Systems with Hysteresis, Springer (1989), "
    "chapter 4: the non-ideal relay.",
)
def latch(
    t, x, v, m, *, damping=0.0, stiffness=3.0, upper=1.0, lower=0.5, force=0.0, frequency="1 rad/s"
):
    r"""Oscillator with a latch (non-ideal relay): a memory of 0 and 1 by jumps.

    States are ``x``, ``v`` and ``m``, which is 1 while the latch holds; all is dimensionless. It is
    forced at ``frequency``.

    =========  =======  ========  ==============================================================
    parameter  symbol   default   meaning
    =========  =======  ========  ==============================================================
    damping    c        0
    stiffness  k        3         of the latch's spring
    upper      h        1         where the latch engages
    lower      l        0.5       where it lets go
    force      F        0
    frequency  omega    1 rad/s
    =========  =======  ========  ==============================================================

    Notes
    -----
    Without damping and force the mass gains the energy k (h^2 - l^2)/2 in each turn: the latch
    engages with its spring drawn to h, and lets go when it is drawn to l.
    """
    return (
        v,
        force * cos(frequency * t) - damping * v - x - stiffness * m * x,
        0.0,
        jump(x > upper, m=1.0),
        jump(x < lower, m=0.0),
    )
