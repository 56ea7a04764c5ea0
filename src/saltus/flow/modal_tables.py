"""The contact states of a system that is linear between its contacts, as tables for the modal flow:
made when a motion first comes to them.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass

import numpy as np

from saltus.codegen.module import MODAL_LANES as LANES
from saltus.contact.guards import is_hold
from saltus.errors import ParameterError
from saltus.kernels import modal_layout as layout
from saltus.kernels.status import LAW_KINDS, NO_LAW
from saltus.system import System
from saltus.system.linear import LinearPiece, LinearSystem
from saltus.system.linear_laws import Constrained, Impacts, constrained, impacts_of

#: Condition of the eigenvectors of a contact state above which its modes don't carry its motion.
MOST_CONDITION = 1e9
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
class ValueSet:
    """Gaps and drives for one set of parameter values, in any contact state."""

    values: dict[str, float]
    gaps: LinearPiece
    rates: np.ndarray
    lags: np.ndarray
    impacts: Impacts


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
        self.sets: list[ValueSet] = []
        self._known: dict[tuple[bytes, ...], _Modes] = {}
        self._states: dict[tuple[int, int], int] = {}
        self._links: list[list[int]] = []
        self._laws, self._presses = _laws_of(linear.system), list[np.ndarray]()
        laws = [guard.law for guard in linear.system.guards]
        self.holds = np.array([is_hold(guard) for guard in linear.system.guards], bool)
        self.plain = np.array([law is None for law in laws], bool)
        self.allowed = np.array([law.side if law else 0 for law in laws], np.int64)
        n, guards = len(linear.system.states), len(linear.system.guards)
        self.row_of, self.sign_of = self._rows_of_gaps()
        rows = int(self.row_of.max(initial=-1)) + 1
        self.first_guard = [int(np.flatnonzero(self.row_of == r)[0]) for r in range(rows)]
        values = dict(linear.system.values)
        slots = len(_slots(np.linalg.eigvals(linear.piece(values, 0).matrix))) + rows
        self.groups, self.state_groups = -(-slots // LANES), -(-n // LANES)
        self.sizes = np.array(
            [n, self.groups, self.state_groups, rows, guards, len(linear.drives)], np.int64
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
                    alike = not (self.holds[g] or self.holds[first])
                    if alike and all(np.array_equal(one[g], sign * one[first]) for one in seen):
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
        offset = np.array([one.gaps.constant for one in self.sets]).reshape(len(self.sets), -1)
        rate = np.array([one.rates for one in self.sets]).reshape(len(self.sets), -1)
        lag = np.array([one.lags for one in self.sets]).reshape(len(self.sets), -1)
        return (
            self.sizes, self.row_of, self.sign_of, offset, rate, lag, self.modes.table,
            self.steady.table, np.array(self._links, np.int64), self._laws, self._acts(),
            np.concatenate(self._presses),
        )  # fmt: skip

    def _acts(self) -> np.ndarray:
        """The table of the laws of all sets."""
        return np.concatenate(
            [
                np.column_stack(
                    [
                        *(one.gaps.matrix, one.gaps.constant, one.gaps.driven),
                        *(one.impacts.closing.matrix, one.impacts.closing.constant),
                        *(one.impacts.closing.driven, one.impacts.push, one.impacts.restitution),
                    ]
                )
                for one in self.sets
            ]
        )

    def set_of(self, row: np.ndarray) -> int:
        """Number of a set of parameter values."""
        key = row.tobytes()
        if key not in self._sets:
            values = dict(zip(self.linear.system.values, row.tolist(), strict=True))
            rates, lags = self.linear.rates(values)
            gaps, impacts = self.linear.gaps(values), impacts_of(self.linear, values)
            gaps.constant[self.holds] = 0.0
            self.sets.append(ValueSet(values, gaps, rates, lags, impacts))
            self._sets[key] = len(self.sets) - 1
        return self._sets[key]

    def state_of(self, which: int, mode: int) -> int:
        """Number of a contact state, made if it isn't known."""
        if (which, mode) not in self._states:
            self._make(which, mode)
        return self._states[which, mode]

    def _make(self, which: int, mode: int) -> None:
        given = self.sets[which]
        piece, gaps = self.linear.piece(given.values, mode), self.linear.gaps(given.values, mode)
        gaps.constant[~self.holds] = 0.0
        free = constrained(self.linear.system, mode, given.gaps, given.impacts)
        modes = self._modes_of(piece.matrix, gaps.matrix, free)
        self._presses.append(self._presses_of(gaps))
        number, guards = len(self._links), len(self.linear.system.guards)
        links = [modes.row, self._steady_of(modes, piece, given, gaps, free)]
        for g in range(guards):
            behind = self._states.get((which, mode ^ 1 << g), -1)
            links.append(behind)
            if behind >= 0:
                self._links[behind][layout.BEHIND + g] = number
        self._links.append(links)
        self._states[which, mode] = number

    def _presses_of(self, gaps: LinearPiece) -> np.ndarray:
        """Closing accelerations of the contacts that can be held: the gaps of their hold guards."""
        rows = np.column_stack([gaps.matrix, gaps.constant, gaps.driven])
        partner = self._laws[:, layout.PARTNER]
        return np.where((partner >= 0)[:, None], rows[partner], 0.0)

    # -- one contact state -------------------------------------------------------------------------
    def _modes_of(self, matrix: np.ndarray, gaps: np.ndarray, free: Constrained) -> _Modes:
        """Modes of a matrix on the states that held contacts allow, and their table."""
        key = (matrix.tobytes(), gaps.tobytes(), free.spread.tobytes())
        if key not in self._known:
            matrix = matrix[free.kept] @ free.spread
            values, vectors = np.linalg.eig(matrix)
            if len(values) and not np.linalg.cond(vectors) < MOST_CONDITION:
                raise ParameterError(
                    f"a contact state of {self.linear.system.name} has modes that coincide, as at "
                    "critical damping: they don't carry its motion. Use method=sl.Taylor()."
                )
            inverse = np.linalg.inv(vectors)
            inverse += inverse @ (np.eye(len(matrix)) - vectors @ inverse)
            whole = np.zeros((len(values), len(gaps.T)), complex)
            whole[:, free.kept], vectors = inverse, free.spread @ vectors
            row = self.modes.add(self._table(values, vectors, whole, gaps))
            self._known[key] = _Modes(values, vectors, whole, row)
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
        size[len(slots) :] = size[: len(slots)].max(initial=0.0)
        to_modes, to_states = np.zeros((width, count), complex), np.zeros((count, width), complex)
        to_modes[: len(slots), : len(vectors)] = inverse[slots]
        to_states[: len(vectors), : len(slots)] = vectors[:, slots] * weight
        # L: by groups of modes, real parts then imaginary ones, each for all states
        left = to_modes.reshape(self.groups, LANES, count).transpose(0, 2, 1)
        left = np.concatenate([left.real, left.imag])
        # V: by groups of states, for each mode the real part and minus the imaginary one
        right = to_states.reshape(self.state_groups, LANES, width).transpose(0, 2, 1)
        right = np.stack([right.real, -right.imag], axis=2)
        rows = gaps[self.first_guard] @ to_states[: len(vectors)]
        waves = np.stack([rows.real, rows.imag, np.abs(rows)], axis=1)
        return np.concatenate(
            [one.ravel() for one in (lam.real, lam.imag, size, left, right, waves)]
        )

    def _steady_of(
        self,
        modes: _Modes,
        piece: LinearPiece,
        given: ValueSet,
        shown: LinearPiece,
        free: Constrained,
    ) -> int:
        """First row of the table of the steady answer to the drives."""
        rates = np.concatenate([[0.0], given.rates])
        far = 1j * rates[:, None] - modes.values[None]
        loads = np.column_stack([piece.constant, piece.driven]) + piece.matrix @ free.base
        parts = (modes.inverse @ loads).T
        noise = layout.ROUNDED * (np.abs(modes.inverse) @ np.abs(loads)).T
        parts[np.abs(parts) <= noise] = 0.0
        slow = np.maximum(rates, np.abs(modes.values).max(initial=0.0) * 1e-6)
        near = (np.abs(far) < RESONANCE * slow[:, None]) & (parts != 0)
        if near.any():
            raise ParameterError(
                f"{self.linear.system.name}: a drive, or a constant force, is in resonance with an "
                "undamped mode. Use method=sl.Taylor()."
            )
        with np.errstate(all="ignore"):
            parts = np.where(parts == 0, 0, parts / far)
        answers = free.base.T + parts @ modes.vectors.T  # float64[1 + drives, N]
        padded = np.zeros((len(rates), LANES * self.state_groups), complex)
        padded[:, : answers.shape[1]] = answers
        waves = np.stack([padded.real, padded.imag], axis=1).reshape(-1, padded.shape[1])
        states = np.delete(waves, 1, axis=0)  # the constant has no imaginary part
        first = self.first_guard
        gaps = shown.matrix[first] @ answers.T  # [rows, 1 + drives]
        gaps += np.column_stack([shown.constant, shown.driven])[first]
        pairs = np.stack([gaps.real, gaps.imag], axis=2).reshape(len(first), -1)
        numbers = np.delete(pairs, 1, axis=1).ravel()
        numbers = np.concatenate([numbers, np.zeros(-len(numbers) % LANES)])
        return self.steady.add(np.concatenate([states.ravel(), numbers]))


def _laws_of(system: System) -> np.ndarray:
    """Of each guard the kind of its law, its partner, and the state that its gap is a level of,
    int64[guards, 3]; -1 where there is none.
    """
    table = np.full((len(system.guards), 3), -1, np.int64)
    table[:, layout.KIND] = NO_LAW
    for g, guard in enumerate(system.guards):
        if guard.law is not None:
            table[g, layout.KIND] = LAW_KINDS[guard.law.kind]
            table[g, layout.PARTNER] = guard.law.partner
        if guard.state is not None:
            table[g, layout.LEVEL] = system.states.index(guard.state)
    return table


def _slots(values: np.ndarray) -> np.ndarray:
    """Indices of one of each pair of complex eigenvalues and of all real ones, ascending by
    size.
    """
    kept = np.flatnonzero(values.imag >= 0)
    return kept[np.argsort(np.abs(values[kept]), kind="stable")]
