"""Why a branch ends between two values of a parameter: the bifurcation, where it can be told.

A fold, at which a stable and an unstable orbit meet, is told by three things: the leading multiplier is real and goes to +1, by the square
root of the distance; Newton's method finds nothing beyond; and the place to which (1 - multiplier)^2 extrapolates is where it stops finding
the orbit. Kuznetsov, Elements of Applied Bifurcation Theory (2004), chapters 4 and 5; di Bernardo, Budd, Champneys & Kowalczyk,
Piecewise-smooth Dynamical Systems (2008), chapter 2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from saltus.analysis.grid import Grid
from saltus.analysis.polish import Closed, close
from saltus.analysis.recurrence import LONGEST
from saltus.analysis.responses import Found
from saltus.analysis.steady import CHAOTIC, CLOSED, EQUILIBRIUM, LIMIT_CYCLE
from saltus.analysis.unforced import close_again
from saltus.flow.family import Family
from saltus.flow.methods import Method

#: Farthest that an orbit moves between two values, in units of its own range.
LINK = 0.35
#: A complex leading multiplier is on its way to the unit circle beyond this, if it grew by so much in the last step of the parameter that
#: it is there after AHEAD more of them. Being near isn't enough: of a lightly damped oscillator all multipliers are, and stay there.
TURNING, AHEAD = 0.95, 2.0
#: Times that the step towards the end of a branch is halved, and how many times its last width the law is measured over.
HALVINGS, OVER = 14, 64
#: Steps towards the end of a branch at most.
STEPS = 100
#: Farthest that the law's extrapolation may lie from the interval, in its widths.
BESIDE = 3.0


@dataclass(frozen=True)
class Event:
    """What happens to a branch between two values.

    Attributes
    ----------
    value : float
        Where [SI]: a fold or Hopf bifurcation to some ten thousandths of the step; anything else is in the middle of the two values.
    kind : str
        ``graze`` (contacts come or go), ``period_doubling``, ``fold``, ``hopf`` (an equilibrium begins to oscillate), ``neimark_sacker``
        (a torus is born), ``chaos`` (its starts are chaotic beyond), or ``end`` (it isn't found any more, by the starts nor by Newton's
        method, for none of these reasons).
    branch : int
        Its number.
    """

    value: float
    kind: str
    branch: int


def closed_again(
    found: Found, rows: np.ndarray, family: Family, start: np.ndarray, scale: np.ndarray, time: np.ndarray | None = None
) -> Closed:
    """Orbits, limit cycles and equilibria near states of some responses int64[m], at the parameter values of a family."""
    time = found.time[rows] if time is None else time
    if np.isnan(time).all():
        return close(family, start, found.period[rows], scale, LONGEST)
    return close_again(family, start, time, scale)


def orbit_distance(p: np.ndarray, q: np.ndarray, scale: np.ndarray) -> float:
    """Largest distance of the points of two orbits float64[n, D] of the same period, at the best phase shift, in units of the scale."""
    shifts = (np.arange(len(q))[:, None] + np.arange(len(q))) % len(q)
    return float(np.abs((p[None] - q[shifts]) / scale).max(axis=(1, 2)).min())


def why_they_end(
    found: Found,
    grid: Grid,
    method: Method,
    ends: np.ndarray,
    branch: np.ndarray,
    way: int,
    threads: int | None = None,
) -> list[Event]:
    """Why branches end upwards (way 1) or begin (way -1).

    Parameters
    ----------
    found : Found
        The responses.
    grid, method, threads
        As they were computed.
    ends : int64[k]
        The last response of each branch; Newton's method doesn't go on from it to an orbit that attracts.
    branch : int64[k]
        Their numbers.
    way : {1, -1}
        Direction in which it ends.

    Returns
    -------
    list of Event
        None for a branch at the edge of the grid, one that never repeats, or one that was not computed beyond.
    """
    (values,) = grid.axes.values()
    beyond = found.place[ends] + way
    inside = (beyond >= 0) & (beyond < len(values)) & np.isin(found.kind[ends], CLOSED)
    inside[inside] = ~(found.of[beyond[inside]] == -4).all(axis=1)
    ends, branch = ends[inside], branch[inside]
    words = [_told_by_neighbours(found, int(end), int(found.place[end]) + way, _leading(found, int(end))) for end in ends]
    places = np.array([middle(values, int(found.place[end]), int(found.place[end]) + way) for end in ends])
    asked = np.array([i for i, word in enumerate(words) if word == "end"], np.int64)
    if len(asked):
        for i, (word, place) in zip(asked, _located(found, grid, method, ends[asked], way, threads), strict=True):
            words[i], places[i] = word, place if np.isfinite(place) else places[i]
    return [Event(float(place), word, int(number)) for place, word, number in zip(places, words, branch, strict=True) if word]


def _leading(found: Found, response: int) -> complex:
    """Leading multiplier; of a limit cycle the largest but the trivial one, of an equilibrium the leading eigenvalue [1/s]."""
    multipliers = found.steady.orbits.multipliers[found.row[response]]
    return complex(multipliers[1 if found.kind[response] == LIMIT_CYCLE and len(multipliers) > 1 else 0])


def _told_by_neighbours(found: Found, last: int, beyond: int, multiplier: complex) -> str:
    """What the responses at the next value say, ``end`` if nothing; "" if it is told by another branch."""
    here = int(found.place[last])
    neighbours = np.flatnonzero(found.place == beyond)
    doubled = [j for j in neighbours if _is_twice(found, int(j), last) and _covers(found, int(j), last)]
    if any(_is_twice(found, last, int(j)) and _covers(found, last, int(j)) for j in neighbours):
        return ""  # the same doubling, told by the branch of half the period
    if doubled and multiplier.real < 0:
        return "period_doubling"
    starts = np.flatnonzero((found.of[here] >= 0) & (found.of[here] == last))
    if len(starts) and (found.steady.kind.reshape(found.of.shape)[beyond, starts] == CHAOTIC).any():
        return "chaos"
    if found.kind[last] != EQUILIBRIUM and abs(multiplier.imag) > 1e-9 and _turns(found, last, 2 * here - beyond, abs(multiplier)):
        return "neimark_sacker"
    return "end"


def _turns(found: Found, last: int, before: int, size: float) -> bool:
    """Whether a leading multiplier of this size reaches the unit circle soon, by how it grew from the value before."""
    alike = (found.place == before) & (found.kind == found.kind[last]) & (found.period == found.period[last])
    if size <= TURNING or not alike.any():
        return False
    scale, points = found.steady.scale[found.row[last]], found.points(last)
    apart = {int(j): orbit_distance(found.points(int(j)), points, scale) for j in np.flatnonzero(alike)}
    nearest = min(apart, key=lambda j: apart[j])
    grown = size - abs(_leading(found, nearest))
    return apart[nearest] < LINK and AHEAD * grown >= 1.0 - size


def _is_twice(found: Found, longer: int, shorter: int) -> bool:
    """Whether one response takes twice as long as another."""
    if found.kind[longer] != found.kind[shorter]:
        return False
    if found.kind[longer] == LIMIT_CYCLE:
        return bool(abs(found.time[longer] / (2 * found.time[shorter]) - 1.0) < 0.2)
    return bool(found.kind[longer] != EQUILIBRIUM and found.period[longer] == 2 * found.period[shorter])


def _covers(found: Found, longer: int, shorter: int) -> bool:
    """Whether every point of an orbit of period 2n lies near one of an orbit of period n."""
    scale = found.steady.scale[found.row[shorter]]
    apart = np.abs((found.points(longer)[:, None] - found.points(shorter)[None]) / scale).max(axis=2).min(axis=1)
    return bool(apart.max() < LINK)


def middle(values: np.ndarray, a: int, b: int) -> float:
    """Between two values: geometric where the axis spans decades."""
    low, high = float(values[a]), float(values[b])
    return float(np.sqrt(low * high)) if values[0] > 0 and values[-1] / values[0] > 100 else 0.5 * (low + high)


# -- folds and Hopf bifurcations -----------------------------------------------------------------------------------------------
class _Follower:
    """Some responses, followed by Newton's method to any value of the parameter between two of the grid."""

    def __init__(self, found: Found, grid: Grid, method: Method, ends: np.ndarray, threads: int | None):
        (self._name, _) = next(iter(grid.axes.items()))
        self._found, self._grid, self._ends, self._threads = found, grid, ends, threads
        self._method = method if method.exact else method.companion()
        self._scale = found.steady.scale[found.row[ends]]
        self.points = [found.points(int(end)) for end in ends]
        self.time = found.time[ends].copy()

    def at(self, value: np.ndarray) -> tuple[Closed, np.ndarray]:
        """What Newton's method finds at values float64[k], and which of it is the same orbit, moved, bool[k]."""
        system = self._grid.system
        rows = self._grid.rows[self._found.place[self._ends]]
        rows[:, list(system.values).index(self._name)] = value
        family = Family(system, self._method, rows, self._grid.every, self._threads)
        start = np.array([points[0] for points in self.points])
        arrived = closed_again(self._found, self._ends, family, start, self._scale, self.time)
        same = arrived.period == [len(points) for points in self.points]
        for i in np.flatnonzero(same):
            same[i] = orbit_distance(self.points[i], arrived.points[i, : arrived.period[i]], self._scale[i]) < LINK
        return arrived, same

    def move(self, arrived: Closed, which: np.ndarray) -> None:
        """Go on from what was found, where ``which``, bool[k]."""
        for i in np.flatnonzero(which):
            self.points[i], self.time[i] = arrived.points[i, : arrived.period[i]], arrived.time[i]

    def to_the_end(self, last: np.ndarray, beyond: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Follow each while it attracts, from values float64[k] towards others beyond, in steps that halve where Newton's method fails.

        Returns the last value found, the width within which nothing more was found, and whether it was followed so far, bool[k]. A step
        that fails is tried again from nearer: Newton's method fails far from an orbit, too.
        """
        last, step = last.copy(), 0.5 * (beyond - last)
        least = np.abs(beyond - last) * 0.5**HALVINGS
        going = np.ones(len(last), bool)
        for _ in range(STEPS):
            value = np.where(going, last + step, last)
            arrived, same = self.at(value)
            goes_on = going & same & arrived.stable
            self.move(arrived, goes_on)
            last = np.where(goes_on, value, last)
            there = np.abs(beyond - last) < least
            narrow = ~goes_on & (np.abs(step) <= 1.5 * least)
            going &= ~(there | narrow)
            step = np.where(going & ~goes_on, 0.5 * step, step)
            if not going.any():
                break
        return last, step, ~there & ~going


def _located(found: Found, grid: Grid, method: Method, ends: np.ndarray, way: int, threads: int | None) -> list[tuple[str, float]]:
    """Kind and place of what ends branches whose leading multiplier is real and positive, or that rest."""
    (values,) = grid.axes.values()
    follower = _Follower(found, grid, method, ends, threads)
    last, width, narrow = follower.to_the_end(values[found.place[ends]], values[found.place[ends] + way])
    farther = last - np.clip(OVER * np.abs(width), 0.0, np.abs(last - values[found.place[ends]])) * np.sign(width)
    near, _ = follower.at(last)
    far, same = follower.at(farther)
    _, beyond = follower.at(last + 2.0 * width)
    result = []
    for i, end in enumerate(ends):
        rests = found.kind[end] == EQUILIBRIUM
        column = 1 if found.kind[end] == LIMIT_CYCLE and near.multipliers.shape[1] > 1 else 0
        one, other = complex(near.multipliers[i, column]), complex(far.multipliers[i, column])
        oscillates = abs(one.imag) > 1e-9 * abs(one)
        distance = np.abs([one.real, other.real]) if rests else np.abs([1.0 - one, 1.0 - other])
        law = distance if rests and oscillates else distance**2  # linear through a Hopf bifurcation, a square root at a fold
        place = last[i] + law[0] * (last[i] - farther[i]) / (law[1] - law[0]) if law[1] > law[0] else np.nan
        here = bool(same[i] and narrow[i]) and abs(place - last[i] - 0.5 * width[i]) <= (0.5 + BESIDE) * abs(width[i])
        word = "hopf" if rests and oscillates and beyond[i] else "fold" if not oscillates and not beyond[i] else "end"
        result.append((word, float(place)) if here else ("end", np.nan))
    return [(word, place if word != "end" and method.exact else np.nan) for word, place in result]
