r"""A mass on a bolted joint: a Jenkins element beside a spring and a damper.

.. math::
    m \ddot x + c \dot x + k x + f = F \cos \omega t, \qquad
    \dot f = k_j \dot x \text{ while } |f| < R, \text{ or where it is unloaded}
"""

from __future__ import annotations

from saltus.contact import slider
from saltus.language import cos
from saltus.models.model import model


@model(
    states={"x": "1", "v": "1"},
    forced_at="frequency",
    source="W. D. Iwan, A distributed-element model for hysteresis and its steady-state dynamic "
    "response, J. Appl. Mech. 33, 893-900 (1966); T. K. Caughey, J. Appl. Mech. 27, 640-643 "
    "(1960).",
)
def jenkins_oscillator(
    t,
    x,
    v,
    *,
    damping=0.05,
    stiffness=0.2,
    joint_stiffness=2.0,
    joint_limit=1.0,
    force=1.5,
    frequency="0.9 rad/s",
):
    r"""Oscillator with a joint that slips (Caughey, Iwan): the bilinear hysteretic oscillator.

    States are ``x``, ``v`` and ``joint``, the deflection of the joint's spring; all is
    dimensionless, the mass is 1. It is forced at ``frequency``.

    ===============  =======  ==========  ======================================================
    parameter        symbol   default     meaning
    ===============  =======  ==========  ======================================================
    damping          c        0.05
    stiffness        k        0.2         of the spring beside the joint
    joint_stiffness  k_j      2
    joint_limit      R        1           force at which the joint slips
    force            F        1.5
    frequency        omega    0.9 rad/s
    ===============  =======  ==========  ======================================================

    Notes
    -----
    In a symmetric periodic motion between -X and X the joint takes the energy 4 R (X - R/k_j) out
    of each period. A motion that slips both ways forgets where the joint was: one of its
    multipliers is zero.
    """
    joint = slider(x, stiffness=joint_stiffness, limit=joint_limit, name="joint")
    return v, force * cos(frequency * t) - damping * v - stiffness * x - joint
