"""Contact sequences of periodic orbits: which contacts a period has, in which order, read from the
free flow.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from saltus.analysis.branches.shooting import PeriodicOrbits
from saltus.contact.guards import is_hold
from saltus.kernels import status as st

#: A contact that two neighbouring periods both report at the time between them is one, in periods.
ONE = 1e-9


@dataclass(frozen=True)
class SequenceContact:
    """One contact of a sequence.

    Attributes
    ----------
    guard, direction : int
        Number of the guard; +1 or -1, the way it is met.
    kind : int
        A code of `status.CONTACT_KIND`.
    before, after : int
        Sides of all guards, as bits.
    """

    guard: int
    direction: int
    kind: int
    before: int
    after: int


@dataclass(frozen=True)
class ContactSequence:
    """The contacts of an orbit in the order in which they come.

    Attributes
    ----------
    contacts : tuple of Contact
        Grazes aren't among them.
    phase : float64[m]
        When, in forcing periods since the orbit's first point; in periods of an orbit without
        forcing.
    after : float64[m, D]
        States behind them.
    velocity : float64[m]
        Rates of the gaps before them.
    mode : int
        Sides of all guards at the end.
    held : bool
        Whether a contact is held then.
    """

    contacts: tuple[SequenceContact, ...]
    phase: np.ndarray
    after: np.ndarray
    velocity: np.ndarray
    mode: int
    held: bool = False

    @property
    def flies(self) -> bool:
        """True if no contact is held, so that the orbit is made of legs (legs.py)."""
        kinds = {one.kind for one in self.contacts}
        return not self.held and kinds <= {st.CROSSING, st.IMPACT}


def sequences(orbits: PeriodicOrbits, z: np.ndarray) -> list[ContactSequence | None]:
    """The contact sequences of orbits float64[p, z], all in one call; None where there is none."""
    p, n = len(z), orbits.n
    outcome = orbits.map.run(orbits.starts(z).reshape(p * n, -1), 1, record=0)
    good = np.isin(outcome.status, (st.OK, st.GRAZE_UNRESOLVED))
    whole = np.asarray(good.reshape(p, n).all(axis=1))
    table = outcome.contacts
    table = table.rows(~np.isin(table.kind, (st.GRAZE, st.GRAZE_SHALLOW)))
    begins = table.begins(p * n)
    phase = table.trajectory % n + table.time / orbits.map.period[0]
    modes = outcome.mode.reshape(p, n)
    holds = sum(1 << i for i, guard in enumerate(orbits.map.system.guards) if is_hold(guard))
    result: list[ContactSequence | None] = []
    for i in range(p):
        rows = np.arange(begins[i * n], begins[(i + 1) * n])
        rows = rows[~_reported_before(table.guard[rows], table.direction[rows], phase[rows], n)]
        what = np.stack(
            [table.guard, table.direction, table.kind, table.mode_before, table.mode_after]
        )[:, rows]
        result.append(
            ContactSequence(
                tuple(SequenceContact(*one) for one in what.T.tolist()),
                phase[rows],
                table.state[rows][:, : orbits.size],
                table.velocity[rows],
                int(modes[i, -1]),
                bool(modes[i, -1] & holds),
            )
            if whole[i]
            else None
        )
    return result


def _reported_before(
    guard: np.ndarray, direction: np.ndarray, phase: np.ndarray, n: int
) -> np.ndarray:
    """True for a contact that is the one before it, reported again at a whole period, bool[c]."""
    if len(guard) < 2:
        return np.zeros(len(guard), bool)
    apart = (phase - np.roll(phase, 1)) % n
    same = (guard == np.roll(guard, 1)) & (direction == np.roll(direction, 1))
    at_period = np.abs(phase - np.round(phase)) < ONE
    reported: np.ndarray = same & at_period & (np.minimum(apart, n - apart) < ONE)
    return reported


def shift(one: ContactSequence, other: ContactSequence, n: int, apart: float = 0.5) -> int | None:
    """By how many places the contacts of a neighbouring orbit of n periods are shifted to be the
    same ones: other than 0 where contacts have crossed the whole period at which the orbits begin.
    None if the sequences differ, or a contact comes earlier or later by ``apart`` times n periods.
    """
    m = len(one.contacts)
    if m != len(other.contacts):
        return None
    if not m:
        return 0 if one.mode == other.mode else None
    for by in sorted(range(-m, m + 1), key=abs):
        order = np.arange(m) + by
        if all(
            _alike(mine, other.contacts[j % m]) for mine, j in zip(one.contacts, order, strict=True)
        ):
            there = other.phase[order % m] + n * (order // m)
            if np.abs(there - one.phase).max() < apart * n:
                return by
    return None


def _alike(one: SequenceContact, other: SequenceContact) -> bool:
    return (one.guard, one.direction) == (other.guard, other.direction)


def without(one: ContactSequence, places: Sequence[int]) -> ContactSequence:
    """A sequence without some of its contacts; the first of these begins what is left out."""
    keep = [i for i in range(len(one.contacts)) if i not in places]
    new = in_order(one, keep)
    return new if keep or not places else replace(new, mode=one.contacts[places[0]].before)


def in_order(one: ContactSequence, places: Sequence[int]) -> ContactSequence:
    """A sequence of some of the contacts, in the order of their places."""
    keep = list(places)
    return replace(
        one,
        contacts=tuple(one.contacts[i] for i in keep),
        phase=one.phase[keep],
        after=one.after[keep],
        velocity=one.velocity[keep],
    )
