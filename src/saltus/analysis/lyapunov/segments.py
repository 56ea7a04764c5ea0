"""Trajectories of a flow from block to block, with the derivative and the divergence of every
block.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from saltus.analysis.lyapunov.divergence import Divergence
from saltus.flow.maps import Stroboscope
from saltus.flow.request import Schedule
from saltus.kernels import status as st

#: Blocks sampled for the size of the motion.
SAMPLED_BLOCKS = 16
#: Samples in each of these blocks.
SAMPLES_PER_BLOCK = 32


@dataclass(frozen=True)
class Segment:
    """A segment of k trajectories.

    Attributes
    ----------
    points : float64[k, n, D]
        States at the ends of the blocks.
    status : int64[k]
        Its end: codes of kernels/status.py.
    grazes, unresolved : int64[k]
        Grazes, and those of them that were shallower than the local error.
    margin : float64[k]
        Smallest distance of a turning point of a gap from its boundary; inf if there was none.
    """

    points: np.ndarray
    status: np.ndarray
    grazes: np.ndarray
    unresolved: np.ndarray
    margin: np.ndarray


class TangentFlow:
    """Trajectories of a flow, each with a row of a map, and the growth of deviations in each block,
    which is one iterate of the map.
    """

    def __init__(self, map_: Stroboscope):
        self.map = map_
        self._divergence = Divergence(map_.system)

    def advance(self, start: np.ndarray, count: int, first: int = 0) -> Segment:
        """Advance ``count`` blocks from float64[k, D]; the points kept begin after ``first`` of
        them.
        """
        if not count:
            nothing = np.zeros(len(start), np.int64)
            return Segment(
                start[:, None], nothing + st.OK, nothing, nothing, np.full(len(start), np.inf)
            )
        outcome = self.map.run(start, count, Schedule.even(count + 1 - first, 1, first))
        grazes, unresolved = outcome.counters[:, st.GRAZES], outcome.counters[:, st.UNRESOLVED]
        return Segment(
            outcome.samples, outcome.status, grazes, unresolved, outcome.minima[:, st.GAP_MARGIN]
        )

    def sample(self, start: np.ndarray) -> np.ndarray:
        """States float64[k, m, D] of the motion from float64[k, D] on, dense enough to show its
        size.
        """
        return self.map.run(
            start, SAMPLED_BLOCKS, Schedule.even(SAMPLED_BLOCKS, SAMPLES_PER_BLOCK)
        ).samples

    def derivatives(self, states: np.ndarray) -> np.ndarray:
        """Derivative float64[k, n, D, D] of the block that begins at each of float64[k, n, D]."""
        k, n, size = states.shape
        return (
            self._blocks(k, n).tangent(states.reshape(k * n, size), 1)[1].reshape(k, n, size, size)
        )

    def images(self, states: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Images of directions float64[k, D, m] behind the block that begins at each of
        float64[k, D], float64[k, D, m].
        """
        return self.map.images(states, 1, directions)[1]

    def divergences(self, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Growth of volumes in the block from each of float64[k, n, D]: logarithm, float64[k, n],
        and directions lost in it for good, int64[k, n].
        """
        k, n, size = states.shape
        growth, lost = self._divergence.of_blocks(self._blocks(k, n), states.reshape(k * n, size))
        return growth.reshape(k, n), lost.reshape(k, n)

    def rows(self, which: np.ndarray) -> Self:
        """Some of the trajectories, int64[m], with repeats if wanted."""
        return type(self)(self.map.rows(which))

    def _blocks(self, k: int, n: int) -> Stroboscope:
        """A row for each block, one trajectory after the other."""
        return self.map.rows(np.repeat(np.arange(k), n))
