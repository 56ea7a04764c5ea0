"""The view of a page, from the fields of its questions: in SI, with the result of each part."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.basins.compare import compare
from saltus.analysis.basins.pipeline import BasinPlan
from saltus.analysis.inputs.starts import range_of
from saltus.analysis.motion.simulate import simulate
from saltus.explore.kept_responses import crossings
from saltus.explore.map import KeptMap, plan_of_map
from saltus.explore.opening import first_quantity
from saltus.explore.questions import MotionQuestion, QuestionError, ResponsesQuestion, question_of
from saltus.explore.responses import STARTS, VALUES
from saltus.explore.save import PARTS, View, starts_of
from saltus.flow.methods import Method
from saltus.system import System
from saltus.units import to_si


def shown(desk: Any, fields: Mapping[str, Any]) -> tuple[View, dict[str, Callable[[], xr.Dataset]]]:
    """The view of a page.

    Parameters
    ----------
    desk : Desk
        The desk that it asks.
    fields : mapping
        The fields of its questions by their kinds: ``motion``, ``map``, ``agreement``,
        ``responses``.

    Returns
    -------
    View, dict of str to callable
        The view in SI; the result of each part, computed when it is called.

    Raises
    ------
    QuestionError
        If a field is wrong.
    """
    asked: dict[str, Any] = {}
    for part in (part for part in PARTS if part in fields):
        if not isinstance(fields[part], Mapping):
            raise QuestionError(f"view.{part} must hold the fields of a question.", "view")
        asked[part] = question_of(part, {**fields[part], "id": 0})
    first = next(iter(asked.values()), None)
    system = desk.system_at({} if first is None else first.values)
    name = next((one.method for one in asked.values() if getattr(one, "method", None)), None)
    method, found = desk.method_of(name), dict[str, Callable[[], xr.Dataset]]()
    given: dict[str, Any] = {}
    if (motion := asked.get("motion")) is not None:
        start = desk.start_of(system, motion.start)
        given["start"] = dict(zip(system.states, start, strict=True))
        length = given["length"] = _length(desk, system, motion)
        found["motion"] = partial(simulate, system, start, method=method, progress=False, **length)
    if (map_ := asked.get("map")) is not None:
        plan = plan_of_map(map_, system, method)
        given["axes"] = {
            axis: (float(one[0]), float(one[-1]), len(one)) for axis, one in plan.axes.items()
        }
        given |= {"at": dict(plan.fixed), "periods": plan.periods}
        found["map"] = partial(_finished, desk, plan)
        if (other := asked.get("agreement")) is not None:
            given["against"] = desk.method_of(other.against, "against")
            theirs = desk.plan_of_question(other, other.against, "against")
            found["agreement"] = partial(_compared, desk, plan, theirs)
    if (responses := asked.get("responses")) is not None:
        limits = range_of(system, responses.parameter, responses.range)
        given["vary"] = responses.parameter, *limits
        plan = desk.plan_of(system, method)
        on = _on_branches(desk, system, method, responses, limits)
        starts = np.unique(np.concatenate([plan.drawn(STARTS), *on]), axis=0)
        given |= {"starts": starts_of(system.states, starts), "values_tried": VALUES}
        found["responses"] = partial(_answered, desk, system, method, responses, limits)
    return View(desk.opening, system, method, **given), found


def _length(desk: Any, system: System, question: MotionQuestion) -> dict[str, Any]:
    """The length of a motion as sl.simulate takes it."""
    if question.t_end is not None:
        return {"t_end": to_si(question.t_end, "s", "t_end")}
    if system.forced_at is None:
        return {"t_end": question.periods * desk.opening.turn}
    return {"periods": question.periods}


def _finished(desk: Any, plan: BasinPlan) -> xr.Dataset:
    kept: KeptMap | None = desk.maps.get(plan)
    if kept is None or kept.dataset is None:
        raise QuestionError("the map isn't finished: let it come to its end first.", "parts")
    return kept.dataset


def _compared(desk: Any, plan: BasinPlan, theirs: BasinPlan) -> xr.Dataset:
    return compare(_finished(desk, plan), _finished(desk, theirs))


def _known(
    desk: Any, system: System, method: Method, question: ResponsesQuestion, limits: Any
) -> xr.Dataset | None:
    """The responses of a view; None if they aren't finished."""
    about = (tuple(system.values.values()), method, question.parameter, limits)
    number = desk.responses.number((*about, question.quantity or first_quantity(system)))
    return None if number is None else desk.responses.get(number)[1]


def _answered(*view: Any) -> xr.Dataset:
    ds = _known(*view)
    if ds is None:
        raise QuestionError("the responses aren't finished: wait for their end.", "parts")
    return ds


def _on_branches(
    desk: Any, system: System, method: Method, question: ResponsesQuestion, limits: Any
) -> list[np.ndarray]:
    """A point of each branch that attracts at the values of the view, or at one from which a saved
    study begins, float64[1, D]: it comes to the branches that are shown, whatever the box leads to.
    """
    ds = _known(desk, system, method, question, limits)
    if ds is None:
        return []
    low, high = limits
    values = np.linspace(low, high, VALUES + 2)[1:-1].tolist()
    here = [system, *(system.with_values(**{question.parameter: one}) for one in values)]
    return [one.points[:1] for each in here for _, one in crossings(ds, each)]
