"""Contact forces with losses: rebound speeds against closed forms, and an independent solver."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import saltus as sl
from saltus.errors import TraceError

FACTORS = {
    "hunt_crossley": lambda e: 1.5 * (1 - e),
    "lankarani_nikravesh": lambda e: 0.75 * (1 - e * e),
    "flores": lambda e: 1.6 * (1 - e) / e,
}


def rebound(factor):
    """The speed at which a mass leaves that comes with 1: v dv/(1 + c v) = -k d^n dd, both sides
    integrated over the contact.
    """
    if factor == 0:
        return 1.0
    balance = lambda e: math.log((1 + factor) / (1 - factor * e)) - factor * (1 + e)  # noqa: E731
    return brentq(balance, 1e-9, min(1.0, (1 - 1e-15) / factor), xtol=1e-16, rtol=1e-15)


def thrown(law, exponent=1.5):
    @sl.system(states="x v")
    def mass(t, x, v, *, stiffness=1e4, restitution=0.5, speed=1.0):
        force = law(
            x, v, stiffness=stiffness, restitution=restitution, speed=speed, exponent=exponent
        )
        return v, -force

    return mass


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.0])
@pytest.mark.parametrize("name", FACTORS)
def test_a_mass_leaves_with_the_speed_of_the_first_integral(name, exponent):
    system = thrown(getattr(sl, name), exponent)
    restitution = np.array([0.3, 0.7, 0.95, 1.0])
    end = sl.simulate(system, (-1e-3, 1.0), t_end=0.5, values={"restitution": restitution})
    exact = [rebound(FACTORS[name](e)) for e in restitution]
    assert -end["end_v"].values == pytest.approx(exact, rel=1e-11)


def test_small_losses_are_those_of_the_papers():
    """Hunt and Crossley: e = 1 - alpha v with the factor 3 alpha/2; all three agree to first order
    in 1 - e, Flores' but for 16/15.
    """
    for name, first in (("hunt_crossley", 1.0), ("lankarani_nikravesh", 1.0), ("flores", 16 / 15)):
        lost = np.array([2e-3, 1e-3])
        end = sl.simulate(
            thrown(getattr(sl, name)), (0.0, 1.0), t_end=0.5, values={"restitution": 1 - lost}
        )
        rest = np.abs(1 + end["end_v"].values - first * lost)
        assert rest[0] < 4 * lost[0] ** 2, name
        assert rest[0] / rest[1] == pytest.approx(4, rel=0.05), "of second order"


@pytest.mark.parametrize("name", FACTORS)
def test_a_contact_is_that_of_an_independent_solver(name):
    factor = FACTORS[name](0.4) / 0.8

    def leaves(t, y):
        return y[0] + 1e-30

    leaves.terminal, leaves.direction = True, -1.0
    exact = solve_ivp(
        lambda t, y: (y[1], -3e3 * max(y[0], 0.0) ** 1.5 * (1 + factor * y[1])),
        (0.0, 1.0), (0.0, 1.3), method="DOP853", rtol=3e-14, atol=1e-16, events=leaves,
    )  # fmt: skip
    system = thrown(getattr(sl, name)).with_values(stiffness=3e3, restitution=0.4, speed=0.8)
    run = sl.simulate(system, (0.0, 1.3), t_end=1.0)
    assert float(run["contact_time"][-1]) == pytest.approx(exact.t_events[0][-1], rel=1e-9)
    assert float(run["end_v"]) == pytest.approx(exact.y[1, -1], rel=1e-10)


def test_hertz_contact_lasts_as_long_as_its_integral_says():
    """T v/d = 2 Gamma(2/5) Gamma(1/2)/(5/2 Gamma(9/10)), d = (5 v^2/4 k)^(2/5)."""

    @sl.system(states="x v")
    def mass(t, x, v, *, stiffness=1e4):
        return v, -sl.hertz(x, stiffness=stiffness)

    run = sl.simulate(mass, (-0.1, 2.0), t_end=1.0)
    deepest = (5 * 4 / (4 * 1e4)) ** 0.4
    lasts = 2 * math.gamma(0.4) * math.gamma(0.5) / (2.5 * math.gamma(0.9)) * deepest / 2
    assert np.diff(run["contact_time"].values) == pytest.approx([lasts], rel=1e-11)
    assert float(run["end_v"]) == pytest.approx(-2.0, rel=1e-13)


@pytest.mark.parametrize(
    ("no_tension", "exact"), [(False, 0.85446789300675647), (True, 0.85875810177509183)]
)
@pytest.mark.parametrize("side", [1, -1])
def test_a_damper_that_cant_pull_takes_less(no_tension, exact, side):
    """x'' + 2 z x' + x = 0 from (0, 1), left where x = 0, or where x + 2 z x' = 0; z = 0.05."""
    gaps = {"upper_gap": 0.0} if side > 0 else {"lower_gap": 0.0}

    @sl.system(states="x v")
    def mass(t, x, v, *, damping=0.1):
        force = sl.freeplay(
            x, stiffness=1.0, damping=damping, velocity=v, no_tension=no_tension, **gaps
        )
        return v, -force

    run = sl.simulate(mass, (-0.5 * side, 1.0 * side), t_end=10.0)
    assert -side * float(run["end_v"]) == pytest.approx(exact, rel=1e-14)


@pytest.mark.parametrize("restitution", [0.0, 1.2, -0.5])
@pytest.mark.parametrize("name", FACTORS)
def test_a_restitution_that_no_damper_has_is_refused(name, restitution):
    with pytest.raises(TraceError, match=r"outside \(0, 1\]"):
        getattr(sl, name)(0.1, 0.0, stiffness=1.0, restitution=restitution, speed=1.0)
