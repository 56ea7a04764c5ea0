"""Linear systems, some of which have no solution."""

from __future__ import annotations

import numpy as np


def solved(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solutions of linear systems [k, d, d] with right sides [k, d], NaN where there is none."""
    try:
        return np.asarray(np.linalg.solve(matrix, right[:, :, None])[:, :, 0])
    except np.linalg.LinAlgError:
        result = np.full(right.shape, np.nan, matrix.dtype)
        for i, (one, vector) in enumerate(zip(matrix, right, strict=True)):
            try:
                result[i] = np.linalg.solve(one, vector)
            except np.linalg.LinAlgError:
                continue
        return result
