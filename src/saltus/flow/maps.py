"""Maps: what attractors and basins are asked of. The stroboscope of a flow, or any function from states to states, behind one interface."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Protocol

import numpy as np

from saltus.errors import ParameterError, shown
from saltus.flow import engine
from saltus.flow.engine import Request, Schedule
from saltus.flow.family import NO_PERIOD, Family
from saltus.flow.flight import Flight
from saltus.flow.methods import Method
from saltus.kernels import status as st
from saltus.system.system import System
from saltus.system.tangent import tangent_system

#: Looks at the mode in each period, where contacts aren't located.
LOOKS = 32


class Travel(Protocol):
    """Trajectories of a map on their way; see :class:`saltus.flow.flight.Flight`."""

    age: int

    def __len__(self) -> int: ...

    @property
    def state(self) -> np.ndarray:
        """States now, float64[k, D]."""

    @property
    def going(self) -> np.ndarray:
        """Which can go on, bool[k]."""

    @property
    def status(self) -> np.ndarray:
        """Status codes, int64[k]."""

    @property
    def unresolved(self) -> np.ndarray:
        """Grazes too shallow to be sure of, int64[k]."""

    def advance(self, periods: int) -> np.ndarray:
        """States at the next iterates, float64[k, periods, D]."""

    def keep(self, wanted: np.ndarray) -> None:
        """Let go of those that aren't wanted, bool[k]."""


class Map(Protocol):
    """A map of states to states. k points, D states.

    Attributes
    ----------
    states : tuple of str
        Their names.
    period : float
        Time of one iterate [s]; 1 for a map without time.
    noise : float
        Mismatch of a closed orbit, relative to the range of the states, that the map's own errors explain.
    exact : Map or None
        Of a map that errors of its own blur: the map without them. None where errors are rounding.
    """

    states: tuple[str, ...]
    period: float
    noise: float

    @property
    def exact(self) -> Map | None:
        """See above."""

    def launch(self, start: np.ndarray, longest: float) -> Travel:
        """Trajectories from float64[k, D]; they will be asked for ``longest`` iterates at most."""

    def tangent(self, start: np.ndarray, count: int, directions: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Ends float64[k, D] of ``count`` iterates, and the derivative times ``directions`` (default: identity) float64[k, D, D]."""

    def sequences(self, start: np.ndarray, count: int) -> tuple[np.ndarray, list[np.ndarray]]:
        """End states after ``count`` iterates, and for each start the contacts on the way: guard and direction in one number."""


class Stroboscope:
    """The states of a flow at whole forcing periods, as a map.

    Parameters
    ----------
    system : System
        Equations and values.
    method : Method
        How to integrate.
    every : float, optional
        Time between two looks [s]: for systems without forcing.
    threads : int, optional
        Threads for :meth:`tangent` and :meth:`sequences`.
    """

    def __init__(self, system: System, method: Method, every: float | None = None, threads: int | None = None):
        if (every is None) == (system.forced_at is None):
            raise ParameterError(f"{system.name} {NO_PERIOD if every is None else 'is forced: leave every= out.'}")
        self.system, self.method, self.states, self._threads = system, method, system.states, threads
        self.period = float(system.period() if every is None else every)
        if not 0 < self.period < math.inf:
            raise ParameterError(f"every must be a positive time, not {shown(every)}.")
        self._parameters = np.array([list(system.values.values())])
        self._tangent = tangent_system(system)
        self.noise = method.noise
        self._every = every

    @functools.cached_property
    def exact(self) -> Stroboscope | None:
        """See :class:`Map`."""
        return None if self.method.exact else Stroboscope(self.system, self.method.companion(), self._every, self._threads)

    def family(self, count: int) -> Family:
        """The same map for so many trajectories."""
        every = self.period if self.system.forced_at is None else None
        return Family(self.system, self.method, np.repeat(self._parameters, count, axis=0), every, self._threads)

    def launch(self, start: np.ndarray, longest: float) -> Flight:
        """See :class:`Map`."""
        return Flight(self.system, self.method, start, self._parameters, np.full(len(start), self.period), longest)

    def tangent(self, start: np.ndarray, count: int, directions: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """See :class:`Map`."""
        k, size = start.shape
        first = np.broadcast_to(np.eye(size), (k, size, size)) if directions is None else directions
        outcome = self._run(self._tangent, np.concatenate([start, first.reshape(k, size * size)], axis=1), count, None)
        lost = ~np.isin(outcome.status, (st.OK, st.GRAZE_UNRESOLVED))
        outcome.state[lost] = np.nan
        return outcome.state[:, :size], outcome.state[:, size:].reshape(k, size, size)

    def sequences(self, start: np.ndarray, count: int) -> tuple[np.ndarray, list[np.ndarray]]:
        """See :class:`Map`."""
        if not self.method.records_contacts:
            return self._modes(start, count)
        outcome = self._run(self.system, start, count, 0)
        table = outcome.record_integers
        codes = np.ravel_multi_index((table[:, st.REC_KIND], table[:, st.REC_DIRECTION] + 1, table[:, st.REC_GUARD]), (3, 3, 2**31))
        return outcome.state, np.split(codes, np.searchsorted(table[:, st.REC_TRAJECTORY], np.arange(1, len(start))))

    def _modes(self, start: np.ndarray, count: int) -> tuple[np.ndarray, list[np.ndarray]]:
        """Where contacts aren't located: the modes in which the motion is seen, one after the other, stand for them."""
        index = np.arange(count * LOOKS)
        outcome = self._run(self.system, start, count, None, Schedule(index // LOOKS, (index % LOOKS) / LOOKS))
        return outcome.state, [row[np.flatnonzero(np.diff(row, prepend=-1))] for row in outcome.sample_mode]

    def trajectory(self, start: np.ndarray, count: int, samples: int) -> tuple[np.ndarray, engine.Outcome]:
        """States at ``samples`` instants of each of ``count`` periods, the start included, float64[k, count * samples, D]; the outcome."""
        index = np.arange(count * samples)
        outcome = self._run(self.system, start, count, 0, Schedule(index // samples, (index % samples) / samples))
        return outcome.samples, outcome

    def _run(self, system: System, start: np.ndarray, count: int, record: int | None, schedule: Schedule | None = None) -> engine.Outcome:
        k = len(start)
        ends = np.full(k, count, np.int64)
        request = Request(start, self._parameters, np.full(k, self.period), 0.0, ends, np.zeros(k), schedule or Schedule.none(), record)
        return engine.run(system, self.method, request, self._threads)


class FunctionMap:
    """A map given as a function of arrays: ``image = function(states)`` with float64[k, D] in and out.

    Parameters
    ----------
    function : callable
        The map; must treat each row alone.
    states : str
        Names of the states, such as ``"x y"``.
    derivative : callable
        ``derivative(states) -> float64[k, D, D]``.
    noise : float
        Size of the errors that the function makes, relative to the range of the states.
    exact : Map, optional
        The map without these errors, where they are more than rounding.
    """

    def __init__(
        self,
        function: Callable[[np.ndarray], np.ndarray],
        states: str,
        derivative: Callable[[np.ndarray], np.ndarray],
        noise: float = 1e-12,
        exact: Map | None = None,
    ):
        self.states, self.period, self.noise, self.exact = tuple(states.split()), 1.0, noise, exact
        self._function, self._derivative = function, derivative

    def launch(self, start: np.ndarray, longest: float) -> _Iterates:  # noqa: ARG002
        """See :class:`Map`."""
        return _Iterates(self._function, start)

    def tangent(self, start: np.ndarray, count: int, directions: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """See :class:`Map`."""
        state, matrix = start, np.eye(start.shape[1]) if directions is None else directions
        with np.errstate(all="ignore"):
            for _ in range(count):
                matrix = self._derivative(state) @ matrix
                state = self._function(state)
        return state, np.broadcast_to(matrix, (*start.shape, start.shape[1]))

    def sequences(self, start: np.ndarray, count: int) -> tuple[np.ndarray, list[np.ndarray]]:
        """See :class:`Map`."""
        state = start
        with np.errstate(all="ignore"):
            for _ in range(count):
                state = self._function(state)
        return state, [np.zeros(0, np.int64)] * len(start)


class _Iterates:
    """Trajectories of a function map."""

    def __init__(self, function: Callable[[np.ndarray], np.ndarray], start: np.ndarray):
        self._function, self.state, self.age = function, np.array(start, float), 0

    def __len__(self) -> int:
        return len(self.state)

    @property
    def going(self) -> np.ndarray:
        return np.isfinite(self.state).all(axis=1)

    @property
    def status(self) -> np.ndarray:
        return np.where(self.going, st.OK, st.NONFINITE)

    @property
    def unresolved(self) -> np.ndarray:
        return np.zeros(len(self), np.int64)

    def advance(self, periods: int) -> np.ndarray:
        points = np.empty((len(self), periods, self.state.shape[1]))
        with np.errstate(all="ignore"):
            for j in range(periods):
                points[:, j] = self.state = self._function(self.state)
        self.age += periods
        return points

    def keep(self, wanted: np.ndarray) -> None:
        self.state = self.state[wanted]
