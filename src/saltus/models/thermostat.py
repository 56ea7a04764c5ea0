r"""A room that a thermostat heats.

.. math::
    \dot T = -a\, (T - T_0) + b\, h

The heater h switches off (0) where T passes the upper limit and on (1) where it passes the lower
one.
"""

from __future__ import annotations

from saltus.contact import jump
from saltus.models.model import model


@model(
    states={"temperature": "1", "heater": "1"},
    source="M. Calvo, J. I. Montijano, L. Randez, Algorithm 968: DISODE45, ACM Trans. Math. Softw. "
    "43(3), 25 (2016), example 6.",
)
def thermostat(
    t, temperature, heater, *, loss=0.1, outside=18.0, heating=2.0, lower=22.0, upper=23.5
):
    r"""Room with a thermostat: a relay with hysteresis (DISODE45, example 6).

    States are the ``temperature`` [degrees Celsius] and the ``heater``, 1 or 0. It isn't forced.

    ===========  =======  ========  ==============================================================
    parameter    symbol   default   meaning
    ===========  =======  ========  ==============================================================
    loss         a        0.1       rate at which the room cools
    outside      T_0      18
    heating      b        2         rate at which the heater warms it
    lower                 22        where the heater is switched on
    upper                 23.5      where it is switched off
    ===========  =======  ========  ==============================================================

    Notes
    -----
    From 15 degrees with the heater on, it is switched at 4.6134556650262, 7.7979929762116,
    8.7823937043441.
    """
    return (
        -loss * (temperature - outside) + heating * heater,
        0.0,
        jump(temperature > upper, heater=0.0),
        jump(temperature < lower, heater=1.0),
    )
