"""Records, sweeps and moving bases of structures against SciPy's integration of the full matrices
and against closed forms.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import scipy.integrate as si
import scipy.interpolate as interpolate
import scipy.signal as signal

import saltus as sl
from saltus.flow.maps import Stroboscope

N = 6
MASS = (4 * np.eye(N) + np.eye(N, k=1) + np.eye(N, k=-1)) / 12
STIFFNESS = 800.0 * (2 * np.eye(N) - np.eye(N, k=1) - np.eye(N, k=-1))
DAMPING = 4e-4 * STIFFNESS + 0.1 * MASS
TIMES = np.linspace(0, 0.8, 33)
RECORD = 9 * np.sin(23 * TIMES) + 4 * np.cos(71 * TIMES)
#: How each degree of freedom moves with the base: no mode of the structure is alone in it.
MOVED = np.array([1.0, 1.0, 0.5, 1.0, -0.3, 1.0])
STOP = sl.Contact("x6", stiffness="30 kN/m", gap="2 mm")


def by_scipy(load, t_end, stop=None, step=np.inf):
    """State of the full matrices at a time, from rest, by DOP853, begun anew after each step: at
    the knots of a record its order is lost.
    """
    inverse = np.linalg.inv(MASS)

    def rates(t, y):
        force = load(t) - STIFFNESS @ y[:N] - DAMPING @ y[N:]
        if stop is not None:
            force[N - 1] -= stop.stiffness * max(y[N - 1] - stop.gap, 0.0)
        return np.concatenate([y[N:], inverse @ force])

    state, knots = np.zeros(2 * N), np.linspace(0, t_end, max(2, round(t_end / step) + 1))
    for begin, end in itertools.pairwise(knots):
        run = si.solve_ivp(rates, (begin, end), state, "DOP853", rtol=1e-12, atol=1e-14)
        state = run.y[:, -1]
    return state


def ended(made, t_end):
    """Deflections and velocities of all degrees of freedom at a time, from rest."""
    run = sl.simulate(made, np.zeros(2 * N), t_end=t_end, progress=False)
    state = np.array([run[f"end_{name}"].item() for name in made.states])
    if made.states[0] == "x1":
        return state
    shapes = sl.structure_modes(MASS, STIFFNESS)["shape"].values
    return np.concatenate([shapes @ state[:N], shapes @ state[N:]])


@pytest.mark.parametrize("modes", [None, N])
def test_a_base_that_moves_by_a_record(modes):
    made = sl.structure(
        MASS, STIFFNESS, DAMPING, base=sl.Base(MOVED, sl.recorded(TIMES, RECORD / 9.80665, "g0")),
        modes=modes,
    )  # fmt: skip
    spline = interpolate.CubicSpline(TIMES, RECORD)
    truth = by_scipy(lambda t: -MASS @ MOVED * spline(t), TIMES[-1], step=TIMES[1])
    assert np.abs(ended(made, TIMES[-1]) - truth).max() < 1e-10 * np.abs(truth).max()
    assert made.forced_at is None


def test_a_record_and_a_stop():
    """Small steps of SciPy find the contacts to their own order only."""
    stop = sl.Contact("x6", stiffness=3e4, gap=2e-3)
    made = sl.structure(
        MASS, STIFFNESS, DAMPING, modes=N, contacts=[stop],
        forces=[sl.Force("x3", sl.recorded(TIMES, RECORD, "N"))],
    )  # fmt: skip
    spline = interpolate.CubicSpline(TIMES, RECORD)
    push = np.eye(N)[2]
    truth = by_scipy(lambda t: push * spline(t), TIMES[-1], stop, step=1e-4)
    run = sl.simulate(made, np.zeros(2 * N), t_end=TIMES[-1], progress=False)
    assert run.sizes["contact"] > 8
    assert np.abs(ended(made, TIMES[-1]) - truth).max() < 1e-7 * np.abs(truth).max()


def test_a_base_that_shakes_harmonically_in_the_steady_state():
    """Complex amplitudes of the full matrices."""
    frequency, amplitude, phase = 3.0, 2.0, 0.7
    made = sl.structure(
        MASS, STIFFNESS, DAMPING, modes=N, frequency=frequency,
        base=[sl.Base("x", f"{amplitude} m/s^2", phase=phase), sl.Base(MOVED, 0.5, harmonic=2)],
    )  # fmt: skip
    truth = np.zeros(2 * N)
    for moved, level, w, angle in (
        (np.ones(N), amplitude, 2 * math.pi * frequency, phase),
        (MOVED, 0.5, 4 * math.pi * frequency, 0.0),
    ):
        dynamic = STIFFNESS - w**2 * MASS + 1j * w * DAMPING
        x = np.linalg.solve(dynamic, -MASS @ moved * level * np.exp(1j * angle))
        truth += np.concatenate([x.real, (1j * w * x).real])
    shapes = sl.structure_modes(MASS, STIFFNESS)["shape"].values
    truth = np.concatenate([shapes.T @ MASS @ one for one in (truth[:N], truth[N:])])
    state = Stroboscope(made, sl.Taylor(lanes=2)).run(truth[None, :], 3).state[0]
    assert np.abs(state - truth).max() < 1e-12 * np.abs(truth).max()


@pytest.mark.parametrize(
    ("first", "last", "rate", "duration", "kind"),
    [
        (5.0, 20.0, "30 Hz/s", 0.5, "linear"),
        (20.0, 5.0, "30 Hz/s", 0.5, "linear"),
        (5.0, 40.0, "2 oct/s", 1.5, "logarithmic"),
        (40.0, 5.0, "120 oct/min", 1.5, "logarithmic"),
    ],
)
def test_the_phase_of_a_sweep(first, last, rate, duration, kind):
    run_up = sl.sweep(first, last, rate, amplitude="3 mm")
    assert run_up.duration == pytest.approx(duration, rel=1e-15)
    assert run_up.unit == "m"
    t = np.linspace(0, duration, 200)
    truth = 3e-3 * signal.chirp(t, first, duration, last, kind, phi=-90)
    assert np.abs(run_up(t) - truth).max() < 3e-3 * 1e-12
    # from there on the frequency stays, and neither value nor frequency jumps
    beyond = 2 * math.pi * (run_up.turns(duration) + last * (t - duration))
    later = t > duration
    assert np.allclose(run_up(t)[later], 3e-3 * np.sin(beyond[later]), atol=1e-14)
    step = 1e-6
    slopes = [(run_up.turns(duration + d) - run_up.turns(duration)) / d for d in (-step, step)]
    assert slopes == pytest.approx([last, last], rel=1e-4)


@pytest.mark.parametrize("rate", ["30 Hz/s", "2 oct/s"])
def test_a_sweep_in_an_equation(rate):
    """Its integral by quadrature, over the break at its end."""
    run_up = sl.sweep("5 Hz", "20 Hz", rate)

    @sl.system(states="x")
    def summed(t, x, *, level=2.0):
        return level * run_up(t)

    end = 1.3 * run_up.duration
    found = sl.simulate(summed, (0.0,), t_end=end, progress=False)["end_x"].item()
    parts = [(0, run_up.duration), (run_up.duration, end)]
    truth = sum(si.quad(run_up, *part, epsabs=1e-13, limit=400)[0] for part in parts)
    assert found == pytest.approx(2 * truth, abs=1e-12)


def test_parameters_of_a_sweep():
    """Its frequencies may be parameters of the equation."""

    @sl.system(states="x v", units={"x": "m", "v": "m/s"})
    def shaken(t, x, v, *, first="5 Hz", last="20 Hz", rate="30 Hz/s", force="2 N", mass="1 kg"):
        return v, force / mass * sl.sweep(first, last, rate)(t)

    swept = sl.sweep(5.0, 20.0, 30.0)
    for t in (0.2, 0.7):
        assert shaken.rhs(t, np.zeros(2))[1] == pytest.approx(2 * swept(t), abs=1e-12)


def test_a_structure_swept_through_a_resonance():
    made = sl.structure(
        MASS, STIFFNESS, DAMPING, modes=N,
        base=sl.Base("x*", sl.sweep("2 Hz", "12 Hz", "10 Hz/s", amplitude="3 m/s^2")),
    )  # fmt: skip
    t_end = 1.2  # the sweep ends at 1 s

    def base(t):
        turns = 2 * t + 5 * t**2 if t < 1 else 7 + 12 * (t - 1)
        return -MASS @ np.ones(N) * 3 * math.sin(2 * math.pi * turns)

    truth = by_scipy(base, t_end, step=0.01)
    assert np.abs(ended(made, t_end) - truth).max() < 1e-9 * np.abs(truth).max()


def test_functions_of_the_time():
    """A shock, and a square wave with the period of the forcing frequency."""
    shock = sl.Force("x2", lambda t: 20 * sl.pulse(t, 0.011, shape="half_sine"))
    made = sl.structure(MASS, STIFFNESS, DAMPING, modes=N, forces=[shock, sl.Force("x3", 2.0)],
        frequency=3.0)  # fmt: skip
    assert made.forced_at is None

    def load(t):
        half = 20 * math.sin(math.pi * t / 0.011) if t < 0.011 else 0.0
        return half * np.eye(N)[1] + 2 * math.cos(6 * math.pi * t) * np.eye(N)[2]

    truth = by_scipy(load, 0.3, step=1e-4)
    assert np.abs(ended(made, 0.3) - truth).max() < 1e-7 * np.abs(truth).max()

    wave = sl.Force("x2", lambda t, frequency: 5 * sl.square(2 * sl.pi * frequency * t))
    beaten = sl.structure(MASS, STIFFNESS, DAMPING, modes=N, forces=[wave], frequency=3.0)
    assert beaten.forced_at == "frequency"
    assert beaten.values["force_scale"] == 1.0
    one, two = (sl.simulate(beaten, np.zeros(2 * N), values={"force_scale": scale}, periods=2,
        progress=False)["end_q1"].item() for scale in (1.0, 2.0))  # fmt: skip
    assert two == pytest.approx(2 * one, rel=1e-12)
