"""The contacts of a run as a table with named columns: views of what the kernels wrote."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from saltus.kernels import status as st


def _integers(column: int) -> property:
    return property(lambda table: table.integers[:, column])


def _floats(column: int | slice) -> property:
    return property(lambda table: table.floats[:, column])


@dataclass(frozen=True)
class ContactTable:
    """c contacts, sorted by trajectory, then time. No column is a copy.

    Attributes
    ----------
    integers : int64[c, .]
    floats : float64[c, .]
        Columns of both as kernels/status.py says.
    trajectory, period, steps : int64[c]
        Trajectory; whole periods and accepted steps since its start.
    guard, direction, kind : int64[c]
        Number of the guard; +1 or -1, the way it was crossed; a code of `status.CONTACT_KIND`.
    mode_before, mode_after : int64[c]
        Sides of all guards, as bits.
    phase, time, time_error : float64[c]
        Time since the beginning of the period, absolute time, the error of one step in it [s].
    velocity : float64[c]
        Rate of the gap.
    state : float64[c, D]
        Where the trajectory is.
    """

    integers: np.ndarray
    floats: np.ndarray

    trajectory, period, guard = (
        _integers(st.REC_TRAJECTORY),
        _integers(st.REC_PERIOD),
        _integers(st.REC_GUARD),
    )
    direction, kind, steps = (
        _integers(st.REC_DIRECTION),
        _integers(st.REC_KIND),
        _integers(st.REC_STEPS),
    )
    mode_before, mode_after = _integers(st.REC_MODE_BEFORE), _integers(st.REC_MODE_AFTER)
    phase, velocity, time_error = (
        _floats(st.REC_PHASE),
        _floats(st.REC_VELOCITY),
        _floats(st.REC_TIME_ERROR),
    )
    state, time = _floats(slice(st.RECORD_FLOATS, -1)), _floats(-1)

    @classmethod
    def joined(cls, parts: list[ContactTable]) -> ContactTable:
        """Tables one below the other, sorted by trajectory; those of one trajectory in the order
        given.
        """
        integers, floats = (
            np.concatenate(half) if len(half) > 1 else half[0]
            for half in zip(*(p.arrays for p in parts), strict=True)
        )
        table, who = cls(integers, floats), integers[:, st.REC_TRAJECTORY]
        return table if (np.diff(who) >= 0).all() else table.rows(np.argsort(who, kind="stable"))

    @classmethod
    def empty(cls, size: int, states: int) -> ContactTable:
        """Uninitialised room for ``size`` contacts of systems with ``states`` states."""
        return cls(
            np.empty((size, st.RECORD_INTEGERS), np.int64),
            np.empty((size, st.RECORD_FLOATS + states + 1)),
        )

    def __len__(self) -> int:
        return len(self.integers)

    @property
    def arrays(self) -> tuple[np.ndarray, np.ndarray]:
        """Both arrays."""
        return self.integers, self.floats

    @property
    def kind_name(self) -> np.ndarray:
        """The kind in words, str[c]."""
        words = np.array([st.CONTACT_KIND[i] for i in range(len(st.CONTACT_KIND))])
        names: np.ndarray = words[self.kind]
        return names

    @property
    def changes_side(self) -> np.ndarray:
        """True where the guard itself changed its side, bool[c]; a graze doesn't change it."""
        changes: np.ndarray = ((self.mode_before ^ self.mode_after) >> self.guard) & 1 == 1
        return changes

    @property
    def chatters(self) -> np.ndarray:
        """True where a contact is one of the ever smaller impacts with which a guard comes to rest,
        bool[c]. The number of these impacts means nothing.
        """
        impact: np.ndarray = self.kind == st.IMPACT
        rows = np.flatnonzero(impact)
        if not len(rows):
            return impact
        # runs of impacts of one guard, and the row behind each
        same = (np.diff(rows) == 1) & (np.diff(self.trajectory[rows]) == 0)
        same &= np.diff(self.guard[rows]) == 0
        run = np.cumsum(np.append(True, ~same)) - 1
        behind = np.minimum(
            rows[np.append(np.flatnonzero(~same), len(rows) - 1)] + 1, len(self) - 1
        )
        rests = (self.kind[behind] == st.HOLD) & (
            self.trajectory[behind] == self.trajectory[behind - 1]
        )
        impact[rows] = rests[run]
        return impact

    def moved(self, by: int) -> ContactTable:
        """The same contacts, with ``by`` added to the numbers of their trajectories."""
        integers = self.integers.copy()
        integers[:, st.REC_TRAJECTORY] += by
        return ContactTable(integers, self.floats)

    def rows(self, which: np.ndarray | slice) -> ContactTable:
        """The contacts of these indices; views for a slice."""
        return ContactTable(self.integers[which], self.floats[which])

    def begins(self, count: int, first: int = 0) -> np.ndarray:
        """Index of the first contact of each of ``count`` trajectories from ``first`` on, and the
        end of the last one: int64[count + 1].
        """
        return np.searchsorted(self.trajectory, first + np.arange(count + 1))
