"""A basin map that grows: its cells as they settle, coarse to fine, for who looks at it meanwhile.

Each thread follows a pool of starts. Those that have settled are handed on after every few
iterates, and new ones take their places, so that no lane waits for the slowest start. Every cell is
labelled as by :func:`saltus.basins`: in what order starts are followed, and beside which others,
changes no bit of them.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from queue import Empty, Full, Queue

import numpy as np

from saltus.analysis.attractors.attractor_set import AttractorSet
from saltus.analysis.basins.basins import compiled
from saltus.analysis.basins.labels import (
    OPEN,
    Settling,
    Wanderers,
    complete,
    fewer,
    has_label,
    renumber,
)
from saltus.analysis.basins.levels import stride_of
from saltus.analysis.basins.pipeline import BasinPlan
from saltus.analysis.basins.scouting import dear
from saltus.analysis.closed.capture import Neighbourhoods
from saltus.flow.maps import Stroboscope
from saltus.flow.threads import on_threads, usable_processors
from saltus.interrupt import check_stop

#: Starts of up to seven states that one thread follows at a time: fewer leave lanes empty, more
#: delay the first cells.
POOL = 1024
#: New starts are sent off when a pool has shrunk to this share.
REFILL = 0.75
#: Iterates after which a start of a coarse level waits for the finer ones.
PATIENCE = 256
#: Smallest stride of the levels that are that impatient.
COARSE = 4
#: Starts from which attractors are looked for before the first cells: not enough for an answer,
#: large basins are hit. Eight give the first cells of the rig after 0.2 s, 64 after 0.6, and even
#: these miss small basins at four of seven frequencies.
FEW_SCOUTS = 8
#: Batches of settled starts that may wait to be taken; then those who follow starts wait.
AHEAD = 256
#: Seconds for which cells are gathered before they are handed on.
GATHERED = 0.03


@dataclass(frozen=True)
class KnownAttractors:
    """The attractors that cells are labelled with from now on.

    Attributes
    ----------
    found : AttractorSet
        All that are known by now.
    ids : int64[m]
        The new id of each that was known before: labels of before change by it.
    """

    found: AttractorSet
    ids: np.ndarray


@dataclass(frozen=True)
class Grown:
    """Cells of one level that have settled since the last of these.

    Attributes
    ----------
    stride : int
        Of their level.
    cells : int64[k]
        Of the flattened grid.
    part : Settling
        Their outcomes. The label :data:`OPEN` says that nothing has captured them yet.
    known : int
        Cells of the map that have a label by now.
    whole : bool
        Whether every cell of the level has been handed on by now, open ones included: shares of
        the labels are fair then.
    """

    stride: int
    cells: np.ndarray
    part: Settling
    known: int
    whole: bool


def grow(
    plan: BasinPlan,
    found: AttractorSet,
    take: Callable[[Grown], None],
    *,
    result: Settling | None = None,
    finest: int = 1,
    patience: int = PATIENCE,
    resume: bool | None = None,
    threads: int | None = None,
) -> Settling:
    """Label the cells of a map, coarse to fine, and hand them on as they settle.

    Starts of coarse levels that nothing captures within ``patience`` iterates are handed on as
    open. They are followed again, from their start and as long as all, when no finer level waits.

    Parameters
    ----------
    plan : BasinPlan
        The map.
    found : AttractorSet
        Its attractors, as :meth:`BasinPlan.scout` finds them.
    take : callable
        Called from this thread, some thirty times a second, with :class:`Grown` cells. While it
        doesn't return, starts are soon followed no further.
    result : Settling, optional
        Outcomes of cells that are known already, such as those of a map that was stopped; they
        aren't followed again. New ones are written to it.
    finest : int
        Stride of the finest level that is wanted.
    patience : int
        Iterates; see above.
    resume : bool
        Whether open starts are followed again; default where ``finest`` is 1. Else all levels are
        that impatient.
    threads : int, optional
        Default all processors.

    Returns
    -------
    Settling
        Of all cells: :meth:`BasinPlan.finish` makes the Dataset of them that
        :func:`saltus.basins` gives.

    Raises
    ------
    Interrupted
        On Ctrl-C, or a :class:`saltus.Stop`. ``result`` holds what was finished.
    """
    if result is None:
        result = Settling.empty(plan.cells, len(plan.system.states))
    resume = finest == 1 if resume is None else resume
    work = _Work(plan, found, result, finest, patience, resume)
    map_ = compiled(plan)
    handed = _Handed(work, take)
    try:
        on_threads(
            lambda _: work.follow(map_), range(threads or usable_processors()), lambda *_: None,
            threads, lambda _: handed.hand_on(), every=GATHERED,
        )  # fmt: skip
    finally:
        handed.gather()
    handed.hand_on()
    return result


def grow_all(
    plan: BasinPlan,
    take: Callable[[Grown | KnownAttractors], None],
    known: AttractorSet | None = None,
    threads: int | None = None,
    *,
    result: Settling | None = None,
    scouted: bool = False,
    looked: Callable[[float], None] | None = None,
) -> tuple[AttractorSet, Settling]:
    """A whole map from nothing, or from some of its attractors, with a first picture early.

    1. Where none is known, attractors are looked for from a few starts.
    2. Coarse levels are labelled by what is known, while attractors are looked for from as many
       starts as :func:`saltus.basins` looks from.
    3. The other cells are labelled, and those that nothing had captured.
    4. More attractors are looked for from cells that are still open.

    Labels are those of :func:`saltus.basins`. Periods to settle may differ by a few where
    attractors were known: their neighbourhoods are those of Newton's method from elsewhere.

    Parameters
    ----------
    plan : BasinPlan
        The map.
    take : callable
        Called with each :class:`KnownAttractors` before the cells that it labels, and with
        :class:`Grown` cells as by :func:`grow`; never by two threads at once.
    known : AttractorSet, optional
        Attractors that are known, such as those of old values
        (:func:`saltus.analysis.attractors.followed.followed`).
    threads : int, optional
        Default all processors.
    result : Settling, optional
        Outcomes of cells that are known already, labelled by the ids of ``known``; they aren't
        followed again. New ones are written to it.
    scouted : bool
        Whether ``known`` is all that a whole sample of starts leads to: none is looked through
        again.
    looked : callable, optional
        Called with the share of that look that is done, by another thread.

    Returns
    -------
    AttractorSet, Settling
        All attractors, and the outcomes of all cells: :meth:`BasinPlan.finish` makes the Dataset.

    Raises
    ------
    Interrupted
        On Ctrl-C, or a :class:`saltus.Stop`.
    """
    states = len(plan.system.states)
    if result is None:
        result = Settling.empty(plan.cells, states)
    found = known or AttractorSet(Neighbourhoods.none(states))
    if not found and not scouted:
        found = plan.glanced(FEW_SCOUTS, threads)
    take(KnownAttractors(found, np.arange(len(known or ()))))
    wider = found

    def look() -> None:
        nonlocal wider
        *_, wider = plan.scouted(1, looked, found)

    def begin() -> None:
        coarsest = plan.levels()[0].stride  # others wait for attractors that take long to be found
        finest = coarsest if dear(plan.periods, states) else min(COARSE, coarsest)
        grow(plan, found, take, result=result, finest=finest, resume=False, threads=threads)

    if not scouted:
        on_threads(lambda job: job(), [look, begin], lambda *_: None, 2)
        ids = wider.ids(found)
        renumber(result.label, ids)
        if len(wider) > len(found):
            take(KnownAttractors(wider, ids))
    grow(plan, wider, take, result=result, threads=threads)
    opened = np.flatnonzero(result.label == OPEN)
    every = complete(plan.map(threads), result, wider, plan.scale, plan.periods, threads)
    if len(every) > len(wider):
        take(KnownAttractors(every, every.ids(wider)))
    strides = stride_of(opened, plan.shape)
    for stride in np.unique(strides)[::-1].tolist():
        here = opened[strides == stride]
        take(Grown(stride, here, result.of(here), plan.cells, True))
    return every, result


class _Work:
    """The cells that are still to be followed, shared by all threads."""

    def __init__(
        self,
        plan: BasinPlan,
        found: AttractorSet,
        result: Settling,
        finest: int,
        patience: int,
        resumes: bool,
    ) -> None:
        self.plan, self.found, self.result = plan, found, result
        self.patience, self.resumes = patience, resumes
        self.levels = [one for one in plan.levels() if one.stride >= finest]
        self.settled: Queue[tuple[np.ndarray, Settling]] = Queue(AHEAD)
        self._lock, self._ahead = threading.Lock(), np.zeros(0, np.int64)
        self._tiles = self._in_order()
        self._waiting: list[np.ndarray] = []
        self._again = np.zeros(plan.cells, bool)

    def _in_order(self) -> Iterator[np.ndarray]:
        for level in self.levels:
            for tile in level.tiles():
                yield tile[~has_label(self.result.label[tile])]

    def take(self, count: int) -> np.ndarray:
        """The next cells, int64[count at most]; behind all levels those that wait."""
        with self._lock:
            while len(self._ahead) < count:
                tile = next(self._tiles, None)
                if tile is None and self._waiting:
                    tile = self._waiting.pop(0)
                    self._again[tile] = True
                if tile is None:
                    break
                self._ahead = np.concatenate([self._ahead, tile])
            taken, self._ahead = self._ahead[:count], self._ahead[count:]
            return taken

    def follow(self, map_: Stroboscope) -> None:
        """Follow starts until none is left; the work of one thread."""
        plan = self.plan
        states = len(plan.system.states)
        pool, size = Wanderers(map_, self.found, plan.periods, states), fewer(POOL, states)
        while True:
            if len(pool) <= REFILL * size and len(more := self.take(size - len(pool))):
                pool.add(more, plan.starts(more))
            if not len(pool):
                return
            self._hand_on(*pool.go_on())
            impatient = (pool.age >= self.patience) & self._is_impatient(pool.who)
            if impatient.any():
                who, part = pool.give_up(impatient)
                self._hand_on(who, part)
                if self.resumes:
                    with self._lock:
                        self._waiting.append(who)

    def _hand_on(self, who: np.ndarray, part: Settling) -> None:
        """Hand on what has settled; wait while who takes it is behind."""
        while len(who):
            try:
                self.settled.put((who, part), timeout=GATHERED)
            except Full:
                check_stop()
            else:
                return

    def _is_impatient(self, cells: np.ndarray) -> np.ndarray:
        if not self.resumes:
            return np.ones(len(cells), bool)
        coarse: np.ndarray = stride_of(cells, self.plan.shape) >= COARSE
        return np.asarray(coarse & ~self._again[cells])


class _Handed:
    """Count of the cells that were handed on, by levels."""

    def __init__(self, work: _Work, take: Callable[[Grown], None]) -> None:
        self._work, self._take = work, take
        self._known = has_label(work.result.label)
        self._seen = self._known.copy()
        strides = stride_of(np.flatnonzero(self._seen), work.plan.shape)
        self._left = {
            one.stride: one.count - int((strides == one.stride).sum()) for one in work.levels
        }
        self._new: list[np.ndarray] = []

    def gather(self) -> None:
        """Write what has settled to the result."""
        while True:
            try:
                who, part = self._work.settled.get_nowait()
            except Empty:
                return
            self._work.result.put(who, part)
            self._new.append(who)

    def hand_on(self) -> None:
        """Hand on what has settled, a level at a time."""
        self.gather()
        if not self._new:
            return
        cells, self._new = np.unique(np.concatenate(self._new)), []
        strides = stride_of(cells, self._work.plan.shape)
        for stride in sorted(set(strides.tolist()), reverse=True):
            here = cells[strides == stride]
            part = self._work.result.of(here)
            self._left[stride] -= int((~self._seen[here]).sum())
            self._seen[here], self._known[here] = True, has_label(part.label)
            self._take(Grown(stride, here, part, int(self._known.sum()), self._left[stride] == 0))
