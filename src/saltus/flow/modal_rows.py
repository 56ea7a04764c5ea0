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
        """Append a row; returns its number."""
        first = super().add(numbers)
        self._changed.append(first)
        return first

    def put(self, row: int, column: int | slice, numbers: int | np.ndarray) -> None:
        """Change some numbers of a row."""
        self.table[row, column] = numbers
        self._changed.append(row)

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


def runs_of(filled: np.ndarray) -> np.ndarray:
    """Runs in which the rows of bool[rows, places] are true: the first place of one and that behind
    it, then those of a second run behind the widest gap, float64[rows, 4].
    """
    runs = np.zeros((len(filled), 4))
    for run, row in zip(runs, filled, strict=True):
        places = np.flatnonzero(row)
        if len(places):
            apart = np.diff(places)
            cut = int(np.argmax(apart)) + 1 if apart.max(initial=1) > 1 else len(places)
            for part, own in enumerate((places[:cut], places[cut:])):
                run[2 * part : 2 * part + 2] = (own[0], own[-1] + 1) if len(own) else 0
    return runs


def shapes_table(
    scale: np.ndarray, damping: np.ndarray, to_states: np.ndarray, lanes: int, size: int
) -> np.ndarray:
    """The table in place of L where the states are coordinates and their rates, float64[size]:
    see kernels/modal/series.py. Factors of the left vectors complex128[M], damping float64[M], V.
    """
    modes, width = len(scale), to_states.shape[1]
    count = -(-modes // lanes) * lanes
    shapes, factors, rates = (
        np.zeros((count, width), complex),
        np.zeros(width, complex),
        np.zeros(count),
    )
    shapes[:modes], factors[:modes], rates[:modes] = to_states[:modes], scale / 2, damping
    blocks = shapes.reshape(-1, lanes, width // lanes, lanes).transpose(0, 2, 1, 3)
    parts = np.stack([blocks.real, blocks.imag], axis=3)
    flat = np.concatenate([one.ravel() for one in (parts, factors.real, factors.imag, rates)])
    return np.concatenate([flat, np.zeros(size - len(flat))])


def _zeros(shape: tuple[int, int], kind: Any) -> np.ndarray:
    """Zeros that begin where a line of the processor's cache does: else half of the lanes lie in
    two lines each.
    """
    room = np.zeros(shape[0] * shape[1] + LINE, kind)
    first = -room.ctypes.data // room.itemsize % LINE
    return room[first : first + shape[0] * shape[1]].reshape(shape)
