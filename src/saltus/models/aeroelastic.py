r"""A typical wing section with freeplay in pitch, in a quasi-steady flow.

.. math::
    m \ddot h + m x_\alpha b\, \ddot\alpha + c_h \dot h + k_h h &= -L \\
    m x_\alpha b\, \ddot h + I_\alpha \ddot\alpha + c_\alpha \dot\alpha + f(\alpha) &= M

    L = \rho U^2 b\, c_l \alpha_e, \qquad
    M = \rho U^2 b^2 \left(\tfrac12 + a\right) c_l \alpha_e, \qquad
    \alpha_e = \alpha + \frac{\dot h}{U} + \left(\tfrac12 - a\right) \frac{b \dot\alpha}{U}

:math:`h` is the plunge (down), :math:`\alpha` the pitch (nose up) about the elastic axis at
:math:`a b` behind mid-chord; the moment :math:`f` of the pitch spring is zero inside the freeplay.
Lengths are per half-chord :math:`b`, loads per unit span.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from saltus.contact import freeplay
from saltus.models.model import model


@model(
    states={"plunge": "m", "pitch": "rad", "plunge_rate": "m/s", "pitch_rate": "rad/s"},
    source="Typical section; values after the Texas A&M pitch-and-plunge apparatus (O'Neil, "
    "Strganac); pitch spring with freeplay.",
)
def aeroelastic(
    t,
    plunge,
    pitch,
    plunge_rate,
    pitch_rate,
    *,
    airspeed="12 m/s",
    mass="12.4 kg/m",
    inertia="0.065 kg*m",
    imbalance=0.25,
    half_chord="0.135 m",
    elastic_axis=-0.6,
    plunge_stiffness="2840 N/m^2",
    pitch_stiffness="40 N/rad",
    pitch_gap="0.01 rad",
    plunge_damping="27.4 N*s/m^2",
    pitch_damping="0.036 N*s/rad",
    air_density="1.225 kg/m^3",
    lift_slope="6.28 1/rad",
):
    """Typical wing section with freeplay in pitch, quasi-steady flow.

    States are ``plunge`` [m], ``pitch`` [rad] and their rates ``plunge_rate`` [m/s], ``pitch_rate``
    [rad/s]. It isn't forced: in a range of airspeeds it oscillates by itself. Masses, springs,
    dampers and loads are per unit span.

    ==================  =========  =================  ==============================================
    parameter           symbol     default            meaning
    ==================  =========  =================  ==============================================
    airspeed            U          12 m/s
    mass                m          12.4 kg/m
    inertia             I_alpha    0.065 kg*m         about the elastic axis
    imbalance           x_alpha    0.25               centre of mass behind the elastic axis, in b
    half_chord          b          0.135 m
    elastic_axis        a          -0.6               position behind mid-chord, in b
    plunge_stiffness    k_h        2840 N/m^2
    pitch_stiffness     k_alpha    40 N/rad           beyond the freeplay
    pitch_gap           delta      0.01 rad           half of the freeplay
    plunge_damping      c_h        27.4 N*s/m^2
    pitch_damping       c_alpha    0.036 N*s/rad
    air_density         rho        1.225 kg/m^3
    lift_slope          c_l        6.28 /rad
    ==================  =========  =================  ==============================================

    Notes
    -----
    The equations are those of every text on aeroelasticity; the values follow the pitch-and-plunge
    apparatus of Texas A&M University (O'Neil and Strganac), rounded, with a stiffer, linear pitch
    spring behind a freeplay in place of its nonlinear one.

    At 12 m/s rest inside the freeplay and an oscillation of 0.0452 rad at 3.73 Hz are both stable;
    the latter is reached from pitch = 0.02 rad at rest. Without freeplay the section is linear; it
    flutters from 13.5002 m/s on.
    """
    incidence = (
        pitch + plunge_rate / airspeed + (0.5 - elastic_axis) * half_chord * pitch_rate / airspeed
    )
    lift = air_density * airspeed**2 * half_chord * lift_slope * incidence
    moment = (0.5 + elastic_axis) * half_chord * lift
    down = -lift - plunge_damping * plunge_rate - plunge_stiffness * plunge
    turn = (
        moment
        - pitch_damping * pitch_rate
        - freeplay(pitch, stiffness=pitch_stiffness, gap=pitch_gap)
    )
    coupling = mass * imbalance * half_chord
    determinant = mass * inertia - coupling**2
    return (
        plunge_rate,
        pitch_rate,
        (inertia * down - coupling * turn) / determinant,
        (mass * turn - coupling * down) / determinant,
    )


# -- energy ----------------------------------------------------------------------------------------
def _stored(
    plunge,
    pitch,
    plunge_rate,
    pitch_rate,
    *,
    mass,
    inertia,
    imbalance,
    half_chord,
    plunge_stiffness,
    pitch_stiffness,
    pitch_gap,
):
    """Energy of the section and its two springs, per unit span."""
    kinetic = (
        mass * plunge_rate**2 / 2
        + mass * imbalance * half_chord * plunge_rate * pitch_rate
        + inertia * pitch_rate**2 / 2
    )
    twist = freeplay(pitch, stiffness=1.0, gap=pitch_gap)
    return kinetic + plunge_stiffness * plunge**2 / 2 + pitch_stiffness * twist**2 / 2


def _supplied(
    pitch, plunge_rate, pitch_rate, *, airspeed, half_chord, elastic_axis, air_density, lift_slope
):
    """Power supplied by the flow, per unit span; negative while it damps."""
    incidence = (
        pitch + plunge_rate / airspeed + (0.5 - elastic_axis) * half_chord * pitch_rate / airspeed
    )
    lift = air_density * airspeed**2 * half_chord * lift_slope * incidence
    return (0.5 + elastic_axis) * half_chord * lift * pitch_rate - lift * plunge_rate


def _dissipated(plunge_rate, pitch_rate, *, plunge_damping, pitch_damping):
    """Power dissipated in the dampers of the mount, per unit span."""
    return plunge_damping * plunge_rate**2 + pitch_damping * pitch_rate**2


#: Stored energy [J], power supplied and dissipated [W].
ENERGY: dict[str, Callable[..., Any]] = {
    "energy": _stored,
    "supplied": _supplied,
    "dissipated": _dissipated,
}
