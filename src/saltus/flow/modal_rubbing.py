"""Starts of the modal flow at which frictions neither slide forwards nor backwards."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from saltus.flow.modal_tables import Tables
from saltus.flow.modal_values import ValueSet
from saltus.system.linear import LinearPiece
from saltus.system.linear_friction import Sticking
from saltus.system.linear_laws import rows_of


@dataclass(frozen=True)
class Rubbing:
    """A start on boundaries of frictions.

    Parameters
    ----------
    tables : Tables
        The contact states.
    which : int
        Number of the set of parameter values.
    state, drives : float64[N], float64[D]
        The state, and the drives there.
    """

    tables: Tables
    which: int
    state: np.ndarray
    drives: np.ndarray

    def mode(self, mode: int, zero: np.ndarray) -> int:
        """The contact state (bits) of one in which the frictions at zero have no side: those that
        both margins hold stick, the others slide to the side on which they have less. All are
        taken as sticking at first.
        """
        asked = [one for one in self.tables.linear.sticking if zero[one.guard]]
        for one in asked:
            mode |= 1 << one.hold | 1 << one.guard
        for _ in range(2 * len(asked)):
            before = mode
            for one in asked:
                margins = self._of(self.tables.shown(self._given, mode))
                upper, lower = margins[one.hold], -margins[one.second]
                mode &= ~(1 << one.hold | 1 << one.guard)
                holds = upper > 0 and lower > 0
                mode |= int(holds) << one.hold | int(holds or upper < lower) << one.guard
            if mode == before:
                break
        return mode

    def is_unique(self, mode: int, zero: np.ndarray) -> bool:
        """False if both sides of a boundary lead away from it in a contact state."""
        margins = self._of(self.tables.shown(self._given, mode))
        asked = [one for one in self.tables.linear.sticking if zero[one.guard]]
        return not any(margins[one.hold] < 0 < margins[one.second] for one in asked)

    def held(self, mode: int) -> list[Sticking]:
        """The frictions that stick in a contact state."""
        return [one for one in self.tables.linear.sticking if mode >> one.hold & 1]

    def projection(self, mode: int, held: Sequence[Sticking]) -> np.ndarray:
        """The share of a small change of the start that the frictions that stick leave,
        float64[N, N]: they end its sliding at once.
        """
        free = mode & ~sum(1 << one.hold for one in held)
        ways = [
            self._of(self.tables.equations.piece_of(self._given, free | 1 << one.guard))
            - self._of(self.tables.equations.piece_of(self._given, free & ~(1 << one.guard)))
            for one in held
        ]
        normals, along = self._given.gaps.matrix[[one.guard for one in held]], np.array(ways).T
        found: np.ndarray = np.eye(len(self.state)) - along @ np.linalg.solve(
            normals @ along, normals
        )
        return found

    @property
    def _given(self) -> ValueSet:
        return self.tables.sets[self.which]

    def _of(self, piece: LinearPiece) -> np.ndarray:
        """Linear functions of the state and the drives, here."""
        found: np.ndarray = rows_of(piece) @ np.concatenate([self.state, [1.0], self.drives])
        return found
