"""Newton's method on many small systems of equations at once: fixed points of maps, limit cycles,
equilibria, points of curves.

Damping, from far away: steps are shortened until they help, by the natural monotonicity test of
Deuflhard, Newton Methods for Nonlinear Problems (2004), section 3.3.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.analysis.solve.deflation import Known, is_new, stretch, weight
from saltus.analysis.solve.linear import solved
from saltus.analysis.solve.tolerances import (
    AMPLIFIED,
    CONVERGED,
    FORESEEN,
    LONGEST_DAMPED,
    MAX_DAMPED_STEPS,
    MAX_NEWTON_STEPS,
    RANK,
    SHORTEST_SHARE,
    SINGULAR,
    SLOW,
)

#: A step so short beside the unknowns is rounding.
ROUNDED = 4 * np.finfo(float).eps
#: Residuals float64[m, e] and derivatives float64[m, e, d] of the rows int64[m], at float64[m, d];
#: all in units of the scale.
Equations = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Zeros:
    """Zeros of k systems of e equations in d unknowns.

    Attributes
    ----------
    z : float64[k, d]
        The zeros.
    found : bool[k]
        Where the iteration converged.
    derivative : float64[k, e, d]
        Of the equations in units of the scale, at the last evaluation: before a last step.
    evaluations : int64[k]
        How many there were, one that was foreseen included.
    contraction : float64[k]
        The second step, in first ones.
    """

    z: np.ndarray
    found: np.ndarray
    derivative: np.ndarray
    evaluations: np.ndarray
    contraction: np.ndarray


def newton(
    equations: Equations,
    start: np.ndarray,
    scale: np.ndarray,
    *,
    planes: np.ndarray | None = None,
    enough: np.ndarray | float = CONVERGED,
    foresee: bool = False,
    longest_step: float = 1.0,
    farthest: np.ndarray | float = np.inf,
    max_steps: int | None = None,
    max_slow: float = np.inf,
    least_squares: bool = False,
    damped: bool = False,
    known: Known | None = None,
) -> Zeros:
    """Solve k systems of d equations.

    A row is done where its step is short enough, or one that rounding amplifies gets no shorter.

    Parameters
    ----------
    equations : callable
        See :data:`Equations`.
    start, scale : float64[k, d]
        First guesses, and the unit of each unknown.
    planes : float64[k, d], optional
        Of one equation less: zeros in the planes through the starts across these, in units of the
        scale. There a residual so small as ``enough`` is the last one: no step is taken from it,
        and the derivative is that at the zero.
    enough : float or float64[k]
        A step so short is the last one.
    foresee : bool
        So is one behind which quadratic convergence foresees nothing but rounding: the derivative
        is farther from the zero then.
    longest_step : float
        Rows are given up after a longer step; damped ones are shortened in place of it.
    farthest : float or float64[k]
        Rows are given up farther from their start.
    max_steps, max_slow : int
        Rows are given up after more steps, or more slow ones.
    least_squares : bool
        Of more equations than unknowns, or of zeros that aren't isolated: each step is the shortest
        of those that fit best. Rows of the derivative should be of one size.
    damped : bool
        Steps are shortened until they help.
    known : Known, optional
        Zeros that must not be found again.
    """
    work = _Iteration(start, scale, least_squares, known, planes is not None)
    enough, farthest = (np.full(len(start), one) for one in (enough, farthest))
    slow, rows = np.zeros(len(start), np.int64), np.isfinite(start).all(axis=1).nonzero()[0]
    for _ in range(max_steps or (MAX_DAMPED_STEPS if damped else MAX_NEWTON_STEPS)):
        if not len(rows):
            break
        at = work.at(rows)
        residual, derivative = equations(work.trial[rows], rows)
        work.count += 1
        work.evaluations[at] = work.count
        retried = rows[:0]
        if damped:
            helps = work.helps(rows, residual)
            retried = rows[~helps & (work.share[rows] >= SHORTEST_SHARE)]
            rows, residual, derivative = rows[helps], residual[helps], derivative[helps]
        if planes is not None:
            residual, derivative = _bordered(residual, derivative, planes[at])
            closed = np.abs(residual).max(axis=1) < enough[at]
            if closed.any():  # a zero is one where the derivative is singular too
                work.settle(rows[closed], derivative[closed])
                rows, residual, derivative = rows[~closed], residual[~closed], derivative[~closed]
                if not len(rows):
                    break
        rows = work.step(rows, residual, derivative)
        at = work.at(rows)
        done = work.done(rows, enough[at], foresee)
        goes = ~done
        if not damped:
            goes &= work.length[at] < longest_step
        if max_slow < np.inf:
            slow[at] += work.length[at] > SLOW * work.before[at]
            goes &= slow[at] <= max_slow
        away = np.abs((work.trial[at] - start[at]) / work.scale[at])
        goes &= away.max(axis=1) <= farthest[at]
        rows = rows[goes]
        rows = np.sort(np.append(rows, retried)) if damped else rows
        work.ahead(rows, damped)
    return work.zeros()


def _bordered(
    residual: np.ndarray, derivative: np.ndarray, planes: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The equations with those of the planes, in which every point of the iteration lies."""
    right, whole = np.zeros(planes.shape), np.empty((*planes.shape, planes.shape[1]))
    right[:, :-1], whole[:, :-1], whole[:, -1] = residual, derivative, planes
    return right, whole


class _Iteration:
    """The states of k iterations: where each is, its Newton step from there in units of the scale,
    and where it looks next.
    """

    def __init__(
        self,
        start: np.ndarray,
        scale: np.ndarray,
        least_squares: bool,
        known: Known | None,
        in_planes: bool,
    ) -> None:
        k, width = start.shape
        self.scale, self.known = scale, known
        self.least_squares, self.in_planes = least_squares, in_planes
        self.x, self.trial = np.array(start, float), np.array(start, float)
        self.newton_step = np.zeros(start.shape)
        self.derivative = np.full((k, width, width), np.nan)
        self.length, self.before = np.full((2, k), np.inf)
        self.share, self.cut = np.ones((2, k))
        self.found, self.evaluations = np.zeros(k, bool), np.zeros(k, np.int64)
        self.count = 0  # of the evaluations of rows that aren't done
        self.contraction = np.zeros(k)

    def at(self, rows: np.ndarray) -> Any:
        """An index of some rows int64[r], ascending: all are a slice, which is quicker."""
        return slice(None) if len(rows) == len(self.x) else rows

    def helps(self, rows: np.ndarray, residual: np.ndarray) -> np.ndarray:
        """True where the step to the trial shortens the next one, or is too short to tell, bool[r];
        elsewhere its share is halved.
        """
        better = (self.evaluations[rows] == 1) | (self.length[rows] < AMPLIFIED)
        told, some = ~better, rows[~better]
        if len(some):
            with np.errstate(all="ignore"):
                simplified = self._solved(self.derivative[some], residual[told])
                now, before = (
                    length * weight(x, self.scale[some], self.known)
                    for length, x in (
                        (np.abs(simplified).max(axis=1), self.trial[some]),
                        (self.length[some], self.x[some]),
                    )
                )
                better[told] = now <= (1.0 - 0.25 * self.cut[some]) * before
        share = self.share[rows]
        self.share[rows] = np.where(better, np.minimum(1.0, 2.0 * share), 0.5 * share)
        return np.asarray(better)

    def settle(self, rows: np.ndarray, derivative: np.ndarray) -> None:
        """End at the trials."""
        self.x[rows], self.found[rows] = self.trial[rows], True
        self._keep(rows, derivative)

    def _keep(self, rows: np.ndarray, derivative: np.ndarray) -> None:
        if len(rows) == len(self.x):
            self.derivative = derivative.copy()
            return
        if self.derivative.shape[1] != derivative.shape[1]:
            self.derivative = np.full((len(self.x), *derivative.shape[1:]), np.nan)
        self.derivative[rows] = derivative

    def step(self, rows: np.ndarray, residual: np.ndarray, derivative: np.ndarray) -> np.ndarray:
        """Go to the trials, where the next steps are known; the rows that have one, int64[r]."""
        good = np.isfinite(derivative).all(axis=(1, 2)) & np.isfinite(residual).all(axis=1)
        if not (self.least_squares or self.in_planes):
            sizes = np.linalg.svd(derivative[good], compute_uv=False)
            good[good] = sizes[:, 0] < SINGULAR * sizes[:, -1]
        if not good.all():
            rows, residual, derivative = rows[good], residual[good], derivative[good]
        self._keep(rows, derivative)
        at = self.at(rows)
        step = -self._solved(derivative, residual)
        self.x[at] = self.trial[at]
        self.newton_step[at], self.before[at] = step, self.length[at]
        self.length[at] = np.abs(step).max(axis=1)
        self.trial[at] += step * self.scale[at]
        if self.count == 2:
            self.contraction[at] = self.length[at] / np.maximum(self.before[at], AMPLIFIED)
        return rows

    def _solved(self, matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
        if self.least_squares:
            return np.asarray((np.linalg.pinv(matrix, RANK) @ right[:, :, None])[:, :, 0])
        return solved(matrix, right)

    def done(self, rows: np.ndarray, enough: np.ndarray, foresee: bool) -> np.ndarray:
        """True where the step is the last one, bool[r]: it is taken, but in planes, where the zeros
        stay where the derivatives are known.
        """
        at = self.at(rows)
        length, before, taken = self.length[at], self.before[at], np.zeros(len(rows), bool)
        done = taken if self.count == 1 else (length < AMPLIFIED) & (length > 0.5 * before)
        if not self.in_planes:
            step = np.abs(self.newton_step[at] * self.scale[at])
            rounding = np.all(step <= ROUNDED * np.abs(self.trial[at]), axis=1)
            taken = done = done | (length < enough) | rounding
        if foresee and self.count > 1:
            sure = ~done & (length * (length / before) ** 2 < FORESEEN)
            self.evaluations[at] += sure
            done, taken = done | sure, taken | sure
        if done.any():
            self.x[rows[taken]], self.found[rows[done]] = self.trial[rows[taken]], True
        return np.asarray(done)

    def ahead(self, rows: np.ndarray, damped: bool) -> None:
        """Set the next trials: deflated steps, shortened where damped."""
        if self.known is None and not damped:
            return
        x, scale, step = self.x[rows], self.scale[rows], self.newton_step[rows]
        step = step * stretch(x, step, scale, self.known)[:, None]
        if damped:
            longest = np.minimum(1.0, LONGEST_DAMPED / np.abs(step).max(axis=1, initial=1e-300))
            self.cut[rows] = self.share[rows] * longest
            step = step * self.cut[rows, None]
        self.trial[rows] = x + step * scale

    def zeros(self) -> Zeros:
        """Return the zeros; known ones don't count as found."""
        found, derivative = self.found, self.derivative
        if self.known is not None:
            found[found] = is_new(self.x[found], self.scale[found], self.known)
        derivative = derivative[:, :-1] if self.in_planes else derivative
        return Zeros(self.x, found, derivative, self.evaluations, self.contraction)


def leading_first(matrices: np.ndarray) -> np.ndarray:
    """Eigenvalues complex128[k, d] of float64[k, d, d], the largest first and of a pair the upper
    one; NaN where a matrix isn't finite.
    """
    finite = np.isfinite(matrices).all(axis=(1, 2))
    values = np.full(matrices.shape[:2], np.nan + 0j)
    values[finite] = np.linalg.eigvals(matrices[finite])
    order = np.lexsort((-values.imag, -np.round(np.abs(values), 12)), axis=1)
    return np.take_along_axis(values, order, axis=1)
