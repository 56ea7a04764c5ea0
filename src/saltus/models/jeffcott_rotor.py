r"""A Jeffcott rotor in a stator that it may rub.

.. math::
    m \ddot x + c \dot x + k x + n (x - \mu y) &= m e \omega^2 \cos \omega t \\
    m \ddot y + c \dot y + k y + n (y + \mu x) &= m e \omega^2 \sin \omega t - m g

    n = k_s (1 - \delta / r) \text{ for } r > \delta, \qquad 0 \text{ elsewhere}

with :math:`r = \sqrt{x^2 + y^2}` and :math:`\omega = 2 \pi f`. The disk turns from x to y, so fast
that its surface slides over the stator in one direction only.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from saltus.contact import clearance
from saltus.language import cos, hypot, pi, piecewise, sin
from saltus.models.model import model


@model(
    states={"x": "m", "y": "m", "u": "m/s", "v": "m/s"},
    forced_at="speed",
    source="F. Chu, Z. Zhang, Bifurcation and chaos in a rub-impact Jeffcott rotor system, J. "
    "Sound Vib. 210(1), 1-18 (1998); own values.",
)
def jeffcott_rotor(
    t,
    x,
    y,
    u,
    v,
    *,
    mass="2 kg",
    damping="60 N*s/m",
    stiffness="50 kN/m",
    eccentricity="0.1 mm",
    gap="0.2 mm",
    stator_stiffness="400 kN/m",
    friction=0.1,
    gravity="0 m/s^2",
    speed="1500 rpm",
):
    r"""Jeffcott rotor with unbalance that rubs a stator (after Chu and Zhang).

    States are the place of the disk's centre from that of the stator, ``x`` and ``y`` [m], and its
    velocity, ``u`` and ``v`` [m/s]; it is forced at the ``speed`` of rotation, and may start at
    rest.

    ================  ==============  ===========  =================================================
    parameter         symbol          default      meaning
    ================  ==============  ===========  =================================================
    mass              m               2 kg         of the disk
    damping           c               60 N*s/m     of the shaft, relative to the ground
    stiffness         k               50 kN/m      of the shaft
    eccentricity      e               0.1 mm       of the center of mass
    gap               :math:`\delta`  0.2 mm       clearance to the stator, radially
    stator_stiffness  :math:`k_s`     400 kN/m     radially
    friction          :math:`\mu`     0.1          coefficient, at the stator
    gravity           g               0 m/s^2      across the shaft, against y; 0 if that is upright
    speed             f               1500 rpm     of rotation
    ================  ==============  ===========  =================================================

    Notes
    -----
    The equations are those of F. Chu and Z. Zhang, Journal of Sound and Vibration 210(1), 1-18
    (1998); the values are chosen here. The natural frequency is 25.16 Hz, the damping ratio 0.095.

    Without contact, and without gravity, the disk runs around a circle with the radius
    :math:`A = m e \omega^2 / |k - m \omega^2 + i c \omega|`. If that exceeds the gap, it is one
    motion to rub all the way around, on a circle with

    .. math::
        |(k - m \omega^2) A + k_s (A - \delta)
            + i (c \omega A + \mu k_s (A - \delta))| = m e \omega^2.
    """
    w = 2 * pi * speed
    unbalance = mass * eccentricity * w**2
    fx, fy = clearance(x, y, stiffness=stator_stiffness, gap=gap, friction=friction)
    return (
        u,
        v,
        (unbalance * cos(w * t) - damping * u - stiffness * x - fx) / mass,
        (unbalance * sin(w * t) - damping * v - stiffness * y - fy) / mass - gravity,
    )


# -- energy ----------------------------------------------------------------------------------------
def _stored(x, y, u, v, *, mass, stiffness, gap, stator_stiffness, gravity):
    """Energy of the disk, the shaft and the stator, and in the field of gravity."""
    r = hypot(x, y)
    stator = piecewise((stator_stiffness * (r - gap) ** 2 / 2, r > gap), otherwise=0)
    return mass * (u**2 + v**2) / 2 + stiffness * (x**2 + y**2) / 2 + stator + mass * gravity * y


def _supplied(t, u, v, *, mass, eccentricity, speed):
    """Power that keeps the unbalance rotating."""
    w = 2 * pi * speed
    return mass * eccentricity * w**2 * (cos(w * t) * u + sin(w * t) * v)


def _dissipated(x, y, u, v, *, damping, gap, stator_stiffness, friction):
    """Power dissipated by the damping, and by the friction at the centre: negative where that
    drives the whirl.
    """
    fx, fy = clearance(x, y, stiffness=stator_stiffness, gap=gap, friction=friction)
    nx, ny = clearance(x, y, stiffness=stator_stiffness, gap=gap)
    return damping * (u**2 + v**2) + (fx - nx) * u + (fy - ny) * v


#: Stored energy [J], power supplied and dissipated [W].
ENERGY: dict[str, Callable[..., Any]] = {
    "energy": _stored,
    "supplied": _supplied,
    "dissipated": _dissipated,
}
