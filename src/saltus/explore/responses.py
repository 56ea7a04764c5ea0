"""Responses for the page: branches over a parameter, the orbits on them, and their hues."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import xarray as xr

from saltus.analysis.basins.pipeline import BasinPlan
from saltus.analysis.branches.branch import Branch
from saltus.analysis.branches.branch_table import table_of
from saltus.analysis.branches.branches import follow_all, seeds_between
from saltus.analysis.branches.plans import LONGEST_DOUBLED, POINTS, SWITCHES, plan_of
from saltus.analysis.inputs.outputs import outputs_of
from saltus.errors import unknown
from saltus.explore.attractors import Legend, dataset_of, pairs
from saltus.explore.frames import Answer, Emit
from saltus.explore.kept_responses import NO_HUE, KeptResponses, crossings, stretches
from saltus.explore.motion import AskedRun
from saltus.explore.orbits import orbit
from saltus.explore.questions import QuestionError
from saltus.flow.methods import Method, exact_method
from saltus.results.dataset import schema
from saltus.system import System

#: Starts that are looked through for attractors to begin with; fewer of them, and the attractors,
#: are run at some more values of the parameter.
LOOKED, STARTS, VALUES = 64, 8, 5
#: Share of the work that the branches of the first attractors are.
FIRST = 0.4
#: Share of progress after which it is told anew.
_STEP = 0.02
#: A point of a branch is an attractor's if it is nearer than this share of the box.
_NEAR = 0.05


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
    beside: Callable[[], Sequence[Legend]],
) -> None:
    """Emit the branches of a system over a parameter: those of the attractors that some starts lead
    to at its values first, then all that fewer starts lead to at other values. Each answer replaces
    the one before. Branches don't depend on what was asked before; only their hues do, which are
    those of the attractors that are shown.

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
        every = kept.get(number)[1]
        if (hues := kept.hues(number)) is None:
            kept.colour(number, hues := _hues(beside(), every))
        emit(*_answer(known, every, hues, number, quantity, 1.0))
        return
    told = _Told(emit, parameter, limits, quantity)
    told.begin("looking for orbits to begin with")
    method, done = exact_method(method, system, "responses"), list[Branch]()
    rules = plan_of(
        system, parameter, limits, method, threads, POINTS, LONGEST_DOUBLED, frozenset(SWITCHES)
    )
    wanted = outputs_of(system)
    known.follow()
    found = plan.glanced(LOOKED, threads)
    starts = np.concatenate([plan.drawn(STARTS), *(one.points[:1] for one in found.every)])
    if found:
        ds = dataset_of(known.map, found)
        known.grow(found)
        known.scouts = max(known.scouts, LOOKED)
        seeds = seeds_between(system, parameter, limits, ds, method=method)
        told.begin("following branches")
        follow_all(rules, system, parameter, *seeds, done, told.between(0.0, FIRST))
        first = table_of(system, parameter, limits, done, wanted, method)
        number = kept.put(None, system, first, hues := _hues([known], first, free=False))
        emit(*_answer(known, first, hues, number, quantity, FIRST))
    told.begin("looking for more orbits")
    seeds = seeds_between(
        system,
        parameter,
        limits,
        starts,
        at=VALUES,
        method=method,
        threads=threads,
    )
    told.begin("following branches")
    follow_all(rules, system, parameter, *seeds, done, told.between(FIRST, 1.0))
    if not done:
        raise QuestionError(f"nothing that repeats is known for this range of {parameter}.")
    every = table_of(system, parameter, limits, done, wanted, method)
    number = kept.put(question, system, every, hues := _hues(beside(), every))
    emit(*_answer(known, every, hues, number, quantity, 1.0))


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
    """Progress that is told now and then, and what is done."""

    def __init__(
        self, emit: Emit, parameter: str, limits: tuple[float, float], quantity: str
    ) -> None:
        self._emit, self._last, self._doing = emit, 0.0, ""
        self._about = {"parameter": parameter, "range": list(limits), "quantity": quantity}

    def begin(self, doing: str) -> None:
        """Tell what is done from now on."""
        self._doing = doing
        self._say()

    def _say(self) -> None:
        about = {"share": self._last, "doing": self._doing, **self._about}
        self._emit({"kind": "responses-progress", **about}, {})

    def between(self, begin: float, end: float) -> Callable[[float], None]:
        """A function that takes the share of a stage."""

        def told(share: float) -> None:
            here = begin + (end - begin) * share
            if here - self._last >= _STEP:
                self._last = here
                self._say()

        return told


def _answer(
    known: Legend, ds: xr.Dataset, hues: np.ndarray, number: int, quantity: str, share: float
) -> Answer:
    """Branches as the page draws them."""
    parameter = str(ds.attrs["parameter"])
    limits = [float(ds.attrs[f"parameter_{end}"]) for end in ("low", "high")]
    branch = ds["point_branch"].values
    periods = ds["branch_periods"].values
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
            {"kind": str(kind), "period": int(n)}
            for kind, n in zip(ds["branch_kind"].values, periods, strict=True)
        ],
        "words": [],
    }
    return head, {
        "point_parameter": ds[schema.point_name(parameter)].values,
        "point_peak": _peaks(ds, quantity, "point"),
        "point_stable": ds["point_stable"].values.astype("u1"),
        "point_branch": branch.astype("u2"),
        "point_period": periods[branch].astype("u1"),
        "point_hue": hues[stretches(ds)],
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


def _hues(legends: Sequence[Legend], ds: xr.Dataset, free: bool = True) -> np.ndarray:
    """The hue of each stretch of the branches, uint8[n]: that of the attractor which lies on it at
    the values of one of the legends, the first that has one. With ``free`` other stretches that
    attract have a hue of their own, the longest first, which attractors take when they are found:
    the first hue that none has at a value that both run through.
    """
    stretch = stretches(ds)
    hues = np.full(int(stretch.max(initial=-1)) + 1, NO_HUE, "u1")
    for known in legends:
        near = [
            (apart, hue, at)
            for at, one in crossings(ds, known.map.system)
            for apart, hue in known.nearest(one)
        ]
        for apart, hue, at in sorted(near):
            if apart < _NEAR and hues[at] == NO_HUE and hue not in hues:
                hues[at] = hue
    if free:
        taken = set(hues.tolist()).union(*(known.hues() for known in legends))
        value = ds[schema.point_name(str(ds.attrs["parameter"]))].values
        stable = ds["point_stable"].values
        mine = {i: value[stretch == i] for i in set(stretch.tolist())}
        ends = {i: (at.min(), at.max()) for i, at in mine.items()}
        for i, (low, high) in sorted(ends.items(), key=lambda one: one[1][0] - one[1][1]):
            if hues[i] == NO_HUE and stable[stretch == i][1:-1].any():  # ends are at folds
                beside = {int(hues[j]) for j, (a, b) in ends.items() if a <= high and b >= low}
                own = (hue for hue in range(NO_HUE) if hue not in taken and hue not in beside)
                hues[i] = next(own, NO_HUE)
    return hues
