"""Multiple shooting: a history that is too sensitive to be followed from its start is fitted
through windows, each of which has a start of its own near the end of the one before.

Bock, in Modelling of Chemical Reaction Systems (1981) 102-125. The first guess of the starts is
that of an iterated extended Kalman filter: Jazwinski, Stochastic Processes and Filtering Theory
(1970), section 8.3.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from saltus.analysis.fits.motion import Motions
from saltus.analysis.fits.search import MisfitSearch, Point
from saltus.analysis.fits.unknowns import INSIDE, Unknowns
from saltus.announce import working
from saltus.interrupt import check_stop

#: Factor by which changes of the start may grow in a window, relative to the sizes of the states.
GROWTH = 10.0
#: Distance at which a window's start may lie from the end of the one before, in the states' sizes.
JOINED = 1e-6
#: Most windows, and passes through them; steps of the filter in a window.
MOST, PASSES, FILTER = 400, 30, 4
#: A pass that gains less of the misfit than this is the last.
SETTLED = 1e-6
#: Share of the work that divides the history, and of what is left that a pass leaves to show.
MARCH, SLOWING = 0.5, 0.7


@dataclass(frozen=True)
class Flown:
    """A window that was flown: n measured numbers, D states, p unknowns.

    Attributes
    ----------
    fitted : float64[M, K]
    residual : float64[n]
        In standard deviations of the noise.
    slopes : float64[n, p + D]
        Its derivatives by the shares of the unknowns and the start.
    states : float64[M, D]
    moved : float64[M, D, p + D]
        Their derivatives.
    """

    fitted: np.ndarray
    residual: np.ndarray
    slopes: np.ndarray
    states: np.ndarray
    moved: np.ndarray


class Windows:
    """The windows of a history.

    Parameters
    ----------
    search : MisfitSearch
        Of a model that is :class:`Motions`; its deviations are those of the noise.
    show : callable, optional
        Called with the share done.

    Attributes
    ----------
    known : tuple, optional
        Shares, starts and windows as flown, of the best pass so far.
    doing : str
        What is done now.
    """

    def __init__(self, search: MisfitSearch, show: Callable[[float], None] | None = None) -> None:
        model = search.model
        assert isinstance(model, Motions)
        self.search, self.unknowns, self._given = search, search.unknowns, model
        system, names = model.system, search.unknowns.names
        starts = [f"{name}(0)" for name in system.states]
        self.size, self.wide = len(starts), len(names)
        self._free = [(starts.index(name), i) for i, name in enumerate(names) if name in starts]
        self._places = [i for i, name in enumerate(names) if name in system.values]
        own, zeros = (*(names[i] for i in self._places), *starts), np.zeros(0)
        self._model = replace(
            model,
            unknowns=Unknowns(own, ("",) * len(own), zeros, zeros, zeros),
            measured=replace(
                model.measured,
                columns=np.concatenate([np.arange(self.size), model.measured.columns]),
            ),
        )
        self.known: tuple[np.ndarray, np.ndarray, list[Flown]] | None = None
        self.doing, self._show = "dividing the history into windows", show
        self.begins: list[int] = []
        self.scale = np.ones(self.size)

    def first(self, shares: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Start of the motion float64[D], and its derivatives by the shares float64[D, p]."""
        values = self.unknowns.values(shares)
        widths = self.unknowns.widths(values)
        start, by = self._given.start.copy(), np.zeros((self.size, self.wide))
        for place, i in self._free:
            start[place], by[place, i] = values[i], widths[i]
        return start, by

    def fly(self, shares: np.ndarray, start: np.ndarray, begin: int, end: int) -> Flown:
        """The motion through the samples ``begin`` to ``end``, from the time of the sample before
        the first one.
        """
        check_stop()
        search, whole, model = self.search, self._model.measured, copy.copy(self._model)
        model.measured = replace(whole, at=whole.at[begin:end], values=whole.values[begin:end])
        if begin:
            model.t_start = float(whole.at[begin - 1])
        values = self.unknowns.values(shares)
        seen, by = model.with_derivatives(np.concatenate([values[self._places], start]))
        places, size = self._places, self.size
        full = np.zeros((*seen.shape, self.wide + size))
        full[..., places] = by[..., : len(places)] * self.unknowns.widths(values)[places]
        full[..., self.wide :] = by[..., len(places) :]
        data, noise = search.data[begin:end], search.deviation[begin:end]
        there, off = np.isfinite(data), (seen[:, size:] - data) / noise
        slopes = full[:, size:] / noise[..., None]
        return Flown(seen[:, size:], off[there], slopes[there], seen[:, :size], full[:, :size])

    def march(self, here: Point) -> np.ndarray:
        """Divide the history, and guess the starts of the windows, float64[w, D]: those of the
        motion up to the end of a beginning that is known, then those of the filter.
        """
        shares, known, whole = here.shares, len(here.fitted), len(self.search.data)
        start, by = self.first(shares)
        trip = self.fly(shares, start, 0, known)
        self.scale = np.abs(trip.states).max(axis=0) + np.finfo(float).tiny
        spread = np.linalg.pinv(here.slopes.T @ here.slopes) * here.variance
        turn = np.concatenate([np.eye(self.wide), by])
        spread, begin, look = turn @ spread @ turn.T, 0, known
        starts: list[np.ndarray] = []
        while begin < whole:
            if len(starts) == MOST:
                raise _TooManyWindowsError
            trip = self.fly(shares, start, begin, min(begin + look, whole))
            length = self._length(trip)
            if begin < known:
                length = min(length, known - begin)
                off = np.zeros(self.wide + self.size)
            else:
                base = np.concatenate([shares, start])
                off, spread, trip = self._filtered(base, spread, begin, begin + length)
            shares = np.clip(shares + off[: self.wide], INSIDE, 1.0 - INSIDE)
            starts.append(start + off[self.wide :])
            self.begins.append(begin)
            moved = trip.moved[length - 1]
            start = trip.states[length - 1]
            turn = np.concatenate([np.eye(self.wide, self.wide + self.size), moved])
            spread = turn @ spread @ turn.T
            spread[self.wide :, self.wide :] += np.diag((JOINED * self.scale) ** 2)
            begin, look = begin + length, 2 * length
            self._tell(MARCH * begin / whole)
        self.shares = shares
        return np.stack([self.first(shares)[0], *starts[1:]])

    def _length(self, trip: Flown) -> int:
        """Samples through which changes of the start don't grow too much."""
        by = trip.moved[..., self.wide :] * self.scale / self.scale[:, None]
        grown = ~(np.linalg.norm(by, 2, axis=(1, 2)) <= GROWTH)
        return max(int(np.argmax(grown)), 1) if grown.any() else len(grown)

    def _filtered(
        self, base: np.ndarray, spread: np.ndarray, begin: int, end: int
    ) -> tuple[np.ndarray, np.ndarray, Flown]:
        """Change of unknowns and start that a window's data tell beside what is known before, its
        covariance, and the window flown with it.
        """
        off, after = np.zeros(len(base)), spread
        for last in (*[False] * FILTER, True):
            shares = np.clip((base + off)[: self.wide], INSIDE, 1.0 - INSIDE)
            trip = self.fly(shares, (base + off)[self.wide :], begin, end)
            if last:
                break
            turned, slopes = np.linalg.qr(trip.slopes)
            said = turned.T @ trip.residual
            gain = np.linalg.solve(
                slopes @ spread @ slopes.T + np.eye(len(slopes)), slopes @ spread
            ).T
            off, kept = gain @ (slopes @ off - said), np.eye(len(off)) - gain @ slopes
            after = kept @ spread @ kept.T + gain @ gain.T  # Joseph's form: no variance below zero
        return off, after, trip

    def _tell(self, share: float) -> None:
        """Report the share done."""
        if self._show is not None:
            self._show(share)

    def _keep(self, count: int, misfit: float, *found: Any) -> None:
        """Keep the best pass so far, number ``count``."""
        self.known, size = found, np.isfinite(self.search.data).sum()
        self.doing = (
            f"fitting through {len(self.begins)} windows: pass {count} of {PASSES} at most, "
            f"residuals {np.sqrt(misfit / size):.3g} times the noise"
        )

    def passed(self, shares: np.ndarray, starts: np.ndarray) -> list[Flown]:
        """All windows."""
        self._given.flows += 1
        ends = [*self.begins[1:], len(self.search.data)]
        return [
            self.fly(shares, start, begin, end)
            for start, begin, end in zip(starts, self.begins, ends, strict=True)
        ]

    def equations(
        self, shares: np.ndarray, starts: np.ndarray, flown: list[Flown]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Linear terms of data and joints, float64[r, p + (w - 1) D] and float64[r]. What a
        window's data say is turned into one row more than it has unknowns.
        """
        wide, size, count = self.wide, self.size, len(flown)
        by, joint = self.first(shares)[1], JOINED * self.scale
        rows: list[np.ndarray] = []
        right: list[np.ndarray] = []
        for k, one in enumerate(flown):
            both = np.column_stack([one.slopes, one.residual])
            own = np.asarray(np.linalg.qr(both, mode="r"))
            parts = [(own[:, :-1], own[:, -1])]
            if k + 1 < count:
                gap = (one.states[-1] - starts[k + 1]) / joint
                parts.append((one.moved[-1] / joint[:, None], gap))
            for matrix, value in parts:
                row = np.zeros((len(matrix), wide + count * size))
                row[:, :wide] = matrix[:, :wide]
                row[:, wide + k * size : wide + (k + 1) * size] = matrix[:, wide:] * self.scale
                rows.append(row)
                right.append(value)
            if k + 1 < count:
                row[:, wide + (k + 1) * size : wide + (k + 2) * size] = -np.eye(size) / JOINED
        whole = np.concatenate(rows)
        first = whole[:, wide : wide + size] @ (by / self.scale[:, None])
        whole[:, :wide] += first
        return np.delete(whole, np.s_[wide : wide + size], axis=1), np.concatenate(right)

    def solve(self, starts: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[Flown]]:
        """Gauss-Newton steps of unknowns and starts, halved where they don't gain."""
        shares, flown = self.shares, self.passed(self.shares, starts)
        matrix, right = self.equations(shares, starts, flown)
        step = np.linalg.lstsq(matrix, -right)[0]
        for count in range(1, PASSES + 1):
            self._keep(count, right @ right, shares, starts, flown)
            self._tell(1.0 - (1.0 - MARCH) * SLOWING**count)
            there = np.clip(shares + step[: self.wide], INSIDE, 1.0 - INSIDE)
            steps = step[self.wide :].reshape(-1, self.size) * self.scale
            moved = np.stack([self.first(there)[0], *(starts[1:] + steps)])
            trial = self.passed(there, moved)
            matrix, after = self.equations(there, moved, trial)
            gain = right @ right - after @ after
            if not gain > 0:
                step = 0.5 * step
                continue
            shares, starts, flown, right = there, moved, trial, after
            if gain <= SETTLED * (right @ right):
                break
            step = np.linalg.lstsq(matrix, -right)[0]
        return shares, starts, flown

    def point(self, shares: np.ndarray, starts: np.ndarray, flown: list[Flown]) -> Point:
        """The place, with derivatives of the residuals along which the starts of the windows
        follow the unknowns.
        """
        matrix, _ = self.equations(shares, starts, flown)
        along = np.linalg.lstsq(matrix[:, self.wide :], -matrix[:, : self.wide])[0]
        along = along.reshape(-1, self.size, self.wide) * self.scale[:, None]
        each = (self.first(shares)[1], *along)
        slopes = [
            one.slopes[:, : self.wide] + one.slopes[:, self.wide :] @ by
            for one, by in zip(flown, each, strict=True)
        ]
        fitted = np.concatenate([one.fitted for one in flown])
        residual = np.concatenate([one.residual for one in flown])
        return Point(shares, fitted, residual, np.concatenate(slopes))


def shoot(
    search: MisfitSearch, here: Point, count: int, show: Callable[[float], None] | None = None
) -> bool:
    """Fit the whole history through windows, from the minimum ``here`` on a beginning, to which
    ``count`` descents led; True if it describes the data better than the best place so far, which
    it is then. On Ctrl-C that of the best pass is.
    """
    if "t_start" in search.unknowns.names or search.best is None:  # times aren't known
        return False
    left = here.fitted - search.data[: len(here.fitted)]
    search.reweigh(np.tile(np.nanstd(left, axis=0), (len(search.data), 1)))
    windows = Windows(search, show)
    try:
        with working(lambda: windows.doing):
            found = windows.solve(windows.march(here))
    except (_TooManyWindowsError, np.linalg.LinAlgError):
        return False
    except KeyboardInterrupt:
        if windows.known is not None:
            _take(search, windows, windows.known, count)
        raise
    return _take(search, windows, found, count)


def _take(
    search: MisfitSearch, windows: Windows, found: tuple[np.ndarray, np.ndarray, list[Flown]],
    count: int,
) -> bool:  # fmt: skip
    """Make a pass the best place so far, to which ``count`` descents led; False if it isn't."""
    assert search.best is not None
    best = windows.point(*found)
    if best.misfit >= search.best.misfit:
        return False
    search.best, search.windows = best, len(windows.begins)
    search.minima = [best] * count
    return True


class _TooManyWindowsError(Exception):
    """There are more windows than are computed."""
