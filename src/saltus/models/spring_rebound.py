r"""A mass on a spring that strikes a stop: code_aster's test SDND101.

.. math::
    m \ddot x + k x + K\, (x - g)\, H(x - g) = 0
"""

from __future__ import annotations

from saltus.contact import freeplay
from saltus.models.model import model


@model(
    states={"x": "m", "v": "m/s"},
    source="code_aster, Validation manual, test SDND101 (mass and spring against a stop).",
)
def spring_rebound(
    t, x, v, *, mass="100 kg", stiffness="1e4 N/m", stop_stiffness="1e6 N/m", gap="0 m"
):
    r"""Mass on a spring that strikes a stop (code_aster, SDND101).

    States are ``x`` [m] and ``v`` [m/s]. It isn't forced.

    ===============  =======  ==========  ====================================================
    parameter        symbol   default     meaning
    ===============  =======  ==========  ====================================================
    mass             m        100 kg
    stiffness        k        10 kN/m     always acts
    stop_stiffness   K        1 MN/m
    gap              g        0 m
    ===============  =======  ==========  ====================================================

    Notes
    -----
    From x = 0 at v0 = 1 m/s the first contact lasts :math:`\pi/\omega`, with
    :math:`\omega^2 = (k + K)/m`: 0.0312600152681233 s. The largest force on the stop is
    :math:`K v_0/\omega` = 9950.37190209989 N, its impulse :math:`2 K v_0/\omega^2` =
    198.019801980198 N*s.
    """
    return v, -(stiffness * x + freeplay(x, stiffness=stop_stiffness, upper_gap=gap)) / mass
