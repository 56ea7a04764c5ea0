"""Contacts from beginning to end: the entries and exits of a table of contacts, paired."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from saltus.analysis.motion.window import Stretch
from saltus.flow.contact_table import ContactTable
from saltus.flow.engine import Outcome
from saltus.kernels import status as st
from saltus.system.evaluate import evaluate


@dataclass(frozen=True)
class Touchdowns:
    """Contacts that begin in a stretch of motion, one a row, by trajectory and time; and when each
    guard is in contact.

    Attributes
    ----------
    trajectory, guard : int64[k]
        Which one.
    begin, end : float64[k]
        Times [s]; the end is NaN where the stretch ends first.
    speed, exit_speed : float64[k]
        Magnitude of the gap's rate at both [unit of the gap per second].
    impulse : float64[k] or None
        Integral of the force from begin to end [N*s]; NaN for a guard without a force.
    spells : mapping of (trajectory, guard) to float64[m, 2]
        Begin and end of all times in contact, cut at the ends of the stretch [s].
    """

    trajectory: np.ndarray
    guard: np.ndarray
    begin: np.ndarray
    end: np.ndarray
    speed: np.ndarray
    exit_speed: np.ndarray
    impulse: np.ndarray | None
    spells: Mapping[tuple[int, int], np.ndarray]

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
            parts.append(rows[sudden, None].repeat(2, axis=1))  # over as it begins
            rows, enters = rows[~sudden], enters[~sudden]
            parts.append(_pairs(rows, enters))
            end = min(float(seen.begin[i] + seen.duration[i]), float(outcome.time[i]))
            touching = _touching_first(outcome, i, g, int(side), enters)
            spells[i, g] = _spells(time[rows], enters, touching, float(seen.begin[i]), end)
    pairs = np.concatenate(parts) if parts else np.zeros((0, 2), np.int64)
    pairs = pairs[np.lexsort((guard[pairs[:, 0]], time[pairs[:, 0]], who[pairs[:, 0]]))]
    first, final = pairs.T
    ended = final >= 0
    speed = np.abs(contacts.velocity)
    after = np.where(struck, _rebounds(seen, contacts), speed)
    return Touchdowns(
        trajectory=who[first],
        guard=guard[first],
        begin=time[first],
        end=np.where(ended, time[final], np.nan),
        speed=speed[first],
        exit_speed=np.where(ended, after[final], np.nan),
        impulse=_impulses(contacts.state, guard, first, final, integrals) if integrals else None,
        spells=spells,
    )


def _rebounds(seen: Stretch, contacts: ContactTable) -> np.ndarray:
    """Speed at which an impact's guard is left, float64[c]; zero for other contacts."""
    system, speed = seen.system, np.zeros(len(contacts))
    values = dict(zip(system.values, seen.group.parameters.T, strict=True))
    if len(seen.group.parameters) > 1:
        values = {name: column[contacts.trajectory] for name, column in values.items()}
    states = dict(zip(system.states, contacts.state.T, strict=False))
    bits = [(contacts.mode_after >> i) & 1 == 1 for i in range(len(system.guards))]
    for g, guard in enumerate(system.guards):
        if guard.law and guard.law.kind == "impact" and guard.law.constraint is not None:
            (closing,) = evaluate(
                [guard.law.constraint], t=contacts.time, states=states, values=values, bits=bits
            )
            speed = np.where(contacts.guard == g, np.abs(closing), speed)
    return speed


def _pairs(rows: np.ndarray, enters: np.ndarray) -> np.ndarray:
    """Rows of each entry and of the exit after it (-1: none), int64[k, 2]."""
    at = np.flatnonzero(enters)
    following = np.append(rows, -1)
    return np.stack([rows[at], following[at + 1]], axis=1)


def _touching_first(outcome: Outcome, i: int, g: int, side: int, enters: np.ndarray) -> bool:
    """Whether a guard is in contact when the stretch begins: the first event tells, else the mode,
    which then never changes.
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
    states: np.ndarray,
    guard: np.ndarray,
    first: np.ndarray,
    final: np.ndarray,
    integrals: Mapping[int, int],
) -> np.ndarray:
    """Difference of the integral of the force between the two ends of each contact."""
    impulse = np.full(len(first), np.nan)
    for g, number in integrals.items():
        rows = (guard[first] == g) & (final >= 0)
        column = states[:, number]
        impulse[rows] = column[final[rows]] - column[first[rows]]
    return impulse
