"""Maps given as functions of states, with closed forms to test the engine of orbits against: it
takes any map.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from saltus.analysis.closed.motions import ClosedMotion
from saltus.analysis.closed.orbits import find_orbits
from saltus.analysis.lyapunov.segments import SAMPLED_BLOCKS, Segment, TangentFlow
from saltus.flow.maps import Map
from saltus.kernels import status as st


def orbit_near(map_: Map, start: np.ndarray, n: int, scale: np.ndarray) -> ClosedMotion | None:
    """The orbit of period n, or a part of it, near one state float64[D]: a batch of one. The noise
    is that of a box.
    """
    found = find_orbits(map_, start[None], np.array([n]), scale[None], np.array([map_.noise]))
    return found[0] if found.period[0] else None


def attracts(orbit: ClosedMotion) -> bool:
    """Whether the largest multiplier lies inside the unit circle."""
    return bool(abs(orbit.multipliers[0]) < 1)


class FunctionMap:
    """A map given as a function of arrays: ``image = function(states)`` with float64[k, D] in and
    out.

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
        self.states, self.period, self.noise, self.exact_map = (
            tuple(states.split()),
            np.ones(1),
            noise,
            exact,
        )
        self._function, self._derivative = function, derivative

    @property
    def exact(self) -> bool:
        """See :class:`Map`."""
        return self.exact_map is None

    def noise_of(self, scale: np.ndarray) -> np.ndarray:
        """See :class:`Map`."""
        return np.full(len(scale), self.noise)

    def rows(self, which: np.ndarray) -> FunctionMap:
        """See :class:`Map`."""
        return self

    def launch(self, start: np.ndarray, longest: float) -> _Iterates:
        """See :class:`Map`."""
        return _Iterates(self._function, start)

    def tangent(
        self, start: np.ndarray, count: np.ndarray | int, directions: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """See :class:`Map`."""
        size = start.shape[1]
        state, matrix = (
            start.copy(),
            np.broadcast_to(
                np.eye(size) if directions is None else directions, (*start.shape, size)
            ).copy(),
        )
        left = np.broadcast_to(count, len(start))
        with np.errstate(all="ignore"):
            for j in range(int(left.max(initial=0))):
                going = left > j
                matrix[going] = self._derivative(state[going]) @ matrix[going]
                state[going] = self._function(state[going])
        return state, matrix

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


class FunctionFlow(TangentFlow):
    """Trajectories of a function map; a block is one iterate."""

    def __init__(self, map_: FunctionMap):
        self.map = map_

    def advance(self, start: np.ndarray, count: int, first: int = 0) -> Segment:
        """See :class:`TangentFlow`."""
        travel = self.map.launch(start, count)
        points = np.concatenate([start[:, None], travel.advance(count)], axis=1)[:, first:]
        return Segment(
            points,
            travel.status,
            0 * travel.unresolved,
            travel.unresolved,
            np.full(len(start), np.inf),
        )

    def sample(self, start: np.ndarray) -> np.ndarray:
        """See :class:`TangentFlow`."""
        return self.map.launch(start, SAMPLED_BLOCKS).advance(SAMPLED_BLOCKS)

    def divergences(self, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See :class:`TangentFlow`."""
        growth = np.linalg.slogdet(self.derivatives(states))[1]
        return growth, np.zeros(growth.shape, np.int64)
