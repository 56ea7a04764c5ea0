"""Contact laws without a Taylor series on their boundary, K d^p with p not whole, held against
closed forms and another solver.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import saltus as sl
from power_laws import duration_of, power_stop, pressed_period, rebound_of
from saltus.system.tangent import tangent_system

EPS = 2.0**-52
METHOD = sl.Taylor(lanes=2)
POWERS = (1.5, 2.5, 1.2, 0.5, math.sqrt(2), 2.0)


def run_of(system, start, t_end, **options):
    return sl.simulate(
        system, start, t_end=t_end, **{"method": METHOD, "time_errors": "local", **options}
    )


@pytest.mark.parametrize("stiffness", [1e3, 1e6, 1e9])
@pytest.mark.parametrize("power", POWERS)
def test_duration_and_rebound_of_an_elastic_contact(power, stiffness):
    system = power_stop.with_values(stiffness=stiffness, power=power)
    truth = duration_of(0.1, stiffness, power)
    run = run_of(system, (-1e-3, 0.1), 0.01 + 1.5 * truth)
    assert run.status.item() == "ok"
    first, last = run.contact_time.values
    assert abs(first - 0.01) <= 4 * EPS * 0.01
    assert abs(last - first - truth) <= 16 * EPS * (truth + 0.01)
    assert abs(run.end_v.item() + 0.1) <= 32 * EPS * 0.1


def test_the_hertz_contact_of_the_handbook():
    run = run_of(power_stop, (-0.001, 0.1), 0.05)
    assert np.abs(np.diff(run.contact_time.values) - 0.02030462036827759).max() < 1e-16


@pytest.mark.parametrize("dashpot", [0.1, 1.0, 5.0])
@pytest.mark.parametrize("power", [1.5, 0.5])
def test_rebound_from_a_hunt_crossley_stop_does_not_depend_on_stiffness_or_power(power, dashpot):
    run = run_of(
        power_stop.with_values(dashpot=dashpot, power=power, stiffness=1e5), (-1e-3, 0.5), 0.1
    )
    assert run.sizes["contact"] == 2
    assert abs(-run.end_v.item() / rebound_of(0.5, dashpot) - 1) < 64 * EPS


@pytest.mark.parametrize(
    ("v", "lift", "contacts", "status"),
    [
        (0.1, 0, 1, "ok"),
        (-0.1, 0, 0, "ok"),
        (0, -1, 0, "ok"),
        (0, 0, 0, "resting"),
        (1e-6, -1, 1, "ok"),
    ],
)
def test_a_start_on_the_boundary_goes_where_the_motion_goes(v, lift, contacts, status):
    run = run_of(power_stop.with_values(lift=float(lift)), (0.0, v), 0.03)
    assert (run.status.item(), run.sizes["contact"]) == (status, contacts)


@pytest.mark.parametrize("power", [1.5, 2.5, 0.5])
def test_a_mass_pressed_from_rest_on_the_boundary_comes_back_after_the_period_of_the_closed_form(
    power,
):
    """It enters at zero speed. At half the period it is deepest and at rest."""
    period = pressed_period(1.0, 1e4, power)
    run = run_of(
        power_stop.with_values(lift=1.0, power=power, stiffness=1e4), (0.0, 0.0), 0.5 * period
    )
    deepest = ((power + 1) / 1e4) ** (1 / power)
    assert abs(run.end_x.item() / deepest - 1) < 16 * EPS
    assert abs(run.end_v.item()) < 64 * EPS * deepest / period


def test_a_mass_at_rest_is_met_by_a_moving_stop():
    """Nothing but the stop's force moves it: every digit of its speed comes from the law."""
    system = power_stop.with_values(shake=1e-3, gap=5e-4, frequency=3.0)
    run = run_of(system, (0.0, 0.0), 0.3, samples=3)
    assert run.status.item() == "ok"
    assert abs(run.contact_time.values[0] - 1 / 9) < 4 * EPS
    truth = piecewise_solution(system, (0.0, 0.0), run.contact_time.values, 0.3, first_side=-1)
    assert abs(run.end_v.item() - truth[1]) < 1e-10 * abs(truth[1])


@pytest.mark.parametrize(
    ("power", "dashpot"), [(1.5, 0.0), (1.5, 0.3), (0.5, 0.0), (math.sqrt(2), 0.1)]
)
def test_a_forced_oscillator_agrees_with_another_solver(power, dashpot):
    system = power_stop.with_values(
        power=power,
        stiffness=2e3,
        gap=0.3,
        dashpot=dashpot,
        spring=1.0,
        damping=0.1,
        force=1.0,
        frequency=0.17,
        shake=0.02,
    )
    run = run_of(system, (0.1, 0.2), 30.0)
    assert run.sizes["contact"] >= 6
    truth = piecewise_solution(system, (0.1, 0.2), run.contact_time.values, 30.0, first_side=-1)
    assert np.abs(np.array([run.end_x.item(), run.end_v.item()]) - truth).max() < 1e-9


def piecewise_solution(system, start, contacts, end, first_side):
    """DOP853 from contact to contact, its own gap checked to be zero there; beside a boundary in
    the square root of the time.
    """
    p = system.values
    w = 2 * math.pi * p["frequency"]
    state, now, side = np.array(start, float), 0.0, first_side
    for then in (*contacts, end):

        def rate(t, y, side=side):
            drive = math.cos(w * t)
            depth = max(y[0] - p["gap"] - p["shake"] * drive, 0.0)
            stop = (
                p["stiffness"] * depth ** p["power"] * (1 + p["dashpot"] * y[1])
                if side > 0
                else 0.0
            )
            return np.array(
                [
                    y[1],
                    p["lift"]
                    + p["force"] * drive
                    - p["spring"] * y[0]
                    - p["damping"] * y[1]
                    - stop,
                ]
            )

        half = 0.5 * (then - now)
        # t = now + s^2 up to the middle, then t = then - s^2
        for low, sign in ((now, 1), (then, -1)):
            span = (0.0, math.sqrt(half)) if sign > 0 else (math.sqrt(half), 0.0)
            solution = solve_ivp(
                lambda s, y, low=low, sign=sign: 2 * sign * s * rate(low + sign * s * s, y),
                span,
                state,
                "DOP853",
                rtol=3e-14,
                atol=1e-15,
            )
            state = solution.y[:, -1]
        now, side = then, -side
        if then < end:
            assert abs(state[0] - p["gap"] - p["shake"] * math.cos(w * then)) < 1e-10
    return state


def test_energy_is_kept_over_a_thousand_contacts():
    """A ball on a Hertz floor: lift pulls it to the boundary. 6e4 steps that each round by 1e-16 at
    random make 1e-13.
    """
    system = power_stop.with_values(lift=9.81, stiffness=1e7)
    run = run_of(system, (-0.1, 0.0), 290.0)
    assert run.sizes["contact"] > 1900
    inside = run.end_x.item() > 0
    energy = (
        0.5 * run.end_v.item() ** 2
        - 9.81 * run.end_x.item()
        + (1e7 * run.end_x.item() ** 2.5 / 2.5 if inside else 0.0)
    )
    assert abs(energy / 0.981 - 1) < 4e-13


def test_the_motion_back_in_time_ends_at_the_start():
    system = power_stop.with_values(lift=1.0, stiffness=1e5, power=1.2)
    there = run_of(system, (-0.1, 0.3), 10.0)
    back = run_of(system, (there.end_x.item(), -there.end_v.item()), 10.0)
    assert there.sizes["contact"] == back.sizes["contact"] > 10
    assert abs(back.end_x.item() + 0.1) < 1e-13
    assert abs(back.end_v.item() + 0.3) < 1e-12


def test_digits_do_not_depend_on_neighbours():
    starts = np.column_stack([-np.linspace(1e-3, 2e-2, 7), np.linspace(0.05, 1.0, 7)])
    system = power_stop.with_values(lift=2.0, stiffness=1e6)
    together = run_of(system, starts, 0.7)
    for i, start in enumerate(starts):
        alone = run_of(system, tuple(start), 0.7)
        assert alone.end_x.item() == together.end_x.values[i]
        assert alone.end_v.item() == together.end_v.values[i]


@pytest.mark.parametrize("late", [1e-10, 1e-8, 1e-6, 1e-5])
def test_samples_and_ends_beside_the_boundary_are_exact(late):
    """v0 - v = K v0^p t^(p+1)/(p+1) to first order; nothing depends on the frequency, whose period
    makes the samples.
    """
    run = run_of(power_stop.with_values(frequency=1 / late), (0.0, 0.1), late, samples=4)
    times = late * np.arange(5) / 4
    lost = 1e6 * 0.1**1.5 * times**2.5 / 2.5
    assert run.v.values.shape == (5,)
    assert np.all(np.abs(0.1 - lost - run.v.values) < 4 * EPS * 0.1 + 1e3 * late * lost)


@pytest.mark.parametrize("power", [1.5, 2.5, 1.2, 0.5])
def test_the_tangent_flow_across_a_contact(power):
    """x = -v0 t - x0 + v0 T(v0) after it, with T ~ v0^((1-p)/(1+p)): the four derivatives."""
    assert_tangent_across_a_contact(power_stop.with_values(stiffness=1e4, power=power), power)


@pytest.mark.parametrize(
    "law", [lambda d: d * sl.sqrt(d), lambda d: d**2 / sl.sqrt(d)], ids=["root", "quotient"]
)
def test_the_tangent_flow_of_a_law_written_with_a_root(law):
    """Its derivative holds d/sqrt(d), which is 0/0 on the boundary."""

    @sl.system(states="x v")
    def stop(t, x, v, *, stiffness=1e4):
        return v, -sl.piecewise((stiffness * law(x), x > 0), otherwise=0)

    assert_tangent_across_a_contact(stop, 1.5)


def assert_tangent_across_a_contact(stop, power, stiffness=1e4, x0=-1e-2, v0=0.5):
    system, duration = tangent_system(stop), duration_of(v0, stiffness, power)
    end = -x0 / v0 + 2 * duration
    run = run_of(system, (x0, v0, 1, 0, 0, 1), end, method=sl.Taylor(lanes=2))
    tangent = [run[f"end_{name}"].item() for name in system.states[2:]]
    truth = [-1.0, -end + 2 * duration / (power + 1), 0.0, -1.0]
    assert np.abs(np.subtract(tangent, truth)).max() < 1e-12


@sl.system(states="x v")
def lossy_stop(t, x, v, *, stiffness=2.47e6, stop=0.005):
    """A Hertz stop with a loss on the way in, a root in a root: example 4 of DISODE45 (Calvo,
    Montijano & Randez).
    """
    depth = x - stop
    force, loss = stiffness * depth**1.5, 1.98 * sl.sqrt(2 * stiffness * sl.sqrt(depth)) * v
    contact = sl.piecewise((force + loss, (depth > 0) & (v > 0)), (force, depth > 0), otherwise=0)
    return v, (-4.1 * v - 210.125 * x - contact - 2 * sl.sin(14 * t)) / 2


def test_the_published_switches_of_a_lossy_hertz_stop():
    """Entry, turn and exit, six times; the first entry is printed to ten digits. Turns outside the
    stop switch nothing.
    """
    run = run_of(lossy_stop, (0.0, 0.0), 3.0, method=sl.Taylor(lanes=2))
    assert run.status.item() == "ok"
    at_stop = run.contact_guard.values == "stop"
    entries = run.contact_time.values[at_stop][::2]
    exits = run.contact_time.values[at_stop][1::2]
    turns = run.contact_time.values[~at_stop]
    inside = [np.sum((turns > a) & (turns < b)) for a, b in zip(entries, exits, strict=True)]
    assert inside == [1] * 6
    assert abs(entries[0] - 0.4006647561) < 1e-10
