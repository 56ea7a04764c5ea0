"""Label starts by the attractors they lead to, once these are known. Pure functions, so that any
part can be computed anywhere.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np

from saltus.analysis.attractors.aperiodic import SURVEY_ITERATES
from saltus.analysis.attractors.attractor_set import AttractorSet
from saltus.analysis.attractors.families import is_neutral, on_families
from saltus.analysis.attractors.find_attractors import find_attractors
from saltus.analysis.attractors.unsettled import keeps_to_sampled
from saltus.analysis.basins.scouting import affordable
from saltus.analysis.closed.motions import ClosedMotion
from saltus.analysis.solve.tolerances import ROUND
from saltus.flow.maps import Map, Travel
from saltus.flow.progress import stage
from saltus.flow.threads import on_threads
from saltus.kernels import status as st
from saltus.results.dataset.kinds import Kind

#: Code of a start that no known attractor has captured, besides those of :class:`Kind`; the
#: post-pass treats it.
OPEN = min(Kind) - 1
#: Iterates between two tests for capture.
BLOCK = 8
#: Starts that one thread follows at a time, of up to seven states, and the fewest.
PIECE, FEWEST = 4096, 16
#: Age from which a trajectory may count as being on a chaotic attractor, and age between two such
#: tests.
APERIODIC_WINDOW = 64
#: Most uncaptured trajectories from which new attractors are searched.
SAMPLE = 256


@dataclass(frozen=True)
class Settling:
    """The outcomes of k starts.

    Attributes
    ----------
    label : int64[k]
        Attractor, or a code below zero.
    periods : int64[k]
        Iterates until captured; -1 if it wasn't.
    status : int64[k]
        Its end: codes of kernels/status.py.
    unresolved : int64[k]
        Grazes on the way that were shallower than the local error.
    end : float64[k, D]
        Its last state.
    """

    label: np.ndarray
    periods: np.ndarray
    status: np.ndarray
    unresolved: np.ndarray
    end: np.ndarray

    @classmethod
    def empty(cls, count: int, size: int) -> Settling:
        """Outcomes of which nothing is computed yet."""
        label, periods = np.full(count, Kind.NOT_COMPUTED, np.int64), np.full(count, -1, np.int64)
        return cls(
            label,
            periods,
            np.full(count, st.NOT_COMPUTED, np.int64),
            np.zeros(count, np.int64),
            np.full((count, size), np.nan),
        )

    def put(self, where: np.ndarray | slice, other: Settling) -> None:
        """Write the outcomes of other starts to these indices."""
        for field in fields(self):
            getattr(self, field.name)[where] = getattr(other, field.name)

    def of(self, where: np.ndarray) -> Settling:
        """The outcomes of some of the starts."""
        return Settling(*(getattr(self, field.name)[where] for field in fields(self)))


def has_label(label: np.ndarray) -> np.ndarray:
    """True where a start has an outcome: it is computed, and not open."""
    known: np.ndarray = (label != Kind.NOT_COMPUTED) & (label != OPEN)
    return known


class Wanderers:
    """Trajectories of any ages on their way to attractors, on one thread.

    Parameters
    ----------
    map_ : Map
        The map.
    found : AttractorSet
        The attractors that capture them.
    most : int
        Iterates after which one is given up.
    size : int
        States.
    """

    def __init__(self, map_: Map, found: AttractorSet, most: int, size: int) -> None:
        self._map, self._found, self._most = map_, found, most
        self._travel: Travel | None = None
        self._window = min(APERIODIC_WINDOW, most) if found.sampled else 0
        self._iterates = np.zeros((0, self._window, size))
        #: Numbers and ages [iterates] of those that are under way, int64[k].
        self.who, self.age = np.zeros((2, 0), np.int64)

    def __len__(self) -> int:
        return len(self.who)

    def add(self, who: np.ndarray, start: np.ndarray) -> None:
        """Send off more from float64[k, D], under their numbers int64[k]."""
        fresh = self._map.launch(start, self._most)
        if self._travel is not None and len(self):
            self._travel.add(fresh)
        else:
            self._travel = fresh
        unseen = np.full((len(who), *self._iterates.shape[1:]), np.nan)
        self._iterates = np.concatenate([self._iterates, unseen])
        self.who = np.concatenate([self.who, who])
        self.age = np.concatenate([self.age, np.zeros(len(who), np.int64)])

    def go_on(self) -> tuple[np.ndarray, Settling]:
        """Move all by :data:`BLOCK` iterates. Returns those that have arrived, or can't go on, and
        those given up, whose code is :data:`OPEN`: numbers int64[m] and outcomes.
        """
        travel, most = self._travel, self._most
        assert travel is not None
        if (self.age == self.age[0]).all():
            points = travel.advance(min(BLOCK, most - int(self.age[0])))
        else:
            points = travel.advance(BLOCK, most)
        label, when = self._found.near.capture(points)
        periods = self.age + when + 1
        moved = np.minimum(points.shape[1], most - self.age)
        self.age = self.age + moved
        if self._window:
            self._keep_to_sampled(points, moved, label, periods)
        going = travel.going
        ended = np.where(travel.status == st.NONFINITE, Kind.ESCAPED, Kind.FAILED)
        label = np.where(label >= 0, label, np.where(going, OPEN, ended))
        return self._let_go(~going | (label >= 0) | (self.age >= most), label, periods)

    def give_up(self, which: np.ndarray) -> tuple[np.ndarray, Settling]:
        """Return some, bool[k], as :meth:`go_on` returns those that are given up."""
        return self._let_go(which, np.full(len(self), OPEN), self.age)

    def _let_go(
        self, which: np.ndarray, label: np.ndarray, periods: np.ndarray
    ) -> tuple[np.ndarray, Settling]:
        """Return some, with labels and periods of all, and keep the others."""
        travel, leaves = self._travel, np.flatnonzero(which)
        assert travel is not None
        label, who = label[leaves], self.who[leaves]
        left = Settling(
            label,
            np.where(label >= 0, periods[leaves], -1),
            travel.status[leaves],
            travel.unresolved[leaves],
            travel.state[leaves],
        )
        if len(leaves):
            travel.keep(~which)
            self.who, self.age = self.who[~which], self.age[~which]
            self._iterates = self._iterates[~which]
        return who, left

    def _keep_to_sampled(
        self, points: np.ndarray, moved: np.ndarray, label: np.ndarray, periods: np.ndarray
    ) -> None:
        """Note in ``label`` and ``periods`` who keeps to an attractor that is known by where it
        goes: asked of each every :data:`APERIODIC_WINDOW` iterates, and at last.
        """
        ages, found = self.age, self._found
        rows, last = np.arange(len(ages))[:, None], np.arange(self._window)
        seen = np.concatenate([self._iterates, points], axis=1)
        self._iterates = seen[rows, moved[:, None] + last]
        asked = np.flatnonzero((ages % APERIODIC_WINDOW == 0) | (ages >= self._most))
        if not len(asked):
            return
        on = keeps_to_sampled(found, self._iterates[asked], found.sampled[0].scale)
        here = (label[asked] < 0) & (on >= 0)
        label[asked[here]] = len(found.orbits) + on[here]
        periods[asked[here]] = ages[asked[here]]


def settle(map_: Map, start: np.ndarray, found: AttractorSet, most: int) -> Settling:
    """Follow trajectories from float64[k, D] until an attractor captures them, for ``most``
    iterates at most.
    """
    result = Settling.empty(len(start), start.shape[1])
    under_way = Wanderers(map_, found, most, start.shape[1])
    if len(start):
        under_way.add(np.arange(len(start)), start)
    while len(under_way):
        result.put(*under_way.go_on())
    return result


def settle_all(
    map_: Map,
    start: np.ndarray,
    found: AttractorSet,
    most: int,
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
    result: Settling | None = None,
) -> Settling:
    """:func:`settle` for any number of starts, in pieces on threads. What is known when Ctrl-C ends
    it stands in ``result``, if that is given.
    """
    result = Settling.empty(len(start), start.shape[1]) if result is None else result
    on_threads(
        lambda piece: settle(map_, start[piece], found, most),
        pieces_of(*start.shape),
        result.put,
        threads,
        progress,
    )
    return result


def pieces_of(count: int, states: int) -> list[slice]:
    """Starts that one thread follows at a time."""
    size = fewer(PIECE, states)
    return [slice(first, first + size) for first in range(0, count, size)]


def fewer(most: int, states: int) -> int:
    """Starts that are followed at a time: fewer of many states, so that one hears of them."""
    return max(most // max(states // 4, 1) ** 3, FEWEST)


def complete(
    map_: Map,
    result: Settling,
    found: AttractorSet,
    scale: np.ndarray,
    most: int,
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> AttractorSet:
    """Search for new attractors from uncaptured trajectories, label those they capture, and give
    all attractors their final ids.

    Changes ``result``. The trajectories go on from where they stood. Returns the attractors in
    their final order.
    """
    opened = np.flatnonzero(result.label == OPEN)
    if not len(opened):
        return found
    size = affordable(most + SURVEY_ITERATES, len(scale), min(SAMPLE, len(opened)))
    sample = np.sort(np.random.default_rng(0).choice(opened, min(size, len(opened)), replace=False))
    half = stage(progress, 0.0, 0.5)
    wider, _, _ = find_attractors(map_, result.end[sample], scale, most, found, half)
    half = stage(progress, 0.5, 1.0)
    wider, label = on_known_families(map_, result.end[opened], wider, scale)
    alone = label < 0
    more = result.of(opened)
    more.label[:], more.periods[:], more.unresolved[:] = label, 0, 0
    more.put(alone, settle_all(map_, more.end[alone], wider, most, threads, half))
    more.periods[more.periods >= 0] += most
    more.unresolved[:] += result.unresolved[opened]
    still = more.label == OPEN
    more.label[still], more.status[still] = Kind.UNCONVERGED, st.LONG_TRANSIENT
    renumber(result.label, wider.ids(found))  # at last: who stops this keeps the ids of before
    result.put(opened, more)
    return wider


def on_known_families(
    map_: Map, state: np.ndarray, found: AttractorSet, scale: np.ndarray
) -> tuple[AttractorSet, np.ndarray]:
    """The families of orbits that trajectories at float64[k, D] are on, int64[k], -1 where none:
    ids among the attractors, to which further families are added. Looks at nothing where no family
    is known.
    """
    owners: list[ClosedMotion | None] = [None] * len(state)
    if any(is_neutral(one) for one in found.orbits):
        found = replace(found, orbits=list(found.orbits))
        for piece in pieces_of(*state.shape):
            points = map_.launch(state[piece], ROUND).advance(ROUND)
            owners[piece] = on_families(map_, points, scale, found)
        found = found.ordered(scale)
    return found, np.array([-1 if one is None else found.index(one) for one in owners], np.int64)


def renumber(label: np.ndarray, ids: np.ndarray) -> None:
    """Give labels new ids of their attractors, int64[m]. Changes ``label``."""
    if len(ids):
        label[label >= 0] = ids[label[label >= 0]]
