"""Derivatives of the places of bifurcations of random systems beside differences of places that are
found anew at other values.
"""

from __future__ import annotations

import json
import warnings
from functools import partial

import numpy as np

import saltus as sl

from .derivative_systems import Case
from .differences import Column, shifts

KINDS = ("fold", "period_doubling", "neimark_sacker", "graze")
#: Events of a system whose derivatives are judged, and half the range in which they are looked for.
EVENTS, RANGE = 2, 0.25


def columns(that: Case, method: sl.Method) -> list[Column] | str:
    """Derivatives of the places of some events over the frequency, or why there are none."""
    system = that.system()
    varied = system.forced_at
    if varied is None:
        return "unforced"
    to = [name for name in that.to if not name.endswith("(0)") and name != varied]
    base = system.values[varied]
    limits = (base * (1.0 - RANGE), base * (1.0 + RANGE))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            found = sl.branches(
                system, {varied: limits}, np.zeros(len(system.states)), at=1, switch=(), points=60,
                periods=300, method=method,
            )  # fmt: skip
        except sl.errors.ParameterError as error:
            if "no periodic orbit" in str(error):
                return "no orbit"
            raise
    which = np.flatnonzero(np.isin(found.event_kind.values, KINDS))
    first = [which[found.event_kind.values[which] == kind][:1] for kind in KINDS]
    chosen = np.concatenate(first)[:EVENTS]
    if not len(chosen) or not to:
        return "no event"
    answer = []
    for one in chosen:
        event = found.isel(event=int(one))
        fly = partial(_place, system, to=to, method=method)
        try:
            _, own = fly(event)
        except sl.errors.ParameterError as error:
            answer.append(Column(str(error), "", *np.empty((3, 0))))
            continue
        for number, name in enumerate(to):
            known = json.loads(event.attrs["parameters"])
            moved, unit = shifts(system.values[name])
            try:
                places = [
                    _place(system, _moved(event, known, name, s, own[number]), to[:1], method)[0]
                    for s in moved
                ]
            except sl.errors.ParameterError:
                answer.append(Column("lost", name, *np.empty((3, 0))))
                continue
            kind = str(event.event_kind.item())
            answer.append(Column.of(kind, name, own[[number]], places, unit))
    return answer


def _moved(event, known, name, shift, slope):
    """An event with another value of a parameter, about where it is then."""
    place = f"event_{event.attrs['parameter']}"
    event = event.assign({place: event[place] + shift * slope})
    return event.assign_attrs(parameters=json.dumps(known | {name: known[name] + shift}))


def _place(system, event, to, method):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = sl.event_sensitivity(system, event, to=to, method=method)
    return float(found.event_value), found.event_derivative.values
