"""The least misfit between bounds: many starts, from the best of which least squares descend."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from saltus.analysis.fits.unknowns import INSIDE, Unknowns
from saltus.flow.progress import stage
from saltus.interrupt import check_stop

#: Descents go on from this share of the starts.
DESCEND = 0.25
#: Share of the work that comes before them.
SCREENING = 0.1
#: Most steps of a descent, and of one on a beginning of the data.
STEPS, SHORT = 60, 20
#: Share of a descent that is left to show after each of its steps: their number isn't known.
SLOWING = 0.9
#: Minima are in one valley if they differ by this share of the ranges at most, or by this many
#: standard errors.
SAME_SHARE, SAME_ERRORS = 1e-4, 1.0
#: A step ends a descent if it lessens the misfit by so many variances of the noise at most.
NO_GAIN = 1e-4
#: A value that can't be computed counts as so many standard deviations of what was measured.
NOWHERE = 3.0


class Model(Protocol):
    """Predictions of the equations for a measurement, by values of the unknowns [SI]."""

    flows: int
    #: Least step of a descent, in the shares.
    least_step: float

    def beginning(self, count: int) -> Model:
        """Predictions for the first samples."""

    def plain(self, values: np.ndarray) -> np.ndarray:
        """For n sets float64[n, p], float64[n, M, K]."""

    def with_derivatives(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """For one float64[p], float64[M, K], and its derivatives float64[M, K, p]."""


@dataclass(frozen=True)
class Point:
    """A place in the ranges of the unknowns, and how well the equations describe the data there.

    Attributes
    ----------
    shares : float64[p]
    fitted : float64[M, K]
        What the equations say [SI].
    residual : float64[m]
        It less the data, in standard deviations of these.
    slopes : float64[m, p]
        Derivatives of the residual by the shares.
    """

    shares: np.ndarray
    fitted: np.ndarray
    residual: np.ndarray
    slopes: np.ndarray

    @property
    def misfit(self) -> float:
        """Sum of squares of the residual."""
        return float(self.residual @ self.residual)

    @property
    def variance(self) -> float:
        """Variance of the noise that the residual tells, in units of the deviations squared."""
        return self.misfit / max(len(self.residual) - len(self.shares), 1)


def same_place(shares: np.ndarray, minimum: Point, variance: float) -> bool:
    """True if shares lie where a minimum lies, as far as data with noise of that variance tell."""
    apart = shares - minimum.shares
    return bool(
        np.abs(apart).max() <= SAME_SHARE
        or np.sum((minimum.slopes @ apart) ** 2) <= SAME_ERRORS**2 * variance
    )


@dataclass
class MisfitSearch:
    """Search for the least misfit of a model.

    Attributes
    ----------
    model : Model
    unknowns : Unknowns
    data : float64[M, K]
        NaN where a sample is missing.
    deviation : float64[M, K]
        Standard deviations of the data, or numbers in proportion.
    most : int
        Most motions.
    best : Point, optional
        The best place so far.
    minima : list of Point
        Where descents ended, the best first.
    last, ended : Point, optional
        The place computed last, and where the last descent ended.
    spent : bool
        Whether the budget ended the search.
    steps : int
        Most steps of a descent.
    windows : int
        Parts of the history, each with a start of its own, through which the best place was found.
    """

    model: Model
    unknowns: Unknowns
    data: np.ndarray
    deviation: np.ndarray
    most: int
    best: Point | None = None
    minima: list[Point] = field(default_factory=list)
    last: Point | None = None
    ended: Point | None = None
    spent: bool = False
    steps: int = STEPS
    windows: int = 1

    def run(
        self, starts: np.ndarray, show: Callable[[float], None] | None, descend: float = DESCEND
    ) -> None:
        """Descend from the best of some starts, float64[n, p] shares, as far as the budget goes."""
        ranked = self._ranked(starts[: max(self.most - 1, 1)])
        best = ranked[: max(round(descend * len(starts)), 1)]
        for i, start in enumerate(best):
            if not self.spent:
                begin, end = (SCREENING + (1 - SCREENING) * j / len(best) for j in (i, i + 1))
                self.descend(start, stage(show, begin, end))

    def beginning(self, count: int) -> MisfitSearch:
        """The search on the first samples of the data, with what is left of the budget."""
        return MisfitSearch(
            self.model.beginning(count), self.unknowns, self.data[:count], self.deviation[:count],
            self.most - self.model.flows, steps=SHORT,
        )  # fmt: skip

    def take(self, part: MisfitSearch) -> None:
        """Count what was computed on a beginning."""
        self.model.flows += part.model.flows
        self.spent |= part.spent

    def descend(self, start: np.ndarray, show: Callable[[float], None] | None) -> None:
        """Descend from shares float64[p] to a minimum."""
        from scipy.optimize import least_squares

        count = 0

        def residual(shares: np.ndarray) -> np.ndarray:
            nonlocal count
            count += 1
            if show is not None:
                show(1.0 - SLOWING**count)
            return self.at(shares).residual

        def slopes(shares: np.ndarray) -> np.ndarray:
            here = self.at(shares)
            self._check_end(here)
            return here.slopes

        start = np.clip(start, INSIDE, 1.0 - INSIDE)
        try:
            end = least_squares(
                residual, start, slopes, bounds=(0.0, 1.0), max_nfev=self.steps,
                xtol=self.model.least_step,
            )  # fmt: skip
            self.ended = self.at(end.x)
        except _EndedError as end:
            self.ended = end.point
        except _SpentError:
            self.spent = True
            return
        self.minima.append(self.ended)
        self.minima.sort(key=lambda one: one.misfit)

    def at(self, shares: np.ndarray) -> Point:
        """A place; computed once for a residual and its derivatives."""
        known = [one for one in (self.last, self.best) if one is not None]
        for one in known:
            if np.array_equal(one.shares, shares):
                return one
        if self.model.flows >= self.most and self.best is not None:
            raise _SpentError
        check_stop()
        values = self.unknowns.values(shares)
        fitted, slopes = self.model.with_derivatives(values)
        slopes = slopes * self.unknowns.widths(values)
        self.last = self._point(np.array(shares), fitted, slopes)
        if self.best is None or self.last.misfit < self.best.misfit:
            self.best = self.last
        return self.last

    def reweigh(self, deviation: np.ndarray) -> None:
        """Go on with other standard deviations of the data, from the best place."""
        assert self.best is not None
        change = (self.deviation / deviation)[np.isfinite(self.data)]
        self.deviation, self.last = deviation, None
        moved = [
            Point(one.shares, one.fitted, one.residual * change, one.slopes * change[:, None])
            for one in (self.best, *self.minima)
        ]
        self.best, self.minima = moved[0], moved[1:]

    # -- parts -------------------------------------------------------------------------------------
    def _check_end(self, here: Point) -> None:
        """End a descent whose next step, by the linear terms, leads to a minimum that is known, or
        gains nothing that the data could tell.
        """
        step = np.linalg.lstsq(here.slopes, -here.residual)[0]
        there = here.shares + step
        for one in self.minima:
            if same_place(there, one, one.variance):
                raise _EndedError(one)
        gain = here.misfit - np.sum((here.residual + here.slopes @ step) ** 2)
        if gain <= NO_GAIN * here.variance and (there >= 0.0).all() and (there <= 1.0).all():
            raise _EndedError(min(here, self.at(there), key=lambda one: one.misfit))

    def _point(self, shares: np.ndarray, fitted: np.ndarray, slopes: np.ndarray) -> Point:
        there = np.isfinite(self.data)
        residual, known = self._residual(fitted), np.isfinite(slopes).all(axis=-1)
        known &= np.isfinite(fitted)
        slopes = np.where(known[..., None], slopes / self.deviation[..., None], 0.0)
        return Point(shares, fitted, residual[there], slopes[there])

    def _residual(self, fitted: np.ndarray) -> np.ndarray:
        """Residuals, float64[..., M, K]; what can't be computed lies far off."""
        off = NOWHERE * np.nanstd(self.data, axis=0)
        return np.asarray(np.where(np.isfinite(fitted), fitted - self.data, off) / self.deviation)

    def _ranked(self, starts: np.ndarray) -> np.ndarray:
        """The starts, that of the least misfit first."""
        off = self._residual(self.model.plain(self.unknowns.values(starts)))
        misfit = np.nansum(off**2, axis=(1, 2))
        return np.asarray(starts[np.argsort(misfit, kind="stable")])


class _EndedError(Exception):
    """The descent has ended at a place."""

    def __init__(self, point: Point) -> None:
        super().__init__()
        self.point = point


class _SpentError(Exception):
    """The budget is spent."""
