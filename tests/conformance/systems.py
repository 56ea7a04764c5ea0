"""Systems that the conformance and property tests share: one compilation each, parameters make the
cases.

Every motion that they are asked for has a closed form, or an invariant that needs none.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr

import saltus as sl

EPS = 2.0**-52


@sl.system(states="x v", forced_at="frequency")
def lab(
    t, x, v, *, lift=0.0, spring=0.0, damping=0.0, force=0.0, boundary=1.0,
    stiffness=0.0, dashpot=0.0, preload=0.0,
    frequency=0.01,
):  # fmt: skip
    """A unit mass with one boundary, at which the force may bend (stiffness) or jump (preload,
    dashpot).
    """
    contact = sl.piecewise(
        (stiffness * (x - boundary) + dashpot * v + preload, x > boundary), otherwise=0
    )
    return v, lift + force * sl.cos(2 * sl.pi * frequency * t) - spring * x - damping * v - contact


@sl.system(states="x v", forced_at="frequency")
def bent(
    t, x, v, *, lift=0.0, spring=0.0, damping=0.0, cubic=1.0, force=0.0, boundary=1.0,
    stiffness=0.0, dashpot=0.0, preload=0.0,
    frequency=0.01,
):  # fmt: skip
    """The same with a spring that isn't linear: where it is negative, the mass may blow up."""
    contact = sl.piecewise(
        (stiffness * (x - boundary) + dashpot * v + preload, x > boundary), otherwise=0
    )
    return v, lift + force * sl.cos(
        2 * sl.pi * frequency * t
    ) - spring * x - damping * v - cubic * x**3 - contact


@sl.system(states="a b c u v w")
def pinched(t, a, b, c, u, v, w, *, middle=1.0, restitution=1.0):
    """Two balls on both sides of a third, all on one line."""
    return (
        u, v, w, 0.0, 0.0, 0.0,
        sl.impact(a < b, u - v, restitution=restitution, inertia=(1.0, middle)),
        sl.impact(b < c, v - w, restitution=restitution, inertia=(middle, 1.0)),
    )  # fmt: skip


@sl.system(states="x v")
def ball_of_clay(t, x, v, *, slope=1.0):
    """It falls on a stop at 0, with a restitution that depends on the speed."""
    return v, -1.0, sl.impact(x > 0, -v, restitution=0.5 + slope * v)


@sl.system(states="x v a j")
def quartic(t, x, v, a, j, *, snap=24.0, push=0.0):
    """x is a polynomial of degree 4 in time: gaps of any shape, exact in a single step of any
    length.
    """
    return v, a, j, snap + sl.piecewise((push, x > 0), otherwise=0)


def quartic_with_roots(*roots: float) -> tuple[float, float, float, float]:
    """Start of `quartic` for which x(t) is the product of (t - root), four roots."""
    c = np.poly(roots)
    return c[4], c[3], 2 * c[2], 6 * c[1]


@sl.system(states="x1 v1 x2 v2")
def pair(
    t,
    x1,
    v1,
    x2,
    v2,
    *,
    lift=0.0,
    spring=0.0,
    stop1=1.0,
    stop2=1.0,
    gap=1.0,
    stiffness1=0.0,
    stiffness2=0.0,
    stiffness=0.0,
):
    """Two unit masses, each with a stop of its own, and a spring between them that begins to act
    when they are a gap apart.
    """
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
def walls(
    t,
    x,
    v,
    *,
    amplitude=0.5,
    moving_stiffness=0.0,
    width=2.0,
    stiffness=0.0,
    ceiling=4.0,
    ceiling_stiffness=0.0,
    frequency=1.0,
):
    """A unit mass between walls: one that moves with time, two at equal distance (abs), and a soft
    ceiling (max).
    """
    wall = amplitude * sl.cos(2 * sl.pi * frequency * t)
    moving = sl.piecewise((moving_stiffness * (x - wall), x > wall), otherwise=0)
    fixed = sl.piecewise((stiffness * (sl.abs(x) - width) * x, sl.abs(x) > width), otherwise=0)
    return v, -moving - fixed - ceiling_stiffness * sl.max(x - ceiling, 0)


@sl.system(states="v", forced_at="frequency")
def slider(t, v, *, force=2.0, friction=1.0, belt=0.0, frequency=1.0):
    """A block on a belt, shaken: Coulomb friction, so both sides may push onto v = belt."""
    return force * sl.cos(2 * sl.pi * frequency * t) - sl.piecewise(
        (friction, v > belt), otherwise=-friction
    )


@sl.system(states="x v")
def latch(t, x, v, *, half_width=0.5, gain=0.0):
    """An oscillator with a switch that has hysteresis: its threshold jumps when the velocity
    changes sign.
    """
    threshold = sl.piecewise((half_width, v > 0), otherwise=-half_width)
    return v, -x - sl.piecewise((gain, x > threshold), otherwise=0)


@sl.system(states="x y v w", forced_at="f")
def two_masses(
    t, x, y, v, w, *, k1=30.0, k2=12.0, c1=0.3, c2=0.2, ka=500.0, ga=0.05, kb=300.0, gb=0.07,
    kd=400.0, gd=0.03, ke=90.0, ge=0.04,
    A=2.0, f=0.9, mu=2.0,
):  # fmt: skip
    """Two masses with a stop on either side of the first, and clearances of both signs between the
    two.
    """
    stop = sl.piecewise((ka * (x - ga), x > ga), (kb * (x + gb), x < -gb), otherwise=0)
    between = sl.piecewise(
        (kd * (y - x - gd), y - x > gd), (ke * (y - x + ge), y - x < -ge), otherwise=0
    )
    inner = k2 * (y - x) + c2 * (w - v) + between
    return v, w, A * sl.cos(2 * sl.pi * f * t) - k1 * x - c1 * v - stop + inner, -mu * inner


@sl.system(states="x y z")
def circuit(t, x, y, z, *, al=9.0, be=14.0, m0=-1.14, m1=-0.71, b=1.0, e=0.02, h=2.0):
    """Chua's circuit with a third kink and a cubic term."""
    diode = sl.piecewise(
        (m1 * x + (m0 - m1) * b, x > b), (m1 * x - (m0 - m1) * b, x < -b), otherwise=m0 * x
    )
    return al * (y - x - diode), x - y + z - e * y**3, -be * y - 0.05 * sl.abs(x - h)


class Contact(NamedTuple):
    """One row of a table of contacts."""

    time: float
    guard: str
    kind: str
    direction: int
    velocity: float
    before: int
    after: int
    error: float


def contacts(run: xr.Dataset, trajectory: int | None = None) -> list[Contact]:
    """The table of contacts, of one trajectory if the run has many."""
    names = (
        "time",
        "guard",
        "kind",
        "direction",
        "velocity",
        "mode_before",
        "mode_after",
        "time_error",
    )
    own = slice(None) if trajectory is None else run.contact_trajectory.values == trajectory
    return [
        Contact(*row)
        for row in zip(
            *(run.variables[f"contact_{name}"].values[own].tolist() for name in names), strict=True
        )
    ]


def bits(run: xr.Dataset, trajectory: int | None = None) -> dict[str, bytes]:
    """Every number of a run (of one of its trajectories), as bytes: equal if and only if the runs
    are equal to the bit.
    """
    of_one = {}
    if trajectory is not None:
        of_one["trajectory"] = trajectory
        if "contact" in run.dims:
            of_one["contact"] = np.flatnonzero(run.contact_trajectory.values == trajectory)
    left_out = ("contact_trajectory", "trajectory", "guard_boundary")
    found = {}
    # not run[name]: a DataArray takes longer to make than a trajectory to compute
    for name, variable in run.variables.items():
        if name not in left_out and variable.dtype.kind in "fiu":
            found[str(name)] = variable.values[
                tuple(of_one.get(dim, slice(None)) for dim in variable.dims)
            ].tobytes()
    return found


def differing(ours, theirs):
    """Trajectories of two lists of :func:`bits` that aren't the same to the bit, with the variables
    that differ.
    """
    assert len(ours) == len(theirs)
    return {
        i: names
        for i, (a, b) in enumerate(zip(ours, theirs, strict=True))
        if (names := [name for name in a if a[name] != b.get(name, a[name])])
    }


@sl.system(states="T on")
def thermostat(t, T, on):
    """A room that is heated from 22 up to 23.5 degrees."""
    return (
        -0.1 * (T - 18) + 2 * on, 0.0,
        sl.jump(T > 23.5, on=0.0), sl.jump(T < 22.0, on=1.0),
    )  # fmt: skip


@sl.system(states="a b c u v w")
def cradle(t, a, b, c, u, v, w):
    """Three equal elastic balls in a row."""
    return (
        u, v, w, 0.0, 0.0, 0.0,
        sl.impact(a < b, u - v, restitution=1.0, inertia=(1.0, 1.0)),
        sl.impact(b < c, v - w, restitution=1.0, inertia=(1.0, 1.0)),
    )  # fmt: skip


@sl.system(states="x y v w")
def two_balls(t, x, y, v, w):
    """Two balls that fall on floors of their own."""
    return (
        v, w, -1.0, -1.0,
        sl.impact(x > 0, -v, restitution=0.5), sl.impact(y > 0, -w, restitution=0.9),
    )  # fmt: skip
