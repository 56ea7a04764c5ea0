"""heyoka's integrators for the equations of benchmarks/compile.py: eight SIMD lanes, a terminal
event at each boundary.
"""

from __future__ import annotations

from collections.abc import Callable

import heyoka as hy
import numpy as np

#: Trajectories at a time: heyoka's widest on this kind of processor that the table of
#: benchmarks/flow.py uses too.
LANES = 8


def row_of_masses(masses: int, stops: int) -> tuple[list, list]:
    """Equations and gaps of `systems.row_of_masses`, a stop's stiffness in a parameter that its
    event switches.
    """
    names = [f"x{i}" for i in range(masses)] + [f"v{i}" for i in range(masses)]
    states = hy.make_vars(*names)
    x, v = states[:masses], states[masses:]
    rates = []
    for i in range(masses):
        rate = (
            -50.0 * (x[i] - (x[i - 1] if i else 0.0))
            - 50.0 * (x[i] - (x[i + 1] if i + 1 < masses else 0.0))
            - 0.1 * v[i]
        )
        rate = rate - hy.par[i] * (x[i] - 0.1) if i < stops else rate
        rates.append(rate + 2.0 * hy.cos(2 * np.pi * hy.time) if i == 0 else rate)
    equations = [*zip(x, v, strict=True), *zip(v, rates, strict=True)]
    return equations, [x[i] - 0.1 for i in range(stops)]


def first_state(equations: list, gaps: list, tangent: bool) -> None:
    """Build the integrator and take it to the end of one period."""

    def switch(which: int) -> Callable:
        def callback(integrator: object, sign: int, lane: int) -> bool:
            integrator.pars[which, lane] = 500.0 if sign > 0 else 0.0  # type: ignore[attr-defined]
            return True

        return callback

    system = hy.var_ode_sys(equations, hy.var_args.vars) if tangent else equations
    state = np.full((len(equations), LANES), 0.01)
    events = [hy.t_event_batch(gap, callback=switch(i)) for i, gap in enumerate(gaps)]
    integrator = hy.taylor_adaptive_batch(
        system, state, pars=np.zeros((len(gaps), LANES)), t_events=events
    )
    integrator.propagate_until(1.0)
