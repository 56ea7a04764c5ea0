"""Tables of the modal flow that grow as motions come to new contact states."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np

from saltus.codegen.module import MODAL_LANES as LANES

#: Numbers in a line of a processor's cache.
LINE = 8


class Rows:
    """A table that grows: [rows, width]."""

    def __init__(self, width: int = LANES, kind: type = float) -> None:
        self.used = 0
        self.table: np.ndarray = _zeros((64, width), kind)

    def add(self, numbers: np.ndarray) -> int:
        """Append rows; returns the first."""
        first, rows = self.used, numbers.reshape(-1, self.table.shape[1])
        if first + len(rows) > len(self.table):
            grown = _zeros((2 * (first + len(rows)), self.table.shape[1]), self.table.dtype)
            grown[:first] = self.table[:first]
            self.table = grown
        self.used += len(rows)
        self.table[first : self.used] = rows
        return first


class Links(Rows):
    """A table of whole numbers whose rows change as others are added. Each thread has a copy, which
    doesn't change while a kernel reads it; only what has changed since is copied again.
    """

    def __init__(self, width: int) -> None:
        super().__init__(width, int)
        self._changed: list[int] = []
        self._mine = threading.local()

    def add(self, numbers: np.ndarray) -> int:
        """Append rows; returns the first."""
        first = super().add(numbers)
        self._changed += range(first, self.used)
        return first

    def put(self, rows: np.ndarray, numbers: np.ndarray) -> None:
        """Change rows int64[k] to int64[k, width]."""
        self.table[rows] = numbers
        self.change(rows)

    def change(self, rows: np.ndarray) -> None:
        """Note that rows int64[k] have been changed."""
        self._changed += rows.tolist()

    def copy(self) -> np.ndarray:
        """The copy of this thread, brought up to date."""
        known: tuple[int, np.ndarray] = getattr(self._mine, "known", (0, self.table[:0]))
        since, copy = known
        if len(copy) < self.used:
            copy = self.table.copy()
        else:
            rows = self._changed[since:]
            copy[rows] = self.table[rows]
        self._mine.known = len(self._changed), copy
        return copy


def _zeros(shape: tuple[int, int], kind: Any) -> np.ndarray:
    """Zeros that begin where a line of the processor's cache does: else half of the lanes lie in
    two lines each.
    """
    room = np.zeros(shape[0] * shape[1] + LINE, kind)
    first = -room.ctypes.data // room.itemsize % LINE
    return room[first : first + shape[0] * shape[1]].reshape(shape)
