"""Energy balances of systems with impacts, jumps and friction, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

import saltus as sl


def kinetic(v):
    return v * v / 2


def nothing():
    return 0.0


@sl.system(states="x v")
def ball(t, x, v, *, gravity=9.81, restitution=0.5):
    return v, -gravity, sl.impact(x > 0, -v, restitution=restitution)


@sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
def stop(t, x, v, *, gap=0.2, restitution=0.6, damping=0.1, w=0.7):
    push = sl.cos(w * t) - damping * v - x
    return v, push, sl.impact(x < gap, v, restitution=restitution)


def test_each_impact_of_a_ball_takes_its_part():
    """(1 - e^2) of the energy each time; the last one, at rest, all that is left."""
    fall = math.sqrt(2 * 10 / 9.81)
    balance = sl.energy_balance(
        ball,
        (10.0, 0.0),
        energy=lambda x, v, *, gravity: v * v / 2 + gravity * x,
        supplied=nothing,
        dissipated=nothing,
        t_end=4 * fall,
        intervals=8,
    )
    whole = 98.1
    assert balance.impacts.values.sum() == pytest.approx(whole, rel=1e-13)
    between = balance.energy.sel(time=[1.5 * fall, 2.25 * fall], method="nearest")
    assert between.values[0] == pytest.approx(whole / 4, rel=1e-13)
    assert np.abs(balance.residual.values).max() < 1e-12 * whole


@pytest.mark.parametrize("w", [0.3, 0.7, 2.6])
def test_a_driven_stop_balances_over_a_hundred_periods(w):
    """At w = 0.3 with chatter, rest and release."""
    balance = sl.energy_balance(
        stop.with_values(w=w),
        (-0.5, 0.0),
        energy=lambda x, v: (v * v + x * x) / 2,
        supplied=lambda t, v, *, w: sl.cos(w * t) * v,
        dissipated=lambda v, *, damping: damping * v * v,
        periods=100,
    )
    assert float(balance.imbalance) < 1e-12
    assert balance.impacts.values.min() >= 0 < balance.impacts.values.sum()


def test_a_block_that_slides_to_rest_loses_its_energy_to_friction():
    """mu m g times the distance v^2/(2 mu g)."""

    @sl.system(states="x v")
    def block(t, x, v, *, mass=2.0, friction=0.3):
        return v, -sl.friction(v, slip=friction * mass * 9.81) / mass

    balance = sl.energy_balance(
        block,
        (0.0, 1.5),
        energy=lambda v, *, mass: mass * v * v / 2,
        supplied=nothing,
        dissipated=nothing,
        friction=lambda v, *, mass, friction: mass * friction * 9.81 * sl.sign(v) * v,
        t_end=1.0,
        intervals=5,
    )
    distance = float(balance.end_x)
    assert distance == pytest.approx(1.5**2 / (2 * 0.3 * 9.81), rel=1e-13)
    assert balance.friction.values.sum() == pytest.approx(0.3 * 2 * 9.81 * distance, rel=1e-13)
    assert float(balance.imbalance) < 1e-13
    assert "impacts" not in balance


def test_a_jump_may_bring_energy():
    """A kick of 0.5 where x passes 1: from v = sqrt(3) to sqrt(3) + 0.5."""

    @sl.system(states="x v")
    def kicked(t, x, v, *, kick=0.5):
        return v, -x, sl.jump(x > 1.0, v=v + kick)

    balance = sl.energy_balance(
        kicked,
        (0.0, 2.0),
        energy=lambda x, v: (x * x + v * v) / 2,
        supplied=nothing,
        dissipated=nothing,
        t_end=1.0,
        intervals=1,
    )
    gained = ((3**0.5 + 0.5) ** 2 - 3) / 2
    assert balance.impacts.values == pytest.approx([-gained], rel=1e-13)


def test_two_bodies_lose_what_their_reduced_mass_does():
    """(1 - e^2) of mu (u - v)^2/2 with mu = m n/(m + n)."""

    @sl.system(states="a b u v")
    def pair(t, a, b, u, v, *, m=1.0, n=3.0, restitution=0.4):
        return u, v, 0.0, 0.0, sl.impact(a < b, u - v, restitution=restitution, inertia=(m, n))

    balance = sl.energy_balance(
        pair,
        (0.0, 1.0, 2.0, 0.5),
        energy=lambda u, v, *, m, n: (m * u * u + n * v * v) / 2,
        supplied=nothing,
        dissipated=nothing,
        t_end=1.0,
        intervals=1,
    )
    lost = (1 - 0.4**2) * 0.75 * 1.5**2 / 2
    assert balance.impacts.values == pytest.approx([lost], rel=1e-14)
    assert float(balance.imbalance) < 1e-15
