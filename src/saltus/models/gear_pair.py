r"""A spur gear pair with backlash: one degree of freedom along the line of action.

.. math::
    m \ddot x + 2 \zeta \sqrt{k m}\, \dot x
        + k \left(1 + \kappa \cos 2 \pi f t\right) g(x) = F_m + F_a \cos 2 \pi f t

    g = x - b \text{ for } x > b, \qquad x + b \text{ for } x < -b, \qquad 0 \text{ between}

:math:`x` is the dynamic transmission error: how far the pinion is ahead of the gear, measured along
the line of action. The teeth are apart in :math:`|x| < b`; below :math:`-b` their backs touch.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from saltus.contact import freeplay
from saltus.language import cos, pi, sin, sqrt
from saltus.models.model import model


@model(
    states={"x": "m", "v": "m/s"},
    forced_at="mesh_frequency",
    source="A. Kahraman, R. Singh, Non-linear dynamics of a spur gear pair, J. Sound Vib. 142(1), "
    "49-75 (1990); own values.",
)
def gear_pair(
    t,
    x,
    v,
    *,
    mesh_mass="0.25 kg",
    damping_ratio=0.05,
    mesh_stiffness="4e8 N/m",
    stiffness_variation=0.2,
    gap="20 um",
    mean_force="800 N",
    alternating_force="400 N",
    mesh_frequency="6e3 Hz",
):
    """Spur gear pair with backlash and varying mesh stiffness (after Kahraman and Singh).

    States are the dynamic transmission error ``x`` [m] and its rate ``v`` [m/s]; it is forced at
    ``mesh_frequency``.

    ===================  =======  ===========  =====================================================
    parameter            symbol   default      meaning
    ===================  =======  ===========  =====================================================
    mesh_mass            m        0.25 kg      1/(r_p^2/I_p + r_g^2/I_g), on the line of action
    damping_ratio        zeta     0.05         of the mesh
    mesh_stiffness       k        400 MN/m     mean
    stiffness_variation  kappa    0.2          first harmonic, relative to the mean
    gap                  b        20 µm        half of the backlash
    mean_force           F_m      800 N        transmitted torque over base radius
    alternating_force    F_a      400 N        from transmission error and torque fluctuation
    mesh_frequency       f        6 kHz        teeth a second
    ===================  =======  ===========  =====================================================

    Notes
    -----
    The equation of A. Kahraman and R. Singh, Non-linear dynamics of a spur gear pair, Journal of
    Sound and Vibration 142(1), 49-75 (1990), with the first harmonic of the mesh stiffness added,
    as the same authors did later. The values are chosen here: F_m/(k b) = 0.1, F_a/(k b) = 0.05,
    natural frequency 6366 Hz. While the teeth stay in contact the system is linear in x; so it is
    up to 5 kHz. At 6 kHz the teeth part once in each mesh period, and x swings between 18.05 µm and
    25.74 µm.
    """
    wave = cos(2 * pi * mesh_frequency * t)
    mesh = freeplay(x, stiffness=mesh_stiffness, gap=gap) * (1 + stiffness_variation * wave)
    damper = 2 * damping_ratio * sqrt(mesh_stiffness * mesh_mass) * v
    return v, (mean_force + alternating_force * wave - damper - mesh) / mesh_mass


# -- energy ----------------------------------------------------------------------------------------
def _stored(t, x, v, *, mesh_mass, mesh_stiffness, stiffness_variation, gap, mesh_frequency):
    """Energy of the gears and of the teeth, with their stiffness at this time."""
    stiffness = mesh_stiffness * (1 + stiffness_variation * cos(2 * pi * mesh_frequency * t))
    return mesh_mass * v**2 / 2 + stiffness * freeplay(x, stiffness=1.0, gap=gap) ** 2 / 2


def _supplied(
    t,
    x,
    v,
    *,
    mesh_stiffness,
    stiffness_variation,
    gap,
    mean_force,
    alternating_force,
    mesh_frequency,
):
    """Power of the two forces, and of the change of stiffness while the teeth are bent."""
    w = 2 * pi * mesh_frequency
    stiffening = -mesh_stiffness * stiffness_variation * w * sin(w * t)
    return (mean_force + alternating_force * cos(w * t)) * v + stiffening * freeplay(
        x, stiffness=1.0, gap=gap
    ) ** 2 / 2


def _dissipated(v, *, mesh_mass, damping_ratio, mesh_stiffness):
    """Power dissipated by the damping of the mesh."""
    return 2 * damping_ratio * sqrt(mesh_stiffness * mesh_mass) * v**2


#: Stored energy [J], power supplied and dissipated [W].
ENERGY: dict[str, Callable[..., Any]] = {
    "energy": _stored,
    "supplied": _supplied,
    "dissipated": _dissipated,
}
