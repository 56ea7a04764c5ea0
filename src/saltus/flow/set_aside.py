"""Series of motions near a boundary on which a law has no Taylor series, such as ``d**1.5`` where a
contact begins.

As in kernels/taylor/singular.py, in NumPy and without the flow's care for its last digits: the flow
knows the states at contacts already. Behind the boundary a series reaches at most as far as the
boundary is away. On it the terms without a series are set aside, for a time in which they change
nothing.
"""

from __future__ import annotations

from types import ModuleType

import numpy as np

from saltus.flow import polynomials
from saltus.kernels.isolation import ROUNDING

#: A series is used for this share of the way to a boundary.
REACH = 0.9
#: Largest relative change of a state by the terms left out.
NEGLIGIBLE = 2.0**-46
#: A gap is nonzero beyond this many rounding errors.
NONZERO_ROUNDINGS = 1024.0
#: Trials for the length over which terms may be left out.
TRIALS = 60


class Boundaries:
    """The boundaries of a series module on which terms have no series, for motions at given nodes.

    Parameters
    ----------
    module : ModuleType
        From :func:`saltus.codegen.plain_series.series_module`.
    state, side, constants, clock : float64[:, n]
        Arguments of its ``jets``: one column for each motion.
    """

    def __init__(
        self,
        module: ModuleType,
        state: np.ndarray,
        side: np.ndarray,
        constants: np.ndarray,
        clock: np.ndarray,
    ):
        self._module, self._state, self._side, self._constants, self._clock = (
            module,
            state,
            side,
            constants,
            clock,
        )

    def jets(self, work: np.ndarray) -> np.ndarray:
        """Fill in all terms; True where some were set aside, bool[n]: those that act near their own
        boundary.
        """
        module, aside = self._module, np.zeros(work.shape[1], bool)
        for _ in range(module.SINGULAR + 1):
            module.jets(self._state, self._side, self._constants, self._clock, work)
            found = np.zeros_like(aside)
            for j in range(module.SINGULAR):
                near = self._near(work, j) & (self._side[module.NGUARDS + j] < 0.0)
                self._side[module.NGUARDS + j, near] = 1.0
                found |= near
            aside |= found
            if not found.any():
                break
        return aside

    def shortened(self, work: np.ndarray, h: np.ndarray, aside: np.ndarray) -> np.ndarray:
        """Shorten lengths float64[n] to those that the terms hold for."""
        module = self._module
        for j in range(module.SINGULAR):
            there = self._acts(work, j) & (self._side[module.NGUARDS + j] < 0.0)
            h = np.where(there, np.minimum(h, REACH * self._way(work, j)), h)
        if aside.any():
            h = h.copy()
            h[aside] = self._negligible(work[:, aside], h[aside], aside)
        return h

    def _gap(self, work: np.ndarray, j: int) -> np.ndarray:
        g = self._module.SINGULAR_GUARD[j]
        gap: np.ndarray = np.maximum(self._side[g] * work[self._module.GAP_ROW + g], 0.0)
        return gap

    def _noise(self, work: np.ndarray, j: int) -> np.ndarray:
        """Gaps that can't be told from zero."""
        scale = work[self._module.SCALE_ROW + self._module.SINGULAR_GUARD[j]]
        noise: np.ndarray = NONZERO_ROUNDINGS * ROUNDING * scale
        return noise

    def _stays(self, work: np.ndarray, j: int, h: np.ndarray) -> np.ndarray:
        """True where a gap changes by no more than rounding in a time h."""
        first = self._module.GUARD_ROW[self._module.SINGULAR_GUARD[j]]
        changes = work[first + 1 : first + _terms(self._module)]
        powers = h ** np.arange(1, _terms(self._module))[:, None]
        stays: np.ndarray = (np.abs(changes) * powers).sum(axis=0) <= self._noise(work, j)
        return stays

    def _way(self, work: np.ndarray, j: int) -> np.ndarray:
        """Time in which the quadratic part of a gap changes by the gap itself."""
        first, gap = self._module.GUARD_ROW[self._module.SINGULAR_GUARD[j]], self._gap(work, j)
        rate, bend = np.abs(work[first + 1]), np.abs(work[first + 2])
        return np.where(
            gap > 0.0, 2.0 * gap / (rate + np.sqrt(rate * rate + 4.0 * bend * gap)), 0.0
        )

    def _forces(self, work: np.ndarray, j: int) -> np.ndarray:
        """Contribution of the terms of a boundary to the rates of the states."""
        module = self._module
        first = module.CALM_ROW + j * module.NMOVED
        forces: np.ndarray = np.abs(
            work[1 : module.NMOVED * _terms(module) : _terms(module)]
            - work[first : first + module.NMOVED]
        )
        return forces

    def _acts(self, work: np.ndarray, j: int) -> np.ndarray:
        acts: np.ndarray = np.any(~(self._forces(work, j) <= 0.0), axis=0)
        return acts

    def _near(self, work: np.ndarray, j: int) -> np.ndarray:
        """True where a motion is on the boundary of an acting term, up to rounding, or so near that
        the term changes nothing until it is reached.
        """
        module, count = self._module, _terms(self._module)
        nonzero = self._gap(work, j) > self._noise(work, j)
        size = np.abs(self._state[: module.NMOVED])
        weak = np.all(
            self._way(work, j) * self._forces(work, j) <= 0.25 * NEGLIGIBLE * size, axis=0
        )
        finite = np.all(np.isfinite(work[: module.NSTATES * count]), axis=0)
        near: np.ndarray = (self._acts(work, j) & weak) | ~(nonzero & finite)
        return near

    def _negligible(self, work: np.ndarray, h: np.ndarray, which: np.ndarray) -> np.ndarray:
        """Lengths over which the terms set aside change no state by more than NEGLIGIBLE, estimated
        in the middle of the step. Those of a boundary on which the motion stays are zero.
        """
        module, count = self._module, _terms(self._module)
        # [terms, states, n]
        series = np.stack(
            [work[i * count : (i + 1) * count] for i in range(module.NSTATES)], axis=1
        )
        rates = polynomials.derivative(series)
        side, constants, clock = (
            self._side[:, which].copy(),
            self._constants[:, which],
            self._clock[:, which].copy(),
        )
        phase, there = clock[module.TAU].copy(), np.zeros_like(work)
        for _ in range(TRIALS):
            for j in range(module.SINGULAR):
                stays = (self._side[module.NGUARDS + j, which] > 0.0) & self._stays(work, j, h)
                side[module.NGUARDS + j] = np.where(stays, 1.0, -1.0)
            clock[module.TAU] = phase + 0.5 * h
            module.jets(polynomials.value(series, 0.5 * h), side, constants, clock, there)
            defect = np.abs(
                there[1 : module.NSTATES * count : count] - polynomials.value(rates, 0.5 * h)
            )
            size = np.where(defect == 0.0, 1.0, np.abs(series[0]) + h * np.abs(series[1]))
            change = (defect * h / size).max(axis=0) / NEGLIGIBLE
            fits = change <= 1.0
            if fits.all():
                break
            h = np.where(
                fits, h, h * np.clip(np.nan_to_num(0.5 * change**-0.4, nan=0.1), 1e-3, 0.5)
            )
        return h


def _terms(module: ModuleType) -> int:
    terms: int = module.ORDER + 1
    return terms
