"""Drives with breaks and contacts without a Taylor series in one system, against an independent
solver.
"""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import saltus as sl
from saltus.analysis.basins import pipeline

METHOD = sl.Taylor(lanes=2)
CUTS, POINTS, VALUES = (
    [0.0, 0.2, 0.45, 0.5, 0.8, 1.0],
    [0.0, 0.2, 0.45, 0.8, 1.0],
    [1.0, 3.0, -1.0, 0.5, 1.0],
)


@sl.system(states="x v", forced_at="frequency")
def both(
    t, x, v, *, stiffness=9.0, damping=0.4, square=0.8, record=0.5, force=0.3, gap=0.1, hertz=300.0,
    loss=0.2, frequency=0.7
):  # fmt: skip
    """An oscillator with a Hertz stop under a cosine, a square wave and a record that is one period
    long.
    """
    cycles = frequency * t
    push = force * sl.cos(2 * sl.pi * cycles) + square * sl.where(
        sl.sin(2 * sl.pi * cycles) > 0, 1, -1
    )
    push += record * sl.table(cycles, POINTS, VALUES, outside="periodic")
    depth = x - gap
    stop = sl.piecewise((hertz * depth**1.5 * (1 + loss * v), depth > 0), otherwise=0)
    return v, push - stiffness * x - damping * v - stop


def one_period(start, p):
    """State after a period, largest |x|, mean and mean square of x: by SciPy, from break to break
    and from contact to contact.
    """
    period, u, widest = 1 / p["frequency"], np.array([*start, 0.0, 0.0]), abs(start[0])

    def rates(t, u, pressed):
        cycles = min(max(t / period, low), high)
        push = p["force"] * np.cos(2 * np.pi * t / period) + p["square"] * (
            1 if high <= 0.5 else -1
        )
        push += p["record"] * np.interp(cycles, POINTS, VALUES)
        depth = max(u[0] - p["gap"], 0.0) * pressed
        stop = p["hertz"] * depth**1.5 * (1 + p["loss"] * u[1])
        return [u[1], push - p["stiffness"] * u[0] - p["damping"] * u[1] - stop, u[0], u[0] ** 2]

    def meets(t, u, pressed):
        return u[0] - p["gap"]

    def turns(t, u, pressed):
        return u[1]

    meets.terminal = True
    for low, high in pairwise(CUTS):
        t = low * period
        pressed = u[0] > p["gap"]
        while t < high * period:
            meets.direction = -1 if pressed else 1
            step = {"rtol": 3e-14, "atol": 1e-16, "max_step": period / 1000}
            run = solve_ivp(
                rates,
                (t, high * period),
                u,
                "DOP853",
                **step,
                events=[meets, turns],
                args=(pressed,),
            )
            t, u = run.t[-1], run.y[:, -1]
            pressed = pressed != (run.status == 1)
            widest = max(
                widest, abs(u[0]), *np.abs(run.y_events[1])[:, 0] if len(run.y_events[1]) else [0.0]
            )
    return u[:2], widest, u[2] / period, u[3] / period


@pytest.mark.parametrize(
    "values", [{}, {"square": 0.0, "record": 0.0, "force": 1.5, "hertz": 1e6, "loss": 0.02}]
)
def test_an_orbit_its_size_and_its_multipliers(values):
    system = both.with_values(**values)
    found = sl.attractors(system, (0.1, 0.0), method=METHOD).isel(attractor=0)
    assert found.attractor_period.item() == 1
    assert found.attractor_itinerary.item() == "gap+ gap-"
    start = np.array([found.attractor_x.values[0], found.attractor_v.values[0]])
    end, widest, _, square = one_period(start, system.values)
    np.testing.assert_allclose(end, start, rtol=0, atol=1e-11)
    assert found.attractor_peak.item() == pytest.approx(widest, rel=1e-11)
    assert found.attractor_rms.item() == pytest.approx(np.sqrt(square), rel=1e-11)
    around = [
        start + 1e-5 * way for way in (np.eye(2)[0], -np.eye(2)[0], np.eye(2)[1], -np.eye(2)[1])
    ]
    a, b, c, d = (one_period(one, system.values)[0] for one in around)
    exact = np.linalg.eigvals(np.transpose([a - b, c - d]) / 2e-5)
    multipliers = (
        found.attractor_multiplier_real.values + 1j * found.attractor_multiplier_imag.values
    )
    np.testing.assert_allclose(np.sort_complex(multipliers), np.sort_complex(exact), atol=1e-4)


@pytest.mark.parametrize("start", [(1.0, -1.0), (0.56, 0.0)])
def test_a_contact_goes_on_over_the_end_of_a_period(start):
    """It took ever smaller shares of the time that was left, and never came to the end."""
    run = sl.simulate(both, start, periods=1, samples=4, method=METHOD)
    assert run.status.item() == "ok"
    assert run.steps.item() < 1000
    np.testing.assert_allclose(
        [run.end_x.item(), run.end_v.item()], one_period(start, both.values)[0], rtol=0, atol=1e-11
    )


def test_every_start_of_a_map_settles(monkeypatch):
    monkeypatch.setattr(pipeline, "SCOUTS", 32)
    basins = sl.basins(both, x=(-1, 1, 6), v=(-1, 1, 6), method=METHOD)
    assert (basins.basin.values == 0).all()
