r"""A forced oscillator with Coulomb friction.

.. math::
    m \ddot x + k x + f\, \operatorname{sign} \dot x = F \cos \omega t

The sign is Filippov's: at rest the friction is whatever holds the mass, up to f.
"""

from __future__ import annotations

from saltus.contact import friction
from saltus.language import cos
from saltus.models.model import model


@model(
    states={"x": "1", "v": "1"},
    forced_at="frequency",
    source="J. P. den Hartog, Forced vibrations with combined Coulomb and viscous friction, Trans. "
    "ASME 53, 107-115 (1931).",
)
def den_hartog(
    t, x, v, *, mass=1.0, stiffness=1.0, friction_force=0.2, force=1.0, frequency="0.6 rad/s"
):
    r"""Forced oscillator with Coulomb friction: it moves on, or stops twice a cycle (den Hartog).

    States are ``x`` and ``v``; all is dimensionless. It is forced at ``frequency``.

    ===============  =======  ==========  =======================================================
    parameter        symbol   default     meaning
    ===============  =======  ==========  =======================================================
    mass             m        1
    stiffness        k        1
    friction_force   f        0.2
    force            F        1           amplitude
    frequency        omega    0.6 rad/s
    ===============  =======  ==========  =======================================================

    Notes
    -----
    At the default values it moves without stops, with the amplitude 1.5506028546868353. At omega =
    0.5 and f = 0.5 it stops twice a cycle, 1.0997616902589446 each time, and its amplitude is
    1.3034292041955001. At half the natural frequency the symmetric response has no stops up to f =
    F/3, and isn't isolated.
    """
    rubbing = friction(v, slip=friction_force)
    return v, (force * cos(frequency * t) - stiffness * x - rubbing) / mass
