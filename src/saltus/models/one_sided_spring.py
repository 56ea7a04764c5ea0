r"""A free oscillator with a second spring behind a gap on one side: code_aster's test SDND122.

.. math::
    m \ddot x + k x + K\, (x - g)\, H(x - g) = 0
"""

from __future__ import annotations

from saltus.contact import freeplay
from saltus.models.model import model


@model(
    states={"x": "m", "v": "m/s"},
    source="code_aster, Validation manual, test SDND122 (free oscillation with a one-sided stop).",
)
def one_sided_spring(
    t, x, v, *, mass="1 kg", stiffness="10 N/m", stop_stiffness="50 N/m", gap="0.01 m"
):
    """Free oscillator with a second spring behind a gap on one side (code_aster, SDND122).

    States are ``x`` [m] and ``v`` [m/s]. It isn't forced.

    ===============  =======  ==========  ====================================================
    parameter        symbol   default     meaning
    ===============  =======  ==========  ====================================================
    mass             m        1 kg
    stiffness        k        10 N/m      always acts
    stop_stiffness   K        50 N/m
    gap              g        0.01 m
    ===============  =======  ==========  ====================================================

    Notes
    -----
    At an energy of 0.00650108331626 J the frequency is 0.646631040639837 Hz, by two arcs of
    harmonic motion. The manual prints 0.64621695 Hz; its formula leaves a term out.
    """
    return v, -(stiffness * x + freeplay(x, stiffness=stop_stiffness, upper_gap=gap)) / mass
