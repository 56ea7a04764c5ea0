"""ode113 and ode15s: closed forms, independent solvers, and errors that follow the tolerance as the
rules say.

ode113 adds its error estimate (local extrapolation), so its errors fall like RelTol; ode15s
doesn't, so a formula of order k leaves errors that fall like RelTol^(k/(k+1)), with k = 5 for most
steps. The exact states are Taylor's, which test_order.py compares with matrix exponentials.
"""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl

END = 20.0
STARTS = np.random.default_rng(7).uniform((-1.5, -1.0), (1.5, 1.0), (12, 2))
LAWS = {"bends": {"stiffness": 25.0}, "jumps": {"push": 1.0}, "none": {}}
RTOLS = 10.0 ** -np.arange(4.0, 12.0)
SLOPE = {sl.ODE113: 1.0, sl.ODE15s: 5 / 6}
ORDER = {sl.ODE113: (9.0, 16.0), sl.ODE15s: (4.5, 7.0)}
both = pytest.mark.parametrize("method", SLOPE)


@sl.system(states="x v")
def oscillator(t, x, v, *, stiffness=0.0, push=0.0, place=0.3):
    stop = sl.piecewise((stiffness * (x - place) + push, x > place), otherwise=0)
    return v, -x - 0.1 * v + sl.cos(0.7 * t) - stop


@sl.system(states="x y")
def van_der_pol(t, x, y, *, mu=1000.0):
    return y, mu * (1 - x**2) * y - x


def run(system, method, start=STARTS, t_end=END, samples=50):
    return sl.simulate(
        system, start, t_end=t_end, samples=samples, time_errors="local", method=method
    )


def error(one, other):
    """Geometric means over the starts: of the state at the end, of the rms of the samples."""
    ends = np.hypot(one.end_x - other.end_x, one.end_v - other.end_v)
    samples = np.sqrt(np.square(one.x - other.x).mean("time"))
    return [np.exp(np.log(part).mean().item()) for part in (ends, samples)]


@both
@pytest.mark.parametrize("events", ["locate", "ignore"])
@pytest.mark.parametrize("law", LAWS)
def test_the_error_follows_the_tolerance(method, law, events):
    system = oscillator.with_values(**LAWS[law])
    exact = run(system, sl.Taylor())
    runs = [run(system, method(rtol, rtol, events=events)) for rtol in RTOLS]
    errors = np.array([error(one, exact) for one in runs])
    slopes = np.polyfit(np.log(RTOLS), np.log(errors), 1)[0]
    assert np.abs(slopes - SLOPE[method]).max() < (0.1 if law == "none" else 0.25)
    if law == "none" and events == "ignore":
        steps = [one.steps.mean().item() for one in runs]
        least, most = ORDER[method]
        assert least < -1 / np.polyfit(np.log(RTOLS), np.log(steps), 1)[0] < most
    if events == "locate":
        times = np.abs(runs[-1].contact_time.values - exact.contact_time.values)
        assert times.max() < 1e-6
        assert np.abs(runs[-1].contact_x.values - 0.3).max() < 1e-12


@both
def test_solutions_are_scipys(method):
    integrate = pytest.importorskip("scipy.integrate")
    times = np.linspace(0.0, END, 41)
    other = integrate.solve_ivp(
        lambda t, y: [y[1], -y[0] - 0.1 * y[1] + np.cos(0.7 * t)],
        (0.0, END), STARTS[0], "DOP853", rtol=1e-12, atol=1e-13, t_eval=times,
    )  # fmt: skip
    found = run(oscillator, method(1e-10, 1e-12, events="ignore"), [STARTS[0]], samples=40)
    np.testing.assert_allclose(found.x.values.ravel(), other.y[0], rtol=0, atol=1e-7)


@both
def test_breaks_of_the_forcing_begin_a_new_leg(method):
    @sl.system(states="x v", forced_at="frequency")
    def pulsed(t, x, v, *, frequency=0.4):
        on = sl.piecewise((1.0, sl.sin(2 * sl.pi * frequency * t) > 0.3), otherwise=0)
        return v, -x - 0.1 * v + on

    exact, found = (
        sl.simulate(pulsed, (0.2, 0.0), 5, samples=9, method=one, time_errors="local")
        for one in (sl.Taylor(), method(1e-9, 1e-9))
    )
    assert np.abs(found.x - exact.x).max() < 1e-6


# -- stiff -----------------------------------------------------------------------------------------


def test_a_fast_decay_beside_a_slow_motion_costs_few_steps():
    """x' = -s (x - cos t) - sin t from x = 1 is cos t for any s."""

    @sl.system(states="x")
    def follower(t, x, *, rate=1e6):
        return -rate * (x - sl.cos(t)) - sl.sin(t)

    found = sl.simulate(follower, [1.0], t_end=10.0, samples=20, method=sl.ODE15s(1e-6, 1e-9))
    assert found.steps.item() < 300
    assert np.abs(found.x.values - np.cos(found.time.values)).max() < 1e-5


def test_van_der_pol_ends_at_the_reference_solution():
    """Mazzia & Magherini, Test Set for IVP Solvers, release 2.4 (2008), problem VDPOL at mu = 1000,
    t = 2000.
    """
    found = sl.simulate(
        van_der_pol, (2.0, 0.0), t_end=2000.0, samples=1, method=sl.ODE15s(1e-9, 1e-12)
    )
    np.testing.assert_allclose(found.end_x, 0.1706167732170483e1, rtol=1e-6)
    np.testing.assert_allclose(found.end_y, -0.8928097010247975e-3, rtol=1e-6)


def test_steps_of_van_der_pol_are_those_that_matlab_counts():
    """vdp1000 with ode15s as it comes: 591 successful steps, 225 failed attempts. MATLAB's print is
    quoted from memory: the page was not at hand.
    """
    found = sl.simulate(van_der_pol, (2.0, 0.0), t_end=3000.0, samples=1, method=sl.ODE15s())
    assert (found.steps.item(), found.rejected_steps.item()) == (591, 225)


def test_steps_of_ode45_are_those_that_matlab_counts():
    """x' = -2 x + t, x(0) = 0 to t = 10: 14 successful steps, 2 failed attempts (MATLAB Answers
    480688, 2019).
    """

    @sl.system(states="x")
    def line(t, x):
        return -2 * x + t

    found = sl.simulate(line, [0.0], t_end=10.0, samples=1, method=sl.ODE45())
    assert (found.steps.item(), found.rejected_steps.item()) == (14, 2)


# -- plain Python ----------------------------------------------------------------------------------


@pytest.mark.nojit
@pytest.mark.parametrize(
    "method",
    [
        *(sl.RK4(0.02, events) for events in ("ignore", "henon", "inverse", "bisect")),
        *(one(1e-6, 1e-6) for one in (sl.ODE23, sl.ODE113, sl.ODE15s)),
    ],
    ids=lambda one: one.label,
)
def test_templates_run_as_plain_python(method):
    system = oscillator.with_values(stiffness=25.0)
    with np.errstate(all="ignore"):  # as compiled code does
        exact, found = (run(system, one, [[0.0, 1.0]], 1.0, 5) for one in (sl.Taylor(), method))
    assert np.abs(found.x - exact.x).max() < 2e-3
    if method.records_contacts:
        assert found.sizes["contact"] == exact.sizes["contact"] > 0
