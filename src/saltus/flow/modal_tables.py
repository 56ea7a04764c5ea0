"""The contact states of a system that is linear between its contacts, as tables for the modal flow:
made when a motion first comes to them.
"""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass

import numpy as np

from saltus.codegen.module import MODAL_LANES as LANES
from saltus.errors import ParameterError
from saltus.kernels import modal_layout as layout
from saltus.language.expression import Expr
from saltus.system.linear import LinearPiece, LinearSystem

#: Condition of the eigenvectors of a contact state above which its modes don't carry its motion.
MOST_CONDITION = 1e9
#: Rounding of a coefficient of the equations, relative to it.
ROUNDED = 16 * np.finfo(float).eps
#: Turns of a drive in a period that are whole to so much are whole [relative].
WHOLE = 1e-12
#: Distance of a drive from an eigenvalue, relative to its rate, below which it is in resonance.
RESONANCE = 1e-9


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
class _Modes:
    """Modes of one contact state: z = V y, y = L z; all of them, and the row of their table."""

    values: np.ndarray
    vectors: np.ndarray
    inverse: np.ndarray
    row: int


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
        self._known: dict[tuple[bytes, bytes], _Modes] = {}
        self._states: dict[tuple[int, int], int] = {}
        self._links: list[list[int]] = []
        self._pieces: list[LinearPiece] = []
        n, guards = len(linear.system.states), len(linear.system.guards)
        self.row_of, self.sign_of = self._rows_of_gaps()
        rows = int(self.row_of.max(initial=-1)) + 1
        self.first_guard = [int(np.flatnonzero(self.row_of == r)[0]) for r in range(rows)]
        values = dict(linear.system.values)
        slots = len(_slots(np.linalg.eigvals(linear.piece(values, 0).matrix))) + rows
        self.groups, self.state_groups = -(-slots // LANES), -(-n // LANES)
        self.sizes = np.array(
            [n, self.groups, self.state_groups, rows, guards, len(linear.drives), 0], np.int64
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
        offset = np.array([one.gaps.constant for one in self.sets]).reshape(len(self.sets), -1)
        rate = np.array([one.rates for one in self.sets]).reshape(len(self.sets), -1)
        lag = np.array([one.lags for one in self.sets]).reshape(len(self.sets), -1)
        return (
            self.row_of, self.sign_of, offset, rate, lag, self.modes.table,
            self.steady.table, np.array(self._links, np.int64),
        )  # fmt: skip

    def set_of(self, row: np.ndarray) -> int:
        """Number of a set of parameter values."""
        key = row.tobytes()
        if key not in self._sets:
            values = dict(zip(self.linear.system.values, row.tolist(), strict=True))
            rates, lags = self.linear.rates(values)
            self.sets.append(_Set(values, self.linear.gaps(values), rates, lags))
            self._sets[key] = len(self.sets) - 1
        return self._sets[key]

    def state_of(self, which: int, mode: int) -> int:
        """Number of a contact state, made if it isn't known."""
        if (which, mode) not in self._states:
            self._make(which, mode)
        return self._states[which, mode]

    def _make(self, which: int, mode: int) -> None:
        given = self.sets[which]
        piece = self.linear.piece(given.values, mode)
        modes = self._modes_of(piece.matrix, given.gaps.matrix)
        number, guards = len(self._links), len(self.linear.system.guards)
        links = [modes.row, self._steady_of(modes, piece, given), 0]
        for g in range(guards):
            behind = self._states.get((which, mode ^ 1 << g), -1)
            links.append(behind)
            if behind >= 0:
                self._links[behind][layout.BEHIND + g] = number
                if _is_smooth(piece, self._pieces[behind], given.gaps, g):
                    links[layout.SMOOTH] |= 1 << g
                    self._links[behind][layout.SMOOTH] |= 1 << g
        self._links.append(links)
        self._pieces.append(piece)
        self._states[which, mode] = number

    # -- one contact state -------------------------------------------------------------------------
    def _modes_of(self, matrix: np.ndarray, gaps: np.ndarray) -> _Modes:
        """Modes of a matrix and their table."""
        key = (matrix.tobytes(), gaps.tobytes())
        if key not in self._known:
            values, vectors = np.linalg.eig(matrix)
            if not np.linalg.cond(vectors) < MOST_CONDITION:
                raise ParameterError(
                    f"a contact state of {self.linear.system.name} has modes that coincide, as at "
                    "critical damping: they don't carry its motion. Use method=sl.Taylor()."
                )
            inverse = np.linalg.inv(vectors)
            inverse += inverse @ (np.eye(len(matrix)) - vectors @ inverse)
            row = self.modes.add(self._table(values, vectors, inverse, gaps))
            self._known[key] = _Modes(values, vectors, inverse, row)
        return self._known[key]

    def _table(
        self, values: np.ndarray, vectors: np.ndarray, inverse: np.ndarray, gaps: np.ndarray
    ) -> np.ndarray:
        """The table of some modes: lambda, its size, L, V, amplitudes of the gaps."""
        slots = _slots(values)
        width, count = LANES * self.groups, LANES * self.state_groups
        if len(slots) > width:
            raise ParameterError(
                f"{len(slots) - width} more modes of {self.linear.system.name} are overdamped in a "
                "contact state than its contacts can explain. Use method=sl.Taylor()."
            )
        weight = np.where(values[slots].imag > 0, 2.0, 1.0)
        lam, size = np.zeros(width, complex), np.zeros(width)
        lam[: len(slots)] = values[slots]
        size[: len(slots)] = np.abs(values[slots])
        size[len(slots) :] = size[: len(slots)].max()
        to_modes, to_states = np.zeros((width, count), complex), np.zeros((count, width), complex)
        to_modes[: len(slots), : len(values)] = inverse[slots]
        to_states[: len(values), : len(slots)] = vectors[:, slots] * weight
        # L: by groups of modes, real parts then imaginary ones, each for all states
        left = to_modes.reshape(self.groups, LANES, count).transpose(0, 2, 1)
        left = np.concatenate([left.real, left.imag])
        # V: by groups of states, for each mode the real part and minus the imaginary one
        right = to_states.reshape(self.state_groups, LANES, width).transpose(0, 2, 1)
        right = np.stack([right.real, -right.imag], axis=2)
        rows = gaps[self.first_guard] @ to_states[: len(values)]
        waves = np.stack([rows.real, rows.imag, np.abs(rows)], axis=1)
        return np.concatenate(
            [one.ravel() for one in (lam.real, lam.imag, size, left, right, waves)]
        )

    def waves(self, row: np.ndarray, mode: int, quantities: tuple[Expr, ...]) -> Waves:
        """The waves of a contact state, with the states, these quantities and the gaps."""
        with self.lock:
            given = self.sets[self.set_of(row)]
            piece = self.linear.piece(given.values, mode)
            modes = self._modes_of(piece.matrix, given.gaps.matrix)
        answers = self._answers(modes, piece, given)
        asked = self.linear.rows(quantities, given.values, mode)
        kept, size = _slots(modes.values), len(modes.values)
        weight = np.where(modes.values[kept].imag > 0, 2.0, 1.0)
        rows = np.vstack([np.eye(size), asked.matrix, given.gaps.matrix])
        direct = np.zeros((len(rows), len(answers)))
        direct[size:, 0] = np.append(asked.constant, given.gaps.constant)
        direct[size:, 1:] = np.vstack([asked.driven, given.gaps.driven])
        return Waves(
            np.concatenate([modes.values[kept], [0.0], 1j * given.rates]),
            np.hstack([rows @ (modes.vectors[:, kept] * weight), rows @ answers.T + direct]),
            modes.inverse[kept], answers, given.rates, given.lags,
        )  # fmt: skip

    def _steady_of(self, modes: _Modes, piece: LinearPiece, given: _Set) -> int:
        """First row of the table of the steady answer to the drives."""
        answers = self._answers(modes, piece, given)
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

    def _answers(self, modes: _Modes, piece: LinearPiece, given: _Set) -> np.ndarray:
        """The steady answer to the constant load and to each drive, complex128[1 + D, N]."""
        rates = np.concatenate([[0.0], given.rates])
        far = 1j * rates[:, None] - modes.values[None]
        loads = np.column_stack([piece.constant, piece.driven])
        parts = modes.inverse @ loads
        least = np.abs(far).min(axis=1)
        near = (least < RESONANCE * np.maximum(rates, np.abs(modes.values).max() * 1e-6)) & (
            np.abs(loads).max(axis=0) > 0
        )
        if near.any():
            raise ParameterError(
                f"{self.linear.system.name}: a drive, or a constant force, is in resonance with an "
                "undamped mode. Use method=sl.Taylor()."
            )
        with np.errstate(all="ignore"):
            answers = modes.vectors @ np.where(parts == 0, 0, parts / far.T)
        return answers.T


@dataclass(frozen=True)
class Waves:
    """The waves of a contact state: its modes, a constant and the drives; see flow/waves.py.

    Attributes
    ----------
    rates : complex128[E]
        [1/s].
    rows : complex128[R, E]
        What each adds to each quantity.
    """

    rates: np.ndarray
    rows: np.ndarray
    _inverse: np.ndarray
    _answers: np.ndarray
    _drive_rates: np.ndarray
    _lags: np.ndarray

    def amplitudes(
        self, states: np.ndarray, count: np.ndarray, period: float, phase: np.ndarray
    ) -> np.ndarray:
        """Amplitudes complex128[p, E] in states float64[p, N], ``phase`` [s] after whole
        periods.
        """
        turns = self._drive_rates * period / (2 * math.pi)
        whole = np.abs(turns - np.round(turns)) <= WHOLE * np.abs(turns)
        angle = self._lags + self._drive_rates * phase[:, None]
        angle = angle + np.where(whole, 0.0, count[:, None] * self._drive_rates * period)
        loads = np.column_stack([np.ones(len(states)), np.exp(1j * angle)])
        modes = (states - (loads @ self._answers).real) @ self._inverse.T
        return np.column_stack([modes, loads])


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


def _slots(values: np.ndarray) -> np.ndarray:
    """Indices of one of each pair of complex eigenvalues and of all real ones, ascending by
    size.
    """
    kept = np.flatnonzero(values.imag >= 0)
    return kept[np.argsort(np.abs(values[kept]), kind="stable")]
