"""Results made by hand, as the analyses make them: what the tests of files, pictures and tables
share.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from saltus.analysis.attractors.attractors import attractors_dataset
from saltus.results import Guards, Subject, build
from saltus.results.dataset import schema
from saltus.results.dataset.attractors import AttractorTable, basin_meanings, padded
from saltus.results.dataset.responses import SAMPLES, grid_values, response_values


class Contacts(NamedTuple):
    """The table of contacts, one row each; ``guard`` is a number, ``states`` have shape (contact,
    state).
    """

    trajectory: Any
    time: Any
    time_error: Any
    guard: Any
    direction: Any
    velocity: Any
    kind: Any
    states: Any
    mode_before: Any
    mode_after: Any
    steps: Any


class Starts(NamedTuple):
    states: Mapping[str, Any] = {}
    directions: Sequence[str] = ()


class Responses(NamedTuple):
    """m responses, the index of their values on each axis (m, A), their branches, and the samples
    of a diagram.
    """

    attractors: AttractorTable
    place: Any
    branch: Any
    samples: Any = None


class Events(NamedTuple):
    values: Mapping[str, Any]
    kind: Sequence[str]
    branch: Any


def trajectory(
    *, states, units, time, values, mode, contacts, guards, status, counters, minima, end_time, end,
    period=None, forcing_period=None,
    varied=None, attrs=None, batch=False,
):  # fmt: skip
    """What ``simulate`` returns."""
    own = np.ndim(time) == 2
    names = np.asarray(list(guards.names) or [""])
    table = {
        f"contact_{name}": column
        for name, column in contacts._asdict().items()
        if name not in ("trajectory", "guard", "states")
    }
    first = {name: table.pop(name) for name in ("contact_time", "contact_time_error")}
    table = {
        **first,
        "contact_guard": names[np.asarray(contacts.guard, int)],
        **table,
        "contact_trajectory": contacts.trajectory,
    }
    at = np.reshape(contacts.states, (len(contacts.time), len(states)))
    subject = Subject(states, units, attrs or {}, guards, "", varied or {}, forcing_period, batch)
    given = {
        "trajectory": np.arange(len(status)),
        **({} if period is None else {"period": period}),
        "time": time,
        "<state>": values,
    }
    given |= {
        "mode": mode,
        **table,
        "contact_<state>": at,
        "status": status,
        **counters,
        **minima,
        "end_time": end_time,
    }
    return build(
        schema.TRAJECTORY,
        subject,
        given | {"end_<state>": end},
        along={"time": "period"} if own else {},
    )


def stroboscope(*, states, units, period, values, status, guards, forcing_period=None, attrs=None):
    """What ``stroboscope`` returns."""
    subject = Subject(states, units, attrs or {}, guards, forcing_period=forcing_period)
    given = {
        "trajectory": np.arange(len(status)),
        "period": period,
        "<state>": values,
        "status": status,
    }
    return build(schema.STROBOSCOPE, subject, given)


def motion(
    kind, *, states, units, guards, status, each, table, end, along=None, words=None,
    forcing_period=None, attrs=None, batch=False
):  # fmt: skip
    """What ``poincare``, ``impact_statistics`` or ``energy_balance`` returns."""
    subject = Subject(
        states, units, attrs or {}, guards, forcing_period=forcing_period, batch=batch
    )
    own = (
        {"<state>": {name: table[name] for name in states if name in table}}
        if set(states) & set(table)
        else {}
    )
    own |= {name: column for name, column in table.items() if name not in states}
    given = {
        "trajectory": np.arange(len(status)),
        **own,
        "status": status,
        **each,
        "end_<state>": end,
    }
    return build(kind, subject, given, along={"period": along} if along else {}, words=words)


def spectrum(
    *, states, units, frequency, order, amplitude, phase, each, forcing_period, attrs, batch
):
    """What ``spectrum`` returns."""
    subject = Subject(states, units, attrs, forcing_period=forcing_period, batch=batch)
    given = {"trajectory": np.arange(len(each["status"])), "frequency": frequency, "order": order}
    given |= {"<state>_amplitude": amplitude, "<state>_phase": phase, **each}
    return build(
        schema.SPECTRUM,
        subject,
        given,
        along={"frequency": "order"} if np.ndim(frequency) == 2 else {},
    )


def basins(
    *,
    states,
    units,
    axes,
    basin,
    periods_to_settle,
    status,
    status_meanings,
    grazes_unresolved,
    attractors,
    gap_unit="",
    attrs=None,
):
    """What ``basins`` returns."""
    given = {
        "<state>": axes,
        "basin": basin,
        "periods_to_settle": periods_to_settle,
        "status": status,
    }
    given |= {"grazes_unresolved": grazes_unresolved, **attractors.values(len(states))}
    flags = {"basin": basin_meanings(len(attractors)), "status": status_meanings}
    subject = Subject(states, units, attrs or {}, gap_unit=gap_unit)
    return build(
        schema.BASINS,
        subject,
        given,
        grid=tuple(axes),
        flags=flags,
        words={"<when>": attractors.points_when},
    )


def attractors(
    *, states, units, attractors, basin=None, periods_to_settle=None, gap_unit="", attrs=None
):
    """What ``attractors`` and ``basin_fractions`` return."""
    starts = (
        {
            "trajectory": np.arange(len(basin)),
            "basin": basin,
            "periods_to_settle": periods_to_settle,
        }
        if basin is not None
        else {}
    )
    return attractors_dataset(
        Subject(states, units, attrs or {}, gap_unit=gap_unit), attractors, starts
    )


def agreement(*, states, units, axes, agreement, basin_a, basin_b, match, attrs=None):
    """What ``compare`` returns."""
    pairs = len(match["a"])
    given = {
        "<state>": axes,
        "pair": np.arange(pairs),
        "agreement": agreement,
        "basin_a": basin_a,
        "basin_b": basin_b,
    }
    given |= {f"match_{name}": column for name, column in match.items()}
    flags = dict.fromkeys(("basin_a", "basin_b"), basin_meanings(pairs))
    return build(
        schema.AGREEMENT, Subject(states, units, attrs or {}), given, grid=tuple(axes), flags=flags
    )


def responses(
    *, states, units, axes, starts, response_of, responses, events=None, guards=None, sample="",
    gap_unit="", attrs=None
):  # fmt: skip
    """What ``frequency_response`` and ``bifurcation_diagram`` return."""
    table, place = (
        responses.attractors,
        np.reshape(np.asarray(responses.place, int), (-1, len(axes))),
    )
    at = {
        name: np.asarray(values)[index]
        for (name, values), index in zip(axes.items(), place.T, strict=True)
    }
    events = events or Events({name: np.zeros(0) for name in axes}, [], np.zeros(0))
    given: dict[str, Any] = {"<parameter>": axes, "start": np.arange(np.shape(response_of)[-1])}
    given |= {"start_direction": list(starts.directions)} if starts.directions else {}
    given |= {"start_<state>": starts.states, **grid_values(np.asarray(response_of), table)}
    given |= response_values(table, responses.branch, at, len(states))
    given |= (
        {"sample_<state>": padded(responses.samples, len(states))}
        if responses.samples is not None
        else {}
    )
    if len(table):
        given |= {
            "event": np.arange(len(events.kind)),
            "event_kind": list(events.kind),
            "event_branch": events.branch,
        }
        given |= {"event_<parameter>": events.values}
    subject = Subject(
        states, units, {**(attrs or {}), **({"sample": sample} if sample else {})}, guards, gap_unit
    )
    words = {"<when>": table.points_when, "<sampled>": SAMPLES.get(sample, "")}
    return build(schema.RESPONSES, subject, given, grid=tuple(axes), words=words)


def exponents(*, columns, rate, states=(), units=None, gap_unit="", varied=None, attrs=None):
    """What ``lyapunov`` and ``wolf`` return."""
    subject = Subject(states, units or {}, attrs or {}, gap_unit=gap_unit, varied=varied or {})
    return build(
        schema.EXPONENTS,
        subject,
        {"trajectory": np.arange(len(columns["kind"])), **columns},
        words={"<rate>": rate},
    )


__all__ = ["AttractorTable", "Contacts", "Events", "Guards", "Responses", "Starts"]
