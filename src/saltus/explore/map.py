"""Maps for the page: cells as they settle, coarse to fine, and in the end what sl.basins gives."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.attractors.attractor_set import AttractorSet
from saltus.analysis.basins.growing import Grown, grow
from saltus.analysis.basins.labels import OPEN, Settling, complete
from saltus.analysis.basins.levels import stride_of
from saltus.analysis.basins.pipeline import BasinPlan, basin_plan
from saltus.errors import counted
from saltus.explore.attractors import KnownAttractors
from saltus.explore.frames import Emit
from saltus.explore.questions import MapQuestion, about
from saltus.flow.methods import Method
from saltus.interrupt import check_stop
from saltus.intervals import wilson
from saltus.results.dataset.kinds import Kind, sentences
from saltus.system import System

#: Bytes of maps that are kept.
KEPT = 2**26
#: Bytes of a kept cell.
_CELL = 40
#: Starts of the first look for attractors at new values; the whole sample follows.
FIRST_SCOUTS = 64
#: Stride of the finest level of a coarse map.
COARSE = 4
#: Starts whose grids differ by less than this share of a cell are the same.
_SAME = 1e-9
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
    """

    plan: BasinPlan
    result: Settling
    found: AttractorSet
    dataset: xr.Dataset | None = None


class KeptMaps:
    """Maps that were asked for, the newest 64 MB: Back is instant, and two pages share them."""

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
            while sum(one.plan.cells * _CELL for one in self._maps.values()) > KEPT:
                if len(self._maps) == 1:
                    break
                self._maps.popitem(last=False)

    def beside(self, plan: BasinPlan) -> list[KeptMap]:
        """Maps of the same values over the same states, whose starts may be some of this one."""
        with self._lock:
            mine = _key(plan)[:2]
            return [one for key, one in self._maps.items() if key[:2] == mine]


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
    known: KnownAttractors,
    maps: KeptMaps,
    emit: Emit,
    coarse: bool,
    threads: int | None,
) -> None:
    """Emit a map as it grows: ``map-begin``, ``map-piece`` and ``map-level`` as cells settle,
    ``map-attractors`` where one is found, ``map-end``.

    Every label is that of :func:`saltus.basins`; what was known already isn't computed again.
    Raises Interrupted if it is asked to stop; what was finished is kept.
    """
    kept = maps.get(plan)
    if kept is not None and kept.dataset is not None:
        _Growing(kept, known, emit).tell_all()
        return
    look(plan, known, min(FIRST_SCOUTS, plan.scouts), threads)
    kept = kept or KeptMap(plan, Settling.empty(plan.cells, len(plan.system.states)), known.found)
    maps.put(kept)
    growing = _Growing(kept, known, emit)
    growing.begin()
    growing.take_over(maps.beside(plan))
    if coarse or known.scouts < plan.scouts:
        growing.grow(min(COARSE, plan.levels()[0].stride), threads)
    if coarse:
        growing.end({"coarse": True})
        return
    if known.scouts < plan.scouts:
        look(plan, known, plan.scouts, threads)
        growing.tell_attractors()
    growing.grow(1, threads)
    growing.finish(threads)


def look(plan: BasinPlan, known: KnownAttractors, scouts: int, threads: int | None) -> None:
    """Look for attractors from a sample of starts, unless as many were looked through."""
    while not known.scouting.acquire(timeout=0.1):
        check_stop()
    try:
        if known.scouts < scouts:
            known.grow(replace(plan, scouts=scouts).scout(threads, None, known.found))
            known.scouts = scouts
    finally:
        known.scouting.release()


class _Growing:
    """A map that is told as it grows."""

    def __init__(self, kept: KeptMap, known: KnownAttractors, emit: Emit) -> None:
        self._kept, self._known, self._emit = kept, known, emit
        self._whole: list[int] = []

    def begin(self) -> None:
        """Tell what map it is."""
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
                "attractors": self._known.table(),
                "cached": self._kept.dataset is not None,
            },
            {},
        )

    def tell_attractors(self) -> None:
        """Tell the attractors anew, and take the ids of the wider set for labels."""
        self._renumber(self._known.found)
        self._emit({"kind": "map-attractors", "attractors": self._known.table()}, {})

    def take_over(self, others: list[KeptMap]) -> None:
        """Take cells that other maps know, and tell what is known."""
        mine, label = self._kept, self._kept.result.label
        self._renumber(self._known.found)
        for other in others:
            if other is not mine:
                here, there = _shared(mine.plan, other.plan)
                has = _has_label(other.result.label[there]) & ~_has_label(label[here])
                here, there = here[has], there[has]
                part = other.result.of(there)
                part.label[:] = self._by_id(part.label, other.found)
                mine.result.put(here, part)
        self._tell(np.flatnonzero(_has_label(label)))

    def grow(self, finest: int, threads: int | None) -> None:
        """Follow the cells of all levels down to a stride."""
        kept = self._kept
        grow(kept.plan, kept.found, self._take, result=kept.result, finest=finest, threads=threads)

    def finish(self, threads: int | None) -> None:
        """Search what nothing captured for new attractors, and tell the finished map."""
        kept, plan = self._kept, self._kept.plan
        opened = np.flatnonzero(kept.result.label == OPEN)
        if len(opened):
            wider = complete(
                plan.map(threads), kept.result, kept.found, plan.scale, plan.periods, threads
            )
            kept.found = wider
            if self._known.grow(wider):
                self.tell_attractors()
            self._tell(opened)
        kept.dataset = plan.finish(kept.result, kept.found, threads)
        self.end({})

    def tell_all(self) -> None:
        """Tell a map that is known."""
        self.begin()
        cells = np.arange(self._kept.plan.cells)
        self._tell(cells)
        self.end({})

    def end(self, more: Mapping[str, Any]) -> None:
        """Tell that nothing follows."""
        ds, label = self._kept.dataset, self._kept.result.label
        seen = label[label != Kind.NOT_COMPUTED]
        trust = {} if ds is None else {name: ds.attrs.get(name) for name in _TRUST}
        words = sentences(seen)
        if waiting := int((seen == OPEN).sum()):
            words.append(f"{counted(waiting, 'start')} not settled yet.")
        shares = {one["key"]: one for one in self._fractions(label)}
        table = [{**row, **shares.get(row["key"], {})} for row in self._known.table()]
        head = {"kind": "map-end", "coarse": False, "attractors": table, "words": words}
        self._emit({**head, **trust, **more}, {})

    # -- cells -------------------------------------------------------------------------------------
    def _take(self, grown: Grown) -> None:
        self._piece(grown.stride, grown.cells, grown.known)
        if grown.whole and grown.stride not in self._whole:
            self._whole.append(grown.stride)
            level = {"kind": "map-level", "level": grown.stride}
            self._emit({**level, "fractions": self._fair()}, {})

    def _tell(self, cells: np.ndarray) -> None:
        """Tell cells that are known, a level at a time."""
        plan, label = self._kept.plan, self._kept.result.label
        known = int(_has_label(label).sum())
        strides = stride_of(cells, plan.shape)
        for level in plan.levels():
            here = cells[strides == level.stride]
            if len(here):
                self._piece(level.stride, here, known)

    def _piece(self, stride: int, cells: np.ndarray, known: int) -> None:
        result = self._kept.result
        label, periods = result.label[cells], result.periods[cells]
        age = np.ceil(np.log2(np.maximum(periods, 1))).astype("u1")
        keys = self._by_key(label)
        head = {"kind": "map-piece", "level": stride, "known": known, "of": self._kept.plan.cells}
        arrays = {
            "cell": cells.astype("u4"),
            "label": keys.astype("i1"),
            "age": np.where(periods >= 0, age, _NO_AGE).astype("u1"),
        }
        self._emit(head, arrays)

    def _fair(self) -> list[dict[str, Any]]:
        """Shares of the cells of whole levels: what settles early is no fair sample."""
        plan, whole = self._kept.plan, []
        for level in plan.levels():
            if level.stride not in self._whole:
                break
            whole.append(level.stride)
        if not whole:
            return []
        rows, columns = (np.arange(0, size, whole[-1]) for size in plan.shape)
        label = self._kept.result.label.reshape(plan.shape)[np.ix_(rows, columns)]
        return self._fractions(label.ravel())

    def _fractions(self, label: np.ndarray) -> list[dict[str, Any]]:
        """Share of each attractor among labels, with its interval."""
        count = len(label)
        found = []
        for i, key in enumerate(self._known.keys(self._kept.found).tolist()):
            mine = int((label == i).sum())
            low, high = wilson(mine, count)
            share = {"fraction": mine / count, "low": float(low), "high": float(high)}
            found.append({"key": key, **share})
        return found

    # -- ids and keys ------------------------------------------------------------------------------
    def _by_key(self, label: np.ndarray) -> np.ndarray:
        """Labels by keys in place of ids; codes stay."""
        keys = np.append(self._known.keys(self._kept.found), -1)
        return np.where(label >= 0, keys[np.maximum(label, -1)], label)

    def _by_id(self, label: np.ndarray, found: AttractorSet) -> np.ndarray:
        """Labels by ids of one set as ids of this map's."""
        keys, ids = self._known.keys(found), self._known.keys(self._kept.found).tolist()
        new = np.array([ids.index(key) if key in ids else OPEN for key in keys] + [OPEN], np.int64)
        return np.where(label >= 0, new[np.maximum(label, -1)], label)

    def _renumber(self, found: AttractorSet) -> None:
        """Take a wider set of attractors, and its ids for the labels so far."""
        before, self._kept.found = self._kept.found, found
        label = self._kept.result.label
        label[:] = self._by_id(label, before)


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
    """Indices of two ascending rows at which they hold the same value."""
    at = np.clip(np.searchsorted(theirs, mine), 1, len(theirs) - 1)
    at -= np.abs(theirs[at - 1] - mine) < np.abs(theirs[at] - mine)
    here = np.flatnonzero(np.abs(theirs[at] - mine) <= _SAME * (mine[1] - mine[0]))
    return here, at[here]


def _has_label(label: np.ndarray) -> np.ndarray:
    known: np.ndarray = (label != Kind.NOT_COMPUTED) & (label != OPEN)
    return known
