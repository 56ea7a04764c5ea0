"""The contact states of a system that is linear between its contacts, as tables for the modal flow:
made when a motion first comes to them.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass

import numpy as np

from saltus.codegen.module import MODAL_LANES as LANES
from saltus.flow.modal_blocks import Eigen, Modes, eigen_of, modes_of, slots_of, table_of
from saltus.kernels import modal_layout as layout
from saltus.system.linear import LinearPiece, LinearSystem

#: Rounding of a coefficient of the equations, relative to it.
ROUNDED = 16 * np.finfo(float).eps


class _Rows:
    """A table that grows: [rows, width]."""

    def __init__(self, width: int = LANES, kind: type = float) -> None:
        self.used = 0
        self.table: np.ndarray = np.zeros((64, width), kind)

    def add(self, numbers: np.ndarray) -> int:
        """Append rows; returns the first."""
        first, rows = self.used, numbers.reshape(-1, self.table.shape[1])
        if first + len(rows) > len(self.table):
            grown = np.zeros((2 * (first + len(rows)), self.table.shape[1]), self.table.dtype)
            grown[:first] = self.table[:first]
            self.table = grown
        self.used += len(rows)
        self.table[first : self.used] = rows
        return first


@dataclass(frozen=True)
class _Equations:
    """The equations of a contact state, the eigenvalues and -vectors of their matrix, and the
    fastest eigenvalue of other states [1/s]: the same for all rates of the drives.
    """

    piece: LinearPiece
    eigen: Eigen
    fastest: float


@dataclass(frozen=True)
class _Set:
    """Gaps and drives for one set of parameter values, in any contact state."""

    values: dict[str, float]
    gaps: LinearPiece
    rates: np.ndarray
    lags: np.ndarray


class Tables:
    """Tables of the contact states of a system, by its parameter values.

    Parameters
    ----------
    linear : LinearSystem
        The system.
    """

    def __init__(self, linear: LinearSystem) -> None:
        self.linear = linear
        self.lock = threading.Lock()
        self.modes, self.steady = _Rows(), _Rows()
        self._sets: dict[bytes, int] = {}
        self.sets: list[_Set] = []
        self._equations: dict[tuple[object, ...], _Equations] = {}
        self._smooth: dict[tuple[object, ...], bool] = {}
        self._known: dict[tuple[int, bytes], int] = {}
        self._states: dict[tuple[int, int], int] = {}
        #: Equations and modes of each contact state.
        self.made: list[tuple[_Equations, Modes]] = []
        n, guards = len(linear.system.states), len(linear.system.guards)
        self._offset, self._rate = _Rows(max(guards, 1)), _Rows(max(len(linear.drives), 1))
        self._lag = _Rows(max(len(linear.drives), 1))
        self._links = _Rows(layout.BEHIND + guards, int)
        self.row_of, self.sign_of = self._rows_of_gaps()
        rows = int(self.row_of.max(initial=-1)) + 1
        self.first_guard = [int(np.flatnonzero(self.row_of == r)[0]) for r in range(rows)]
        values = dict(linear.system.values)
        slots = len(slots_of(np.linalg.eigvals(linear.piece(values, 0).matrix))) + rows
        self.groups, self.state_groups = -(-slots // LANES), -(-n // LANES)
        drives = len(linear.drives)
        self.block_groups = -(-(n + 1 + 2 * drives) // LANES)
        self.rows = 2 * self.groups + self.block_groups
        self.sizes = np.array(
            [n, self.groups, self.state_groups, rows, guards, drives, self.rows, 0], np.int64
        )

    def _rows_of_gaps(self) -> tuple[np.ndarray, np.ndarray]:
        """Row and sign of each guard's gap: guards whose gaps differ by a number only share one."""
        values = dict(self.linear.system.values)
        rng = np.random.default_rng(0)
        sets = [values, {name: one * rng.uniform(0.9, 1.1) for name, one in values.items()}]
        seen = [np.column_stack([g.matrix, g.driven]) for g in map(self.linear.gaps, sets)]
        rows: list[int] = []
        row_of, sign_of = np.zeros(len(seen[0]), np.int64), np.ones(len(seen[0]))
        for g in range(len(seen[0])):
            for row, first in enumerate(rows):
                for sign in (1.0, -1.0):
                    if all(np.array_equal(one[g], sign * one[first]) for one in seen):
                        row_of[g], sign_of[g] = row, sign
                        break
                else:
                    continue
                break
            else:
                row_of[g] = len(rows)
                rows.append(g)
        return row_of, sign_of

    # -- what the kernel reads ---------------------------------------------------------------------
    def arrays(self) -> tuple[np.ndarray, ...]:
        """The tables, in the order in which the kernel takes them after the sizes."""
        parts = (self._offset, self._rate, self._lag, self.modes, self.steady, self._links)
        return self.row_of, self.sign_of, *(one.table for one in parts)

    def set_of(self, row: np.ndarray) -> int:
        """Number of a set of parameter values."""
        key = row.tobytes()
        if key not in self._sets:
            values = dict(zip(self.linear.system.values, row.tolist(), strict=True))
            rates, lags = self.linear.rates(values)
            gaps = self.linear.gaps(values)
            for table, numbers in (
                (self._offset, gaps.constant),
                (self._rate, rates),
                (self._lag, lags),
            ):
                table.add(np.append(numbers, np.zeros(table.table.shape[1] - len(numbers))))
            self.sets.append(_Set(values, gaps, rates, lags))
            self._sets[key] = len(self.sets) - 1
        return self._sets[key]

    def state_of(self, which: int, mode: int) -> int:
        """Number of a contact state, made if it isn't known."""
        if (which, mode) not in self._states:
            self._make(which, mode)
        return self._states[which, mode]

    def _make(self, which: int, mode: int) -> None:
        given, known = self.sets[which], self._equations_of(self.sets[which], mode)
        modes = modes_of(
            known.piece, given.gaps, given.rates, LANES * self.groups, known.eigen, known.fastest
        )
        number, guards = len(self.made), len(self.linear.system.guards)
        links = [self._modes_of(known, modes, given), self._steady_of(modes, given), 0]
        for g in range(guards):
            behind = self._states.get((which, mode ^ 1 << g), -1)
            links.append(behind)
            if behind >= 0:
                self._links.table[behind, layout.BEHIND + g] = number
                if self._is_smooth(known, self.made[behind][0], given.gaps, g):
                    links[layout.SMOOTH] |= 1 << g
                    self._links.table[behind, layout.SMOOTH] |= 1 << g
        self._links.add(np.array(links))
        self.made.append((known, modes))
        self._states[which, mode] = number

    # -- one contact state -------------------------------------------------------------------------
    def _equations_of(self, given: _Set, mode: int) -> _Equations:
        """The equations of a contact state, read off once for all rates of the drives."""
        used = tuple(given.values[name] for name in self.linear.parameters)
        if (mode, used) not in self._equations:
            piece, fastest = self.linear.piece(given.values, mode), 0.0
            every = (1 << len(self.linear.system.guards)) - 1
            if piece.constant.any():
                others = [self.linear.piece(given.values, one).matrix for one in (0, every)]
                fastest = max(float(np.abs(np.linalg.eigvals(one)).max()) for one in others)
            self._equations[mode, used] = _Equations(piece, eigen_of(piece.matrix), fastest)
        return self._equations[mode, used]

    def _is_smooth(self, one: _Equations, other: _Equations, gaps: LinearPiece, g: int) -> bool:
        key = id(one), id(other), g, gaps.constant[g], gaps.matrix[g].tobytes()
        if key not in self._smooth:
            self._smooth[key] = _is_smooth(one.piece, other.piece, gaps, g)
        return self._smooth[key]

    def _modes_of(self, known: _Equations, modes: Modes, given: _Set) -> int:
        """First row of the table of some modes; those of equal equations share one, but for blocks,
        which hold drives.
        """
        key = id(known), given.gaps.matrix.tobytes()
        if modes.block is not None:
            return self.modes.add(self._table(modes, given.gaps.matrix))
        if key not in self._known:
            self._known[key] = self.modes.add(self._table(modes, given.gaps.matrix))
        return self._known[key]

    def _table(self, modes: Modes, gaps: np.ndarray) -> np.ndarray:
        """The table of some modes: lambda, its size, L, V, amplitudes of the gaps; the block."""
        values, vectors, inverse = modes.values, modes.vectors, modes.inverse
        slots, states = slots_of(values), len(vectors)
        width, count = LANES * self.groups, LANES * self.state_groups
        weight = np.where(values[slots].imag > 0, 2.0, 1.0)
        lam, size = np.zeros(width, complex), np.zeros(width)
        lam[: len(slots)] = values[slots]
        size[: len(slots)] = np.abs(values[slots])
        size[len(slots) :] = size[: len(slots)].max(initial=0.0)
        to_modes, to_states = np.zeros((width, count), complex), np.zeros((count, width), complex)
        to_modes[: len(slots), :states] = inverse[slots]
        to_states[:states, : len(slots)] = vectors[:, slots] * weight
        # L: by groups of modes, real parts then imaginary ones, each for all states
        left = to_modes.reshape(self.groups, LANES, count).transpose(0, 2, 1)
        left = np.concatenate([left.real, left.imag])
        # V: by groups of states, for each mode the real part and minus the imaginary one
        right = to_states.reshape(self.state_groups, LANES, width).transpose(0, 2, 1)
        right = np.stack([right.real, -right.imag], axis=2)
        gaps = gaps[self.first_guard]
        rows = gaps @ to_states[:states]
        waves = np.stack([rows.real, rows.imag, np.abs(rows)], axis=1)
        block = table_of(modes.block, gaps, LANES, self.state_groups)
        return np.concatenate(
            [one.ravel() for one in (lam.real, lam.imag, size, left, right, waves, *block)]
        )

    def _steady_of(self, modes: Modes, given: _Set) -> int:
        """First row of the table of the steady answer to the drives."""
        answers = modes.answers.T  # [1 + drives, N]
        padded = np.zeros((len(answers), LANES * self.state_groups), complex)
        padded[:, : answers.shape[1]] = answers
        waves = np.stack([padded.real, padded.imag], axis=1).reshape(-1, padded.shape[1])
        states = np.delete(waves, 1, axis=0)  # the constant has no imaginary part
        first = self.first_guard
        gaps = given.gaps.matrix[first] @ answers.T  # [rows, 1 + drives]
        gaps[:, 1:] += given.gaps.driven[first]
        pairs = np.stack([gaps.real, gaps.imag], axis=2).reshape(len(first), -1)
        numbers = np.delete(pairs, 1, axis=1).ravel()
        numbers = np.concatenate([numbers, np.zeros(-len(numbers) % LANES)])
        return self.steady.add(np.concatenate([states.ravel(), numbers]))


def _is_smooth(one: LinearPiece, other: LinearPiece, gaps: LinearPiece, g: int) -> bool:
    """True if the rates in two contact states agree where the gap of a guard is zero: their
    difference is a multiple of the gap, to rounding.
    """
    first, second, rows = (
        np.column_stack([piece.matrix, piece.constant, piece.driven])
        for piece in (one, other, gaps)
    )
    gap, jump = rows[g] / np.linalg.norm(rows[g]), first - second
    noise = ROUNDED * (np.abs(first) + np.abs(second))
    left = jump - np.outer(jump @ gap, gap)
    return bool((np.abs(left) <= noise + np.outer(noise @ np.abs(gap), np.abs(gap))).all())
