"""Terms that sleep where a step begins: saturated tanh, pulses to come, high powers of time. Taylor
coefficients alone don't see them.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import saltus as sl


@sl.system(states="x v")
def sleeper(
    t,
    x,
    v,
    *,
    spring=20.0,
    damping=0.1,
    force=0.0,
    friction=0.0,
    stop=0.0,
    width=0.01,
    pulse=0.0,
    ramp=0.0,
    duration=0.1,
):
    """An oscillator with everything that can saturate: regularised friction, a smoothed stop at
    0.1, a pulse and a ramp at t = 3.
    """
    contact = stop * (x - 0.1) * (1 + sl.tanh((x - 0.1) / width)) / 2
    drive = (
        force * sl.cos(2 * sl.pi * t)
        + pulse * sl.exp(-(((t - 3) / duration) ** 2))
        + ramp * (1 + sl.tanh((t - 3) / duration)) / 2
    )
    return v, drive - spring * x - damping * v - friction * sl.tanh(v / width) - contact


def reference(values, start, t_end):
    p = {**sleeper.values, **values}

    def rate(t, y):
        contact = p["stop"] * (y[0] - 0.1) * (1 + math.tanh((y[0] - 0.1) / p["width"])) / 2
        bump = math.exp(-(((t - 3) / p["duration"]) ** 2))
        step = (1 + math.tanh((t - 3) / p["duration"])) / 2
        drive = p["force"] * math.cos(2 * math.pi * t) + p["pulse"] * bump + p["ramp"] * step
        return [
            y[1],
            drive
            - p["spring"] * y[0]
            - p["damping"] * y[1]
            - p["friction"] * math.tanh(y[1] / p["width"])
            - contact,
        ]

    # at rest until the pulse or the ramp exceeds rounding
    asleep = start == (0.0, 0.0) and p["force"] == 0.0
    begin = 3.0 - (9.0 if p["pulse"] else 20.0) * p["duration"] if asleep else 0.0
    return solve_ivp(
        rate, (begin, t_end), start, method="DOP853", rtol=1e-12, atol=1e-13, max_step=5e-3
    ).y[:, -1]


@pytest.mark.parametrize(
    ("values", "start", "t_end"),
    [
        *[
            ({"force": 5.0, "friction": 2.0, "width": w}, (0.0, 0.0), 1.0)
            for w in (0.05, 0.02, 0.01, 0.003)
        ],
        *[
            ({"force": 4.0, "damping": 0.5, "stop": 5000.0, "width": w}, (0.0, 0.0), 2.0)
            for w in (0.01, 0.002)
        ],
        *[({"pulse": 1.0, "duration": d}, (x, 0.0), 6.0) for d in (0.1, 0.03) for x in (0.0, 0.01)],
        ({"ramp": 1.0}, (0.0, 0.0), 6.0),
    ],
)
def test_nothing_is_stepped_over(values, start, t_end):
    run = sl.simulate(sleeper.with_values(**values), start, t_end=t_end, samples=1)
    exact = reference(values, start, t_end)
    assert run.status.item() == "ok"
    assert np.abs([run.end_x.item() - exact[0], run.end_v.item() - exact[1]]).max() < 1e-8
