"""Where every response of a grid goes from its value of the parameter: up and down, to the next
value and on.
"""

from __future__ import annotations

import numpy as np

from saltus.analysis.orbits.tolerances import SAME
from saltus.analysis.responses.continuation import HALVINGS, INEXACT, Follower
from saltus.analysis.responses.grid import Grid
from saltus.analysis.responses.responses import GridResponses
from saltus.flow.methods import Method
from saltus.results.dataset.kinds import CLOSED

#: Values over which a response is followed at most to meet one that was found.
FARTHEST = 16
#: How often the distance to a value beyond the next is halved: where the branch ends there isn't
#: asked.
COARSE = 6
#: Directions.
WAYS = (+1, -1)


class Followed:
    """All responses that repeat, followed up and down.

    Attributes
    ----------
    follower : Follower
        Those that aren't followed to the next value stand where they were followed to.
    goes_on : bool[k]
        Which are followed to the next value: each in both directions. None of an inexact method is,
        though its exact orbit may be.
    met : int64[k]
        The first response that each becomes; -1 where it becomes none.
    """

    def __init__(
        self, found: GridResponses, grid: Grid, method: Method, threads: int | None = None
    ):
        closed = np.flatnonzero(np.isin(found.kind, CLOSED))
        self._index = np.full((len(WAYS), len(found)), -1, np.int64)
        self._index[:, closed] = np.arange(len(WAYS) * len(closed)).reshape(len(WAYS), -1)
        rows, ways = np.tile(closed, len(WAYS)), np.repeat(WAYS, len(closed))
        self.follower = Follower(found, grid, method, rows, threads)
        self.met = np.full(len(rows), -1, np.int64)
        self._near = SAME if method.exact else INEXACT
        arrived = self._follow(found, grid, rows, ways, 1, np.ones(len(rows), bool))
        self.goes_on = arrived & method.exact
        last = np.array(
            [_last(found, int(row), int(way)) for row, way in zip(rows, ways, strict=True)],
            np.int64,
        )
        for ahead in range(2, int(last.max(initial=0)) + 1):
            arrived = self._follow(
                found, grid, rows, ways, ahead, arrived & (self.met < 0) & (ahead <= last)
            )

    def index(self, responses: np.ndarray, way: int) -> np.ndarray:
        """Where responses int64[m], followed up (way 1) or down (-1), stand in the arrays int64[m];
        -1 for what never repeats.
        """
        return np.asarray(self._index[WAYS.index(way), responses])

    def _follow(
        self,
        found: GridResponses,
        grid: Grid,
        rows: np.ndarray,
        ways: np.ndarray,
        ahead: int,
        which: np.ndarray,
    ) -> np.ndarray:
        """Follow some on to a value ahead, and note what they meet there; which arrive, bool[k]."""
        (values,) = grid.axes.values()
        place = found.place[rows] + ahead * ways
        arrived = self.follower.to(
            values[np.clip(place, 0, grid.places - 1)],
            which & (place >= 0) & (place < grid.places),
            HALVINGS if ahead == 1 else COARSE,
        )
        for i in np.flatnonzero(arrived):
            others = [
                int(other)
                for other in _alike(found, int(rows[i]))
                if found.place[other] == place[i]
            ]
            apart = [self.follower.beside(int(i), found.points(other)) for other in others]
            if min(apart, default=np.inf) < self._near:
                self.met[i] = others[int(np.argmin(apart))]
        return arrived


def _alike(found: GridResponses, response: int) -> np.ndarray:
    """The responses of the kind and period of one, int64[n]."""
    return np.flatnonzero(
        (found.kind == found.kind[response]) & (found.period == found.period[response])
    )


def _last(found: GridResponses, response: int, way: int) -> int:
    """How many values ahead the last one lies that a response may become."""
    ahead = way * (found.place[_alike(found, response)] - found.place[response])
    return int(ahead[(ahead > 0) & (ahead <= FARTHEST)].max(initial=0))
