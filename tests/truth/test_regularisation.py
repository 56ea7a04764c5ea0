"""Smooth stand-ins of contacts held against closed forms: how wrong the force is, and how fast the
motion becomes that of the contact as the width goes to zero.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import saltus as sl

GOLDEN = (math.sqrt(5) - 1) / 2
#: Largest error of a spring's force over stiffness*width: the largest u*(1 - H(u)).
WORST = {
    "tanh": 0.1392322713805369,
    "sigmoid": 2 * 0.1392322713805369,  # tanh of twice the width
    "polynomial": (lambda u: u / 2 - 3 * u**2 / 4 + u**4 / 4)((math.sqrt(3) - 1) / 2),
    "rational": GOLDEN**2.5 / 2,  # at u = sqrt(GOLDEN)
}


@sl.system(states="x v")
def stop(t, x, v, *, stiffness=7.0, gap=0.3):
    return v, -sl.where(x > gap, stiffness * (x - gap), 0)


@sl.system(states="x v")
def dead_zone(t, x, v, *, gap=1.0):
    return v, -sl.freeplay(x, stiffness=1.0, gap=gap)


def force_error(system, smooth, x):
    start = np.stack([x, np.zeros_like(x)])
    return abs(smooth.rhs(0.0, start)[1] - system.rhs(0.0, start)[1])


@pytest.mark.parametrize("width", [1e-3, 0.01, 0.05])
@pytest.mark.parametrize("law", WORST)
def test_largest_force_error(law, width):
    """The row M40 of tests/reference/laws_more.csv is that of tanh with the width 0.01."""
    smooth = sl.regularise(stop, law, width=width)
    worst = minimize_scalar(
        lambda u: -force_error(stop, smooth, 0.3 + u * width), bounds=(0.05, 1.4), method="bounded"
    )
    assert -worst.fun == pytest.approx(WORST[law] * 7.0 * width, rel=1e-9)
    everywhere = force_error(stop, smooth, 0.3 + width * np.linspace(-50, 50, 4001))
    assert everywhere.max() <= -worst.fun * (1 + 1e-9)


def test_arctan_is_wrong_far_from_the_boundary():
    smooth = sl.regularise(stop, "arctan", width=1e-3)
    errors = [force_error(stop, smooth, 0.3 + depth) for depth in (0.01, 1.0, 100.0)]
    assert errors == sorted(errors)
    assert errors[-1] == pytest.approx(7.0 * 1e-3 / math.pi, rel=1e-6)


@pytest.mark.parametrize(
    ("law", "order"),
    [("tanh", 2), ("sigmoid", 2), ("polynomial", 2), ("rational", 2), ("arctan", 1)],
)
def test_the_motion_becomes_that_of_the_contact(law, order):
    period = 2 * math.pi + 4.0  # of amplitude 2: half turns on the springs, dead zone at speed 1
    smooth = sl.regularise(dead_zone, law, width=0.01)
    errors = []
    for width in (4e-3, 2e-3, 1e-3):
        run = sl.simulate(smooth.with_values(width=width), (2.0, 0.0), t_end=period)
        errors.append(math.hypot(run.end_x.item() - 2.0, run.end_v.item()))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    # the algebraic tail of "rational" leaves a logarithm: width**2*log(1/width)
    assert np.abs(orders - order).max() < (0.25 if law == "rational" else 0.05)


def test_period_to_leading_order_in_the_width():
    """The smoothed spring stores k*width**2*pi**2/24 less than the spring: the dead zone is crossed
    at a lower speed, sqrt(1 - 2*less), and the motion of one period is late.
    """
    width = 1e-3
    less = math.pi**2 / 24 * width**2  # twice the integral of u*(1 - tanh u)/2 from 0 on
    smooth = sl.regularise(dead_zone, "tanh", width=width)
    run = sl.simulate(smooth, (2.0, 0.0), t_end=2 * math.pi + 4.0)
    late = 4 * less
    assert run.end_v.item() == pytest.approx(late, rel=1e-5)


def test_orbit_of_the_rig():
    rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    exact = sl.attractors(rig, start=("0.75 mm", 0.0))
    smooth = sl.attractors(sl.regularise(rig, "tanh", width="0.1 um"), start=("0.75 mm", 0.0))
    assert smooth.attractor_period.values.tolist() == [3]
    assert abs(smooth.attractor_peak - exact.attractor_peak).max() < 1e-9
