"""The limit cycles of a system without forcing, stable and unstable: from close returns of many
motions, closed by Newton's method on points of the cycle and its period.

A motion that comes near an unstable cycle follows it for a while and returns close to where it was:
state and time are a first guess. Auerbach, Cvitanovic, Eckmann, Gunaratne & Procaccia, Phys. Rev.
Lett. 58 (1987) 2387-2389. The unknowns are points of the cycle a part of its period apart, and the
period (multiple shooting); each step of Newton's method is across the flow at the first point.
Parker & Chua, Practical Numerical Algorithms for Chaotic Systems (1989), chapter 5.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from saltus.analysis.closed.all_orbits import BESIDE, HELD, Search, chained, used_up
from saltus.analysis.closed.cycles import (
    LOCATED,
    NO_CYCLE,
    close_returns,
    first_point,
    least_period,
    units,
)
from saltus.analysis.closed.field_zeros import field_of
from saltus.analysis.solve.deflation import Known
from saltus.analysis.solve.floquet import nontrivial
from saltus.analysis.solve.newton import Equations, newton
from saltus.analysis.solve.tolerances import AMPLIFIED, CONVERGED, LONGEST, SAME
from saltus.flow.maps import Stroboscope
from saltus.flow.polynomials import between
from saltus.flow.request import Schedule

#: Turns that starts are followed before a return is looked for, in turn: none, so that cycles are
#: found which nothing comes near; some, so that a chaotic set is reached.
AGES = (0, 4, 8, 12)
#: Windows of time in each of which the nearest return is a guess.
WINDOWS = 3
#: Starts whose motions are held at a time.
TOGETHER = 64
#: Points of a cycle that are unknowns: at least, at most; one for each turn between.
FEWEST, MOST = 4, 16
#: Looks at a cycle for each of them to see whether it repeats, and the largest difference.
FINER, FAR = 8, 1e-2
#: Farthest that points go from the guess, in units of its range.
FARTHEST = 3.0
#: Samples of a cycle by which others are told to be it.
SAMPLES = 1024
#: One in so many of these is looked at first.
COARSE = 8
#: Sizes of guesses beside a known cycle, in units of its own.
SIZES = np.array([0.3, 0.5, 0.7, 0.8, 0.9, 0.97, 1.03, 1.1, 1.25, 1.5, 2.0, 3.0])
#: Starts of a search with the known cycles deflated, searches at most, and steps of one.
DEFLATED_STARTS, DEFLATED_SEARCHES, DEFLATED_STEPS = 64, 4, 40


@dataclass(frozen=True)
class Cycle:
    """A limit cycle.

    Attributes
    ----------
    time : float
        Its period [s].
    points : float64[LONGEST, D]
        States in equal steps of its time, from where the first state that moves is least.
    multipliers : complex128[D - 1]
        Floquet multipliers without the trivial 1, the largest first.
    mismatch : float
        Largest distance of a point that was shot from the image of the one before, in units of the
        range.
    scale : float64[D]
        Range of each state, its size where it rests.
    samples, rates : float64[SAMPLES + 1, D]
        States from the first point on to the last, which is it again, and their rates.
    """

    time: float
    points: np.ndarray
    multipliers: np.ndarray
    mismatch: float
    scale: np.ndarray
    samples: np.ndarray
    rates: np.ndarray

    def nearest(self, states: np.ndarray) -> np.ndarray:
        """Where on it states float64[m, D] are nearest, float64[m] in samples: from the nearest of
        some samples on along the tangent.
        """
        offset = (states[:, None] - self.samples[None, :-1:COARSE]) / self.scale
        place = COARSE * np.argmin(np.einsum("mij,mij->mi", offset, offset), axis=1)
        for _ in range(LOCATED):
            place = place + np.clip(self._along(place, states), -COARSE, COARSE)
        return np.asarray(place % SAMPLES)

    def _along(self, place: np.ndarray, states: np.ndarray) -> np.ndarray:
        """How many samples further on states are nearest, by the tangent at a place."""
        rate = self.rates[np.round(place).astype(int) % SAMPLES] * (self.time / SAMPLES)
        rate, offset = rate / self.scale, (states - self.at(place)) / self.scale
        size = np.einsum("mj,mj->m", rate, rate)
        further: np.ndarray = np.einsum("mj,mj->m", rate, offset) / np.maximum(size, 1e-300)
        return further

    def at(self, place: np.ndarray) -> np.ndarray:
        """States at places float64[...] in samples, float64[..., D]: cubics between the samples."""
        whole = np.floor(place)
        i, step = whole.astype(int) % SAMPLES, self.time / SAMPLES
        return between(
            self.samples[i],
            self.samples[i + 1],
            step * self.rates[i],
            step * self.rates[i + 1],
            (place - whole)[..., None],
        )


@dataclass
class CycleSet:
    """Limit cycles, each once.

    Attributes
    ----------
    cycles : list of Cycle
        They.
    found : list of int
        Starts that led to each.
    search : Search
        What the search came to; its period is 0.
    """

    search: Search
    cycles: list[Cycle] = field(default_factory=list)
    found: list[int] = field(default_factory=list)

    def take(self, map_: Stroboscope, guess: Guess) -> np.ndarray:
        """Add the cycles that aren't known yet; the number of each, int64[k], -1 of one that
        doesn't close.
        """
        number = np.full(len(guess), -1)
        for i, cycle in enumerate(self.cycles):
            rows = np.flatnonzero(number < 0)
            number[rows[_is(map_, cycle, guess.rows(rows))]] = i
        for row in range(len(guess)):
            if number[row] != -1:
                continue
            one = _cycle(map_, guess.rows(np.array([row])))
            if one is None:
                number[row] = -2
                continue
            rows = np.flatnonzero(number == -1)
            number[rows[_is(map_, one, guess.rows(rows))]] = len(self.cycles)
            number[row] = len(self.cycles)
            self.cycles.append(one)
            self.found.append(0)
        found: np.ndarray = np.maximum(number, -1)
        return found

    def within(self, limits: tuple[float, float]) -> CycleSet:
        """Those with periods in a range [s], in an order that doesn't depend on discovery: by
        period, then by place.
        """
        low, high = limits[0] * (1.0 - SAME), limits[1] * (1.0 + SAME)
        order = sorted(
            (i for i, one in enumerate(self.cycles) if low <= one.time <= high),
            key=lambda i: (
                float(f"{self.cycles[i].time:.7e}"),
                *np.round(self.cycles[i].points[0] / self.cycles[i].scale, 6).tolist(),
            ),
        )
        return CycleSet(
            self.search, [self.cycles[i] for i in order], [self.found[i] for i in order]
        )


@dataclass
class Guess:
    """What Newton's method begins with, or has found: k of them.

    Attributes
    ----------
    points : float64[k, n, D]
        States in equal steps of the period.
    time : float64[k]
        The period [s].
    scale : float64[k, D]
        Range of each state.
    row : int64[k]
        Which start it comes from.
    """

    points: np.ndarray
    time: np.ndarray
    scale: np.ndarray
    row: np.ndarray

    def __len__(self) -> int:
        return len(self.time)

    def rows(self, which: np.ndarray) -> Guess:
        """Those of some rows, int64[m] or bool[k]."""
        return Guess(self.points[which], self.time[which], self.scale[which], self.row[which])

    @classmethod
    def joined(cls, parts: list[Guess]) -> Guess:
        """Those of several."""
        columns = zip(*([p.points, p.time, p.scale, p.row] for p in parts), strict=True)
        return cls(*(np.concatenate(column) for column in columns))


def all_cycles(
    map_: Stroboscope,
    start: np.ndarray,
    limits: tuple[float, float],
    time: float,
    progress: Callable[[float], None] | None = None,
) -> CycleSet:
    """The limit cycles that starts lead to, with periods in a range.

    Parameters
    ----------
    map_ : Stroboscope
        Of a system without forcing, with one row of parameter values; its period is about a turn.
    start : float64[k, D]
        Returns of motions from here are looked for, and of motions that have gone on: see
        :data:`AGES`.
    limits : (float, float)
        Shortest and longest period [s].
    time : float
        First guess of the period from starts that don't return [s].
    progress : callable, optional
        Called with the share done.
    """
    search = Search(0, len(start))
    result = CycleSet(search)
    turn = float(map_.period[0])
    n = int(np.clip(np.ceil(limits[1] / turn), FEWEST, MOST))
    guesses, led = list[Guess](), list[np.ndarray]()
    for first in range(0, len(start), TOGETHER):
        part = slice(first, first + TOGETHER)
        state, followed = _aged(map_, start[part], np.resize(AGES, len(start))[part])
        search.given_up += int((~followed).sum())
        for guess in _guesses(map_, state, limits, time, n):
            guesses.append(guess)
            closed = close(map_, guess, limits[1])
            number = result.take(map_, closed)
            led.append(np.stack([first + closed.row, number])[:, number >= 0])
        if progress:
            progress(0.7 * min(1.0, (first + TOGETHER) / len(start)))
    pairs = np.unique(np.concatenate(led, axis=1), axis=1)
    result.found = np.bincount(pairs[1], minlength=len(result.cycles)).tolist()
    search.converged, search.found_once = len(np.unique(pairs[0])), result.found.count(1)
    _deflate(map_, Guess.joined(guesses), limits[1], result)
    return result.within(limits)


def close(
    map_: Stroboscope,
    guess: Guess,
    longest: float,
    known: Known | None = None,
    max_steps: int | None = None,
) -> Guess:
    """The cycles that Newton's method finds, with periods up to the longest [s]; ``known`` ones are
    deflated.
    """
    _, n, size = guess.points.shape
    step, parts = max(1, HELD // (n * size + 1) ** 2), [guess.rows(np.zeros(0, np.int64))]
    for first in range(0, len(guess), step):
        part = guess.rows(np.arange(first, min(first + step, len(guess))))
        z = np.concatenate([part.points.reshape(len(part), -1), part.time[:, None]], axis=1)
        unit = np.concatenate([np.tile(part.scale, n), part.time[:, None]], axis=1)
        zeros = newton(
            _equations(map_, part, longest), z, unit, damped=True, known=known, max_steps=max_steps
        )
        z = zeros.z
        found = zeros.found & (z[:, -1] > 0) & (z[:, -1] <= longest * (1.0 + SAME))
        points = z[found, :-1].reshape(-1, n, size)
        parts.append(Guess(points, z[found, -1], part.scale[found], part.row[found]))
    return Guess.joined(parts)


def _equations(map_: Stroboscope, guess: Guess, longest: float) -> Equations:
    """The equations of the cycles near guesses, in units of these; the last one keeps each step
    across the flow at the first point. They end at twice the longest period,
    and far from the guess, where a motion may run away.
    """
    _, n, size = guess.points.shape

    def equations(z: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        k, points, scale = len(z), z[:, :-1].reshape(-1, n, size), guess.scale[rows]
        away = np.abs(points - guess.points[rows]) / scale[:, None]
        ahead = (z[:, -1] > 0) & (z[:, -1] < 2.0 * longest) & (away.max(axis=(1, 2)) < FARTHEST)
        points = np.where(ahead[:, None, None], points, guess.points[rows])
        part = np.where(ahead, z[:, -1], guess.time[rows]) / n
        mine = map_.rows(np.zeros(k * n, np.int64)).with_period(np.repeat(part, n))
        gaps, matrix, ends = chained(mine, points, scale)
        residual = np.append(gaps, np.zeros((k, 1)), axis=1)
        residual[~ahead] = np.nan
        unit = guess.time[rows, None, None] / scale[:, None]
        derivative = np.zeros((k, n * size + 1, n * size + 1))
        derivative[:, :-1, :-1] = matrix
        derivative[:, :-1, -1] = (_rates(map_, ends) * unit / n).reshape(k, -1)
        derivative[:, -1, :size] = (_rates(map_, points[:, :1]) * unit)[:, 0]
        return residual, derivative

    return equations


def _rates(map_: Stroboscope, states: np.ndarray) -> np.ndarray:
    """Rates at states float64[..., D]."""
    flat = states.reshape(-1, states.shape[-1])
    values = {name: np.full(len(flat), column[0]) for name, column in map_.values.items()}
    return field_of(map_.system, flat, values).reshape(states.shape)


# -- first guesses ---------------------------------------------------------------------------------
def _aged(map_: Stroboscope, start: np.ndarray, age: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """States of motions from float64[k, D] so many turns later, int64[k]; and which of the motions
    are followed, bool[k]: the budgets of the others are used up.
    """
    last = AGES[-1]
    rows = map_.rows(np.zeros(len(start), np.int64))
    flight = rows.launch(start, last)
    points = np.concatenate([start[:, None], flight.advance(last)], axis=1)
    state, followed = points[np.arange(len(start)), age], ~used_up(flight)
    return np.where(followed[:, None], state, np.nan), followed


def _guesses(
    map_: Stroboscope, state: np.ndarray, limits: tuple[float, float], time: float, n: int
) -> list[Guess]:
    """The nearest returns of motions from float64[k, D] in each window of time; without any in the
    first one after a given time.
    """
    rows = np.flatnonzero(np.isfinite(state).all(axis=1))
    state = state[rows]
    edges = np.linspace(*limits, WINDOWS + 1)
    each = close_returns(map_.rows(np.zeros(len(state), np.int64)), state, edges)
    none = np.all([np.isnan(one.time) for one in each], axis=0)
    each[0].time[none] = time
    guesses = []
    for one in each:
        here = np.isfinite(one.time)
        length = one.time[here]
        points = _parts(map_, state[here], length, n)
        guesses.append(Guess(points, length, one.scale[here], rows[here]))
    return guesses


def _parts(map_: Stroboscope, state: np.ndarray, time: np.ndarray, n: int) -> np.ndarray:
    """States of motions in n equal steps of a time each, float64[k, n, D]."""
    rows = map_.rows(np.zeros(len(state), np.int64)).with_period(time)
    return np.asarray(rows.run(state, 1, Schedule.even(1, n)).samples)


# -- other cycles than those that are known --------------------------------------------------------
def _deflate(map_: Stroboscope, guesses: Guess, longest: float, result: CycleSet) -> None:
    """Search on with the known cycles deflated, from some guesses and from beside the known ones,
    until nothing more is found.
    """
    search, n = result.search, guesses.points.shape[1]
    some = guesses.rows(np.arange(0, len(guesses), max(1, len(guesses) // DEFLATED_STARTS)))
    random = np.random.default_rng(0)
    for _ in range(DEFLATED_SEARCHES):
        before = len(result.cycles)
        starts = Guess.joined([some, *(_beside(one, n, random) for one in result.cycles)])
        cycles = tuple(result.cycles)
        known = _nearest(cycles, n)
        result.take(map_, close(map_, starts, longest, known, DEFLATED_STEPS))
        search.deflated += len(result.cycles) - before
        if len(result.cycles) == before:
            search.exhausted = True
            return


def _beside(cycle: Cycle, n: int, random: np.random.Generator) -> Guess:
    """Guesses beside a cycle: larger and smaller ones of its shape, and what lies beside its points
    once and twice round.
    """
    far = np.concatenate([np.full(len(SIZES), BESIDE[0]), BESIDE, BESIDE])
    size = np.concatenate([SIZES, np.ones(2 * len(BESIDE))])
    turns = np.where(np.arange(len(far)) < len(SIZES) + len(BESIDE), 1, 2)
    steps = np.arange(n) * turns[:, None] * SAMPLES / n
    middle = cycle.samples[:-1].mean(axis=0)
    points = cycle.at(random.uniform(0, SAMPLES, (len(far), 1)) + steps)
    points = middle + size[:, None, None] * (points - middle)
    points = points + far[:, None, None] * random.standard_normal(points.shape) * cycle.scale
    scale = np.broadcast_to(cycle.scale, (len(far), len(cycle.scale)))
    return Guess(points, turns * cycle.time, scale, np.full(len(far), -1))


def _nearest(cycles: tuple[Cycle, ...], n: int) -> Known:
    """What gives each known cycle as it is nearest to guesses: the phase by their points, as often
    round as their period has it.
    """

    def zeros(z: np.ndarray) -> np.ndarray:
        points = z[:, :-1].reshape(len(z), n, (z.shape[1] - 1) // n)
        result = np.empty((len(z), len(cycles), z.shape[1]))
        for i, cycle in enumerate(cycles):
            turns = np.maximum(np.round(z[:, -1] / cycle.time), 1.0)
            place = cycle.nearest(points[:, 0])[:, None] + np.arange(n) * (
                turns[:, None] * SAMPLES / n
            )
            result[:, i, :-1] = cycle.at(place).reshape(len(z), z.shape[1] - 1)
            result[:, i, -1] = turns * cycle.time
        return result

    return zeros


# -- one cycle -------------------------------------------------------------------------------------
def _is(map_: Stroboscope, cycle: Cycle, found: Guess) -> np.ndarray:
    """Which of those that were found are a cycle, once or several times round, bool[k]."""
    turns = np.maximum(np.round(found.time / cycle.time), 1.0)
    same = np.abs(found.time / cycle.time - turns) < SAME * turns
    rows = np.flatnonzero(same)
    if len(rows):
        points = found.points[rows]
        apart = _apart(map_, cycle, points.reshape(-1, points.shape[2]))
        # one point may lie at a jump
        same[rows] = np.sort(apart.reshape(points.shape[:2]), axis=1)[:, -2:][:, 0] < SAME
    return same


def _apart(map_: Stroboscope, cycle: Cycle, states: np.ndarray) -> np.ndarray:
    """How far states float64[m, D] lie from a cycle, in units of its range, float64[m]."""
    rows, step = map_.rows(np.zeros(len(states), np.int64)), cycle.time / SAMPLES
    place = cycle.nearest(states)
    for _ in range(LOCATED):
        sample = np.floor(place - 0.5).astype(int)
        there = rows.with_period((place - sample) * step).run(cycle.samples[sample % SAMPLES], 1)
        offset, rate = (states - there.state) / cycle.scale, _rates(map_, there.state) / cycle.scale
        along = np.einsum("mj,mj->m", offset, rate) / np.einsum("mj,mj->m", rate, rate)
        place = place + np.clip(np.nan_to_num(along / step), -1.0, 1.0)
    return np.asarray(np.abs(offset).max(axis=1))


def _cycle(map_: Stroboscope, found: Guess) -> Cycle | None:
    """The cycle that Newton's method found; None if it doesn't close, or rests."""
    row, n = map_.rows(np.zeros(1, np.int64)), found.points.shape[1]
    travelled = np.abs(_rates(map_, found.points[0])) * found.time
    if not (travelled > NO_CYCLE * found.scale).any():
        return None
    time = least_period(row, found.points[:, 0], found.time, found.scale)
    if time[0] < 0.75 * found.time[0]:
        points = _parts(map_, found.points[:, 0], time, n)
        found = close(map_, Guess(points, time, found.scale, found.row), 2.0 * time[0])
        if not len(found):
            return None
    parts = map_.rows(np.zeros(n, np.int64)).with_period(np.repeat(found.time / n, n))
    ends, matrices = parts.tangent(found.points[0], 1)
    whole = row.with_period(found.time)
    first = first_point(row, found.points[:, 0], found.time)
    samples = whole.run(first, 1, Schedule.even(1, SAMPLES, beyond=1)).samples[0]
    scale = units(samples.max(axis=0), samples.min(axis=0))
    mismatch = float(np.abs((ends - np.roll(found.points[0], -1, axis=0)) / scale).max())
    if not (mismatch < AMPLIFIED and np.isfinite(matrices).all() and np.isfinite(samples).all()):
        return None
    multipliers = nontrivial(matrices, _rates(map_, found.points[0]))
    if not _repeats(whole, found.points[0], scale, float(np.abs(multipliers).max())):
        return None
    return Cycle(
        float(found.time[0]), samples[:: SAMPLES // LONGEST][:LONGEST],
        multipliers, mismatch, scale, samples,
        _rates(map_, samples),
    )  # fmt: skip


def _repeats(whole: Stroboscope, points: np.ndarray, scale: np.ndarray, growth: float) -> bool:
    """Whether the motion from the first of points float64[n, D] passes the others, and repeats in
    a second period. At a point at which a held contact was let go it doesn't.
    """
    parts = FINER * len(points)
    seen = whole.run(points[:1], 2, Schedule.even(2, parts, beyond=1)).samples[0] / scale
    enough = min(SAME + CONVERGED * max(growth, 1.0) ** 2, FAR)
    again = np.abs(seen[parts:] - seen[: parts + 1]).max(axis=1)
    passed = np.abs(seen[:parts:FINER] - points / scale).max(axis=1)
    # either side of a jump may be seen, at the first point twice
    return bool((again > enough).sum() <= 2 and (passed > enough).sum() <= 1)
