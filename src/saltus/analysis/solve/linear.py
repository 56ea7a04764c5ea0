"""Linear systems, some of which have no solution."""

from __future__ import annotations

import numpy as np


def solved(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solutions of linear systems [k, d, d] with right sides [k, d], NaN where there is none."""
    return solutions(matrix, right[:, :, None])[:, :, 0]


def solutions(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Likewise with c right sides each, [k, d, c]."""
    try:
        return np.asarray(np.linalg.solve(matrix, right))
    except np.linalg.LinAlgError:
        result = np.full(right.shape, np.nan, np.result_type(matrix, right))
        for i, (one, sides) in enumerate(zip(matrix, right, strict=True)):
            try:
                result[i] = np.linalg.solve(one, sides)
            except np.linalg.LinAlgError:
                continue
        return result


def moves(by_unknowns: np.ndarray, by_parameters: np.ndarray) -> np.ndarray:
    """Derivatives of zeros z of equations F(z, p) = 0 with respect to parameters, by the implicit
    function theorem: dz/dp = -(dF/dz)^-1 dF/dp.

    Parameters
    ----------
    by_unknowns : float64[k, d, d]
        dF/dz of k zeros.
    by_parameters : float64[k, d, c]
        dF/dp.

    Returns
    -------
    float64[k, d, c]
        NaN where a derivative isn't finite, and where there is no such move, as at a fold.
    """
    result = np.full(by_parameters.shape, np.nan)
    good = np.isfinite(by_unknowns).all(axis=(1, 2)) & np.isfinite(by_parameters).all(axis=(1, 2))
    result[good] = -solutions(by_unknowns[good], by_parameters[good])
    return result
