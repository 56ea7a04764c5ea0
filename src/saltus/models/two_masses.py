r"""Two masses with a stiff spring behind a gap on one side: example 3 of NLvib.

.. math::
    m_1 \ddot x_1 &= -k_{12} (x_1 - x_2) - d_{12} (\dot x_1 - \dot x_2)
        - K\, (x_1 - g)\, H(x_1 - g) \\
    m_2 \ddot x_2 &= \phantom{-} k_{12} (x_1 - x_2) + d_{12} (\dot x_1 - \dot x_2)
        - k_2 x_2 - d_2 \dot x_2 + F \cos \omega t

with :math:`d = \delta k` for each of the two springs.
"""

from __future__ import annotations

from saltus.contact import freeplay
from saltus.language import cos
from saltus.models.model import model


@model(
    states={"x1": "1", "x2": "1", "v1": "1", "v2": "1"},
    forced_at="frequency",
    source="M. Krack, J. Gross, Harmonic Balance for Nonlinear Vibration Problems, Springer "
    "(2019); NLvib, example 03 (two degrees of freedom, unilateral spring).",
)
def two_masses(
    t,
    x1,
    x2,
    v1,
    v2,
    *,
    first_mass=1.0,
    second_mass=1.0,
    coupling=1.0,
    ground=1.0,
    loss=0.03,
    stop_stiffness=100.0,
    gap=1.0,
    force=0.1,
    frequency="0.7 rad/s",
):
    """Two masses with a stiff spring behind a gap on one side (NLvib, example 03).

    States are ``x1``, ``x2`` and their rates ``v1``, ``v2``; all is dimensionless. It is forced at
    ``frequency``.

    ===============  =======  ==========  =======================================================
    parameter        symbol   default     meaning
    ===============  =======  ==========  =======================================================
    first_mass       m_1      1           meets the stop
    second_mass      m_2      1           is forced
    coupling         k_12     1           spring between the masses
    ground           k_2      1           spring from the second mass to the ground
    loss             delta    0.03        damper over spring, for both springs
    stop_stiffness   K        100
    gap              g        1
    force            F        0.1         amplitude, on the second mass
    frequency        omega    0.7 rad/s
    ===============  =======  ==========  =======================================================

    Notes
    -----
    NLvib reports a period doubling near the peak of the resonance, a stable response at 0.635 and
    Neimark-Sacker bifurcations near 0.6. Here: the fold at the peak stands at 0.755627352609, a
    period doubling at 0.738783025373, a Neimark-Sacker bifurcation at 0.618606874267.
    """
    between = coupling * (x1 - x2) + loss * coupling * (v1 - v2)
    stop = freeplay(x1, stiffness=stop_stiffness, upper_gap=gap)
    support = ground * x2 + loss * ground * v2
    drive = force * cos(frequency * t)
    return v1, v2, -(between + stop) / first_mass, (drive + between - support) / second_mass
