"""Systems that the conformance and property tests share: one compilation each, parameters make the cases.

Every motion that they are asked for has a closed form, or an invariant that needs none.
"""

from __future__ import annotations

import saltus as sl


@sl.system(states="x v", forced_at="frequency")
def lab(
    t, x, v, *, lift=0.0, spring=0.0, damping=0.0, cubic=0.0, force=0.0, boundary=1.0, stiffness=0.0, dashpot=0.0, preload=0.0,
    frequency=0.01,
):  # fmt: skip
    """A unit mass with one boundary, at which the force may bend (stiffness) or jump (preload, dashpot)."""
    contact = sl.piecewise((stiffness * (x - boundary) + dashpot * v + preload, x > boundary), otherwise=0)
    return v, lift + force * sl.cos(2 * sl.pi * frequency * t) - spring * x - damping * v - cubic * x**3 - contact


@sl.system(states="x v a j")
def quartic(t, x, v, a, j, *, snap=24.0, push=0.0):
    """x is a polynomial of degree 4 in time: gaps of any shape, exact in a single step of any length."""
    return v, a, j, snap + sl.piecewise((push, x > 0), otherwise=0)


@sl.system(states="x1 v1 x2 v2")
def pair(t, x1, v1, x2, v2, *, lift=0.0, spring=0.0, stop1=1.0, stop2=1.0, gap=1.0, stiffness1=0.0, stiffness2=0.0, stiffness=0.0):
    """Two unit masses, each with a stop of its own, and a spring between them that begins to act when they are a gap apart."""
    between = sl.piecewise((stiffness * (x1 - x2 - gap), x1 - x2 > gap), otherwise=0)
    first = sl.piecewise((stiffness1 * (x1 - stop1), x1 > stop1), otherwise=0)
    second = sl.piecewise((stiffness2 * (x2 - stop2), x2 > stop2), otherwise=0)
    return v1, lift - spring * x1 - first - between, v2, lift - spring * x2 - second + between


@sl.system(states="x y u w")
def ring(t, x, y, u, w, *, radius=1.0, wind=0.0):
    """A particle in the plane; a wind blows along x inside a circle."""
    inside = sl.piecewise((wind, x**2 + y**2 < radius**2), otherwise=0)
    return u, w, inside, 0.0 * x


@sl.system(states="x v", forced_at="frequency")
def walls(t, x, v, *, amplitude=0.5, moving_stiffness=0.0, width=2.0, stiffness=0.0, ceiling=4.0, ceiling_stiffness=0.0, frequency=1.0):
    """A unit mass between walls: one that moves with time, two at equal distance (abs), and a soft ceiling (max)."""
    wall = amplitude * sl.cos(2 * sl.pi * frequency * t)
    moving = sl.piecewise((moving_stiffness * (x - wall), x > wall), otherwise=0)
    fixed = sl.piecewise((stiffness * (sl.abs(x) - width) * x / width, sl.abs(x) > width), otherwise=0)
    return v, -moving - fixed - ceiling_stiffness * sl.max(x - ceiling, 0)


@sl.system(states="v", forced_at="frequency")
def slider(t, v, *, force=2.0, friction=1.0, belt=0.0, frequency=1.0):
    """A block on a belt, shaken: Coulomb friction, so both sides may push onto v = belt."""
    return force * sl.cos(2 * sl.pi * frequency * t) - sl.piecewise((friction, v > belt), otherwise=-friction)
