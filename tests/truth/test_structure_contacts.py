"""Contact laws of structures against invariants and closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

import saltus as sl

N, KEPT = 8, 5
MASS = np.diag(np.linspace(0.5, 1.5, N))
STIFFNESS = 900.0 * (2 * np.eye(N) - np.eye(N, k=1) - np.eye(N, k=-1))


def states_of(run, made, kind):
    """States at contacts, before or after: float64[contact, state]."""
    names = [f"contact_{name}{kind}" for name in made.states]
    return np.column_stack([run[name].values for name in names])


def thrown(made, seed=3):
    """A run from a random start with a speed of some m/s."""
    speeds = np.random.default_rng(seed).normal(size=len(made.states) // 2)
    start = np.concatenate([np.zeros(len(speeds)), speeds])
    return sl.simulate(made, start, t_end=2.0, progress=False), start


@pytest.mark.parametrize("modes", [None, N, KEPT])
@pytest.mark.parametrize("between", [None, "x3"])
def test_a_rigid_stop_reverses_the_velocity_and_keeps_the_energy(modes, between):
    """At restitution 1: the closing velocity changes its sign, the change of momentum is along the
    contact, and the energy is that at the start.
    """
    stop = sl.Contact("x6", to=between, gap="2 mm", side="both", restitution=1.0)
    made = sl.structure(MASS, STIFFNESS, contacts=[stop], modes=modes)
    run, start = thrown(made)
    k = len(made.states) // 2
    along = np.eye(N)[5] - (np.eye(N)[2] if between else 0.0)
    mass, stiffness, push = MASS, STIFFNESS, along
    if modes is not None:
        table = sl.structure_modes(MASS, STIFFNESS, modes)
        mass, stiffness = np.eye(k), np.diag((2 * math.pi * table["frequency"].values) ** 2)
        push = along @ table["shape"].values
    before, after = (states_of(run, made, kind)[:, k:] for kind in ("_before", ""))
    assert len(before) > 40
    closing = before @ push
    assert np.abs(after @ push + closing).max() < 1e-12 * np.abs(closing).max()
    impulse = 2 * closing / (push @ np.linalg.solve(mass, push))
    assert np.abs((before - after) @ mass - np.outer(impulse, push)).max() < 1e-12
    end = np.array([run[f"end_{name}"].item() for name in made.states])
    energies = [
        0.5 * (y[k:] @ mass @ y[k:] + y[:k] @ stiffness @ y[:k]) for y in (start, end)
    ]  # fmt: skip
    assert energies[1] == pytest.approx(energies[0], rel=1e-11)


def test_a_restitution_loses_energy_as_newton_says():
    """Each blow loses (1 - e^2)/2 times the effective mass times the square of the speed."""
    stop = sl.Contact("x8", gap="2 mm", restitution=0.6)
    made = sl.structure(MASS, STIFFNESS, contacts=[stop], modes=KEPT)
    run, _ = thrown(made)
    push = sl.structure_modes(MASS, STIFFNESS, KEPT)["shape"].values[-1]
    before, after = (states_of(run, made, kind)[:, KEPT:] for kind in ("_before", ""))
    blows = run["contact_kind"].values == "impact"
    assert blows.sum() > 5
    lost = 0.5 * ((before**2).sum(axis=1) - (after**2).sum(axis=1))
    told = 0.5 * (1 - 0.6**2) * (before @ push) ** 2 / (push @ push)
    assert np.abs(lost - told)[blows].max() < 1e-12


@pytest.mark.parametrize("side", ["upper", "lower"])
@pytest.mark.parametrize("rigid", [True, False])
def test_a_preload_closes_a_contact_at_rest(rigid, side):
    """The damped motion ends in the static solution, with the stop pressed."""
    sign = 1.0 if side == "upper" else -1.0
    law = {"restitution": 0.4} if rigid else {"stiffness": 2e4}
    stop = sl.Contact("x6", gap=1e-3, side=side, preload=20.0, **law)
    made = sl.structure(MASS, STIFFNESS, 0.02 * STIFFNESS, contacts=[stop])
    run = sl.simulate(made, np.zeros(2 * N), t_end=20.0, progress=False)
    found = np.array([run[f"end_x{i + 1}"].item() for i in range(N)])
    push = np.eye(N)[5]
    if rigid:  # the deflection there is the gap; the stop carries what the structure doesn't
        truth = sign * 1e-3 * np.linalg.solve(STIFFNESS, push) / np.linalg.inv(STIFFNESS)[5, 5]
    else:
        joined = STIFFNESS + 2e4 * np.outer(push, push)
        truth = sign * np.linalg.solve(joined, push * (20.0 + 2e4 * 1e-3))
    assert np.abs(found - truth).max() < 1e-12
    assert (STIFFNESS @ truth)[5] * sign < 20.0  # the stop is pressed


@pytest.mark.parametrize("rigid", [True, False])
def test_friction_brakes_what_slides(rigid):
    """A mass pressed onto a stop by P slides for v m/(friction P), and then sticks."""
    law = {"restitution": 0} if rigid else {"stiffness": 1e4}
    stop = sl.Contact("x1", gap=0.0, preload=8.0, friction=0.25, sliding="x2", **law)
    made = sl.structure(np.diag([2.0, 3.0]), np.zeros((2, 2)), contacts=[stop])
    depth = 0.0 if rigid else 8.0 / 1e4
    run = sl.simulate(made, (depth, 0.0, 0.0, 0.5), t_end=1.0, progress=False)
    stops = 0.5 * 3.0 / (0.25 * 8.0)
    assert run["contact_time"].values[-1] == pytest.approx(stops, rel=1e-12)
    assert run["end_x2"].item() == pytest.approx(0.5 * stops / 2, rel=1e-12)
    assert run["end_v2"].item() == 0.0


@pytest.mark.parametrize("damping", [None, 3.0])
@pytest.mark.parametrize("side", ["upper", "lower", "both"])
def test_a_contact_of_curved_bodies(side, damping):
    """As the equation written by hand, from either side."""
    k, gap = 4e5, 1e-3
    stop = sl.Contact("x1", stiffness=k, gap=gap, side=side, power=1.5, damping=damping)
    made = sl.structure([[2.0]], [[500.0]], contacts=[stop])
    assert made.units["stop_stiffness"] == "N/m^1.5"

    @sl.system(states="x v")
    def hand(t, x, v):
        c = damping or 0.0
        up = sl.piecewise((k * (x - gap) ** 1.5 + c * v, x > gap), otherwise=0.0)
        down = sl.piecewise((k * (-x - gap) ** 1.5 - c * v, x < -gap), otherwise=0.0)
        push = {"upper": up, "lower": -down, "both": up - down}[side]
        return v, (-500.0 * x - push) / 2.0

    one, two = (
        sl.simulate(system, (0.0, 0.2), t_end=1.0, progress=False) for system in (made, hand)
    )
    assert one.sizes["contact"] == two.sizes["contact"] > 4
    assert one["end_x1"].item() == pytest.approx(two["end_x"].item(), abs=1e-13)


def test_a_hertz_contact_keeps_the_energy():
    """A ball against a wall: the depth at which it turns is (5 m v^2/(4 k))^(2/5)."""
    stop = sl.Contact("x1", stiffness=1e6, gap=0.0, power=1.5)
    made = sl.structure([[0.3]], [[0.0]], contacts=[stop])
    run = sl.poincare(made, (-1e-3, 0.8), "x1 turns", t_end=0.02, progress=False)
    deepest = float(np.max(run["x1"].values))
    assert deepest == pytest.approx((5 * 0.3 * 0.8**2 / 4e6) ** 0.4, rel=1e-12)
