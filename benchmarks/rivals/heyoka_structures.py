"""heyoka on the modes of a beam with soft stops on both sides: one trajectory, a terminal event at
each boundary that switches the stiffness there.
"""

from __future__ import annotations

from collections.abc import Callable

import heyoka as hy
import numpy as np


class Trajectory:
    """One trajectory from rest.

    Parameters
    ----------
    squares, damping : float64[n]
        Squares of the natural frequencies [rad^2/s^2], 2 zeta omega [rad/s].
    shapes : float64[stops, n]
        Mode shapes at the stops.
    push : float64[n]
        Modal loads of the force cos(rate t).
    gap, stiffness, rate : float
        Of all stops [m], [N/m]; of the force [rad/s].
    compact : bool
        heyoka's compact mode.
    """

    def __init__(
        self,
        squares: np.ndarray,
        damping: np.ndarray,
        shapes: np.ndarray,
        push: np.ndarray,
        gap: float,
        stiffness: float,
        rate: float,
        compact: bool,
    ) -> None:
        n, stops = len(squares), len(shapes)
        states = hy.make_vars(*[f"q{i}" for i in range(n)], *[f"v{i}" for i in range(n)])
        q, v = states[:n], states[n:]
        deflections = [hy.sum([shapes[s, j] * q[j] for j in range(n)]) for s in range(stops)]
        forces = [
            hy.par[2 * s] * (deflections[s] - gap) + hy.par[2 * s + 1] * (deflections[s] + gap)
            for s in range(stops)
        ]
        wave = hy.cos(rate * hy.time)
        rates = [
            push[j] * wave
            - squares[j] * q[j]
            - damping[j] * v[j]
            - hy.sum([shapes[s, j] * forces[s] for s in range(stops)])
            for j in range(n)
        ]
        events = [
            hy.t_event(deflections[s] - way * gap, callback=self._switch(2 * s + k, stiffness, way))
            for s in range(stops)
            for k, way in enumerate((1.0, -1.0))
        ]
        self.contacts = 0
        self.integrator = hy.taylor_adaptive(
            [*zip(q, v, strict=True), *zip(v, rates, strict=True)],
            np.zeros(2 * n),
            pars=np.zeros(2 * stops),
            t_events=events,
            compact_mode=compact,
        )

    def _switch(self, which: int, stiffness: float, way: float) -> Callable:
        def callback(integrator: hy.taylor_adaptive, sign: int) -> bool:
            self.contacts += 1
            integrator.pars[which] = stiffness if sign * way > 0 else 0.0
            return True

        return callback

    def run(self, time: float) -> np.ndarray:
        """The state at a time [s]."""
        self.integrator.propagate_until(time)
        return np.array(self.integrator.state)
