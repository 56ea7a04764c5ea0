"""Walks: trajectories of one flow or map, seen from block to block, with the derivative and the divergence of every block."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from saltus.analysis.lyapunov.divergence import Divergence
from saltus.flow.engine import Schedule
from saltus.flow.family import Family
from saltus.flow.maps import Map, Stroboscope
from saltus.kernels import status as st

#: Blocks whose motion is sampled for its size, and samples in each.
LOOKED, SAMPLES = 16, 32


@dataclass(frozen=True)
class Stretch:
    """A stretch of k trajectories.

    Attributes
    ----------
    trail : float64[k, n, D]
        States at the ends of the blocks.
    status : int64[k]
        How each ended: codes of kernels/status.py.
    grazes, unresolved : int64[k]
        Grazes, and those of them that were shallower than the local error.
    margin : float64[k]
        Smallest distance of a turning point of a gap from its boundary; inf if there was none.
    """

    trail: np.ndarray
    status: np.ndarray
    grazes: np.ndarray
    unresolved: np.ndarray
    margin: np.ndarray


class Walk(Protocol):
    """k trajectories of D states that are followed in blocks: a forcing period, a given time, or one iterate of a map."""

    def move(self, start: np.ndarray, count: int, first: int = 0) -> Stretch:
        """``count`` blocks from float64[k, D]; the trail begins after ``first`` of them."""

    def look(self, start: np.ndarray) -> np.ndarray:
        """States float64[k, m, D] of the motion from float64[k, D] on, close enough to one another to tell its size."""

    def matrices(self, states: np.ndarray) -> np.ndarray:
        """Derivative float64[k, n, D, D] of the block that begins at each of float64[k, n, D]."""

    def divergences(self, states: np.ndarray) -> np.ndarray:
        """Logarithm float64[k, n] of the factor by which volumes grow in the block that begins at each of float64[k, n, D]."""

    def of(self, which: np.ndarray) -> Walk:
        """The walk of some of the trajectories, int64[m], with repeats if wanted."""

    def map_of(self, i: int) -> Map:
        """The map that trajectory i follows."""


class FlowWalk:
    """Trajectories of a flow, each with parameter values of its own; a block is a forcing period, or ``every``."""

    def __init__(self, family: Family, every: float | None = None):
        self.family, self._every = family, every
        self._divergence = Divergence(family.system)

    def move(self, start: np.ndarray, count: int, first: int = 0) -> Stretch:
        """See :class:`Walk`."""
        if not count:
            nothing = np.zeros(len(start), np.int64)
            return Stretch(start[:, None], nothing + st.OK, nothing, nothing, np.full(len(start), np.inf))
        kept = np.arange(first, count + 1, dtype=np.int64)
        outcome = self.family.run(start, count, Schedule(kept, np.zeros(len(kept))))
        grazes, unresolved = outcome.counters[:, st.GRAZES], outcome.counters[:, st.UNRESOLVED]
        return Stretch(outcome.samples, outcome.status, grazes, unresolved, outcome.minima[:, st.GAP_MARGIN])

    def look(self, start: np.ndarray) -> np.ndarray:
        """See :class:`Walk`."""
        index = np.arange(LOOKED * SAMPLES)
        return self.family.run(start, LOOKED, Schedule(index // SAMPLES, (index % SAMPLES) / SAMPLES)).samples

    def matrices(self, states: np.ndarray) -> np.ndarray:
        """See :class:`Walk`."""
        k, n, size = states.shape
        return self._blocks(k, n).tangent(states.reshape(k * n, size), 1)[1].reshape(k, n, size, size)

    def divergences(self, states: np.ndarray) -> np.ndarray:
        """See :class:`Walk`."""
        k, n, size = states.shape
        return self._divergence.of_blocks(self._blocks(k, n), states.reshape(k * n, size)).reshape(k, n)

    def of(self, which: np.ndarray) -> FlowWalk:
        """See :class:`Walk`."""
        return FlowWalk(self.family.rows(which), self._every)

    def map_of(self, i: int) -> Stroboscope:
        """See :class:`Walk`."""
        family = self.family
        values = dict(zip(family.system.values, family.parameters[i].tolist(), strict=True))
        return Stroboscope(family.system.with_values(**values), family.method, self._every, family.threads)

    def _blocks(self, k: int, n: int) -> Family:
        """A row for each block, one trajectory after the other."""
        return self.family.rows(np.repeat(np.arange(k), n))


class MapWalk:
    """Trajectories of any map; a block is one iterate."""

    def __init__(self, map_: Map):
        self._map = map_

    def move(self, start: np.ndarray, count: int, first: int = 0) -> Stretch:
        """See :class:`Walk`."""
        travel = self._map.launch(start, count)
        trail = np.concatenate([start[:, None], travel.advance(count)], axis=1)[:, first:]
        return Stretch(trail, travel.status, 0 * travel.unresolved, travel.unresolved, np.full(len(start), np.inf))

    def look(self, start: np.ndarray) -> np.ndarray:
        """See :class:`Walk`."""
        return self._map.launch(start, LOOKED).advance(LOOKED)

    def matrices(self, states: np.ndarray) -> np.ndarray:
        """See :class:`Walk`."""
        k, n, size = states.shape
        return self._map.tangent(states.reshape(k * n, size), 1)[1].reshape(k, n, size, size)

    def divergences(self, states: np.ndarray) -> np.ndarray:
        """See :class:`Walk`."""
        return np.linalg.slogdet(self.matrices(states))[1]

    def of(self, which: np.ndarray) -> MapWalk:  # noqa: ARG002
        """See :class:`Walk`."""
        return self

    def map_of(self, i: int) -> Map:  # noqa: ARG002
        """See :class:`Walk`."""
        return self._map
