"""Newton's method from far away, on many small systems of equations at once: steps are shortened
until they help, and zeros that are known already are taken out of the equations.

Damping: the natural monotonicity test of Deuflhard, Newton Methods for Nonlinear Problems (2004),
section 3.3. Deflation: Farrell, Birkisson & Funke, SIAM J. Sci. Comput. 37 (2015) A2026-A2045. The
residual times m(x) = prod (1 + 1/|x - z|^2) over the known zeros z grows without bound at each of
them; its Newton step is the plain one times 1/(1 - d log m), by the formula of Sherman and
Morrison, so that no matrix changes.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from saltus.analysis.solve.newton import Equations
from saltus.analysis.solve.tolerances import AMPLIFIED, CONVERGED, SAME, SINGULAR

#: Known zeros, float64[m, d]; or of zeros that aren't isolated, such as a limit cycle from each of
#: its points on, what gives the nearest of each kind to float64[k, d]: float64[k, m, d].
Known = np.ndarray | Callable[[np.ndarray], np.ndarray]
#: Steps at most, shortened ones included.
MAX_STEPS = 60
#: Longest step, in units of the scale.
LONGEST_STEP = 0.3
#: Share of a step below which it isn't shortened any more.
SHORTEST = 1.0 / 64


def damped_newton(
    equations: Equations,
    start: np.ndarray,
    scale: np.ndarray,
    known: Known | None = None,
    max_steps: int = MAX_STEPS,
) -> tuple[np.ndarray, np.ndarray]:
    """Zeros of k systems of d equations, float64[k, d], and where the iteration converged, bool[k].

    Parameters
    ----------
    equations : callable
        See :data:`saltus.analysis.solve.newton.Equations`.
    start, scale : float64[k, d]
        First guesses, and the unit of each unknown.
    known : Known, optional
        Zeros that must not be found again.
    max_steps : int
        Rows are given up after more steps.
    """
    x, found = np.array(start, float), np.zeros(len(start), bool)
    rows = np.flatnonzero(np.isfinite(x).all(axis=1))
    rows, step, inverse = _steps(equations, x[rows], rows)
    level = np.abs(step).max(axis=1) * _weight(x[rows], scale[rows], known)
    share = np.ones(len(rows))
    for _ in range(max_steps):
        done = np.abs(step).max(axis=1, initial=0.0) < CONVERGED
        x[rows[done]] += step[done] * scale[rows[done]]
        found[rows[done]] = True
        rows, step, inverse, level, share = _kept(~done, rows, step, inverse, level, share)
        if not len(rows):
            break
        full = step * _stretch(x[rows], step, scale[rows], known)[:, None]
        cut = share * np.minimum(1.0, LONGEST_STEP / np.abs(full).max(axis=1, initial=1e-300))
        trial = x[rows] + cut[:, None] * full * scale[rows]
        residual, derivative = equations(trial, rows)
        with np.errstate(all="ignore"):
            simplified = np.einsum("kij,kj->ki", inverse, residual)
            now = np.abs(simplified).max(axis=1) * _weight(trial, scale[rows], known)
            better = now <= (1.0 - 0.25 * cut) * level
        stalled = np.abs(step).max(axis=1) < AMPLIFIED  # rounding, amplified
        found[rows[stalled & ~better]] = True
        share = np.where(better, np.minimum(1.0, 2.0 * share), 0.5 * share)
        x[rows[better]] = trial[better]
        fresh, moved, turned = _newton_steps(residual[better], derivative[better])
        alive = np.zeros(len(rows), bool)
        alive[np.flatnonzero(better)[fresh]] = True
        accepted = np.flatnonzero(better)[fresh]
        step[accepted], inverse[accepted] = moved, turned
        level[accepted] = np.abs(moved).max(axis=1) * _weight(
            x[rows[accepted]], scale[rows[accepted]], known
        )
        stay = alive | (~better & ~stalled & (share >= SHORTEST))
        rows, step, inverse, level, share = _kept(stay, rows, step, inverse, level, share)
    if known is not None:  # a start may have been one of them
        found[found] = (_apart(x[found], scale[found], known)[1] > SAME**2).all(axis=1)
    return x, found


def _kept(stay: np.ndarray, *arrays: np.ndarray) -> tuple[np.ndarray, ...]:
    return tuple(one[stay] for one in arrays)


def _steps(
    equations: Equations, x: np.ndarray, rows: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The rows that have a step, the steps, and the inverses of the derivatives."""
    good, step, inverse = _newton_steps(*equations(x, rows))
    return rows[good], step, inverse


def _newton_steps(
    residual: np.ndarray, derivative: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Which rows have a step, int64[m], their steps float64[m, d] and inverses float64[m, d, d]."""
    good = np.flatnonzero(
        np.isfinite(derivative).all(axis=(1, 2)) & np.isfinite(residual).all(axis=1)
    )
    good = good[np.linalg.cond(derivative[good]) < SINGULAR]
    inverse = np.linalg.inv(derivative[good])
    return good, -np.einsum("kij,kj->ki", inverse, residual[good]), inverse


# -- known zeros -----------------------------------------------------------------------------------
def _apart(x: np.ndarray, scale: np.ndarray, known: Known) -> tuple[np.ndarray, np.ndarray]:
    """Differences float64[k, m, d] to the known zeros, and their mean squares float64[k, m], in
    units of the scale.
    """
    zeros = known(x) if callable(known) else known[None]
    apart = (x[:, None] - zeros) / scale[:, None]
    return apart, np.maximum(np.einsum("kmd,kmd->km", apart, apart) / x.shape[1], 1e-300)


def _weight(x: np.ndarray, scale: np.ndarray, known: Known | None) -> np.ndarray:
    """m(x), float64[k]."""
    if known is None:
        return np.ones(len(x))
    _, square = _apart(x, scale, known)
    return np.asarray(np.exp(np.minimum(np.log1p(1.0 / square).sum(axis=1), 600.0)))


def _stretch(x: np.ndarray, step: np.ndarray, scale: np.ndarray, known: Known | None) -> np.ndarray:
    """What the step of the deflated residual is of the plain one, float64[k]."""
    if known is None:
        return np.ones(len(x))
    apart, square = _apart(x, scale, known)
    along = np.einsum("kmd,kd->km", apart, step) / x.shape[1]
    slope = -(2.0 * along / (square * (square + 1.0))).sum(axis=1)
    with np.errstate(divide="ignore"):
        return np.asarray(np.clip(1.0 / (1.0 - slope), -1e6, 1e6))
