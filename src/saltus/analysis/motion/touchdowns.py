"""Contacts from beginning to end: the entries and exits of a table of contacts, paired."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from saltus.analysis.motion.window import Stretch
from saltus.flow.contact_table import ContactTable
from saltus.flow.request import Outcome
from saltus.kernels import status as st
from saltus.language.evaluate import evaluate
from saltus.system import System
from saltus.system.quantity import rate_of


@dataclass(frozen=True)
class Touchdowns:
    """Contacts that begin in a stretch of motion, one a row, by trajectory and time; and the times
    in contact of each guard.

    Attributes
    ----------
    trajectory, guard : int64[k]
        Which one.
    begin, end : float64[k]
        Times [s]; the end is NaN where the stretch ends first.
    speed, exit_speed : float64[k]
        Magnitude of the gap's rate at both [unit of the gap per second].
    impulse : float64[k] or None
        Integral of the force from begin to end [N*s], impacts and rest included; NaN for a guard
        without a force.
    struck : float64[k]
        That of the impacts alone; NaN for other contacts.
    impacts : int64[k]
        Impacts that were met one by one: none for a contact with a force.
    spells : mapping of (trajectory, guard) to float64[m, 2]
        Begin and end of all times in contact, cut at the ends of the stretch [s].
    first, final : int64[k]
        Rows of the table of contacts at which each begins and ends; -1 if it doesn't end.
    """

    trajectory: np.ndarray
    guard: np.ndarray
    begin: np.ndarray
    end: np.ndarray
    speed: np.ndarray
    exit_speed: np.ndarray
    impulse: np.ndarray | None
    struck: np.ndarray
    impacts: np.ndarray
    spells: Mapping[tuple[int, int], np.ndarray]
    first: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    final: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))

    def covered(self, trajectory: int, guard: int, borders: np.ndarray) -> np.ndarray:
        """Time in contact in each of the blocks between borders float64[b + 1] [s]."""
        spells = self.spells[trajectory, guard]
        behind = [
            np.clip(border - spells[:, 0], 0.0, spells[:, 1] - spells[:, 0]).sum()
            for border in borders
        ]
        return np.diff(behind)


def find(
    seen: Stretch, outcome: Outcome, sides: np.ndarray, integrals: Mapping[int, int]
) -> Touchdowns:
    """Pair the entries and exits of every trajectory and guard.

    Impacts that come to rest are one contact, from the first one to the end of the rest.

    Parameters
    ----------
    seen : Stretch
        Its first sample is the beginning.
    outcome : Outcome
        With contacts.
    sides : int8[guard]
        Sign of each gap in contact.
    integrals : mapping of int to int
        For guards with a force: the state that holds its integral.
    """
    contacts = outcome.contacts
    time, who, guard = contacts.time, contacts.trajectory, contacts.guard
    struck = contacts.kind == st.IMPACT
    usable = (contacts.changes_side | struck) & (time > seen.begin[who])
    ends = contacts.begins(seen.group.size)
    parts, spells = [], {}
    for i in range(seen.group.size):
        mine = ends[i] + np.flatnonzero(usable[ends[i] : ends[i + 1]])
        for g, side in enumerate(sides):
            rows = mine[guard[mine] == g]
            enters = contacts.direction[rows] == side
            sudden = struck[rows]
            parts.append(_strikes(contacts, rows[sudden], hold_of(seen.system, g)))
            rows, enters = rows[~sudden], enters[~sudden]
            parts.append(_pairs(rows, enters))
            end = min(float(seen.begin[i] + seen.duration[i]), float(outcome.time[i]))
            touching = _touching_first(outcome, i, g, int(side), enters)
            spells[i, g] = _spells(time[rows], enters, touching, float(seen.begin[i]), end)
    pairs = np.concatenate(parts) if parts else np.zeros((0, 4), np.int64)
    pairs = pairs[np.lexsort((guard[pairs[:, 0]], time[pairs[:, 0]], who[pairs[:, 0]]))]
    first, final, impacts, last = pairs.T
    ended = final >= 0
    speed = np.abs(contacts.velocity)
    after, momentum = _rebounds(seen, contacts)
    after = np.where(struck, after, np.where(contacts.kind == st.RELEASE, 0.0, speed))
    summed = _summed_up(contacts, momentum, speed, after)
    held = np.where(contacts.kind[first] == st.HOLD, summed[first], 0.0)
    impulse = _impulses(seen, outcome, first, final, integrals)
    return Touchdowns(
        trajectory=who[first],
        guard=guard[first],
        begin=time[first],
        end=np.where(ended, time[final], np.nan),
        speed=speed[first],
        exit_speed=np.where(ended, after[final], np.nan),
        impulse=impulse + held if integrals else None,
        struck=_impulses(seen, outcome, first, last, integrals) + summed[last],
        impacts=impacts,
        spells=spells,
        first=first,
        final=final,
    )


def _rebounds(seen: Stretch, contacts: ContactTable) -> tuple[np.ndarray, np.ndarray]:
    """Rate of the gap after an impact, and the momentum of the rebound, float64[c]; zero for other
    contacts. The gap may be scaled: 2*x < 1 is x < 0.5.
    """
    system = seen.system
    speed, momentum = np.zeros(len(contacts)), np.zeros(len(contacts))
    values = dict(zip(system.values, seen.group.parameters.T, strict=True))
    if len(seen.group.parameters) > 1:
        values = {name: column[contacts.trajectory] for name, column in values.items()}
    states = dict(zip(system.states, contacts.state.T, strict=False))
    bits = [(contacts.mode_after >> i) & 1 == 1 for i in range(len(system.guards))]
    for g, guard in enumerate(system.guards):
        if guard.law and guard.law.mass is not None and guard.law.constraint is not None:
            wanted = [rate_of(system, guard.gap), guard.law.constraint, guard.law.mass]
            found = evaluate(wanted, t=contacts.time, states=states, values=values, bits=bits)
            speed = np.where(contacts.guard == g, np.abs(found[0]), speed)
            momentum = np.where(contacts.guard == g, found[2] * np.abs(found[1]), momentum)
    return speed, momentum


def _summed_up(
    contacts: ContactTable, momentum: np.ndarray, speed: np.ndarray, after: np.ndarray
) -> np.ndarray:
    """Impulses that are summed up where a chatter isn't followed to its end, float64[c]. In the row
    of its last impact: that of the missing impacts, ``m v (1 + e)/(1 - e)`` from a rebound v. In
    the row after it, where the rest begins: minus the integral of the force at rest for that time,
    ``2 m v/(1 - e)``.
    """
    result = np.zeros(len(contacts))
    last = np.flatnonzero(contacts.chatters[:-1] & (contacts.kind[1:] == st.HOLD))
    last = last[after[last] > 0]
    lost = 1.0 - after[last] / speed[last]
    result[last] = momentum[last] * (2.0 - lost) / lost
    result[last + 1] = -2.0 * momentum[last] / lost
    return result


def _pairs(rows: np.ndarray, enters: np.ndarray) -> np.ndarray:
    """Rows of each entry and of the exit after it (-1: none), with zero impacts, int64[k, 4]."""
    at = np.flatnonzero(enters)
    following = np.append(rows, -1)
    return np.stack([rows[at], following[at + 1], 0 * at, 0 * at - 1], axis=1)


def hold_of(system: System, guard: int) -> int:
    """The hold guard of a stop; -1 for any other guard."""
    law = system.guards[guard].law
    return law.partner if law is not None and law.kind == "impact" else -1


def _strikes(contacts: ContactTable, rows: np.ndarray, hold: int) -> np.ndarray:
    """Rows of the first impact of each contact of a stop and of its end (-1: none), the number of
    impacts, and the row of the last one, int64[k, 4].

    An impact is over as it begins. Those that come to rest are one contact, as far back as each
    flight is shorter than the one before it; it ends with the rest.
    """
    result: list[tuple[int, int, int, int]] = []
    rests = contacts.chatters[rows]
    begin = 0
    while begin < len(rows):
        run = begin
        while rests[run] and run + 1 < len(rows) and rows[run + 1] == rows[run] + 1:
            run += 1
        if not rests[begin]:
            result.append(_single(rows[begin]))
            begin += 1
            continue
        flights = np.diff(contacts.time[rows[begin : run + 1]])
        longer = np.flatnonzero(flights[1:] >= flights[:-1])
        first = begin + (int(longer[-1]) + 1 if len(longer) else 0)
        result += map(_single, rows[begin:first])
        end = _released(contacts, int(rows[run]), hold)
        result.append((int(rows[first]), end, run + 1 - first, int(rows[run])))
        begin = run + 1
    return np.array(result, np.int64).reshape(-1, 4)


def _single(row: int) -> tuple[int, int, int, int]:
    return int(row), int(row), 1, int(row)


def _released(contacts: ContactTable, row: int, hold: int) -> int:
    """The row in which the rest after the last impact of a chatter ends, -1 if it doesn't."""
    later = np.flatnonzero(
        (contacts.trajectory[row:] == contacts.trajectory[row])
        & (contacts.guard[row:] == hold)
        & (contacts.kind[row:] == st.RELEASE)
    )
    return row + int(later[0]) if len(later) else -1


def _touching_first(outcome: Outcome, i: int, g: int, side: int, enters: np.ndarray) -> bool:
    """True if a guard is in contact when the stretch begins: the first event shows it, else the
    mode, which then never changes.
    """
    if len(enters):
        return not enters[0]
    positive = (int(outcome.sample_mode[i, 0]) >> g) & 1 == 1
    return positive == (side > 0)


def _spells(
    time: np.ndarray, enters: np.ndarray, touching: bool, begin: float, end: float
) -> np.ndarray:
    """Begin and end of all times in contact, float64[m, 2]."""
    starts, ends = time[enters], time[~enters]
    if touching:
        starts = np.append(begin, starts)
    if len(starts) > len(ends):
        ends = np.append(ends, max(end, begin))
    return np.stack([starts, ends], axis=1)


def _impulses(
    seen: Stretch,
    outcome: Outcome,
    first: np.ndarray,
    final: np.ndarray,
    integrals: Mapping[int, int],
) -> np.ndarray:
    """Difference of the integral of the force between the two ends of each contact; of a stop, from
    before its first impact.
    """
    contacts, impulse = outcome.contacts, np.full(len(first), np.nan)
    for g, number in integrals.items():
        rows = (contacts.guard[first] == g) & (final >= 0)
        column, ahead = contacts.state[:, number], first[rows]
        begins = column[ahead]
        if hold_of(seen.system, g) >= 0:
            who = contacts.trajectory[ahead]
            earlier = (ahead > 0) & (contacts.trajectory[ahead - 1] == who)
            begins = np.where(earlier, column[ahead - 1], outcome.samples[who, 0, number])
        impulse[rows] = column[final[rows]] - begins
    return impulse
