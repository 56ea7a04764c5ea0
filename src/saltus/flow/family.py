"""A family of stroboscopes: many trajectories of one system, each with parameter values, and so a forcing period, of its own."""

from __future__ import annotations

import copy
from collections.abc import Mapping

import numpy as np

from saltus.errors import ParameterError
from saltus.flow import engine
from saltus.flow.engine import Request, Schedule
from saltus.flow.flight import Flight
from saltus.flow.methods import Method
from saltus.kernels import status as st
from saltus.system.overlaps import check_overlaps
from saltus.system.system import System
from saltus.system.tangent import tangent_system

#: What a system without forcing needs, as the end of a sentence.
NO_PERIOD = (
    'has no forcing period: give every=, the time between two looks at the motion, such as every="0.1 s", about a turn of it. '
    "Answers don't depend on it."
)
#: A method tells its noise in units of a box of starts, some ten times the range of a motion in it. Measured for ode45 at (1e-4, 1e-7) on
#: the rig's responses: its returns scatter by 0.05 to 2 % of their range with location, by 0.3 to 4 % without. More than this share of the
#: range is no noise.
MOTION, MOST_NOISE = 10.0, 0.03


class Family:
    """The stroboscopic map of a system at each of k rows of parameter values. Row i of all arrays belongs to row i of the values.


    Parameters
    ----------
    system : System
        Equations; forced, or with ``every``.
    method : Method
        How to integrate.
    parameters : float64[k, P]
        Values in the order of ``system.values``.
    every : float or float64[k], optional
        Time between two looks [s]: for systems without forcing.
    threads : int, optional
        Threads for everything but :meth:`launch`.
    """

    def __init__(
        self, system: System, method: Method, parameters: np.ndarray, every: float | np.ndarray | None = None, threads: int | None = None
    ):
        if (every is None) == (system.forced_at is None):
            raise ParameterError(f"{system.name} {NO_PERIOD if every is None else 'is forced: leave every= out.'}")
        self.system, self.method, self.threads = system, method, threads
        self.parameters = np.ascontiguousarray(parameters, float)
        self.states = system.states
        check_overlaps(system, self.values)
        period = system.period(self.values) if every is None else every
        self.period = np.broadcast_to(np.asarray(period, float), len(self)).copy()

    def __len__(self) -> int:
        return len(self.parameters)

    @property
    def values(self) -> Mapping[str, np.ndarray]:
        """Parameter values by name, float64[k] each."""
        return dict(zip(self.system.values, self.parameters.T, strict=True))

    @property
    def exact(self) -> bool:
        """Whether the maps are exact but for rounding, and the same wherever a trajectory is restarted."""
        return self.method.exact

    def noise(self, scale: np.ndarray) -> np.ndarray:
        """Mismatch of closed orbits, float64[m], in units of their ranges float64[m, D], that the method's own errors explain."""
        return np.minimum(MOTION * self.method.noise_of(scale), MOST_NOISE)

    def rows(self, which: np.ndarray) -> Family:
        """The family of some of the rows: int64[m], with repeats if wanted, or bool[k]."""
        some = copy.copy(self)  # nothing of what was checked changes
        some.parameters, some.period = np.ascontiguousarray(self.parameters[which]), self.period[which].copy()
        return some

    def every(self, time: np.ndarray) -> Family:
        """The same rows with other times between two looks [s], float64[k]: for systems without forcing."""
        return Family(self.system, self.method, self.parameters, time, self.threads)

    def launch(self, start: np.ndarray, longest: float) -> Flight:
        """Trajectories from float64[k, D], on one thread; they will be asked for ``longest`` periods at most."""
        return Flight(self.system, self.method, start, self.parameters, self.period, longest)

    def run(
        self, start: np.ndarray, periods: np.ndarray | int, schedule: Schedule | None = None, record: int | None = None
    ) -> engine.Outcome:
        """Trajectories of so many periods each, with samples at a schedule; contacts from period ``record`` on are kept."""
        return self._run(self.system, start, periods, schedule, record)

    def tangent(self, start: np.ndarray, periods: np.ndarray | int, directions: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Ends float64[k, D] after so many periods each, and the derivative times ``directions`` (default: identity) float64[k, D, D]."""
        k, size = start.shape
        first = np.broadcast_to(np.eye(size), (k, size, size)) if directions is None else directions
        outcome = self._run(tangent_system(self.system), np.concatenate([start, first.reshape(k, size * size)], axis=1), periods)
        outcome.state[~np.isin(outcome.status, (st.OK, st.GRAZE_UNRESOLVED))] = np.nan
        return outcome.state[:, :size], outcome.state[:, size:].reshape(k, size, size)

    def _run(
        self, system: System, start: np.ndarray, periods: np.ndarray | int, schedule: Schedule | None = None, record: int | None = None
    ) -> engine.Outcome:
        k = len(start)
        ends = np.broadcast_to(np.asarray(periods, np.int64), k).copy()
        request = Request(start, self.parameters, self.period, 0.0, ends, np.zeros(k), schedule or Schedule.none(), record)
        return engine.run(system, self.method, request, self.threads)
