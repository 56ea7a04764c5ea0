"""A unit mass that meets a force K*d**p in the depth d behind a boundary, and the closed forms of
its motion.
"""

from __future__ import annotations

from math import log1p

from scipy.optimize import brentq
from scipy.special import beta

import saltus as sl


@sl.system(states="x v", forced_at="frequency")
def power_stop(
    t, x, v, *, stiffness=1e6, power=1.5, gap=0.0, dashpot=0.0, lift=0.0, spring=0.0, damping=0.0,
    force=0.0, shake=0.0, frequency=1.0
):  # fmt: skip
    """Hertz (p = 1.5) and its kin, with Hunt and Crossley's damping; the stop may be shaken."""
    drive = sl.cos(2 * sl.pi * frequency * t)
    depth = x - gap - shake * drive
    stop = sl.piecewise((stiffness * depth**power * (1 + dashpot * v), depth > 0), otherwise=0)
    return v, lift + force * drive - spring * x - damping * v - stop


def depth_of(speed, stiffness, p):
    """Largest depth: v^2/2 = K d^(p+1)/(p+1)."""
    return ((p + 1) * speed**2 / (2 * stiffness)) ** (1 / (p + 1))


def duration_of(speed, stiffness, p):
    """Duration of a contact: 2 d/v times the integral of (1 - s^(p+1))^(-1/2) over [0, 1]."""
    return 2 * depth_of(speed, stiffness, p) / speed * beta(1 / (p + 1), 0.5) / (p + 1)


def pressed_period(lift, stiffness, p):
    """Time from rest on the boundary, pressed by a force a, until it is back: 2 (x/2a)^(1/2)
    B(1/2p, 1/2)/p with x = ((p+1)a/K)^(1/p).
    """
    deepest = ((p + 1) * lift / stiffness) ** (1 / p)
    return 2 * (deepest / (2 * lift)) ** 0.5 * beta(1 / (2 * p), 0.5) / p


def rebound_of(speed, dashpot):
    """Speed after a contact with the force K d^p (1 + c v), whatever K and p: v/c - log(1 + c
    v)/c^2 is the same before and after.
    """

    def level(v):
        return v / dashpot - log1p(dashpot * v) / dashpot**2

    return brentq(
        lambda u: level(-u) - level(speed),
        1e-9 * speed,
        min(speed, (1 - 1e-15) / dashpot),
        xtol=1e-17,
        rtol=1e-15,
    )
