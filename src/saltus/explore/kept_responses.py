"""Responses that were computed: by numbers that a page can name, and what they say of hues."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.attractors.aperiodic import SampledMotion
from saltus.analysis.closed.motions import ClosedMotion
from saltus.explore.attractors import Attractor
from saltus.explore.questions import QuestionError
from saltus.results.dataset import schema
from saltus.results.dataset.kinds import Kind
from saltus.system import System

#: Sets of responses that are kept.
KEPT = 16
#: No hue: nothing on this stretch attracts.
NO_HUE = 255


class KeptResponses:
    """Responses that were computed, by numbers that a page can name."""

    def __init__(self) -> None:
        self._kept: OrderedDict[int, tuple[System, xr.Dataset]] = OrderedDict()
        self._hues: dict[int, np.ndarray | None] = {}
        self._by_question: dict[Any, int] = {}
        self._lock = threading.Lock()
        self._next = 0

    def put(
        self, question: Any, system: System, ds: xr.Dataset, hues: np.ndarray | None = None
    ) -> int:
        """Keep the responses of a system, with the hues of their stretches, and give them a
        number; the oldest are dropped.
        """
        with self._lock:
            number, self._next = self._next, self._next + 1
            self._kept[number] = system, ds
            self._hues[number] = hues
            self._by_question[question] = number
            while len(self._kept) > KEPT:
                self._kept.popitem(last=False)
            return number

    def number(self, question: Any) -> int | None:
        """The number of the responses to a question; None if they aren't kept."""
        with self._lock:
            number = self._by_question.get(question)
            return number if number in self._kept else None

    def hues(self, number: int) -> np.ndarray | None:
        """The hues of the stretches of responses, uint8[n]; None if they were kept without."""
        with self._lock:
            return self._hues[number]

    def colour(self, number: int, hues: np.ndarray) -> None:
        """Keep the hues of the stretches of responses."""
        with self._lock:
            self._hues[number] = hues

    def orbits_at(self, system: System) -> tuple[list[tuple[Attractor, int]], set[int]]:
        """Attractors that stretches of branches have at the values of a system, and their hues: of
        the newest responses that hold these values. All hues of these responses besides.
        """
        with self._lock:
            kept = [(*self._kept[number], self._hues[number]) for number in reversed(self._kept)]
        for other, ds, hues in kept:
            name, mine = str(ds.attrs["parameter"]), system.values
            same = all(mine[key] == value for key, value in other.values.items() if key != name)
            within = ds.attrs["parameter_low"] <= mine[name] <= ds.attrs["parameter_high"]
            if same and within and hues is not None and (hues != NO_HUE).any():
                found = [(one, int(hues[at])) for at, one in crossings(ds, system)]
                return found, set(hues.tolist()) - {NO_HUE}
        return [], set()

    def get(self, number: int) -> tuple[System, xr.Dataset]:
        """The responses of a number. Raises QuestionError if there are none."""
        with self._lock:
            if number not in self._kept:
                raise QuestionError("these responses aren't kept any longer: ask again.", "point")
            return self._kept[number]


def stretches(ds: xr.Dataset) -> np.ndarray:
    """The stretch of its branch that each point lies on, int64[point]: from fold to fold, so that
    the parameter moves one way. The ends of a closed branch are one stretch.
    """
    at = ds[schema.point_name(str(ds.attrs["parameter"]))].values
    branch = ds["point_branch"].values
    begins = np.diff(branch, prepend=-1) != 0
    way = np.sign(np.diff(at, prepend=np.nan))
    way[begins] = np.nan
    turns = way[1:] * way[:-1] < 0
    number: np.ndarray = np.cumsum(begins | np.append(False, turns)) - 1
    for one in np.flatnonzero(ds["branch_closed"].values).tolist():
        mine = number[branch == one]
        number[number == mine[-1]] = mine[0]
    return number


def crossings(ds: xr.Dataset, system: System) -> Iterator[tuple[int, Attractor]]:
    """Stretches of branches, and the attractors on them at the value that the parameter has in a
    system, between those that were computed.
    """
    parameter = str(ds.attrs["parameter"])
    value, at = system.values[parameter], ds[schema.point_name(parameter)].values
    names = [schema.point_name(state) for state in system.states]
    points = np.stack([ds[name].values for name in names], axis=2)
    branch, stable, stretch = ds["point_branch"].values, ds["point_stable"].values, stretches(ds)
    periods, kinds = ds["branch_periods"].values, ds["branch_kind"].values
    for i in np.flatnonzero(branch[:-1] == branch[1:]).tolist():
        step = at[i + 1] - at[i]
        if (at[i] - value) * (at[i + 1] - value) <= 0 and (stable[i] or stable[i + 1]):
            n, share = max(int(periods[branch[i]]), 1), (value - at[i]) / step if step else 0.0
            between = points[i, :n] + share * (points[i + 1, :n] - points[i, :n])
            yield int(stretch[i + 1]), _attractor(str(kinds[branch[i]]), between)


def _attractor(kind: str, points: np.ndarray) -> Attractor:
    if kind == Kind.LIMIT_CYCLE.word:
        return SampledMotion(kind, 0.0, 0.0, points, np.ones(points.shape[1]))
    return ClosedMotion(points, np.zeros(points.shape[1]), 0.0)
