"""SciPy on an impact oscillator: a loop around solve_ivp with a terminal event."""

from __future__ import annotations

import math
import time

import numpy as np
from scipy.integrate import solve_ivp


def impact_oscillator(starts: np.ndarray, periods: int, w: float, gap: float, e: float) -> tuple:
    """x'' + 0.1 x' + x = cos w t, x <= gap: microseconds a period, states at the end."""

    def reached(_t: float, y: np.ndarray) -> float:
        return y[0] - gap

    reached.terminal, reached.direction = True, 1.0  # type: ignore[attr-defined]
    end, ends = periods * 2 * math.pi / w, np.zeros_like(starts)
    begun = time.process_time()
    for i, start in enumerate(starts):
        t, state = 0.0, np.array(start)
        while t < end:
            run = solve_ivp(
                lambda t, y: (y[1], math.cos(w * t) - 0.1 * y[1] - y[0]),
                (t, end), state, "DOP853", rtol=1e-12, atol=1e-12, events=reached,
            )  # fmt: skip
            t, state = run.t[-1], run.y[:, -1]
            if run.status == 1:
                state = np.array([gap, -e * state[1]])
        ends[i] = state
    return (time.process_time() - begun) / (len(starts) * periods) * 1e6, ends
