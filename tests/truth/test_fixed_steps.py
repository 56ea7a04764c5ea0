"""Runge-Kutta steps of a fixed length: orders of convergence across contacts, how each rule lands
on a boundary, and where it can't.

Orders are those of x'' = -x - 0.1 x' + cos 0.7 t - f, boundary 0.3, T = 20, h = 0.05 halved five
times, with a force beyond it that bends (25 (x - 0.3)), jumps with the speed (2 x') or jumps (1).
The exact states are Taylor's, which test_order.py compares with matrix exponentials. An error is
the geometric mean over the starts.
"""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from saltus.errors import SaltusWarning

LAWS = {
    "bends": {"stiffness": 25.0},
    "jumps with speed": {"drag": 2.0},
    "jumps": {"push": 1.0},
    "none": {},
}
PLACE, END = 0.3, 20.0
LOCATED = ("henon", "inverse", "bisect")
NOT_LOCATED = {"bends": 2.2, "jumps with speed": 1.1, "jumps": 1.1, "none": 4.0}
LEAST = {"bends": 3.7, "jumps with speed": 3.7, "jumps": 3.4, "none": 3.9}


@sl.system(states="x v")
def oscillator(t, x, v, *, stiffness=0.0, drag=0.0, push=0.0, place=PLACE):
    stop = sl.piecewise((stiffness * (x - place) + drag * v + push, x > place), otherwise=0)
    return v, -x - 0.1 * v + sl.cos(0.7 * t) - stop


@sl.system(states="x v")
def thrown(t, x, v, *, fall=2.0, push=0.0, place=0.999, other=10.0, slope=0.0):
    """x = 2 t - t^2 whatever the boundaries are, without a push."""
    none = sl.piecewise((push, x > place + slope * t), otherwise=0.0)
    return v, -fall + none + sl.piecewise((push, x > other), otherwise=0.0)


STARTS = np.random.default_rng(7).uniform((-1.5, -1.0), (1.5, 1.0), (24, 2))


def ends(run):
    return np.stack([run.end_x.values, run.end_v.values], axis=1)


def run(system, method, start=STARTS, t_end=END, **more):
    return sl.simulate(
        system, start, t_end=t_end, samples=1, time_errors="local", method=method, **more
    )


def run_of(system, method):
    return sl.simulate(system, [1.0], t_end=5.0, samples=1, method=method)


def order(system, events):
    exact, steps = ends(run(system, sl.Taylor())), 0.05 / 2.0 ** np.arange(6)
    errors = [
        np.exp(np.mean(np.log(np.linalg.norm(ends(run(system, one)) - exact, axis=1))))
        for one in (sl.RK4(step, events) for step in steps)
    ]
    return np.polyfit(np.log(steps), np.log(errors), 1)[0]


@pytest.mark.parametrize("law", LAWS)
def test_contacts_that_are_not_located_cost_the_order(law):
    measured = order(oscillator.with_values(**LAWS[law]), "ignore")
    assert abs(measured - NOT_LOCATED[law]) < (0.1 if law == "none" else 0.4)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("events", LOCATED)
def test_located_contacts_keep_the_order(law, events):
    assert order(oscillator.with_values(**LAWS[law]), events) >= LEAST[law]


def test_a_step_is_that_of_the_textbook():
    """Beside a loop of NumPy, contacts not located."""

    def rate(t, y):
        force = 25.0 * (y[:, 0] - PLACE) * (y[:, 0] > PLACE)
        return np.stack([y[:, 1], -y[:, 0] - 0.1 * y[:, 1] + np.cos(0.7 * t) - force], axis=1)

    y, h = STARTS.copy(), 0.03125
    for n in range(int(END / h)):
        t = n * h
        k1 = rate(t, y)
        k2 = rate(t + h / 2, y + h / 2 * k1)
        k3 = rate(t + h / 2, y + h / 2 * k2)
        k4 = rate(t + h, y + h * k3)
        y = y + h * (k1 + 2 * k2 + 2 * k3 + k4) / 6
    there = run(oscillator.with_values(stiffness=25.0), sl.RK4(h, "ignore"))
    assert (there.steps == int(END / h)).all()
    np.testing.assert_allclose(ends(there), y, rtol=0, atol=1e-11)


# -- landing ---------------------------------------------------------------------------------------


def test_a_step_in_the_gap_lands_on_the_boundary():
    found = run(oscillator.with_values(stiffness=25.0), sl.RK4(0.05, "henon"))
    assert found.sizes["contact"] > 100
    assert np.abs(found.contact_x.values - PLACE).max() <= 4 * np.spacing(PLACE)


@pytest.mark.parametrize("events", LOCATED)
def test_a_parabola_is_left_where_it_is_met(events):
    """RK4 is exact on it; t(x) isn't a cubic, so steps in x and inverse cubics are near."""
    found = run(thrown.with_values(place=0.75), sl.RK4(0.02, events), [[0.0, 2.0]], 2.0)
    assert found.status.values.tolist() == ["ok"]
    accuracy = 1e-12 if events == "bisect" else 1e-8
    np.testing.assert_allclose(found.contact_time.values, [0.5, 1.5], rtol=0, atol=accuracy)
    assert found.contact_direction.values.tolist() == [1, -1]


@pytest.mark.parametrize("events", ["henon", "inverse"])
def test_a_gap_that_turns_about_within_the_step_is_named(events):
    with pytest.warns(SaltusWarning, match="turned about.*bisect"):
        found = run(thrown, sl.RK4(0.5, events), [[0.0, 2.0]], 2.0)
    assert found.status.values.tolist() == ["turned"]
    assert found.end_time.item() < 1.0


def test_bisection_gets_through_a_graze():
    found = run(thrown, sl.RK4(0.5, "bisect"), [[0.0, 2.0]], 2.0)
    depth = np.sqrt(0.001)
    np.testing.assert_allclose(found.contact_time.values, [1 - depth, 1 + depth], atol=1e-10)
    np.testing.assert_allclose(ends(found), [[0.0, -2.0]], atol=1e-12)


@pytest.mark.parametrize("events", LOCATED)
def test_boundaries_that_move_or_meet(events):
    moving = thrown.with_values(place=0.25, slope=0.5)  # 2 t - t^2 = 0.25 + t/2
    root = np.sqrt(2.25 - 1.0)
    found = run(moving, sl.RK4(0.01, events), [[0.0, 2.0]], 2.0)
    np.testing.assert_allclose(
        found.contact_time.values, [(1.5 - root) / 2, (1.5 + root) / 2], rtol=0, atol=1e-7
    )
    both = run(thrown.with_values(place=0.75, other=0.75), sl.RK4(0.01, events), [[0, 2.0]], 2.0)
    np.testing.assert_allclose(both.contact_time.values, [0.5, 0.5, 1.5, 1.5], rtol=0, atol=1e-7)
    assert set(both.contact_guard.values[:2]) == set(both.guard.values)
    pair = run(thrown.with_values(place=0.77, other=0.75), sl.RK4(0.3, events), [[0, 2.0]], 0.6)
    assert pair.contact_guard.values.tolist() == pair.guard.values[::-1].tolist()


@pytest.mark.parametrize("events", LOCATED)
def test_a_start_on_the_boundary_is_no_contact(events):
    """Nor is one at rest, whose acceleration decides."""
    for speed, fall, side in ((1.0, 2, 1), (-1.0, 2, 0), (0.0, 2, 0), (0.0, -2, 1)):
        system = thrown.with_values(place=0.0, fall=fall)
        found = run(system, sl.RK4(0.01, events), [[0.0, speed]], 0.3)
        assert found.sizes["contact"] == 0
        assert found["mode"].values[0, -1] & 1 == side


def test_multipliers_come_to_the_exact_ones_with_order_4():
    from saltus.flow.maps import Stroboscope

    system, start = oscillator.with_values(push=0.3, drag=0.5), STARTS[:8]

    def tangent(method):
        return Stroboscope(system, method, every=5.0).tangent(start, 1)[1]

    exact = tangent(sl.Taylor())
    errors = [np.abs(tangent(sl.RK4(h, "bisect")) - exact).max() for h in (0.02, 0.01)]
    assert 3.4 < np.log2(errors[0] / errors[1]) < 4.6


@pytest.mark.parametrize("events", LOCATED)
def test_a_motion_that_sticks_is_named(events):
    """v' = 0.5 cos t - sign v from v = 1: v = 1 + 0.5 sin t - t until it is zero; there both sides
    push onto v = 0.
    """

    @sl.system(states="v")
    def rub(t, v, *, friction=1.0):
        return 0.5 * sl.cos(t) - sl.piecewise((friction, v > 0), otherwise=-friction)

    with pytest.warns(SaltusWarning, match="sliding"):
        found = run_of(rub, sl.RK4(0.01, events))
    assert found.status.item() == "sliding"
    assert 0.0 < 1 + 0.5 * np.sin(found.end_time.item()) - found.end_time.item() < 0.02


# -- options ---------------------------------------------------------------------------------------


def test_the_last_step_ends_at_the_end():
    free = oscillator.with_values(place=100.0)
    found = run(free, sl.RK4("30 ms", "ignore"), [[1.0, 0.0]], 1.0)
    assert found.steps.item() == 34
    assert found.end_time.item() == 1.0
    assert run(free, sl.RK4(0.1, "ignore"), [[1.0, 0.0]], 1.0).steps.item() == 10


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"step": 0.0}, "step must be a positive number"),
        ({"step": "1 m"}, "step"),
        ({"step": 0.1, "events": "locate"}, 'one of "ignore", "henon", "inverse", "bisect"'),
        ({"step": 0.1, "tolerance": 2.0}, "share of a step"),
    ],
)
def test_bad_options_are_refused(arguments, message):
    with pytest.raises(sl.SaltusError, match=message):
        sl.RK4(**arguments)


@pytest.mark.parametrize("events", ["ignore", *LOCATED])
def test_samples_come_to_the_solution_with_order_4_also_in_steps_that_land(events):
    system = oscillator if events == "ignore" else oscillator.with_values(push=1.0)
    exact, errors = sl.simulate(system, STARTS, t_end=5.0, samples=999).x, []
    for step in (0.05, 0.025, 0.0125):
        found = sl.simulate(
            system, STARTS, t_end=5.0, samples=999, method=sl.RK4(step, events), progress=False
        )
        errors.append(float(np.abs(found.x - exact).max()))
    assert np.polyfit([2, 1, 0], np.log2(errors), 1)[0] > 3.5
