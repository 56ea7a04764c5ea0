"""The desk: what a page may ask of a system, answered with arrays. Knows no sockets."""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.basins.basins import compiled
from saltus.analysis.basins.pipeline import BasinPlan, basin_plan
from saltus.analysis.inputs.starts import ensemble, range_of
from saltus.errors import ParameterError, unknown
from saltus.explore import questions as asked
from saltus.explore.about import about_answer, models_answer
from saltus.explore.attractors import Legend
from saltus.explore.frames import Answer, Emit
from saltus.explore.kept_responses import KeptResponses
from saltus.explore.map import KeptMap, KeptMaps, grow_map, plan_of_map
from saltus.explore.motion import AskedRun, motion
from saltus.explore.opening import Opening, first_quantity
from saltus.explore.orbits import (
    MOST_PERIODS,
    attractor_orbit,
    nowhere,
    orbit_of,
    settle,
    tracked,
)
from saltus.explore.questions import QuestionError, about
from saltus.flow.methods import METHODS, Method
from saltus.system import System
from saltus.system.volume import nothing_attracts
from saltus.units import from_si, to_si

#: Quantities that are sent of each motion unless others are named: states, and outputs.
MOST_STATES, MOST_OUTPUTS = 4, 8
#: Samples of a forcing period unless the page asks for others.
SAMPLES = 200
#: Sets of values whose attractors are kept.
KEPT_VALUES = 64


class Desk:
    """Answers of one system, to any number of pages at once.

    Parameters
    ----------
    opening : Opening
        The system, and what is shown first.
    threads : int, optional
        Threads of a map; default all processors.
    """

    def __init__(self, opening: Opening, threads: int | None = None) -> None:
        self.opening, self.threads = opening, threads
        self._lock = threading.RLock()
        self._plans: OrderedDict[Any, BasinPlan] = OrderedDict()
        self._known: OrderedDict[Any, Legend] = OrderedDict()
        self.maps, self.responses = KeptMaps(), KeptResponses()
        self._answers: Mapping[type, Callable[[Any], Answer]] = {
            asked.About: self._about,
            asked.Open: self._about,
            asked.MotionQuestion: self._motion,
            asked.Settle: self._settle,
            asked.OrbitQuestion: self._orbit,
            asked.Track: self._track,
            asked.Save: self._save,
        }

    def answer(self, question: asked.PageQuestion, emit: Emit) -> None:
        """Answer a question: ``emit(head, arrays)`` for each answer, as it is ready.

        Raises
        ------
        QuestionError
            If it can't be answered; with the field that is wrong.
        Interrupted
            If the work is asked to stop (:class:`saltus.interrupt.Stop`).
        """
        if isinstance(question, asked.AgreementQuestion):
            self._agree(question, emit)
            return
        if isinstance(question, asked.MapQuestion):
            self._map(question, emit)
            return
        if isinstance(question, asked.ResponsesQuestion):
            self._respond(question, emit)
            return
        answer = self._answers.get(type(question))
        if answer is None:
            raise QuestionError(f"{question.ask} isn't answered here.", "ask")
        emit(*answer(question))

    def warm(self) -> None:
        """Compile what the first map needs, before anybody asks for it."""
        compiled(self.plan_of(self.opening.system, self.opening.method))

    # -- what questions share ----------------------------------------------------------------------
    def system_at(self, values: Mapping[str, asked.Number]) -> System:
        """The system at the values of a question."""
        for name, value in values.items():
            with about(f"values.{name}"):
                self.opening.system.resolve(name, value)
        with about("values"):
            return self.opening.system.with_values(**values) if values else self.opening.system

    def method_of(self, name: str | None, field: str = "method") -> Method:
        """The method of a name; that of the desk for None."""
        mine = self.opening.method
        if name is None or name == mine.name:
            return mine
        if name not in METHODS:
            raise QuestionError(unknown("there is no method", name, METHODS), field)
        return named_method(name, self.opening)

    def start_of(self, system: System, start: asked.Start) -> tuple[float, ...]:
        """The state of a start [SI]."""
        with about("start"):
            return tuple(ensemble(system, start, None).start[0].tolist())

    def quantities_of(self, names: tuple[str, ...] | None) -> tuple[str, ...]:
        """Names of states and outputs, checked; by default the first of them."""
        system = self.opening.system
        if names is None:
            few = 2 if system.outputs.first else MOST_STATES
            axes = [name for name in self.opening.axes if name in system.states]
            states = list(dict.fromkeys([*axes, *system.states]))[:few]
            return (*states, *system.outputs.names[:MOST_OUTPUTS])
        known = (*system.states, *system.outputs.names)
        for name in names:
            if name not in known:
                raise QuestionError(unknown("there is no quantity", name, known), "quantities")
        return names

    # -- answers -----------------------------------------------------------------------------------
    def _about(self, question: asked.PageQuestion) -> Answer:  # noqa: ARG002
        return about_answer(self.opening)

    def _motion(self, question: asked.MotionQuestion) -> Answer:
        begun = time.thread_time()
        system = self.system_at(question.values)
        method = self.method_of(question.method)
        other = None if question.against is None else self.method_of(question.against, "against")
        end = None
        if question.t_end is not None:
            with about("t_end"):
                end = to_si(question.t_end, "s", "t_end")
                most = asked.MOST_PERIODS * self.period_of(system)
                if not 0 < end <= most:
                    raise ParameterError(f"t_end must be a time from 0 to {from_si(most, 's')}.")
        run = AskedRun(
            system,
            self.start_of(system, question.start),
            self.period_of(system),
            question.periods if end is None else None,
            end,
            method,
            question.samples or SAMPLES,
            question.errors == "measured",
        )
        head, arrays = motion(run, self.quantities_of(question.quantities), other)
        return {**head, "ms": 1e3 * (time.thread_time() - begun)}, arrays

    def _map(self, question: asked.MapQuestion, emit: Emit) -> None:
        self.grown(
            self.plan_of_question(question, question.method, "method"), emit, question.coarse
        )

    def plan_of_question(
        self, question: asked.MapQuestion, method: str | None, field: str
    ) -> BasinPlan:
        """The map that a question is about, by a method."""
        system, by = self.system_at(question.values), self.method_of(method, field)
        if why := nothing_attracts(system):
            raise QuestionError(f"{why} A map shows attractors.")
        return plan_of_map(question, system, by)

    def grown(self, plan: BasinPlan, emit: Emit, coarse: bool = False) -> KeptMap:
        """Grow a map, beside those that are known, and return it."""
        return grow_map(plan, self.legend_at(plan), self.maps, emit, coarse, self.threads)

    def _agree(self, question: asked.AgreementQuestion, emit: Emit) -> None:
        from saltus.explore.agreement import agree

        agree(
            self.plan_of_question(question, question.method, "method"),
            self.plan_of_question(question, question.against, "against"),
            self.grown,
            self.maps,
            emit,
        )

    def _settle(self, question: asked.Settle) -> Answer:
        system, method = self.system_at(question.values), self.method_of(question.method)
        start = self.start_of(system, question.start)
        if why := nothing_attracts(system):
            return nowhere(system, why)
        known = self.legend_at(self.plan_of(system, method))
        return settle(known, start, method, self.quantities_of(None))

    def _orbit(self, question: asked.OrbitQuestion) -> Answer:
        system, method = self.system_at(question.values), self.opening.method
        quantities = self.quantities_of(None)
        if question.responses is not None:
            from saltus.explore.responses import response_orbit  # a fifth of a start

            row = question.point if question.event is None else question.event
            if row is None:
                raise QuestionError("orbit of responses needs point or event.", "point")
            return response_orbit(
                self.responses,
                question.responses,
                row,
                question.event is not None,
                method,
                quantities,
                self.period_of,
            )
        known = self.legend_at(self.plan_of(system, method))
        if question.attractor is None or known.row(question.attractor) is None:
            raise QuestionError(
                f"no attractor {question.attractor} is known at these values.", "attractor"
            )
        return attractor_orbit(known, question.attractor, method, quantities)

    def _track(self, question: asked.Track) -> Answer:
        with about("source"):
            source = self.system_at(question.source)
        system, method = self.system_at(question.values), self.opening.method
        known = self.legend_at(self.plan_of(source, method))
        old = None
        if question.key is not None:
            old = known.closed(question.key)
        elif question.point is not None:
            old = orbit_of(known.map, self.start_of(source, list(question.point)), question.period)
        if old is None:
            raise QuestionError("no orbit is known there: it needs key, or point.", "key")
        quantities = self.quantities_of(None)
        return tracked(old, source, system, method, self.period_of, quantities)

    def _respond(self, question: asked.ResponsesQuestion, emit: Emit) -> None:
        from saltus.explore.responses import respond

        system, method = self.system_at(question.values), self.opening.method
        with about("parameter"):
            system.parameter_text(question.parameter)
        with about("range"):
            limits = range_of(system, question.parameter, question.range)
        quantity = self.quantities_of((question.quantity or first_quantity(system),))[0]
        along = [system.with_values(**{question.parameter: one}) for one in limits]
        if all(reasons := [nothing_attracts(one) for one in (system, *along)]):
            raise QuestionError(f"{reasons[0]} Responses are followed from attractors.")
        known = self.legend_at(plan := self.plan_of(system, method))
        respond(
            known, method, question.parameter, limits, quantity, plan,
            self.responses, emit, self.threads, lambda: self._beside(known, question.parameter),
        )  # fmt: skip

    def _save(self, question: asked.Save) -> Answer:
        from saltus.explore.save import saved
        from saltus.explore.shown import shown

        return saved(question, *shown(self, question.view))

    def keep_responses(self, ds: xr.Dataset) -> None:
        """Keep branches that were computed before."""
        parameter, system = str(ds.attrs["parameter"]), self.opening.system
        limits = tuple(float(ds.attrs[f"parameter_{end}"]) for end in ("low", "high"))
        for quantity in ds["output"].values.tolist():
            asked_for = (tuple(system.values.values()), self.opening.method, parameter, limits)
            self.responses.put((*asked_for, quantity), system, ds)

    # -- what is known of values -------------------------------------------------------------------
    def plan_of(self, system: System, method: Method) -> BasinPlan:
        """The map of the opening at some values, of a few cells: its scale, and how often motions
        without forcing are looked at.
        """
        key = (tuple(system.values.values()), method)
        with self._lock:
            plan = self._plans.get(key)
        if plan is None:
            axes = {name: (*ends, 2) for name, ends in self.opening.axes.items()}
            plan = basin_plan(system, axes, self.opening.at, method, MOST_PERIODS, None)
            with self._lock:
                keep(self._plans, key, plan, KEPT_VALUES)
        return plan

    def legend_at(self, plan: BasinPlan) -> Legend:
        """The attractors that are known at the values of a map, as they are found."""
        key = (tuple(plan.system.values.values()), plan.method, plan.every)
        with self._lock:
            if key not in self._known:
                before = next(reversed(self._known.values()), None)
                scale = self.plan_of(plan.system, plan.method).scale
                branches = partial(self.responses.orbits_at, plan.system)
                legend = Legend(plan.map(1), scale, before, branches)
                keep(self._known, key, legend, KEPT_VALUES)
            self._known.move_to_end(key)
            return self._known[key]

    def _beside(self, known: Legend, parameter: str) -> list[Legend]:
        """Attractors at these values, then those at other values of one parameter, the newest
        first.
        """
        mine, method = known.map.system.values, known.map.method
        with self._lock:
            others = [one for one in reversed(self._known.values()) if one is not known]
        return [known] + [
            one
            for one in others
            if one.map.method == method
            and all(
                mine[name] == value
                for name, value in one.map.system.values.items()
                if name != parameter
            )
        ]

    def period_of(self, system: System) -> float:
        """The forcing period at these values; without forcing the turn of the opening [s]."""
        if system.forced_at is None:
            return self.opening.turn
        return float(np.ravel(system.period(system.values))[0])


def keep(kept: OrderedDict[Any, Any], key: Any, value: Any, most: int) -> None:
    """Keep a value; the oldest are dropped."""
    kept[key] = value
    while len(kept) > most:
        kept.popitem(last=False)


class Models:
    """Answers before a system is chosen: the models of saltus."""

    def answer(self, question: asked.PageQuestion, emit: Emit) -> None:
        """The list of models. Raises QuestionError for any other question."""
        if not isinstance(question, asked.About):
            raise QuestionError("choose a model first.", "ask")
        emit(*models_answer())


def named_method(name: str, opening: Opening) -> Method:
    """A method by its name, with the options that show what it is compared for: MATLAB's usual
    tolerances, a fixed step of a hundredth of a period.
    """
    if name == "RK4":
        return METHODS[name](step=opening.turn / 100)  # type: ignore[call-arg]
    if name.startswith("ODE"):
        return METHODS[name](rtol=1e-4, atol=1e-7)  # type: ignore[call-arg]
    return METHODS[name]()
