"""ode23: beside the published rules written out once more in NumPy, beside SciPy, beside closed
forms.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import saltus as sl

PLACE, END = 0.3, 10.0


@sl.system(states="x v")
def oscillator(t, x, v, *, stiffness=0.0, place=PLACE):
    stop = sl.piecewise((stiffness * (x - place), x > place), otherwise=0)
    return v, -x - 0.1 * v + sl.cos(0.7 * t) - stop


def rate(t, y, stiffness=0.0):
    stop = stiffness * (y[0] - PLACE) if y[0] > PLACE else 0.0
    return np.array([y[1], -y[0] - 0.1 * y[1] + math.cos(0.7 * t) - stop])


def published(y, rtol, atol, stiffness=0.0):
    """Shampine & Reichelt's ode23: the state at the end, accepted and failed steps."""
    y, t, theta, f1 = np.array(y), 0.0, atol / rtol, rate(0.0, y, stiffness)
    slowness = np.abs(f1 / np.maximum(np.abs(y), theta)).max() / (0.8 * rtol ** (1 / 3))
    length, steps, failed = min(0.1 * END, 1 / slowness), 0, 0
    while t < END:
        shortest, first = 16 * np.spacing(t), True
        length = min(0.1 * END, max(shortest, length))
        last = 1.1 * length >= END - t
        length = END - t if last else length
        while True:
            f2 = rate(t + length * 0.5, y + length * (0.5 * f1), stiffness)
            f3 = rate(t + length * 0.75, y + length * (0.75 * f2), stiffness)
            t_new = END if last else t + length
            new = y + (t_new - t) * (2 / 9 * f1 + 1 / 3 * f2 + 4 / 9 * f3)
            f4 = rate(t_new, new, stiffness)
            off = (-5 / 72 * f1 + 1 / 12 * f2 + 1 / 9 * f3 + -1 / 8 * f4) / np.maximum(
                np.maximum(np.abs(y), np.abs(new)), theta
            )
            err = length * np.abs(off).max()
            if err <= rtol:
                break
            shrink = max(0.5, 0.8 * (rtol / err) ** (1 / 3)) if first else 0.5
            length, last, first, failed = max(shortest, length * shrink), False, False, failed + 1
        if first:
            grow = 1.25 * (err / rtol) ** (1 / 3)
            length = length / grow if grow > 0.2 else 5 * length
        t, y, f1, steps = t_new, new, f4, steps + 1
    return y, steps, failed


def run(method, start, system=oscillator, **more):
    return sl.simulate(system, start, t_end=END, time_errors="local", method=method, **more)


def ends(ds):
    return np.stack([ds.end_x.values, ds.end_v.values], axis=-1)


STARTS = np.random.default_rng(3).uniform((-1.5, -1.0), (1.5, 1.0), (8, 2))


@pytest.mark.parametrize("stiffness", [0.0, 25.0])
@pytest.mark.parametrize("rtol", [1e-3, 1e-6])
def test_steps_and_states_are_those_of_the_published_rules(stiffness, rtol):
    ds = run(
        sl.ODE23(rtol, rtol * 1e-3, events="ignore"),
        STARTS,
        oscillator.with_values(stiffness=stiffness),
        samples=1,
    )
    for i, start in enumerate(STARTS):
        end, steps, failed = published(start, rtol, rtol * 1e-3, stiffness=stiffness)
        assert (ds.steps.values[i], ds.rejected_steps.values[i]) == (steps, failed)
        assert ends(ds)[i].tolist() == end.tolist()


def test_the_error_follows_the_tolerance_and_the_steps_the_order():
    exact = ends(run(sl.Taylor(), STARTS))
    rtols, errors, steps = 10.0 ** -np.arange(4.0, 9.0), [], []
    for rtol in rtols:
        ds = run(sl.ODE23(rtol, rtol), STARTS)
        errors.append(np.sqrt(np.mean((ends(ds) - exact) ** 2)))
        steps.append((ds.steps - ds.events).mean().item())
    assert abs(np.polyfit(np.log(rtols), np.log(errors), 1)[0] - 1.0) < 0.15
    assert abs(-np.polyfit(np.log(steps), np.log(errors), 1)[0] - 3.0) < 0.3


@pytest.mark.parametrize("events", ["locate", "ignore"])
def test_across_contacts_the_error_follows_the_tolerance_too(events):
    system = oscillator.with_values(stiffness=25.0)
    exact = ends(run(sl.Taylor(), STARTS, system))
    rtols = 10.0 ** -np.arange(4.0, 9.0)
    errors = [
        np.sqrt(np.mean((ends(run(sl.ODE23(q, q, events=events), STARTS, system)) - exact) ** 2))
        for q in rtols
    ]
    assert abs(np.polyfit(np.log(rtols), np.log(errors), 1)[0] - 1.0) < 0.25


def test_contacts_lie_on_the_boundary_and_come_to_the_exact_times():
    system = oscillator.with_values(stiffness=25.0)
    exact = run(sl.Taylor(), STARTS, system).contact_time.values
    for rtol in (1e-5, 1e-8):
        ds = run(sl.ODE23(rtol, rtol), STARTS, system)
        assert np.abs(ds.contact_x.values - PLACE).max() < 1e-12  # 128 ulp of the time
        assert np.abs(ds.contact_time.values - exact).max() < 100 * rtol


def test_samples_and_solutions_are_scipys():
    integrate = pytest.importorskip("scipy.integrate")
    times = np.linspace(0.0, END, 41)
    ds = run(sl.ODE23(1e-7, 1e-9), [STARTS[0]], samples=40)
    other = integrate.solve_ivp(
        rate, (0.0, END), STARTS[0], "RK23", rtol=1e-7, atol=1e-9, t_eval=times
    )
    np.testing.assert_allclose(ds.x.values.ravel(), other.y[0], rtol=0, atol=5e-6)


def test_one_step_is_scipys_to_rounding():
    """A tolerance that never binds: the longest step is a tenth of the span."""
    rk = pytest.importorskip("scipy.integrate._ivp.rk")
    y, f = STARTS[0], rate(0.0, STARTS[0])
    y = np.array(y)
    for n in range(10):
        y, f = rk.rk_step(rate, float(n), y, f, 1.0, rk.RK23.A, rk.RK23.B, rk.RK23.C,
                          np.empty((4, 2)))  # fmt: skip
    ds = run(sl.ODE23(1.0, 1e9, events="ignore"), [STARTS[0]])
    assert ds.steps.item() == 10
    np.testing.assert_allclose(ends(ds)[0], y, rtol=0, atol=1e-14)
