"""Label starts by the attractors they lead to, once these are known. Pure functions, so that any
part can be computed anywhere.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from saltus.analysis.attractors.aperiodic import SURVEY_ITERATES
from saltus.analysis.attractors.attractor_set import AttractorSet
from saltus.analysis.attractors.find_attractors import find_attractors, keeps_to_sampled
from saltus.analysis.basins.scouting import affordable
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
        for name in ("label", "periods", "status", "unresolved", "end"):
            getattr(self, name)[where] = getattr(other, name)


def settle(map_: Map, start: np.ndarray, found: AttractorSet, most: int) -> Settling:
    """Follow trajectories from float64[k, D] until an attractor captures them, for ``most``
    iterates at most.
    """
    result = Settling.empty(len(start), start.shape[1])
    travel, who = map_.launch(start, most), np.arange(len(start))
    iterates = np.zeros((len(start), 0, start.shape[1]))
    while len(who) and travel.age < most:
        points = travel.advance(min(BLOCK, most - travel.age))
        label, when = found.near.capture(points)
        periods = travel.age - points.shape[1] + when + 1
        if found.sampled:
            iterates = np.concatenate([iterates, points], axis=1)[:, -APERIODIC_WINDOW:]
            if travel.age % APERIODIC_WINDOW == 0 or travel.age >= most:
                on = keeps_to_sampled(found, iterates, found.sampled[0].scale)
                here = (label < 0) & (on >= 0)
                label[here], periods[here] = len(found.orbits) + on[here], travel.age
        going = travel.going & (label < 0)
        leaves = np.flatnonzero(~going)
        label[leaves] = np.where(
            label[leaves] >= 0,
            label[leaves],
            np.where(travel.status[leaves] == st.NONFINITE, Kind.ESCAPED, Kind.FAILED),
        )
        _write(result, who[leaves], label[leaves], periods[leaves], travel, leaves)
        travel.keep(going)
        who, iterates = who[going], iterates[going]
    _write(result, who, np.full(len(who), OPEN), np.full(len(who), -1), travel, np.arange(len(who)))
    return result


def settle_all(
    map_: Map,
    start: np.ndarray,
    found: AttractorSet,
    most: int,
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Settling:
    """:func:`settle` for any number of starts, in pieces on threads."""
    result = Settling.empty(len(start), start.shape[1])
    on_threads(
        lambda piece: settle(map_, start[piece], found, most), pieces_of(*start.shape), result.put,
        threads, progress,
    )  # fmt: skip
    return result


def pieces_of(count: int, states: int) -> list[slice]:
    """Starts that one thread follows at a time: fewer of many states, so that one hears of them."""
    size = max(PIECE // max(states // 4, 1) ** 3, FEWEST)
    return [slice(first, first + size) for first in range(0, count, size)]


def _write(
    result: Settling,
    who: np.ndarray,
    label: np.ndarray,
    periods: np.ndarray,
    travel: Travel,
    rows: np.ndarray,
) -> None:
    result.label[who], result.periods[who] = label, np.where(label >= 0, periods, -1)
    result.status[who], result.unresolved[who] = travel.status[rows], travel.unresolved[rows]
    result.end[who] = travel.state[rows]


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
    _renumber(result.label, found, wider)
    half = stage(progress, 0.5, 1.0)
    more = settle_all(map_, result.end[opened], wider, most, threads, half)
    more.periods[more.periods >= 0] += most
    more.unresolved[:] += result.unresolved[opened]
    still = more.label == OPEN
    more.label[still], more.status[still] = Kind.UNCONVERGED, st.LONG_TRANSIENT
    result.put(opened, more)
    return wider


def _renumber(label: np.ndarray, before: AttractorSet, after: AttractorSet) -> None:
    ids = np.array([*map(after.index, before.orbits), *map(after.index, before.sampled)], np.int64)
    if len(ids):
        label[label >= 0] = ids[label[label >= 0]]
