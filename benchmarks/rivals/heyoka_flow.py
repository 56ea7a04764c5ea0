"""heyoka on the rig, as an expert would: eight SIMD lanes, terminal events whose callback switches
the lane's stiffness.

Tried and slower (us per period, this variant 4.1): pars through NumPy indexing in the callback 4.4,
without fast_math 4.3, forcing from two extra states 4.3, compact mode 5.3, four lanes 5.1, one
event for both boundaries 4.6, one trajectory at a time 7.9; sixteen lanes take 4.0. ``x**3`` is NaN
at x = 0 in heyoka 7.13.2, the product isn't. A start at rest on a boundary hangs: don't.
"""

from __future__ import annotations

import heyoka as hy
import numpy as np

from . import rig


class Flow:
    """heyoka's integrator for the rig, ``lanes`` trajectories at a time (1: its
    scalar integrator).
    """

    def __init__(self, lanes: int, tolerance: float):
        self.lanes, self.contacts = lanes, [0]
        x, v = hy.make_vars("x", "v")
        stiffness, push = hy.par[0], hy.par[1]
        rate = (
            rig.DRIVE * hy.cos(rig.W * hy.time)
            - rig.DECAY * v
            - x * (rig.HARDENING * (x * x) + stiffness)
            + push
        )
        shape = (2,) if lanes == 1 else (2, lanes)
        make, event = (
            (hy.taylor_adaptive, hy.t_event)
            if lanes == 1
            else (hy.taylor_adaptive_batch, hy.t_event_batch)
        )
        events = [
            event(x - at, callback=self._switch(at, upward))
            for at, upward in ((rig.UPPER_GAP, True), (-rig.LOWER_GAP, False))
        ]
        self.integrator = make(
            [(x, v), (v, rate)],
            np.zeros(shape),
            pars=np.zeros(shape),
            t_events=events,
            tol=tolerance,
            fast_math=True,
        )
        # a write through it costs a fifth of one through NumPy
        self.pars = memoryview(self.integrator.pars)

    def _switch(self, boundary: float, upward: bool):
        """Callback of one boundary: contact beyond it when crossed upward (or downward), free
        otherwise.
        """
        inside, outside = rig.WN**2 + rig.STIFFNESS, rig.WN**2
        push, counter = rig.STIFFNESS * boundary, self.contacts

        def batch(_, sign, lane):
            counter[0] += 1
            pars = self.pars
            enters = (sign > 0) == upward
            pars[0, lane] = inside if enters else outside
            pars[1, lane] = push if enters else 0.0
            return True

        def scalar(_, sign):
            counter[0] += 1
            pars = self.pars
            enters = (sign > 0) == upward
            pars[0] = inside if enters else outside
            pars[1] = push if enters else 0.0
            return True

        return scalar if self.lanes == 1 else batch

    def _begin(self, x, v) -> None:
        """Start of all lanes at t = 0."""
        above, below = x > rig.UPPER_GAP, x < -rig.LOWER_GAP
        integrator = self.integrator
        if self.lanes == 1:
            integrator.time = 0.0
        else:
            integrator.set_time(0.0)
        integrator.state[0], integrator.state[1] = x, v
        integrator.pars[0] = rig.WN**2 + rig.STIFFNESS * (above | below)
        integrator.pars[1] = rig.STIFFNESS * (rig.UPPER_GAP * above - rig.LOWER_GAP * below)
        integrator.reset_cooldowns()

    def run(self, x: np.ndarray, v: np.ndarray, periods: int) -> np.ndarray:
        """States (starts, 2) after some periods; ``contacts[0]`` counts the contacts. The number of
        starts is a multiple of the lanes.
        """
        self.contacts[0] = 0
        end = np.empty((x.size, 2))
        for at in range(0, x.size, self.lanes):
            these = at if self.lanes == 1 else slice(at, at + self.lanes)
            self._begin(x[these], v[these])
            self.integrator.propagate_until(periods * rig.PERIOD)
            end[these] = self.integrator.state.T
        return end

    def stroboscope(self, x: np.ndarray, v: np.ndarray, periods: int, keep: int) -> np.ndarray:
        """States (starts, keep, 2) at the last of some periods. Only with more lanes than one; any
        number of starts.
        """
        self.contacts[0] = 0
        times = np.concatenate([[0.0], np.arange(periods - keep + 1, periods + 1) * rig.PERIOD])
        grid = np.ascontiguousarray(np.repeat(times[:, None], self.lanes, axis=1))
        points = np.empty((x.size, keep, 2))
        for at in range(0, x.size, self.lanes):
            # unused lanes at the end repeat the first starts
            these = np.arange(at, at + self.lanes) % x.size
            self._begin(x[these], v[these])
            points[these] = self.integrator.propagate_grid(grid)[-1][1:].transpose(2, 0, 1)
        return points


def measure(
    x: np.ndarray,
    v: np.ndarray,
    *,
    periods: int = 100,
    tolerance: float = 1e-12,
    lanes: int | None = None,
) -> rig.Measured:
    """CPU time, end states and contacts of heyoka.

    Parameters
    ----------
    x, v : arrays (starts,)
        Starts [m], [m/s]; their number is a multiple of the lanes.
    periods : int
        Forcing periods in the timed run.
    tolerance : float
        heyoka's.
    lanes : int, optional
        Trajectories at a time: heyoka's recommended SIMD width by default, 1 for its scalar
        integrator.
    """
    flow = Flow(lanes or hy.recommended_simd_size(), tolerance)
    end = flow.run(x, v, 5)
    seconds = rig.cpu_seconds(lambda: flow.run(x, v, periods))
    work = periods * x.size
    return rig.Measured(seconds / work * 1e6, end, flow.contacts[0] / work, np.empty(0, int))
