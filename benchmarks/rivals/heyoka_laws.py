"""heyoka on systems whose contacts have laws: events and callbacks written by hand.

It has no rest mode: an impact is a terminal event whose callback turns the velocity round, sticking
is left to the caller, who stops at the surface and goes on with the equations of the other mode.
"""

from __future__ import annotations

import math
import time

import heyoka as hy
import numpy as np

hy.set_logger_level_error()  # of hundreds of warnings that a root wasn't found


def impact_oscillator(starts: np.ndarray, periods: int, w: float, gap: float, e: float) -> tuple:
    """x'' + 0.1 x' + x = cos w t, x <= gap: microseconds a period, states at the end."""
    x, v = hy.make_vars("x", "v")
    field = [(x, v), (v, hy.cos(w * hy.time) - 0.1 * v - x)]

    def rebound(integrator: object, _sign: int) -> bool:
        integrator.state[1] = -e * integrator.state[1]  # type: ignore[attr-defined]
        return True

    stop = hy.t_event(x - gap, callback=rebound, direction=hy.event_direction.positive)
    one = hy.taylor_adaptive(field, starts[0], tol=1e-15, t_events=[stop])
    ends, begun = np.zeros_like(starts), time.process_time()
    for i, start in enumerate(starts):
        one.time, one.state[:] = 0.0, start
        one.reset_cooldowns()
        one.propagate_until(periods * 2 * math.pi / w)
        ends[i] = one.state
    return (time.process_time() - begun) / (len(starts) * periods) * 1e6, ends


def dry_friction(starts: np.ndarray, periods: int, w: float, slip: float) -> tuple:
    """x'' + x = cos w t - slip sgn x': microseconds a period, states at the end."""
    x, v = hy.make_vars("x", "v")
    drive = hy.cos(w * hy.time) - x
    reached = hy.t_event(v)
    sliding = hy.taylor_adaptive(
        [(x, v), (v, drive - slip * hy.par[0])],
        [0.0, 1.0],
        tol=1e-15,
        t_events=[reached],
        pars=[1.0],
    )
    loose = hy.t_event(drive * drive - slip**2, direction=hy.event_direction.positive)
    stuck = hy.taylor_adaptive(
        [(x, 0.0 * x), (v, 0.0 * x)], [0.0, 0.0], tol=1e-15, t_events=[loose]
    )
    end, ends = periods * 2 * math.pi / w, np.zeros_like(starts)
    begun = time.process_time()
    for i, start in enumerate(starts):
        t, state, sign = 0.0, np.array(start), float(np.sign(start[1]))
        while t < end:
            if sign:
                sliding.time, sliding.state[:], sliding.pars[0] = t, state, sign
                sliding.propagate_until(end)
                t, state = sliding.time, sliding.state.copy()
                if t < end:
                    state[1] = 0.0
                    force = math.cos(w * t) - state[0]
                    sign = float(np.sign(force)) if abs(force) > slip else 0.0
            else:
                stuck.time, stuck.state[:] = t, state
                stuck.propagate_until(end)
                t, state = stuck.time, stuck.state.copy()
                sign = float(np.sign(math.cos(w * t) - state[0]))
        ends[i] = state
    return (time.process_time() - begun) / (len(starts) * periods) * 1e6, ends
