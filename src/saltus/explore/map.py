"""Maps for the page: cells as they settle, coarse to fine, and in the end what sl.basins gives."""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.attractors.attractor_set import AttractorSet
from saltus.analysis.basins.growing import (
    COARSE,
    FEW_SCOUTS,
    Grown,
    KnownAttractors,
    grow,
    grow_all,
)
from saltus.analysis.basins.labels import OPEN, Settling, has_label
from saltus.analysis.basins.levels import stride_of
from saltus.analysis.basins.pipeline import BasinPlan, basin_plan
from saltus.errors import counted
from saltus.explore.attractors import Legend
from saltus.explore.cells import packed_cells
from saltus.explore.frames import Emit
from saltus.explore.questions import MapQuestion, about
from saltus.flow.methods import Method
from saltus.interrupt import check_stop
from saltus.intervals import wilson
from saltus.results.dataset.kinds import Kind, sentences
from saltus.system import System

#: Bytes of maps that are kept, and bytes of a kept cell beside its last state.
KEPT, CELL = 2**25, 52
#: Time between two looks whether who waits was asked to stop [s].
LOOK = 0.1
#: Time for which cells of fine levels are gathered, so that frames are few [s].
GATHERED = 0.3
#: Time between two words on the search for attractors [s].
SAID = 1.0
#: Starts that are looked through for attractors where no map's whole sample follows at once.
LOOKED = 64
#: Age of a start that isn't settled.
_NO_AGE = 255
#: Numbers of a finished map that the page shows.
_TRUST = (
    "flip_rate", "flip_rate_low", "flip_rate_high", "flip_checked", "basin_entropy",
    "uncertainty_exponent",
)  # fmt: skip


@dataclass
class KeptMap:
    """A map as far as it is known.

    Attributes
    ----------
    plan : BasinPlan
    result : Settling
        Outcomes of its cells; labels are ids of ``found``.
    found : AttractorSet
    dataset : Dataset or None
        The finished map.
    lock : RLock
        Who grows it holds this.
    """

    plan: BasinPlan
    result: Settling
    found: AttractorSet
    dataset: xr.Dataset | None = None
    lock: Any = field(default_factory=threading.RLock)


class KeptMaps:
    """Maps that were asked for, the newest 32 MB: Back is instant, and two pages share them."""

    def __init__(self) -> None:
        self._maps: OrderedDict[Any, KeptMap] = OrderedDict()
        self._lock = threading.Lock()

    def get(self, plan: BasinPlan) -> KeptMap | None:
        """The map of a plan; None if it isn't kept."""
        with self._lock:
            return self._maps.get(_key(plan))

    def put(self, kept: KeptMap) -> None:
        """Keep a map; the oldest are dropped."""
        with self._lock:
            self._maps[_key(kept.plan)] = kept
            self._maps.move_to_end(_key(kept.plan))
            while sum(_size(one.plan) for one in self._maps.values()) > KEPT:
                if len(self._maps) == 1:
                    break
                self._maps.popitem(last=False)

    def beside(self, plan: BasinPlan) -> list[KeptMap]:
        """Maps of the same values over the same states, whose starts may be some of this one."""
        with self._lock:
            mine = _key(plan)[:2]
            return [one for key, one in self._maps.items() if key[:2] == mine]


def _size(plan: BasinPlan) -> int:
    return plan.cells * (CELL + 8 * len(plan.system.states))


def _key(plan: BasinPlan) -> tuple[Any, ...]:
    about = (
        tuple(plan.system.values.values()), plan.method, tuple(plan.fixed.items()), plan.periods,
        plan.every,
    )  # fmt: skip
    ends = tuple((values[0], values[-1], len(values)) for values in plan.axes.values())
    return about, tuple(plan.axes), ends


def plan_of_map(question: MapQuestion, system: System, method: Method) -> BasinPlan:
    """The map of a question. Raises QuestionError if it can't be."""
    axes = {
        name: (*ends, count)
        for (name, ends), count in zip(question.axes.items(), question.size, strict=True)
    }
    with about("axes"):
        return basin_plan(system, axes, question.at, method, question.periods, None)


def grow_map(
    plan: BasinPlan,
    legend: Legend,
    maps: KeptMaps,
    emit: Emit,
    coarse: bool,
    threads: int | None,
) -> KeptMap:
    """Emit a map as it grows: ``map-begin``, ``map-piece`` and ``map-level`` as cells settle,
    ``map-attractors`` where one is found, ``map-look`` while all are looked for, ``map-end``.

    Every label is that of :func:`saltus.basins`; what was known already isn't computed again.
    Raises Interrupted if it is asked to stop; what was finished is kept.
    """
    kept = maps.get(plan)
    if kept is None:
        kept = KeptMap(plan, Settling.empty(plan.cells, len(plan.system.states)), legend.found)
        maps.put(kept)
    growing = _Growing(kept, legend, emit)
    with _held(kept.lock):
        if kept.dataset is None:
            growing.take_over(maps.beside(plan))
            growing.grow(coarse, threads)
        else:
            growing.tell_all()
    return kept


@contextmanager
def _held(lock: Any) -> Iterator[None]:
    """Hold a lock; who waits for it hears that it is asked to stop."""
    while not lock.acquire(timeout=LOOK):
        check_stop()
    try:
        yield
    finally:
        lock.release()


def look(plan: BasinPlan, legend: Legend, threads: int | None, scouts: int = LOOKED) -> None:
    """Look for attractors from those of the values before, and from some starts, unless as many
    were looked through.
    """
    legend.follow()
    if legend.scouts < scouts:
        legend.grow(plan.glanced(scouts, threads, legend.found))
        legend.scouts = scouts


class _Growing:
    """A map that is told as it grows."""

    def __init__(self, kept: KeptMap, legend: Legend, emit: Emit) -> None:
        self._kept, self._legend, self._emit = kept, legend, emit
        self._whole: list[int] = []
        self._begun, self._known, self._told, self._looked_at = False, 0, 0.0, 0.0
        self._waiting: dict[int, list[np.ndarray]] = {}

    def take_over(self, others: list[KeptMap]) -> None:
        """Take cells that other maps know."""
        mine, label = self._kept, self._kept.result.label
        wider, before = self._legend.found, mine.found
        label[:] = self._renumbered(label, before, wider)
        mine.found = wider
        for other in others:
            if other is not mine:
                here, there = _shared(mine.plan, other.plan)
                has = has_label(other.result.label[there]) & ~has_label(label[here])
                here, there = here[has], there[has]
                part = other.result.of(there)
                part.label[:] = self._renumbered(part.label, other.found, wider)
                mine.result.put(here, part)

    def grow(self, coarse: bool, threads: int | None) -> None:
        """Follow the cells that aren't known: all, or those of coarse levels."""
        kept, plan, legend = self._kept, self._kept.plan, self._legend
        if coarse:
            look(plan, legend, threads)
            self.take_over([])
            self._begin()
            finest = min(COARSE, plan.levels()[0].stride)
            grow(plan, kept.found, self._take, result=kept.result, finest=finest, threads=threads)
            self._end({"coarse": True})
            return
        if not legend.follow():  # else what was known there colours the first cells
            look(plan, legend, threads, FEW_SCOUTS)
        self.take_over([])
        scouted = legend.scouts >= plan.scouts
        found, _ = grow_all(
            plan, self._take, kept.found, threads, result=kept.result, scouted=scouted,
            looked=self._looked,
        )  # fmt: skip
        legend.grow(found)
        legend.scouts = max(legend.scouts, plan.scouts)
        kept.dataset = plan.finish(kept.result, found, threads)
        self._end({"coarse": False})

    def tell_all(self) -> None:
        """Tell a map that is known."""
        self._begin()
        self._end({"coarse": False})

    def _begin(self) -> None:
        """Tell what map it is, and what is known of it."""
        plan = self._kept.plan
        self._emit(
            {
                "kind": "map-begin",
                "size": list(plan.shape),
                "axes": {name: [one[0], one[-1]] for name, one in plan.axes.items()},
                "values": dict(plan.system.values),
                "at": dict(plan.fixed),
                "method": plan.method.name,
                "every": plan.every,
                "levels": [level.stride for level in plan.levels()],
                "attractors": self._legend.table(),
                "cached": self._kept.dataset is not None,
            },
            {},
        )
        self._begun = True
        label = self._kept.result.label
        cells = np.flatnonzero(label != Kind.NOT_COMPUTED)
        known, strides = int(has_label(label).sum()), stride_of(cells, plan.shape)
        for level in plan.levels():
            here = cells[strides == level.stride]
            if len(here):
                self._piece(level.stride, here, known)

    def _end(self, more: Mapping[str, Any]) -> None:
        """Tell that nothing follows."""
        self._tell()
        ds, label = self._kept.dataset, self._kept.result.label
        seen = label[label != Kind.NOT_COMPUTED]
        trust = {name: None if ds is None else ds.attrs.get(name) for name in _TRUST}
        words = sentences(seen)
        if waiting := int((seen == OPEN).sum()):
            words.append(f"{counted(waiting, 'start')} not settled yet.")
        fair = self._fair()[1] if ds is None else self._fractions(label)
        shares = {one["key"]: one for one in fair}
        table = [{**row, **shares.get(row["key"], {})} for row in self._legend.table()]
        self._emit({"kind": "map-end", "attractors": table, "words": words, **trust, **more}, {})

    # -- cells -------------------------------------------------------------------------------------
    def _take(self, news: Grown | KnownAttractors) -> None:
        if isinstance(news, KnownAttractors):
            self._tell()
            self._kept.found = news.found
            fresh = self._legend.grow(news.found)
            if not self._begun:
                self._begin()
            elif fresh:
                self._emit({"kind": "map-attractors", "attractors": self._legend.table()}, {})
            return
        self._waiting.setdefault(news.stride, []).append(news.cells)
        self._known = news.known
        if news.stride >= COARSE or news.whole or time.monotonic() > self._told + GATHERED:
            self._tell()
        if news.whole and news.stride not in self._whole:
            self._whole.append(news.stride)
            stride, shares = self._fair()
            level = {"kind": "map-level", "level": news.stride, "of": stride}
            self._emit({**level, "fractions": shares}, {})

    def _looked(self, share: float) -> None:
        """Tell how far the search for all attractors is, now and then."""
        if share == 1.0 or time.monotonic() > self._looked_at + SAID:
            self._looked_at = time.monotonic()
            self._emit({"kind": "map-look", "share": share}, {})

    def _tell(self) -> None:
        """Send the cells that wait, a level at a time."""
        waiting, self._waiting, self._told = self._waiting, {}, time.monotonic()
        for stride, cells in sorted(waiting.items(), reverse=True):
            self._piece(stride, np.unique(np.concatenate(cells)), self._known)

    def _piece(self, stride: int, cells: np.ndarray, known: int) -> None:
        result = self._kept.result
        label, periods = result.label[cells], result.periods[cells]
        age = np.ceil(np.log2(np.maximum(periods, 1)))
        age = np.where(periods >= 0, age, _NO_AGE).astype("u1")
        keys = self._by_key(label).astype("i1")
        head = {"kind": "map-piece", "level": stride, "known": known, "of": self._kept.plan.cells}
        head["open"] = int((result.label == OPEN).sum())
        self._emit(head, packed_cells(cells, keys, age, self._kept.plan.shape[1]))

    def _fair(self) -> tuple[int | None, list[dict[str, Any]]]:
        """The stride of the finest grid of which all levels are whole, None if there is none, and
        the shares of its cells: what settles early is no fair sample.
        """
        plan, whole = self._kept.plan, []
        for level in plan.levels():
            if level.stride not in self._whole:
                break
            whole.append(level.stride)
        if not whole:
            return None, []
        rows, columns = (np.arange(0, size, whole[-1]) for size in plan.shape)
        label = self._kept.result.label.reshape(plan.shape)[np.ix_(rows, columns)]
        return whole[-1], self._fractions(label.ravel())

    def _fractions(self, label: np.ndarray) -> list[dict[str, Any]]:
        """Share of each attractor among labels, with its interval."""
        count = len(label)
        found = []
        for i, key in enumerate(self._legend.keys(self._kept.found).tolist()):
            mine = int((label == i).sum())
            low, high = wilson(mine, count)
            share = {"fraction": mine / count, "low": float(low), "high": float(high)}
            found.append({"key": key, **share})
        return found

    # -- ids and keys ------------------------------------------------------------------------------
    def _by_key(self, label: np.ndarray) -> np.ndarray:
        """Labels by keys in place of ids; codes stay."""
        keys = np.append(self._legend.keys(self._kept.found), -1)
        return np.where(label >= 0, keys[np.maximum(label, -1)], label)

    def _renumbered(
        self, label: np.ndarray, before: AttractorSet, after: AttractorSet
    ) -> np.ndarray:
        """Labels by ids of one set as ids of another."""
        keys, ids = self._legend.keys(before), self._legend.keys(after).tolist()
        new = np.array([ids.index(key) if key in ids else OPEN for key in keys] + [OPEN], np.int64)
        return np.where(label >= 0, new[np.maximum(label, -1)], label)


def _shared(plan: BasinPlan, other: BasinPlan) -> tuple[np.ndarray, np.ndarray]:
    """Cells of two maps over the same states that are the same starts: int64[k] of each."""
    pairs = [
        _same_starts(mine, theirs)
        for mine, theirs in zip(plan.axes.values(), other.axes.values(), strict=True)
    ]
    (rows, other_rows), (columns, other_columns) = pairs
    return (
        (rows[:, None] * plan.shape[1] + columns).ravel(),
        (other_rows[:, None] * other.shape[1] + other_columns).ravel(),
    )


def _same_starts(mine: np.ndarray, theirs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Indices of two rows at which they hold the same value, to the bit: one start in a hundred
    leads elsewhere from beside it, however near.
    """
    _, here, there = np.intersect1d(mine, theirs, return_indices=True)
    return here, there
