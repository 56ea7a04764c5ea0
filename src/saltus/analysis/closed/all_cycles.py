"""The limit cycles of a system without forcing, stable and unstable: from close returns of many
motions, closed by Newton's method on points of the cycle and its period.

A motion that comes near an unstable cycle follows it for a while and returns close to where it was:
state and time are a first guess. Auerbach, Cvitanovic, Eckmann, Gunaratne & Procaccia, Phys. Rev.
Lett. 58 (1987) 2387-2389. The unknowns are points of the cycle a part of its period apart, and the
period (multiple shooting); each step of Newton's method is across the flow at the first point.
Parker & Chua, Practical Numerical Algorithms for Chaotic Systems (1989), chapter 5.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from saltus.analysis.closed.cycles import (
    LOCATED,
    NO_CYCLE,
    close_returns,
    first_point,
    least_part,
    units,
    with_trivial,
)
from saltus.analysis.closed.field_zeros import field_of
from saltus.analysis.closed.motions import ClosedMotion
from saltus.analysis.closed.search import AGES, BESIDE, Family, Search, used_up
from saltus.analysis.closed.shooting import Shooting, close
from saltus.analysis.solve.deflation import Known
from saltus.analysis.solve.tolerances import AMPLIFIED, CONVERGED, LONGEST, SAME
from saltus.flow.maps import Stroboscope
from saltus.flow.polynomials import between
from saltus.flow.request import Schedule
from saltus.interrupt import PartInterrupted

#: Windows of time in each of which the nearest return is a guess.
WINDOWS = 3
#: Starts whose motions are held at a time.
TOGETHER = 64
#: Fewest points of a cycle that are unknowns; one for each rotation otherwise.
FEWEST = 4
#: Most points of a cycle that are unknowns.
MOST = 16
#: Places between two points at which a cycle is looked at to see whether it repeats.
FINER = 8
#: Largest difference there.
FAR = 1e-2
#: Farthest that points go from the guess, in units of its range.
FARTHEST = 3.0
#: Sample points of a cycle by which duplicates of it are recognised.
SAMPLES = 1024
#: One in so many of these is looked at first.
COARSE = 8
#: Sizes of guesses beside a known cycle, in units of its own.
SIZES = np.array([0.3, 0.5, 0.7, 0.8, 0.9, 0.97, 1.03, 1.1, 1.25, 1.5, 2.0, 3.0])


@dataclass(frozen=True)
class Cycle(ClosedMotion):
    """A limit cycle, and where it goes.

    Attributes
    ----------
    points : float64[LONGEST, D]
        States in equal steps of its time, from where the first state that moves is least.
    scale : float64[D]
        Range of each state, its size where it rests.
    samples, rates : float64[SAMPLES + 1, D]
        States from the first point on to the last, which is it again, and their rates.
    """

    scale: np.ndarray = field(kw_only=True)
    samples: np.ndarray = field(kw_only=True)
    rates: np.ndarray = field(kw_only=True)

    def nearest(self, states: np.ndarray) -> np.ndarray:
        """Positions on the cycle nearest to states float64[m, D], float64[m] in samples: from the
        nearest of some samples on along the tangent.
        """
        offset = (states[:, None] - self.samples[None, :-1:COARSE]) / self.scale
        place = COARSE * np.argmin(np.einsum("mij,mij->mi", offset, offset), axis=1)
        for _ in range(LOCATED):
            place = place + np.clip(self._along(place, states), -COARSE, COARSE)
        return np.asarray(place % SAMPLES)

    def _along(self, place: np.ndarray, states: np.ndarray) -> np.ndarray:
        """Number of samples on to the point nearest to states, by the tangent at a place."""
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


class Cycles(Family[Cycle]):
    """Limit cycles of a flow with one row of values, each once.

    Parameters
    ----------
    map_ : Stroboscope
        Of a system without forcing.
    longest : float
        Longest period looked for [s].
    """

    rounds = 4

    def __init__(self, map_: Stroboscope, longest: float) -> None:
        super().__init__()
        self.map, self.longest = map_, longest

    def guess(self, points: np.ndarray, time: np.ndarray, scale: np.ndarray) -> Shooting:
        """Guesses of cycles float64[k, n, D], with their periods [s] and ranges."""
        row = np.zeros(len(points), np.int64)
        return Shooting(
            self.map, row, points, scale, time=time, longest=self.longest, farthest=FARTHEST
        )

    def motion(self, closed: Shooting) -> Cycle | None:
        """See :class:`Family`; None too if it rests."""
        assert closed.time is not None
        row, n = self.map.rows(closed.row), closed.points.shape[1]
        travelled = np.abs(closed.rates(closed.points)[0]) * closed.time
        if not (travelled > NO_CYCLE * closed.scale).any():
            return None
        time = least_part(row, closed.points[:, 0], closed.time, closed.scale)
        if time[0] < 0.75 * closed.time[0]:
            points = _parts(self.map, closed.points[:, 0], time, n)
            _, closed = close(replace(closed, points=points, time=time, longest=2.0 * time[0]))
            if not len(closed):
                return None
        assert closed.time is not None
        ends, matrices = closed.parts().tangent(closed.points[0], 1)
        whole = row.with_period(closed.time)
        first = first_point(row, closed.points[:, 0], closed.time)
        samples = whole.run(first, 1, Schedule.even(1, SAMPLES, beyond=1)).samples[0]
        scale = units(samples.max(axis=0), samples.min(axis=0))
        mismatch = float(np.abs((ends - np.roll(closed.points[0], -1, axis=0)) / scale).max())
        if not (
            mismatch < AMPLIFIED and np.isfinite(matrices).all() and np.isfinite(samples).all()
        ):
            return None
        multipliers = with_trivial(matrices, closed.rates(closed.points)[0])
        growth = float(np.abs(multipliers[1:]).max(initial=0.0))
        if not _repeats(whole, closed.points[0], scale, growth):
            return None
        points = samples[:: SAMPLES // LONGEST][:LONGEST]
        return Cycle(
            points,
            multipliers,
            mismatch,
            float(closed.time[0]),
            scale=scale,
            samples=samples,
            rates=closed.rates(samples[None])[0],
        )

    def same(self, motion: Cycle, closed: Shooting) -> np.ndarray:
        """See :class:`Family`: once or several times round."""
        assert closed.time is not None
        rotations = np.maximum(np.round(closed.time / motion.time), 1.0)
        same = np.abs(closed.time / motion.time - rotations) < SAME * rotations
        rows = np.flatnonzero(same)
        if len(rows):
            points = closed.points[rows]
            apart = _apart(self.map, motion, points.reshape(-1, points.shape[2]))
            # one point may lie at a jump
            same[rows] = np.sort(apart.reshape(points.shape[:2]), axis=1)[:, -2:][:, 0] < SAME
        return same

    def known(self, n: int) -> Known:
        """Return a function that gives each known cycle at the phase nearest to the unknowns, over
        as many rotations as their period has.
        """
        cycles = tuple(self.motions)

        def zeros(z: np.ndarray) -> np.ndarray:
            points = z[:, :-1].reshape(len(z), n, (z.shape[1] - 1) // n)
            result = np.empty((len(z), len(cycles), z.shape[1]))
            for i, cycle in enumerate(cycles):
                rotations = np.maximum(np.round(z[:, -1] / cycle.time), 1.0)
                place = cycle.nearest(points[:, 0])[:, None] + np.arange(n) * (
                    rotations[:, None] * SAMPLES / n
                )
                result[:, i, :-1] = cycle.at(place).reshape(len(z), z.shape[1] - 1)
                result[:, i, -1] = rotations * cycle.time
            return result

        return zeros

    def beside(self, n: int, random: np.random.Generator) -> list[Shooting]:
        """See :class:`Family`: larger and smaller ones of a cycle's shape, and what lies beside its
        points once and twice round.
        """
        far = np.concatenate([np.full(len(SIZES), BESIDE[0]), BESIDE, BESIDE])
        size = np.concatenate([SIZES, np.ones(2 * len(BESIDE))])
        rotations = np.where(np.arange(len(far)) < len(SIZES) + len(BESIDE), 1, 2)
        steps = np.arange(n) * rotations[:, None] * SAMPLES / n
        guesses = []
        for cycle in self.motions:
            middle = cycle.samples[:-1].mean(axis=0)
            points = cycle.at(random.uniform(0, SAMPLES, (len(far), 1)) + steps)
            points = middle + size[:, None, None] * (points - middle)
            points += far[:, None, None] * random.standard_normal(points.shape) * cycle.scale
            scale = np.broadcast_to(cycle.scale, (len(far), len(cycle.scale)))
            guesses.append(self.guess(points, rotations * cycle.time, scale))
        return guesses

    def place(self, motion: Cycle) -> tuple[float, ...]:
        """See :class:`Family`: by period, then by place."""
        return (float(f"{motion.time:.7e}"), *np.round(motion.points[0] / motion.scale, 6))


def all_cycles(
    map_: Stroboscope,
    start: np.ndarray,
    limits: tuple[float, float],
    time: float,
    progress: Callable[[float], None] | None = None,
) -> Cycles:
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

    Raises
    ------
    PartInterrupted
        On Ctrl-C. Its ``partial`` is what was found.
    """
    search, result = Search(0, len(start)), Cycles(map_, limits[1])
    rotation = float(map_.period[0])
    n = int(np.clip(np.ceil(limits[1] / rotation), FEWEST, MOST))

    def guesses() -> Iterator[tuple[Shooting, np.ndarray]]:
        for first in range(0, len(start), TOGETHER):
            part = slice(first, first + TOGETHER)
            state, followed = _aged(map_, start[part], np.resize(AGES, len(start))[part])
            search.given_up += int((~followed).sum())
            for guess, row in _guesses(result, state, limits, time, n):
                yield guess, first + row
            if progress:
                progress(0.7 * min(1.0, (first + TOGETHER) / len(start)))

    low, high = limits[0] * (1.0 - SAME), limits[1] * (1.0 + SAME)

    def ordered() -> Cycles:
        return result.ordered(lambda one: low <= one.time <= high)

    try:
        result.deflate(search, result.hunt(search, guesses()))
    except KeyboardInterrupt:
        raise PartInterrupted(ordered) from None
    return ordered()


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
    cycles: Cycles, state: np.ndarray, limits: tuple[float, float], time: float, n: int
) -> Iterator[tuple[Shooting, np.ndarray]]:
    """The nearest returns of motions from float64[k, D] in each window of time, and the motions
    that they are of, int64[m]; of those without any a given time in the first window.
    """
    rows = np.flatnonzero(np.isfinite(state).all(axis=1))
    state = state[rows]
    edges = np.linspace(*limits, WINDOWS + 1)
    each = close_returns(cycles.map.rows(np.zeros(len(state), np.int64)), state, edges)
    none = np.all([np.isnan(one.time) for one in each], axis=0)
    each[0].time[none] = time
    for one in each:
        here = np.isfinite(one.time)
        length = one.time[here]
        points = _parts(cycles.map, state[here], length, n)
        yield cycles.guess(points, length, one.scale[here]), rows[here]


def _parts(map_: Stroboscope, state: np.ndarray, time: np.ndarray, n: int) -> np.ndarray:
    """States of motions in n equal steps of a time each, float64[k, n, D]."""
    rows = map_.rows(np.zeros(len(state), np.int64)).with_period(time)
    return np.asarray(rows.run(state, 1, Schedule.even(1, n)).samples)


# -- one cycle -------------------------------------------------------------------------------------
def _apart(map_: Stroboscope, cycle: Cycle, states: np.ndarray) -> np.ndarray:
    """Distances of states float64[m, D] from a cycle, in units of its range, float64[m]."""
    rows, step = map_.rows(np.zeros(len(states), np.int64)), cycle.time / SAMPLES
    place = cycle.nearest(states)
    for _ in range(LOCATED):
        sample = np.floor(place - 0.5).astype(int)
        there = rows.with_period((place - sample) * step).run(cycle.samples[sample % SAMPLES], 1)
        offset = (states - there.state) / cycle.scale
        rate = field_of(map_.system, there.state, rows.values) / cycle.scale
        along = np.einsum("mj,mj->m", offset, rate) / np.einsum("mj,mj->m", rate, rate)
        place = place + np.clip(np.nan_to_num(along / step), -1.0, 1.0)
    return np.asarray(np.abs(offset).max(axis=1))


def _repeats(whole: Stroboscope, points: np.ndarray, scale: np.ndarray, growth: float) -> bool:
    """True where the motion from the first of points float64[n, D] passes the others, and repeats
    in a second period. At a point where a held contact was released it doesn't.
    """
    parts = FINER * len(points)
    seen = whole.run(points[:1], 2, Schedule.even(2, parts, beyond=1)).samples[0] / scale
    enough = min(SAME + CONVERGED * max(growth, 1.0) ** 2, FAR)
    again = np.abs(seen[parts:] - seen[: parts + 1]).max(axis=1)
    passed = np.abs(seen[:parts:FINER] - points / scale).max(axis=1)
    # either side of a jump may be seen, at the first point twice
    return bool((again > enough).sum() <= 2 and (passed > enough).sum() <= 1)
