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


def steady_rows(answers: np.ndarray, gaps: np.ndarray, harmonic: int, width: int) -> np.ndarray:
    """Rows of the table of steady answers, contact state by contact state, float64[k, ..].

    Parameters
    ----------
    answers, gaps : complex128[k, N, ..], complex128[k, R, ..]
        Of the states, and of the gaps; the first ``harmonic`` of them have an imaginary part, but
        for that to the constant.
    harmonic, width : int
        How many; numbers that the states take with those that fill the lanes.
    """
    states, columns = answers.shape[1:]
    terms = [(0, "real")]
    terms += [(d, part) for d in range(1, harmonic) for part in ("real", "imag")]
    terms += [(d, "real") for d in range(harmonic, columns)]
    first, count = width * len(terms), len(terms) * gaps.shape[1]
    rows = np.zeros((len(answers), first + count + -count % LANES))
    for k, (d, part) in enumerate(terms):
        rows[:, width * k : width * k + states] = getattr(answers[:, :, d], part)
        rows[:, first + k : first + count : len(terms)] = getattr(gaps[:, :, d], part)
    return rows


def _zeros(shape: tuple[int, int], kind: Any) -> np.ndarray:
    """Zeros that begin where a line of the processor's cache does: else half of the lanes lie in
    two lines each.
    """
    room = np.zeros(shape[0] * shape[1] + LINE, kind)
    first = -room.ctypes.data // room.itemsize % LINE
    return room[first : first + shape[0] * shape[1]].reshape(shape)
