"""Responses for the page: branches over a parameter, the orbits on them, and their hues."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.basins.pipeline import BasinPlan
from saltus.analysis.branches.branch import Branch
from saltus.analysis.branches.branch_table import table_of
from saltus.analysis.branches.branches import follow_all, seeds_between
from saltus.analysis.branches.plans import LONGEST_DOUBLED, POINTS, SWITCHES, plan_of
from saltus.analysis.closed.motions import ClosedMotion, orbit_distance
from saltus.analysis.inputs.outputs import outputs_of
from saltus.errors import unknown
from saltus.explore.attractors import Legend, pairs
from saltus.explore.frames import Answer, Emit
from saltus.explore.motion import AskedRun
from saltus.explore.orbits import orbit
from saltus.explore.questions import QuestionError
from saltus.flow.methods import Method, exact_method
from saltus.results.dataset import schema
from saltus.system import System

#: Starts that are drawn from the box of the map, and values of the parameter at which they and the
#: known attractors are run.
STARTS, VALUES = 8, 5
#: Share of the work that the branches of the known attractors are.
FIRST = 0.4
#: Share of progress after which it is told anew.
_STEP = 0.02
#: Sets of responses that are kept.
KEPT = 16
#: A point of a branch is an attractor's if it is nearer than this share of the box.
_NEAR = 0.05
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
                    for branch, points in _crossings(ds, system)
                    if hues[branch] != NO_HUE
                ]
        return []

    def get(self, number: int) -> tuple[System, xr.Dataset]:
        """The responses of a number. Raises QuestionError if there are none."""
        with self._lock:
            if number not in self._kept:
                raise QuestionError("these responses aren't kept any longer: ask again.", "point")
            return self._kept[number]


def respond(
    known: Legend,
    method: Method,
    parameter: str,
    limits: tuple[float, float],
    quantity: str,
    plan: BasinPlan,
    kept: KeptResponses,
    emit: Emit,
    threads: int | None,
) -> None:
    """Emit the branches of a system over a parameter: those of the known attractors first, then all
    that starts in a box lead to. Each answer replaces the one before.

    Raises
    ------
    ParameterError, UnitError
        If an argument can't be used, or nothing repeats in the range.
    Interrupted
        If it is asked to stop.
    """
    system = known.map.system
    question = (tuple(system.values.values()), method, parameter, limits, quantity)
    number = kept.number(question)
    if number is not None:
        emit(*_answer(known, kept.get(number)[1], number, quantity, 1.0))
        return
    told = _Told(emit, parameter, limits, quantity)
    method, done = exact_method(method, system, "responses"), list[Branch]()
    rules = plan_of(
        system, parameter, limits, method, threads, POINTS, LONGEST_DOUBLED, frozenset(SWITCHES)
    )
    wanted = outputs_of(system)
    if len(known):
        seeds = seeds_between(system, parameter, limits, known.dataset(), method=method)
        follow_all(rules, system, parameter, *seeds, done, told.between(0.0, FIRST))
        first = table_of(system, parameter, limits, done, wanted, method)
        number = kept.put(None, system, first, _hues(known, first))
        emit(*_answer(known, first, number, quantity, FIRST))
    seeds = seeds_between(
        system,
        parameter,
        limits,
        starts_from(known, plan),
        at=VALUES,
        method=method,
        threads=threads,
    )
    follow_all(rules, system, parameter, *seeds, done, told.between(FIRST, 1.0))
    if not done:
        raise QuestionError(f"nothing that repeats is known for this range of {parameter}.")
    every = table_of(system, parameter, limits, done, wanted, method)
    number = kept.put(question, system, every, _hues(known, every))
    emit(*_answer(known, every, number, quantity, 1.0))


def response_orbit(
    kept: KeptResponses,
    number: int,
    row: int,
    is_event: bool,
    method: Method,
    quantities: Sequence[str],
    turn: Callable[[System], float],
) -> Answer:
    """The orbit of a point of a branch, or of an event, over one whole period. Raises QuestionError
    if there is none.
    """
    system, ds = kept.get(number)
    what, field = ("event", "event") if is_event else ("point", "point")
    if row >= ds.sizes[what]:
        raise QuestionError(f"there is no {what} {row}: {ds.sizes[what]} are known.", field)
    one = ds.isel({what: row})
    name_of = schema.event_name if is_event else schema.point_name
    parameter = ds.attrs["parameter"]
    here = system.with_values(**{parameter: float(one[name_of(parameter)])})
    start = [float(np.ravel(one[name_of(state)].values)[0]) for state in system.states]
    branch = ds.isel(branch=int(one[f"{what}_branch"]))
    nearest = ds.isel(point=int(one["event_point"])) if is_event else one
    kind, periods = str(branch["branch_kind"].item()), int(branch["branch_periods"])
    seconds = float(nearest["point_period"])
    rests = kind == "equilibrium"
    numbers = "eigenvalue" if rests else "multiplier"
    both = one[f"{what}_{numbers}_real"].values + 1j * one[f"{what}_{numbers}_imag"].values
    about = {
        "name": schema.kind_text(kind, periods if kind == "periodic" else 0),
        "stable": bool(nearest["point_stable"]),
        "multipliers": pairs(both),
        "eigenvalues": rests,
        "margin": float(nearest["point_margin"]),
        "peak": {system.states[0]: float(one[f"{what}_peak"])},
        "seconds": None if rests else seconds,
    }
    end = seconds if kind == "limit_cycle" else None
    asked = AskedRun(here, start, turn(here), max(periods, 1), end, method)
    head, arrays = orbit(asked, quantities, about)
    event = str(one["event_kind"].item()) if is_event else None
    return {**head, "responses": number, "row": row, "event": event}, arrays


class _Told:
    """Progress that is told now and then."""

    def __init__(
        self, emit: Emit, parameter: str, limits: tuple[float, float], quantity: str
    ) -> None:
        self._emit, self._last = emit, 0.0
        self._about = {"parameter": parameter, "range": list(limits), "quantity": quantity}

    def between(self, begin: float, end: float) -> Callable[[float], None]:
        """What takes the share of a stage."""

        def told(share: float) -> None:
            here = begin + (end - begin) * share
            if here - self._last >= _STEP:
                self._last = here
                self._emit({"kind": "responses-progress", "share": here, **self._about}, {})

        return told


def starts_from(known: Legend, plan: BasinPlan) -> np.ndarray:
    """Starts in the box of a map, and a point of each known attractor, float64[k, D]."""
    return np.concatenate([plan.drawn(STARTS), *(one.points[:1] for one in known.found.every)])


def _answer(known: Legend, ds: xr.Dataset, number: int, quantity: str, share: float) -> Answer:
    """Branches as the page draws them."""
    parameter = str(ds.attrs["parameter"])
    limits = [float(ds.attrs[f"parameter_{end}"]) for end in ("low", "high")]
    branch = ds["point_branch"].values
    periods = ds["branch_periods"].values
    hue = _hues(known, ds)
    head = {
        "kind": "responses",
        "key": number,
        "parameter": parameter,
        "range": limits,
        "quantity": quantity,
        "values": dict(known.map.system.values),
        "share": share,
        "done": share == 1.0,
        "events": ds["event_kind"].values.tolist(),
        "event_guards": ds["event_guard"].values.tolist(),
        "branches": [
            {"kind": str(kind), "period": int(n), "hue": int(color)}
            for kind, n, color in zip(ds["branch_kind"].values, periods, hue, strict=True)
        ],
        "words": [],
    }
    return head, {
        "point_parameter": ds[schema.point_name(parameter)].values,
        "point_peak": _peaks(ds, quantity, "point"),
        "point_stable": ds["point_stable"].values.astype("u1"),
        "point_branch": branch.astype("u2"),
        "point_period": periods[branch].astype("u1"),
        "point_hue": hue[branch],
        "event_parameter": ds[schema.event_name(parameter)].values,
        "event_peak": _peaks(ds, quantity, "event"),
        "event_branch": ds["event_branch"].values.astype("u2"),
        "event_point": ds["event_point"].values.astype("u4"),
    }


def _peaks(ds: xr.Dataset, quantity: str, what: str) -> np.ndarray:
    """Largest magnitude of a quantity at points or events. Raises QuestionError if it isn't known
    there.
    """
    known = ds["output"].values.tolist()
    if quantity not in known:
        raise QuestionError(unknown("there is no quantity", quantity, known), "quantity")
    peaks = ds["point_output_peak"].values[:, known.index(quantity)]
    if what == "event":
        peaks = peaks[ds["event_point"].values] if len(peaks) else np.zeros(0)
        if quantity == schema.states_of(ds)[0]:
            peaks = ds["event_peak"].values
    return np.asarray(peaks, "f4")


def _hues(known: Legend, ds: xr.Dataset) -> np.ndarray:
    """The hue of each branch: that of the known attractor which lies on it, uint8[branch]."""
    hues = np.full(ds.sizes["branch"], NO_HUE, "u1")
    for branch, points in _crossings(ds, known.map.system):
        for key, one in known.members():
            if orbit_distance(one.points, points, known.scale) < _NEAR:
                hues[branch] = known.hue(key)
    return hues


def _crossings(ds: xr.Dataset, system: System) -> Iterator[tuple[int, np.ndarray]]:
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
