"""The contact states of a system that is linear between its contacts, as tables for the modal flow:
made when a motion first comes to them.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass

import numpy as np

from saltus.codegen.module import MODAL_LANES as LANES
from saltus.flow.modal_blocks import table_of
from saltus.flow.modal_modes import Eigen, StateModes, eigen_of, modes_of, slots_of
from saltus.language.expression import Expr, walk
from saltus.system.courses import TERMS, Course, course_of
from saltus.system.linear import LinearPiece, LinearSystem

#: Memory of the tables of one system [bytes]. Beyond it all are dropped, as soon as no trajectory
#: that a call moves needs them; those still to be moved make theirs anew.
MOST_BYTES = 2**28
#: Memory of a set of parameter values besides its arrays [bytes].
SET_BYTES = 4096


class _Rows:
    """A table that grows: float64[rows, LANES]."""

    def __init__(self) -> None:
        self.used, self._memory = 0, np.zeros((256, LANES))

    @property
    def table(self) -> np.ndarray:
        """All of it, with room behind."""
        return self._memory

    def add(self, numbers: np.ndarray) -> int:
        """Append rows; returns the first."""
        first, rows = self.used, numbers.reshape(-1, LANES)
        if first + len(rows) > len(self._memory):
            grown = np.zeros((2 * (first + len(rows)), LANES))
            grown[:first] = self._memory[:first]
            self._memory = grown
        self._memory[first : first + len(rows)] = rows
        self.used += len(rows)
        return first


@dataclass(frozen=True)
class _Set:
    """Gaps and drives for one set of parameter values, in any contact state."""

    values: dict[str, float]
    gaps: LinearPiece
    rates: np.ndarray
    lags: np.ndarray
    courses: tuple[Course, ...]
    course_rows: np.ndarray


class Tables:
    """Tables of the contact states of a system, by its parameter values.

    Parameters
    ----------
    linear : LinearSystem
        The system.

    Notes
    -----
    They take MOST_BYTES, 256 MB, at most, and what one more contact state needs.
    """

    def __init__(self, linear: LinearSystem) -> None:
        self.linear = linear
        self.lock = threading.Lock()
        self.generation = 0
        self.clear()
        n, guards = len(linear.system.states), len(linear.system.guards)
        self.row_of, self.sign_of = self._rows_of_gaps()
        rows = int(self.row_of.max(initial=-1)) + 1
        self.first_guard = [int(np.flatnonzero(self.row_of == r)[0]) for r in range(rows)]
        values = dict(linear.system.values)
        slots = len(slots_of(np.linalg.eigvals(linear.piece(values, 0).matrix))) + rows
        self.groups, self.state_groups = -(-slots // LANES), -(-n // LANES)
        drives = len(linear.drives)
        courses = len(linear.courses)
        self.block_groups = -(-(n + 1 + 2 * drives + TERMS * courses) // LANES)
        self.rows = 2 * self.groups + self.block_groups
        self.sizes = np.array(
            [n, self.groups, self.state_groups, rows, guards, drives, self.rows, courses], np.int64
        )

    def clear(self) -> None:
        """Drop all sets and contact states: their numbers are of a new generation. Arrays that
        kernels hold stay as they are.
        """
        self.generation += 1
        self.modes, self.steady, self.pieces = _Rows(), _Rows(), _Rows()
        self._courses: dict[tuple[Expr, bytes], tuple[Course, list[float]]] = {}
        self._sets: dict[bytes, int] = {}
        self.sets: list[_Set] = []
        self._eigen: dict[bytes, Eigen] = {}
        self._known: dict[tuple[bytes, bytes], int] = {}
        self._states: dict[tuple[int, int], int] = {}
        self._links: list[list[int]] = []
        self._arrays: tuple[np.ndarray, ...] | None = None
        self._held = 0

    @property
    def full(self) -> bool:
        """True if the tables hold MOST_BYTES or more."""
        rows = sum(one.table.nbytes for one in (self.modes, self.steady, self.pieces))
        return self._held + rows >= MOST_BYTES

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
        """The tables, in the order in which the kernel takes them."""
        if self._arrays is None:
            count = len(self.sets)
            offset = np.array([one.gaps.constant for one in self.sets]).reshape(count, -1)
            rate = np.array([one.rates for one in self.sets]).reshape(count, -1)
            lag = np.array([one.lags for one in self.sets]).reshape(count, -1)
            course = np.array([one.course_rows for one in self.sets]).reshape(count, -1)
            self._arrays = (
                self.sizes, self.row_of, self.sign_of, offset, rate, lag, self.modes.table,
                self.steady.table, np.array(self._links, np.int64).reshape(len(self._links), -1),
                course, self.pieces.table,
            )  # fmt: skip
        return self._arrays

    def set_of(self, row: np.ndarray) -> int:
        """Number of a set of parameter values."""
        key = row.tobytes()
        if key not in self._sets:
            values = dict(zip(self.linear.system.values, row.tolist(), strict=True))
            rates, lags = self.linear.rates(values)
            found = [self._course_of(node, values) for node in self.linear.courses]
            rows = np.array([row for _, row in found], float)
            courses = tuple(course for course, _ in found)
            gaps = self.linear.gaps(values)
            self.sets.append(_Set(values, gaps, rates, lags, courses, rows))
            self._sets[key], self._arrays = len(self.sets) - 1, None
            self._held += SET_BYTES + self.sets[-1].gaps.matrix.nbytes
        return self._sets[key]

    def _course_of(self, node: Expr, values: dict[str, float]) -> tuple[Course, list[float]]:
        """A course and its row of numbers for the kernel: one for all values that it doesn't ask
        for.
        """
        asked = [one.payload for one in walk(node) if one.op == "param"]
        key = (node, np.array([values[name] for name in asked]).tobytes())
        if key not in self._courses:
            course = course_of(node, values)
            begins = np.concatenate([course.begins, np.zeros(-len(course.begins) % LANES)])
            first = self.pieces.add(np.concatenate([begins, course.terms.ravel()]))
            row = [first, len(course.begins), course.cycle, len(begins) // LANES]
            self._courses[key] = course, row
            self._held += course.begins.nbytes + course.terms.nbytes
        return self._courses[key]

    def state_of(self, which: int, mode: int) -> int:
        """Number of a contact state, made if it isn't known."""
        if (which, mode) not in self._states:
            self._make(which, mode)
        return self._states[which, mode]

    def _make(self, which: int, mode: int) -> None:
        given = self.sets[which]
        piece = self.linear.piece(given.values, mode)
        number, guards = len(self._links), len(self.linear.system.guards)
        others = (0, (1 << guards) - 1) if piece.constant.any() else ()
        matrices = [self.linear.piece(given.values, one).matrix for one in others]
        fastest = max((np.abs(self._eigen_of(one)[0]).max() for one in matrices), default=0.0)
        eigen, most = self._eigen_of(piece.matrix), LANES * self.groups
        speeds = np.array([one.speeds for one in given.courses]).reshape(-1, TERMS)
        modes = modes_of(piece, given.gaps, given.rates, speeds, most, eigen, float(fastest))
        key = piece.matrix.tobytes()
        links = [self._modes_of(key, modes, given), self._steady_of(modes, given)]
        for g in range(guards):
            behind = self._states.get((which, mode ^ 1 << g), -1)
            links.append(behind)
            if behind >= 0:
                self._links[behind][2 + g] = number
        self._links.append(links)
        self._states[which, mode], self._arrays = number, None

    # -- one contact state -------------------------------------------------------------------------
    def _eigen_of(self, matrix: np.ndarray) -> Eigen:
        """Modes of a matrix, computed once."""
        key = matrix.tobytes()
        if key not in self._eigen:
            self._eigen[key] = eigen_of(matrix)
            self._held += sum(part.nbytes for part in self._eigen[key])
        return self._eigen[key]

    def _modes_of(self, matrix: bytes, modes: StateModes, given: _Set) -> int:
        """First row of the table of some modes; those of equal matrices share one, but for blocks,
        which hold drives.
        """
        key = (matrix, given.gaps.matrix.tobytes())
        if modes.block is not None:
            return self.modes.add(self._table(modes, given.gaps.matrix))
        if key not in self._known:
            self._known[key] = self.modes.add(self._table(modes, given.gaps.matrix))
        return self._known[key]

    def _table(self, modes: StateModes, gaps: np.ndarray) -> np.ndarray:
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

    def _steady_of(self, modes: StateModes, given: _Set) -> int:
        """First row of the table of the steady answer: to the constant, to cosine and sine of each
        harmonic drive, to each derivative of each course.
        """
        harmonic, first = 1 + len(given.rates), self.first_guard
        answers = modes.answers.T  # [1 + drives + TERMS * courses, N]
        padded = np.zeros((len(answers), LANES * self.state_groups), complex)
        padded[:, : answers.shape[1]] = answers
        gaps = given.gaps.matrix[first] @ answers.T
        gaps[:, 1:harmonic] += given.gaps.driven[first, : harmonic - 1]
        gaps[:, harmonic::TERMS] += given.gaps.driven[first, harmonic - 1 :]
        # only the harmonic ones have an imaginary part
        states = [padded[0].real]
        numbers = [gaps[:, 0].real]
        for d in range(1, harmonic):
            states += [padded[d].real, padded[d].imag]
            numbers += [gaps[:, d].real, gaps[:, d].imag]
        states += list(padded[harmonic:].real)
        numbers += list(gaps[:, harmonic:].T.real)
        flat = np.array(numbers).T.ravel()
        flat = np.concatenate([flat, np.zeros(-len(flat) % LANES)])
        return self.steady.add(np.concatenate([*states, flat]))
