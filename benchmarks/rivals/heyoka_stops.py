"""heyoka on masses with several stops: eight SIMD lanes, a terminal event at each boundary that
switches the lane's stiffness there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import heyoka as hy
import numpy as np

#: Trajectories at a time: the width that benchmarks/flow.py uses too.
LANES = 8
#: An equation's states with their rates, its gaps (contact where positive) and the stiffness of
#: each: what a stop adds is ``par[i] * gap``.
Problem = tuple[list, list, Sequence[float]]


def chain(values: dict[str, float]) -> Problem:
    """The equation of ``saltus.models.chain``."""
    x1, x2, v1, v2 = hy.make_vars("x1", "x2", "v1", "v2")
    p, (ground, coupling) = values, (values["ground_gap"], values["coupling_gap"])
    stretch, rate = x2 - x1, v2 - v1
    gaps = [x1 - ground, -ground - x1, stretch - coupling, -coupling - stretch]
    below = (
        p["ground_stiffness"] * x1
        + p["ground_damping"] * v1
        + hy.par[0] * gaps[0]
        - hy.par[1] * gaps[1]
    )
    between = (
        p["coupling_stiffness"] * stretch
        + p["coupling_damping"] * rate
        + hy.par[2] * gaps[2]
        - hy.par[3] * gaps[3]
    )
    drive = p["force"] * hy.cos(2 * np.pi * p["frequency"] * hy.time)
    rates = (v1, v2, (drive - below + between) / p["first_mass"], -between / p["second_mass"])
    hard, soft = p["ground_contact_stiffness"], p["coupling_contact_stiffness"]
    return [*zip((x1, x2, v1, v2), rates, strict=True)], gaps, (hard, hard, soft, soft)


def row_of_masses(masses: int, stops: int) -> Problem:
    """The equation of ``benchmarks.compile.row_of_masses``: a stop at one side of each of the first
    masses, and then at the other.
    """
    names = [f"x{i}" for i in range(masses)] + [f"v{i}" for i in range(masses)]
    states = hy.make_vars(*names)
    x, v = states[:masses], states[masses:]
    gaps = [x[i] - 0.1 if i < masses else -0.1 - x[i - masses] for i in range(stops)]
    rates = []
    for i in range(masses):
        rate = (
            -50.0 * (x[i] - (x[i - 1] if i else 0.0))
            - 50.0 * (x[i] - (x[i + 1] if i + 1 < masses else 0.0))
            - 0.1 * v[i]
        )
        rate = rate - hy.par[i] * gaps[i] if i < stops else rate
        rate = rate + hy.par[i + masses] * gaps[i + masses] if i + masses < stops else rate
        rates.append(rate + 2.0 * hy.cos(2 * np.pi * hy.time) if i == 0 else rate)
    return [*zip(x, v, strict=True), *zip(v, rates, strict=True)], gaps, (500.0,) * stops


class Flow:
    """heyoka's integrator for a problem, eight trajectories at a time."""

    def __init__(self, problem: Problem, tolerance: float):
        equations, gaps, self.stiffness = problem
        self.contacts = 0
        self.gaps = hy.cfunc(gaps, [state for state, _ in equations])
        shape = (len(gaps), LANES)
        events = [hy.t_event_batch(gap, callback=self._switch(i)) for i, gap in enumerate(gaps)]
        self.integrator = hy.taylor_adaptive_batch(
            equations,
            np.zeros((len(equations), LANES)),
            pars=np.zeros(shape),
            t_events=events,
            tol=tolerance,
            fast_math=True,
        )
        self.pars = memoryview(self.integrator.pars)

    def _switch(self, which: int) -> Callable:
        def callback(_: object, sign: int, lane: int) -> bool:
            self.contacts += 1
            self.pars[which, lane] = self.stiffness[which] if sign > 0 else 0.0
            return True

        return callback

    def run(self, start: np.ndarray, t_end: float) -> np.ndarray:
        """States (starts, states) at ``t_end``; ``contacts`` counts the contacts. The number of
        starts is a multiple of the lanes.
        """
        self.contacts, end = 0, np.empty_like(start)
        integrator = self.integrator
        for at in range(0, len(start), LANES):
            lanes = np.ascontiguousarray(start[at : at + LANES].T)
            integrator.set_time(0.0)
            integrator.state[:] = lanes
            integrator.pars[:] = np.where(
                self.gaps(lanes) > 0.0, np.reshape(self.stiffness, (-1, 1)), 0.0
            )
            integrator.reset_cooldowns()
            integrator.propagate_until(t_end)
            end[at : at + LANES] = integrator.state.T
        return end
