"""The equations of the contact states of a system that is linear between its contacts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from saltus.flow.modal_eigen import Eigen, half_of
from saltus.flow.modal_values import ValueSet
from saltus.system.linear import LinearPiece, LinearSystem
from saltus.system.linear_laws import Constrained

#: Rounding of a coefficient of the equations, relative to it.
ROUNDED = 16 * np.finfo(float).eps


@dataclass(frozen=True)
class StateEquations:
    """The equations of a contact state, one of each pair of eigenvalues and -vectors of their
    matrix, the largest eigenvalue, and the fastest of other states [1/s]: the same for all rates of
    the drives.
    """

    piece: LinearPiece
    eigen: Eigen
    largest: float
    fastest: float


class EquationsOfStates:
    """The equations of contact states, read off once for all rates of the drives.

    Parameters
    ----------
    linear : LinearSystem
        The system.
    holds : bool[G]
        Guards that tell if a contact is held.

    Attributes
    ----------
    held : int
        Memory of the matrices [bytes].
    """

    def __init__(self, linear: LinearSystem, holds: np.ndarray) -> None:
        self.linear, self._holds, self.held = linear, holds, 0
        self._equations: dict[tuple[object, ...], StateEquations] = {}
        self._pieces: dict[tuple[float, ...], Callable[[int], LinearPiece]] = {}
        self._fast: dict[tuple[float, ...], float] = {}
        self._slow: dict[tuple[float, ...], float] = {}
        self._finite: dict[tuple[float, ...], bool] = {}
        self._smooth: dict[tuple[object, ...], bool] = {}

    def piece_of(self, given: ValueSet, mode: int) -> LinearPiece:
        """The matrices of a contact state."""
        used = tuple(given.values[name] for name in self.linear.parameters)
        if used not in self._pieces:
            self._pieces[used] = self.linear.every_piece(given.values)
            self.held += getattr(self._pieces[used], "nbytes", 0)
        return self._pieces[used](mode)

    def of(self, given: ValueSet, mode: int, free: Constrained) -> StateEquations:
        """The equations of a contact state, of those states that contacts at rest allow."""
        used = tuple(given.values[name] for name in self.linear.parameters)
        key = mode, used, free.spread.tobytes()
        if key not in self._equations:
            piece = self.piece_of(given, mode)
            fastest = self._fastest(given, used) if piece.constant.any() else 0.0
            eigen = half_of(piece.matrix[free.kept] @ free.spread)
            largest = float(np.abs(eigen[0]).max(initial=0.0))
            self._equations[key] = StateEquations(piece, eigen, largest, fastest)
            # at most two copies
            self.held += piece.matrix.nbytes + 2 * sum(one.nbytes for one in eigen)
        return self._equations[key]

    def _fastest(self, given: ValueSet, used: tuple[float, ...]) -> float:
        """Size of the fastest eigenvalue where all gaps have one sign, and no contact is at rest
        [1/s].
        """
        if used not in self._fast:
            every = int(np.sum((1 << np.arange(len(self._holds)))[~self._holds]))
            matrices = [numbers_of(self.piece_of(given, mode).matrix) for mode in (0, every)]
            self._fast[used] = max(float(np.abs(np.linalg.eigvals(one)).max()) for one in matrices)
        return self._fast[used]

    def slowest(self, given: ValueSet) -> float:
        """The slowest decay of a free motion in the contact state in which all states are zero
        [1/s]; 0 or less where one doesn't decay.
        """
        mode = int((given.gaps.constant > 0) @ (1 << np.arange(len(self._holds))))
        key = mode, *(given.values[name] for name in self.linear.parameters)
        if key not in self._slow:
            values = np.linalg.eigvals(numbers_of(self.piece_of(given, mode).matrix))
            self._slow[key] = float(-values.real.max())
        return self._slow[key]

    def are_finite(self, given: ValueSet, mode: int) -> bool:
        """True if the equations of a contact state are made of numbers, whatever formulas say."""
        key = mode, *(given.values[name] for name in self.linear.parameters)
        if key not in self._finite:
            piece = self.piece_of(given, mode)
            parts = piece.matrix, piece.constant, piece.driven
            self._finite[key] = all(bool(np.isfinite(part).all()) for part in parts)
        return self._finite[key] and given.is_finite

    def are_smooth(
        self, one: StateEquations, other: StateEquations, gaps: LinearPiece, g: int
    ) -> bool:
        """True if the rates in two contact states agree where the gap of guard g is zero."""
        key = id(one), id(other), g, gaps.constant[g], gaps.matrix[g].tobytes()
        if key not in self._smooth:
            self._smooth[key] = _is_smooth(one.piece, other.piece, gaps, g)
        return self._smooth[key]


def numbers_of(matrix: np.ndarray) -> np.ndarray:
    """A matrix with zeros where formulas give no numbers."""
    return np.where(np.isfinite(matrix), matrix, 0.0)


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
