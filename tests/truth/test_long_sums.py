"""Motions of structures of many modes, whose long sums are loops: beside the same equations written
out, and beside SciPy.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import saltus as sl
from saltus.codegen import long_sums as ls
from saltus.codegen import module, plain_series
from saltus.codegen.taylor_head import taylor_head

#: Fewer than are loops by default: written out they take long to compile.
MODES = 10


@pytest.fixture(autouse=True)
def loops(monkeypatch):
    monkeypatch.setattr(ls, "LEAST_STATES", 2 * MODES)


def structure(law, seed):
    """The lowest modes of a random chain with contacts at two places."""
    random = np.random.default_rng(seed)
    springs = random.uniform(0.5, 2.0, 3 * MODES)
    stiffness = np.diag(springs + np.append(springs[1:], 0))
    stiffness -= np.diag(springs[1:], 1) + np.diag(springs[1:], -1)
    squares, shapes = np.linalg.eigh(stiffness)
    squares, shapes = squares[:MODES].tolist(), shapes[:, :MODES].tolist()
    first = float(np.sqrt(squares[0]) / (2 * np.pi))
    names = [f"q{i}" for i in range(MODES)] + [f"w{i}" for i in range(MODES)]

    def push(d, rate, k, gap):
        if law == "hertz":
            return sl.piecewise((k * (d - gap) ** 1.5 * (1 + 0.05 * rate), d > gap), otherwise=0)
        if law == "stops":
            return sl.freeplay(d, stiffness=k, lower_gap=gap, upper_gap=gap) + 0.01 * d**3
        if law == "rigid":
            return 0.1 * k * d**3
        if law == "dry":
            return sl.friction(rate, slip=0.01) + sl.freeplay(d, stiffness=k, upper_gap=gap)
        return k * sl.tanh(20 * rate) / 20 + sl.freeplay(d, stiffness=k, upper_gap=gap)

    @sl.system(states=names, forced_at="frequency", name=law)
    def chain(t, *y, k=0.7, gap=0.2, amplitude=0.05, frequency=0.9 * first):
        q, w = y[:MODES], y[MODES:]
        drive = amplitude * sl.cos(2 * sl.pi * frequency * t)
        load = [a * drive for a in shapes[-1]]
        for at in (shapes[-1], shapes[-9]):
            d, rate = (sum(a * one for a, one in zip(at, of, strict=True)) for of in (q, w))
            force = push(d, rate, k, gap)
            load = [x - a * force for x, a in zip(load, at, strict=True)]
        rates = [
            one - square * x - 0.02 * v
            for one, square, x, v in zip(load, squares, q, w, strict=True)
        ]
        masses = dict.fromkeys(names[MODES:], 1.0)
        stop = sl.impact(d < gap, rate, restitution=0.6, inertia=masses) if law == "rigid" else None
        return (*w, *rates, *([stop] if stop is not None else []))

    return chain


def motions(system, method):
    """Some motions, one of them from rest, with all contacts."""
    starts = np.zeros((3, 2 * MODES))
    starts[1, 0], starts[2, 1] = 0.6, -0.8
    return sl.simulate(system, starts, periods=4, method=method, samples=16, progress=False)


@pytest.mark.parametrize(
    ("law", "lanes"),
    [
        ("hertz", None),
        ("hertz", 16),
        ("stops", None),
        ("rubbing", None),
        ("rigid", None),
        ("dry", None),
    ],
)
@pytest.mark.slow
def test_loops_and_plain_code_give_the_same_motion(law, lanes, monkeypatch):
    system, method = structure(law, 11), sl.Taylor(lanes=lanes)
    assert "add_up" in taylor_head(system, 20, 4).functions
    looped = motions(system, method)
    monkeypatch.setattr(ls, "LEAST_STATES", 1000)
    module.taylor_module.cache_clear()
    plain_series.series_module.cache_clear()
    plain = motions(system, method)
    module.taylor_module.cache_clear()
    plain_series.series_module.cache_clear()
    assert set(looped.status.values) == {"ok"}
    assert len(looped.contact) == len(plain.contact) > 20
    period = 1.0 / system.values["frequency"]
    apart = np.abs(looped.contact_time - plain.contact_time).max()
    assert apart < 1e-12 * period
    for name in system.states:
        a, b = looped[name].values, plain[name].values
        assert np.abs(a - b).max() < 1e-11 * np.abs(b).max()


@pytest.mark.slow
def test_a_motion_is_that_of_scipy():
    system = structure("rubbing", 3)
    start = np.zeros(2 * MODES)
    start[0] = 0.8
    run = sl.simulate(system, start, periods=1, samples=8, progress=False)
    period = 1.0 / system.values["frequency"]
    other = solve_ivp(
        system.rhs, (0, period), start, "DOP853", rtol=1e-11, atol=1e-13,
        t_eval=np.minimum(run.time.values, period),
    )  # fmt: skip
    assert len(run.contact) > 0
    found = np.array([run[name].values for name in system.states])
    size = np.abs(other.y).max(axis=1, keepdims=True)
    assert np.all(np.abs(found - other.y) < 1e-7 * size.max())
