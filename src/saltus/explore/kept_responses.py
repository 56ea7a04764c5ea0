"""Responses that were computed: by numbers that a page can name, and what they say of hues."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.closed.motions import ClosedMotion
from saltus.explore.questions import QuestionError
from saltus.results.dataset import schema
from saltus.system import System

#: Sets of responses that are kept.
KEPT = 16
#: No hue: nothing on this branch attracts at the values of the page.
NO_HUE = 255


class KeptResponses:
    """Responses that were computed, by numbers that a page can name."""

    def __init__(self) -> None:
        self._kept: OrderedDict[int, tuple[System, xr.Dataset]] = OrderedDict()
        self._hues: dict[int, np.ndarray] = {}
        self._by_question: dict[Any, int] = {}
        self._lock = threading.Lock()
        self._next = 0

    def put(
        self, question: Any, system: System, ds: xr.Dataset, hues: np.ndarray | None = None
    ) -> int:
        """Keep the responses of a system, with the hues of their branches, and give them a number;
        the oldest are dropped.
        """
        with self._lock:
            number, self._next = self._next, self._next + 1
            self._kept[number] = system, ds
            self._hues[number] = np.zeros(0) if hues is None else hues
            self._by_question[question] = number
            while len(self._kept) > KEPT:
                self._kept.popitem(last=False)
            return number

    def number(self, question: Any) -> int | None:
        """The number of the responses to a question; None if they aren't kept."""
        with self._lock:
            number = self._by_question.get(question)
            return number if number in self._kept else None

    def orbits_at(self, system: System) -> list[tuple[ClosedMotion, int]]:
        """Orbits of branches that have a hue, at the values of a system, and these hues: of the
        newest responses that hold these values.
        """
        with self._lock:
            kept = [(*self._kept[number], self._hues[number]) for number in reversed(self._kept)]
        for other, ds, hues in kept:
            name, mine = str(ds.attrs["parameter"]), system.values
            same = all(mine[key] == value for key, value in other.values.items() if key != name)
            within = ds.attrs["parameter_low"] <= mine[name] <= ds.attrs["parameter_high"]
            if same and within and (np.asarray(hues) != NO_HUE).any():
                return [
                    (ClosedMotion(points, np.zeros(points.shape[1]), 0.0), int(hues[branch]))
                    for branch, points in crossings(ds, system)
                    if hues[branch] != NO_HUE
                ]
        return []

    def get(self, number: int) -> tuple[System, xr.Dataset]:
        """The responses of a number. Raises QuestionError if there are none."""
        with self._lock:
            if number not in self._kept:
                raise QuestionError("these responses aren't kept any longer: ask again.", "point")
            return self._kept[number]


def crossings(ds: xr.Dataset, system: System) -> Iterator[tuple[int, np.ndarray]]:
    """Branches and the points float64[n, D] of their orbits at the value that the parameter has in
    a system, between those that were computed.
    """
    parameter = str(ds.attrs["parameter"])
    value, at = system.values[parameter], ds[schema.point_name(parameter)].values
    names = [schema.point_name(state) for state in system.states]
    points = np.stack([ds[name].values for name in names], axis=2)
    branch, periods = ds["point_branch"].values, ds["branch_periods"].values
    for i in np.flatnonzero(branch[:-1] == branch[1:]).tolist():
        n, step = int(periods[branch[i]]), at[i + 1] - at[i]
        if n and (at[i] - value) * (at[i + 1] - value) <= 0:
            share = (value - at[i]) / step if step else 0.0
            yield int(branch[i]), points[i, :n] + share * (points[i + 1, :n] - points[i, :n])
