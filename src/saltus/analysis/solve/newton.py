"""Newton's method on many small systems of equations at once: fixed points of maps, limit cycles,
equilibria.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from saltus.analysis.solve.tolerances import (
    AMPLIFIED,
    CONVERGED,
    MAX_NEWTON_STEPS,
    RANK,
    SINGULAR,
    SLOW,
)

#: Residuals float64[m, d] and derivatives float64[m, d, d] of the rows int64[m], at float64[m, d];
#: all in units of the scale.
Equations = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


def newton(
    equations: Equations,
    start: np.ndarray,
    scale: np.ndarray,
    enough: np.ndarray | float = CONVERGED,
    longest_step: float = 1.0,
    farthest: float = np.inf,
    max_slow: int = MAX_NEWTON_STEPS,
    least_squares: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Zeros of k systems of d equations, float64[k, d], and where the iteration converged, bool[k].

    Parameters
    ----------
    equations : callable
        See :data:`Equations`.
    start, scale : float64[k, d]
        First guesses, and the unit of each unknown.
    enough : float or float64[k]
        A step so short is the last one.
    longest_step, farthest : float
        Rows are given up after a longer step, or farther from their start.
    max_slow : int
        Rows are given up after more slow steps.
    least_squares : bool
        Of more equations than unknowns, or of zeros that aren't isolated: each step is the shortest
        of those that fit best. Rows of the derivative should be of one size.
    """
    x, found, rows = (
        np.array(start, float),
        np.zeros(len(start), bool),
        np.flatnonzero(np.isfinite(start).all(axis=1)),
    )
    before, slow, enough = (
        np.full(len(start), np.inf),
        np.zeros(len(start), np.int64),
        np.broadcast_to(enough, len(start)),
    )
    for _ in range(MAX_NEWTON_STEPS):
        if not len(rows):
            break
        residual, derivative = equations(x[rows], rows)
        good = np.flatnonzero(
            np.isfinite(derivative).all(axis=(1, 2)) & np.isfinite(residual).all(axis=1)
        )
        if not least_squares:
            good = good[np.linalg.cond(derivative[good]) < SINGULAR]
        rows, residual, derivative = rows[good], residual[good], derivative[good]
        if least_squares:
            step = -(np.linalg.pinv(derivative, RANK) @ residual[:, :, None])[:, :, 0]
        else:
            step = -np.linalg.solve(derivative, residual[:, :, None])[:, :, 0]
        x[rows] += step * scale[rows]
        length = np.abs(step).max(axis=1)
        rounding = np.all(
            np.abs(step * scale[rows]) <= 4 * np.finfo(float).eps * np.abs(x[rows]), axis=1
        )
        done = (
            (length < enough[rows])
            | ((length < AMPLIFIED) & (length > 0.5 * before[rows]))
            | rounding
        )
        found[rows[done]] = True
        slow[rows] += length > SLOW * before[rows]
        before[rows] = length
        near = np.abs((x[rows] - start[rows]) / scale[rows]).max(axis=1) < farthest
        rows = rows[~done & near & (length < longest_step) & (slow[rows] <= max_slow)]
    return x, found


def leading_first(matrices: np.ndarray) -> np.ndarray:
    """Eigenvalues complex128[k, d] of float64[k, d, d], the largest first and of a pair the upper
    one; NaN where a matrix isn't finite.
    """
    finite = np.isfinite(matrices).all(axis=(1, 2))
    values = np.full(matrices.shape[:2], np.nan + 0j)
    values[finite] = np.linalg.eigvals(matrices[finite])
    order = np.lexsort((-values.imag, -np.round(np.abs(values), 12)), axis=1)
    return np.take_along_axis(values, order, axis=1)
