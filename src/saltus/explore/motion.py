"""Motions for the page: samples, contacts and, of a second method, where the two part."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from saltus.analysis.dataset_parts import guards_over
from saltus.analysis.inputs.outputs import outputs_of
from saltus.analysis.motion.motion_arrays import MotionArrays, motion_arrays
from saltus.contact.guards import is_hold
from saltus.explore.frames import Answer
from saltus.flow.methods import Method
from saltus.flow.until import STATUS
from saltus.kernels import status as st
from saltus.language.evaluate import evaluate
from saltus.system import System
from saltus.units import from_si

#: Whole periods at the end whose samples are sent; of longer motions the rest is sent in columns.
KEPT = 250
#: Columns of a long motion: pixels of a wide screen.
COLUMNS = 2000
#: Most contacts that are sent: the last ones.
MOST_CONTACTS = 2000
#: Most contacts that a motion may meet: what meets more never ends, as where it is driven on.
MOST_MET = 200_000
#: Most steps of a motion: so many, and so many more in each period.
LEAST_STEPS, STEPS = 1_000_000, 500
#: Two motions have parted where they differ by this share of the range.
PARTED = 0.01
#: Statuses of a motion that reached its end.
REACHED = (st.OK, st.GRAZE_UNRESOLVED)


def bounded(method: Method, periods: int) -> Method:
    """A method with the budgets of a motion on the page: some seconds at most."""
    own: Any = method
    steps = min(own.max_steps or math.inf, LEAST_STEPS + STEPS * periods)
    within: Method = replace(own, max_events=min(own.max_events, MOST_MET), max_steps=steps)
    return within


@dataclass(frozen=True)
class AskedRun:
    """A motion to run.

    Attributes
    ----------
    system : System
        Equations and values.
    start : sequence of float
        State at the start [SI].
    period : float
        Forcing period, or the time between two looks without forcing [s].
    periods : int or None
        How many of these; None where ``t_end`` says it.
    t_end : float or None
        Time at the end [s].
    method : Method
    samples : int
        In each period.
    measured : bool
        Whether errors of contact times are measured.
    """

    system: System
    start: Sequence[float]
    period: float
    periods: int | None
    t_end: float | None
    method: Method
    samples: int = 200
    measured: bool = True

    def run(self, method: Method | None = None) -> MotionArrays:
        """The motion, on this thread."""
        forced = self.system.forced_at is not None
        length: dict[str, Any] = {"periods": self.periods, "samples": self.samples}
        if self.t_end is not None:
            length = {"t_end": self.t_end, "samples": self.samples}
        if not forced:
            end = self.t_end or (self.periods or 1) * self.period
            count = max(round(end / self.period * self.samples), 2)
            length = {"t_end": end, "samples": count}
        return motion_arrays(
            self.system,
            tuple(self.start),
            method=bounded(method or self.method, self.periods or 1),
            threads=1,
            time_errors="measured" if self.measured else "local",
            **length,
        )


def motion(asked: AskedRun, quantities: Sequence[str], against: Method | None = None) -> Answer:
    """A motion as the page draws it.

    Parameters
    ----------
    asked : AskedRun
        The motion.
    quantities : sequence of str
        States and outputs that are sent.
    against : Method, optional
        Another method whose motion is sent too.

    Returns
    -------
    head : dict
    arrays : dict of str to array
        ``sample:NAME`` float32 [SI], ``mode``; ``contact_time`` float64 [s], ``contact_error`` [s],
        ``contact_guard``, ``contact_direction``, ``contact_kind``, ``contact_velocity`` (rate of
        the gap), ``contact:NAME`` float32. Of motions longer than :data:`KEPT` periods
        ``column_time``, ``least:NAME``, ``most:NAME`` of all of it. With ``against``
        ``other:NAME``, ``other_contact_time``, ``other_contact_guard``.
    """
    system = asked.system
    found = asked.run()
    columns = [_columns(system).index(name) for name in quantities]
    values, time = found.values[0][:, columns], found.time
    first = max(len(time) - KEPT * asked.samples - 1, 0)
    contacts, last = found.contacts, slice(max(len(found.contacts) - MOST_CONTACTS, 0), None)
    step = float(time[1] - time[0]) if len(time) > 1 else 0.0
    status = int(found.outcome.status[0])
    head: dict[str, Any] = {
        "kind": "motion",
        "t0": float(time[first]) if len(time) else 0.0,
        "dt": step,
        "count": len(time) - first,
        "period": asked.period if system.forced_at is not None else None,
        "periods": asked.periods,
        "method": asked.method.name,
        "values": dict(system.values),
        "start": dict(zip(system.states, map(float, asked.start), strict=True)),
        "status": STATUS[status][0],
        "words": _words(found, status),
        "contacts": len(contacts),
        "contacts_from": last.start,
        "gaps": gaps(system),
        "quantities": list(quantities),
    }
    arrays: dict[str, np.ndarray] = {
        **_each("sample", quantities, values[first:]),
        "mode": _bits(found.mode[0][first:], len(system.guards)),
        "contact_time": contacts.time[last],
        "contact_error": found.time_error[last],
        "contact_guard": contacts.guard[last].astype("u1"),
        "contact_direction": contacts.direction[last].astype("i1"),
        "contact_kind": contacts.kind[last].astype("u1"),
        "contact_velocity": contacts.velocity[last].astype("f4"),
        **_each("contact", quantities, found.contact_values[last][:, columns]),
    }
    if first:
        arrays |= _in_columns(time, values, quantities)
    if against is not None:
        other = asked.run(against)
        theirs = other.values[0][first:, columns]
        head["against"] = _parting(found, other, columns, against, system)
        arrays |= _each("other", quantities, theirs)
        arrays |= {
            "other_contact_time": other.contacts.time,
            "other_contact_guard": other.contacts.guard.astype("u1"),
        }
    return head, arrays


def gaps(system: System) -> list[dict[str, Any]]:
    """Boundaries that are a value of one state or sensor, at the values of the system: their
    guard's name, the state or sensor and the value [SI].
    """
    about = guards_over(system, system.values, ())
    rows = [*zip(about.names, about.states, np.ravel(about.boundaries), strict=True)]
    return [
        {"guard": name, "quantity": quantity, "value": float(value)}
        for name, quantity, value in [*rows, *_on_sensors(system)]
        if quantity and np.isfinite(value)
    ]


@functools.lru_cache(maxsize=16)
def _on_sensors(system: System) -> tuple[tuple[str, str, float], ...]:
    """Boundaries that are a value of one sensor: their guard's name, the sensor and the value. Both
    are seen at random states to change alike.
    """
    sensors, count, found = system.outputs.names, len(system.states), []
    if not sensors or all(guard.state for guard in system.guards):
        return ()
    states = np.random.default_rng(0).normal(size=(count + 3, count))
    seen = outputs_of(system).values(0.0, states, system.values, np.zeros(len(states), int))
    named = dict(zip(system.states, states.T, strict=True))
    shown = seen[:, count:] - seen[0, count:]
    for guard in system.guards:
        if guard.state or is_hold(guard):
            continue
        (gap,) = evaluate(
            [guard.gap], states=named, values=system.values, bits=[False] * len(system.guards)
        )
        change = np.broadcast_to(gap, len(states)) - np.ravel(gap)[0]
        with np.errstate(all="ignore"):
            slopes = change[-1] / shown[-1]
            alike = np.abs(change[:, None] - slopes * shown).max(axis=0) < 1e-9 * np.ptp(change)
        for i in np.flatnonzero(alike).tolist():
            place = seen[0, count + i] - np.ravel(gap)[0] / slopes[i]
            found.append((guard.name, sensors[i], float(f"{place:.12g}")))
    return tuple(found)


def _columns(system: System) -> tuple[str, ...]:
    return (*system.states, *system.outputs.names)


def _each(what: str, names: Sequence[str], values: np.ndarray) -> dict[str, np.ndarray]:
    """Columns of float64[n, k] under their names."""
    with np.errstate(over="ignore"):  # what has left the picture may be infinite
        columns = values.T.astype("f4")
    return {f"{what}:{name}": column for name, column in zip(names, columns, strict=True)}


def _bits(mode: np.ndarray, guards: int) -> np.ndarray:
    """Modes in the smallest type that holds a bit for each guard, 0 where nothing is known."""
    known: np.ndarray = np.maximum(mode, 0)
    return known.astype("u1" if guards <= 8 else "u2" if guards <= 16 else "u4")


def _in_columns(time: np.ndarray, values: np.ndarray, names: Sequence[str]) -> dict[str, Any]:
    """The whole of a long motion: the least and the most of each column of pixels."""
    edges = np.unique(np.linspace(0, len(time), COLUMNS + 1).astype(int))[:-1]
    least, most = (by.reduceat(values, edges, axis=0) for by in (np.minimum, np.maximum))
    return {
        "column_time": time[edges],
        **_each("least", names, least),
        **_each("most", names, most),
    }


def _words(found: MotionArrays, status: int) -> list[str]:
    """Sentences on a motion's end."""
    if status == st.OK:
        return []
    meaning = STATUS[status][1]
    if status in REACHED:
        return [f"It {meaning}."]
    if status in (st.BUDGET_STEPS, st.BUDGET_EVENTS):
        meaning = "it meets too many contacts, or takes too many steps, to be followed further here"
    return [f"It ended at {from_si(float(found.outcome.time[0]), 's')}: {meaning}."]


def _parting(
    ours: MotionArrays, theirs: MotionArrays, columns: Sequence[int], method: Method, system: System
) -> Mapping[str, Any]:
    """The parting of two motions, in numbers and words: when they differ by :data:`PARTED` of the
    range, and the contact before that.
    """
    count = min(len(ours.time), len(theirs.time))
    mine, other = (one.values[0][:count, columns] for one in (ours, theirs))
    spread = np.nanmax(mine, axis=0) - np.nanmin(mine, axis=0)
    apart = np.abs(mine - other) > PARTED * np.where(spread > 0, spread, np.inf)
    rows = np.flatnonzero(apart.any(axis=1))
    if not len(rows):
        words = f"They agree to {PARTED:.0%} of the range all the way."
        return {"method": method.name, "parts": None, "contact": None, "words": words}
    time = float(ours.time[rows[0]])
    words = f"They part by {PARTED:.0%} of the range after {from_si(time, 's', 3)}"
    number = int(np.searchsorted(ours.contacts.time, time)) - 1
    if number < 0:
        return {"method": method.name, "parts": time, "contact": None, "words": f"{words}."}
    guard = system.guards[int(ours.contacts.guard[number])].name
    words += f", at contact {number + 1} ({guard})"
    if number < len(theirs.contacts):
        late = float(theirs.contacts.time[number] - ours.contacts.time[number])
        when = "late" if late > 0 else "early"
        words += f", which {method.name} meets {from_si(abs(late), 's', 2)} {when}"
    return {"method": method.name, "parts": time, "contact": number, "words": f"{words}."}
