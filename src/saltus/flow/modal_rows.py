"""Parts of the tables of the modal flow: rows that grow as motions come to new contact states, and
sets of parameter values.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from saltus.codegen.module import MODAL_LANES as LANES
from saltus.system.courses import Course
from saltus.system.linear import LinearPiece
from saltus.system.linear_laws import Impacts


class Rows:
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
class ValueSet:
    """Gaps and drives for one set of parameter values, in any contact state."""

    values: dict[str, float]
    gaps: LinearPiece
    rates: np.ndarray
    lags: np.ndarray
    courses: tuple[Course, ...]
    impacts: Impacts
