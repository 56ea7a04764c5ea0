"""Parts of a work array whose offset the compiler knows, so that it keeps their values in
registers.

A slice checks its ends against the length of the array at run time; after that no compiler can tell
whether two slices overlap, and it reloads every value after every store. The compiled :func:`part`
(codegen/lowering/lane_types.py) checks nothing.
"""

from __future__ import annotations

import numpy as np


def part(work: np.ndarray, start: int, length: int) -> np.ndarray:
    """The ``length`` values of a one-dimensional array of doubles from index ``start`` on, as an
    array that shares its memory.

    Both must lie inside the array: compiled code doesn't check.
    """
    return work[start : start + length]
