r"""A mass on a spring that bounces on a stop at the spring's place of rest: Siconos' linear
oscillator.

.. math::
    m \ddot x = -k x - m g, \quad x \ge 0, \qquad \dot x^+ = -e\, \dot x^- \text{ at } x = 0
"""

from __future__ import annotations

from saltus.contact import impact
from saltus.models.model import model


@model(
    states={"x": "m", "v": "m/s"},
    source="Siconos, example LinearOscillatorED.",
)
def dropped_oscillator(
    t, x, v, *, mass="0.001 kg", stiffness="100 N/m", gravity="9.81 m/s^2", restitution=0.9
):
    r"""Mass on a spring, with weight, that bounces on a stop until it rests (Siconos).

    States are the height ``x`` [m] and ``v`` [m/s]. It isn't forced.

    ============  =======  ===========  ==========================================================
    parameter     symbol   default      meaning
    ============  =======  ===========  ==========================================================
    mass          m        0.001 kg
    stiffness     k        100 N/m
    gravity       g        9.81 m/s^2
    restitution   e        0.9
    ============  =======  ===========  ==========================================================

    Notes
    -----
    Released at 1 m it strikes the stop first at 0.0049669839438886324 s, then at
    0.014900882900775434 s; each flight at speed v lasts :math:`2 \arctan(v \omega/g)/\omega`, with
    :math:`\omega^2 = k/m`.
    """
    return v, -stiffness * x / mass - gravity, impact(x > 0, -v, restitution=restitution)
