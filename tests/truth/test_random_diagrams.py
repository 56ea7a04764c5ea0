"""Diagrams of random systems: bifurcations against an independent solver and closed forms."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import saltus as sl


@sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
def stop(t, x, v, *, damping=0.1, contact=5.0, gap=0.5, cubic=0.0, w=1.0):
    """An oscillator with a spring behind a gap, and a cubic one."""
    force = -damping * v - x - cubic * x**3 - contact * sl.max(x - gap, 0)
    return v, force + sl.cos(w * t)


@sl.system(states="x v y")
def oscillator(t, x, v, y, *, damping=0.3, stiffness=2.0, decay=0.5, push=0.1):
    """Begins to oscillate where what pushes it is what damps it; y only decays."""
    return v, (push - damping) * v - stiffness * x - v * v * v, -decay * y


def multipliers(values, start, n):
    """Floquet multipliers by DOP853, which stops wherever x turns: between these it can't pass the
    gap twice. And how well the orbit closes.
    """
    d, k, g, c, w = (values[name] for name in ("damping", "contact", "gap", "cubic", "w"))

    def rates(t, z, touches):
        x, v, m = z[0], z[1], z[2:].reshape(2, 2)
        force = -d * v - x - c * x**3 - touches * k * (x - g) + np.cos(w * t)
        slope = np.array([[0.0, 1.0], [-1.0 - 3 * c * x * x - touches * k, -d]])
        return np.concatenate([[v, force], (slope @ m).ravel()])

    def turns(t, z, touches):
        return z[1]

    def meets(t, z, touches):
        return z[0] - g

    turns.terminal = meets.terminal = True
    exact = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14, "max_step": 0.05 / w}
    t, end, z = 0.0, n * 2 * np.pi / w, np.array([*start, 1.0, 0.0, 0.0, 1.0])
    touches, hop = float(z[0] > g), 1e-9 / w
    while t < end:
        run = solve_ivp(rates, (t, end), z, events=(turns, meets), args=(touches,), **exact)
        if not run.t_events[1].size and (run.y[0, -1] > g) != touches:  # met before it turned
            run = solve_ivp(rates, (t, run.t[-1]), z, events=(meets,), args=(touches,), **exact)
            assert run.t_events[0].size
            touches = 1.0 - touches
        elif run.t_events[1].size:
            touches = float(run.y[1, -1] > 0)
        t, z = run.t[-1], run.y[:, -1]
        if t < end:  # off the event
            run = solve_ivp(rates, (t, min(t + hop, end)), z, args=(touches,), **exact)
            t, z = run.t[-1], run.y[:, -1]
    return np.linalg.eigvals(z[2:].reshape(2, 2)), np.abs(z[:2] - start).max()


def forced(seed):
    """A random diagram; how many events were held against the other solver."""
    rng = np.random.default_rng(seed)
    values = {
        "damping": rng.uniform(0.02, 0.15), "contact": 10 ** rng.uniform(0.5, 2.0),
        "gap": rng.uniform(0.0, 0.8), "cubic": rng.choice([0.0, 0.1]),
    }  # fmt: skip
    low = rng.uniform(0.4, 2.5)
    start = {"x": rng.uniform(-2, 2, 4) * rng.integers(0, 2, 4), "v": rng.uniform(-2, 2, 4)}
    vary = {"w": (low, 1.4 * low, 7)}
    found = sl.bifurcation_diagram(stop, vary, start, values=values, periods=600, progress=False)
    repeats = found.response_period.values > 0
    assert (found.response_branch.values[repeats] < found.sizes.get("branch", 0)).all()
    checked = 0
    for i in range(found.sizes.get("event", 0)):
        place = {"fold": 1.0, "period_doubling": -1.0}.get(str(found.event_kind.values[i]))
        if place is None:
            continue
        n = int(found.branch_periods.values[found.event_branch.values[i]])
        at = {**values, "w": float(found.event_w.values[i])}
        own, apart = multipliers(at, [found.event_x.values[i, 0], found.event_v.values[i, 0]], n)
        assert apart < 1e-7
        assert np.abs(own - place).min() < 1e-4
        checked += 1
    return checked


def unforced(seed):
    """Equilibria at zero, of starts that are zero in some states: one branch and its Hopf point."""
    rng = np.random.default_rng(seed)
    values = {"damping": rng.uniform(0.2, 0.4), "stiffness": 10 ** rng.uniform(-1, 2)}
    size = 10.0 ** rng.uniform(-6, 1)
    start = size * rng.uniform(0.5, 1, 3) * [1, *rng.integers(0, 2, 2)]
    vary = {"push": (0.0, 0.55, 8)}
    found = sl.bifurcation_diagram(
        oscillator, vary, tuple(start), values=values, periods=400, progress=False
    )
    rests = found.response_type.values == "equilibrium"
    assert len(set(found.response_branch.values[rests])) == 1
    hopf = found.event_push.values[found.event_kind.values == "hopf"]
    np.testing.assert_allclose(hopf, [values["damping"]], rtol=1e-9)


@pytest.mark.slow
def test_bifurcations_of_random_oscillators_are_those_of_an_independent_solver():
    assert sum(forced(seed) for seed in range(12)) > 20


@pytest.mark.parametrize("seed", range(4))
def test_equilibria_at_zero_are_one_branch_whatever_the_starts(seed):
    unforced(seed)
