"""Derivatives beside differences of fourth order with two steps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SHIFTS = np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
#: Differences of fourth order, and of second order on either side.
MIDDLE = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / 12.0
SIDES = np.array([[1.0, -4.0, 3.0, 0.0, 0.0], [0.0, 0.0, -3.0, 4.0, -1.0]]) / 2.0
#: Two steps, in the parameter.
STEPS = (3e-5, 4e-6)
#: Part of a derivative, and of the largest of its kind, that it may be off; differences whose own
#: error is larger than the last, in the largest, decide nothing.
ALLOWED, OF_LARGEST, UNDECIDABLE = 1e-6, 1e-7, 1e-3


@dataclass(frozen=True)
class Column:
    """The derivatives of one kind by one parameter: found, by differences, their errors."""

    kind: str
    to: str
    found: np.ndarray
    expected: np.ndarray
    error: np.ndarray
    left_out: np.ndarray | bool = False

    @property
    def largest(self) -> float:
        return float(np.nanmax(np.abs(self.expected), initial=1e-3))

    @property
    def decided(self) -> np.ndarray:
        """Where the differences say something."""
        return np.isfinite(self.expected) & (self.error <= UNDECIDABLE * self.largest)

    @property
    def off(self) -> np.ndarray:
        """How far each is off, in what it may be; NaN where nothing is said."""
        may = 10 * self.error + ALLOWED * np.abs(self.expected) + OF_LARGEST * self.largest
        return np.where(self.decided, np.abs(self.found - self.expected) / may, np.nan)

    @property
    def unknown(self) -> np.ndarray:
        """Where a derivative exists and none is given."""
        return self.decided & ~np.isfinite(self.found) & ~np.asarray(self.left_out)

    @classmethod
    def of(cls, kind, to, found, read, unit, left_out=False) -> Column:
        """Of values ``read`` [2, 5, ...] at parameters moved by each step times SHIFTS times
        ``unit``.
        """
        read = np.asarray(read, float).reshape(2, len(SHIFTS), -1)
        first, second = (
            np.tensordot(MIDDLE, part, 1) / (step * unit)
            for part, step in zip(read, STEPS, strict=True)
        )
        left, right = np.tensordot(SIDES, read[1], 1) / (STEPS[1] * unit)
        error = np.maximum(np.abs(second - first), np.abs(right - left))
        return cls(kind, to, np.ravel(found), second, error, left_out)


def shifts(base: float) -> tuple[np.ndarray, float]:
    """By how much a parameter is moved, float64[10], and its unit."""
    unit = max(abs(base), 0.1)
    return np.concatenate([SHIFTS * step for step in STEPS]) * unit, unit
