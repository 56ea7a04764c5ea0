r"""A rigid rod that slides with one end on a rough floor: Painleve's paradox.

.. math::
    m \ddot x = -\mu N \operatorname{sign} s, \qquad m \ddot y = N - m g, \qquad
    J \ddot\theta = -l N (\cos\theta - \mu \sin\theta \operatorname{sign} s), \qquad
    J = \tfrac13 m l^2

where N >= 0 is the force of the floor on the end at :math:`y - l \sin\theta`, which slides at s.
"""

from __future__ import annotations

from saltus.contact import impact
from saltus.language import cos, sin
from saltus.models.model import model


@model(
    states={"x": "1", "y": "1", "tilt": "1", "u": "1", "v": "1", "turn": "1"},
    source="P. Painleve, Sur les lois du frottement de glissement, C. R. Acad. Sci. 121 (1895) "
    "112-115; F. Genot, B. Brogliato, New results on Painleve paradoxes, Eur. J. Mech. A/Solids "
    "18(4), 653-677 (1999).",
)
def painleve_rod(
    t, x, y, tilt, u, v, turn, *, mass=1.0, half_length=1.0, gravity=1.0, friction=1.4
):
    r"""Slender rod that slides with one end on a rough floor, of which rigid bodies know no motion
    where friction is large (Painleve).

    States are the centre ``x`` and ``y``, the ``tilt`` [rad] from the floor, and their rates ``u``,
    ``v`` and ``turn``; all is dimensionless. It isn't forced.

    ===========  ==============  ========  =======================================================
    parameter    symbol          default   meaning
    ===========  ==============  ========  =======================================================
    mass         m               1
    half_length  l               1
    gravity      g               1
    friction     :math:`\mu`     1.4       of the end on the floor
    ===========  ==============  ========  =======================================================

    Notes
    -----
    A unit of the floor's force adds :math:`(1 + 3\cos^2\theta - 3\mu\sin\theta\cos\theta)/m` to the
    acceleration of the end away from the floor, where the end slides to the side to which the rod
    leans. From :math:`\mu = 4/3` on, first at :math:`\tan\theta = 2`, that is negative: status
    ``painleve``.
    """
    end = impact(
        y > half_length * sin(tilt),
        half_length * cos(tilt) * turn - v,
        restitution=0,
        inertia={"u": mass, "v": mass, "turn": mass * half_length**2 / 3},
        friction=friction,
        slip_velocity=u + half_length * sin(tilt) * turn,
    )
    return u, v, turn, 0.0, -gravity, 0.0, end
