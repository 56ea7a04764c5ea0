r"""A mass that falls onto an elastic stop: code_aster's test SDND108.

.. math::
    m \ddot x = -m g - K\, (x + j)\, H(-x - j)
"""

from __future__ import annotations

from saltus.contact import freeplay
from saltus.models.model import model


@model(
    states={"x": "m", "v": "m/s"},
    source="code_aster, Validation manual, test SDND108 (mass thrown onto an elastic stop).",
)
def thrown_mass(t, x, v, *, mass="1 kg", gravity="10 m/s^2", stop_stiffness="100 N/m", gap="2 m"):
    r"""Mass that falls onto an elastic stop (code_aster, SDND108).

    States are the height ``x`` [m] and ``v`` [m/s]. It isn't forced.

    ===============  =======  ==========  ====================================================
    parameter        symbol   default     meaning
    ===============  =======  ==========  ====================================================
    mass             m        1 kg
    gravity          g        10 m/s^2
    stop_stiffness   K        100 N/m
    gap              j        2 m         the stop begins at x = -gap
    ===============  =======  ==========  ====================================================

    Notes
    -----
    From x = 0 at -1 m/s the mass meets the stop after :math:`(\sqrt{41} - 1)/10` =
    0.5403124237432849 s and leaves it at 0.8854561530764269 s.
    """
    return v, -gravity - freeplay(x, stiffness=stop_stiffness, lower_gap=gap) / mass
