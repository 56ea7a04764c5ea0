"""What many trajectories settle to, each with parameter values of its own: the engine of frequency
responses and bifurcation diagrams.

A basin map asks one system of a great many starts, and capture by known attractors answers. Here
every trajectory may have an attractor of its own: each is followed until it nearly recurs, Newton's
method closes the orbit, its multipliers say that it attracts, and the trajectory must lie beside
it. What never recurs is typed by its largest Lyapunov exponent.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from saltus.analysis.orbits import unforced
from saltus.analysis.orbits.aperiodic import kinds_of
from saltus.analysis.orbits.equilibria import autonomous
from saltus.analysis.orbits.orbits import OrbitBatch
from saltus.analysis.orbits.recurrence import recurrence, recurring_orbits
from saltus.analysis.orbits.tolerances import BESIDE, NEAR, RESTS, ROUND, SETTLED
from saltus.flow.engine import Schedule
from saltus.flow.maps import Stroboscope
from saltus.flow.threads import on_threads
from saltus.kernels import status as st
from saltus.results.dataset.kinds import Kind

#: Trajectories that one thread follows at a time.
PIECE = 512
#: Periods, and samples in each, from which the range of a motion is taken.
RANGE_PERIODS, SAMPLES_PER_PERIOD = 4, 32
#: Iterates that are kept of a motion that never repeats.
KEPT_ITERATES = 1024


@dataclass
class SettledMotions:
    """What k trajectories settle to.

    Attributes
    ----------
    kind : int64[k]
        What it settles to, or why to nothing: :class:`saltus.results.dataset.kinds.Kind`.
    orbits : OrbitBatch
        The orbits of the periodic ones, verified; elsewhere nothing.
    exponent, exponent_error : float64[k]
        Largest Lyapunov exponent and its standard error [per iterate].
    settled : int64[k]
        Iterates after which it was known; -1 if it isn't.
    scale : float64[k, D]
        Range of each state in the motion.
    iterates : dict of int to float64[KEPT_ITERATES, D]
        Points of those that never repeat.
    end : float64[k, D]
        Where the trajectory stood last.
    """

    kind: np.ndarray
    orbits: OrbitBatch
    exponent: np.ndarray
    exponent_error: np.ndarray
    settled: np.ndarray
    scale: np.ndarray
    iterates: dict[int, np.ndarray]
    end: np.ndarray

    @classmethod
    def empty(cls, count: int, size: int) -> SettledMotions:
        """Nothing computed yet."""
        nothing = np.full(count, np.nan)
        return cls(
            np.full(count, Kind.NOT_COMPUTED, np.int64), OrbitBatch.none(count, size),
            nothing.copy(), nothing.copy(),
            np.full(count, -1, np.int64), np.ones((count, size)), {},
            np.full((count, size), np.nan),
        )  # fmt: skip

    def put(self, where: np.ndarray, other: SettledMotions) -> None:
        """Write another's results to the rows int64[m]."""
        for name in ("kind", "exponent", "exponent_error", "settled", "scale", "end"):
            getattr(self, name)[where] = getattr(other, name)
        self.orbits.put(where, other.orbits)
        self.iterates.update({int(where[i]): iterates for i, iterates in other.iterates.items()})


def find_responses(
    map_: Stroboscope,
    start: np.ndarray,
    most: int,
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
    result: SettledMotions | None = None,
) -> SettledMotions:
    """What each trajectory settles to: start float64[k, D], row i by row i of the map, followed for
    ``most`` iterates at the longest.

    What is known when Ctrl-C ends it stands in ``result``, if that is given. The result doesn't
    depend on the other trajectories, nor on threads.
    """
    result = SettledMotions.empty(len(start), start.shape[1]) if result is None else result
    pieces = [
        np.arange(first, min(first + PIECE, len(start))) for first in range(0, len(start), PIECE)
    ]

    def work(piece: np.ndarray) -> SettledMotions:
        return _settle(map_.rows(piece, threads=1), start[piece], most)

    on_threads(work, pieces, result.put, threads, progress)
    return result


def _settle(map_: Stroboscope, start: np.ndarray, most: int) -> SettledMotions:
    """One piece, on one thread."""
    result = SettledMotions.empty(*start.shape)
    who = _follow(map_, start, np.arange(len(start)), most, result, SETTLED)
    if len(who):
        result.scale[who] = motion_range(map_.rows(who), result.end[who])
        who = _follow(map_, result.end, who, ROUND, result, NEAR)
    if len(who):
        who = _classify_aperiodic(map_, result.end, who, result)
    if len(who):  # neither a recurrence nor an exponent: once more as long, and from farther away
        who = _follow(map_, result.end, who, most, result, NEAR)
        result.kind[who] = Kind.UNCONVERGED
    return result


def _follow(
    map_: Stroboscope,
    start: np.ndarray,
    who: np.ndarray,
    most: int,
    result: SettledMotions,
    near: float,
) -> np.ndarray:
    """Follow trajectories until they settle on an orbit; writes what is known, returns those that
    haven't.
    """
    flight = map_.rows(who).launch(start[who], most + ROUND)
    while len(who) and flight.age < most:
        points = flight.advance(ROUND)
        going = flight.going
        result.end[who] = flight.state
        ended = who[~going]
        result.kind[ended] = np.where(
            flight.status[~going] == st.NONFINITE, Kind.ESCAPED, Kind.FAILED
        )
        stay = going.copy()
        if going.any():
            rows = np.flatnonzero(going)
            if flight.age == ROUND:
                result.scale[who[rows]] = motion_range(map_.rows(who[rows]), flight.state[rows])
            stay[rows[_settled(map_, points[rows], who[rows], near, result)]] = False
            result.settled[who[going & ~stay]] = flight.age
        flight.keep(stay)
        who = who[stay]
    return who


def _settled(
    map_: Stroboscope, points: np.ndarray, who: np.ndarray, near: float, result: SettledMotions
) -> np.ndarray:
    """Which of the trajectories float64[k, ROUND, D] lie on an attracting orbit, bool[k]; writes
    the orbits.
    """
    if autonomous(map_.system):
        return _settled_unforced(map_.rows(who), points, who, near, result)
    orbits, apart, noise = recurring_orbits(map_.rows(who), points, result.scale[who], near)
    beside = orbits.distance(points[:, -1], result.scale[who]) <= BESIDE * np.maximum(apart, noise)
    done = orbits.stable & beside
    result.orbits.put(who[done], orbits.rows(done))
    result.kind[who[done]], result.exponent_error[who[done]] = Kind.PERIODIC, 0.0
    with np.errstate(divide="ignore"):
        result.exponent[who[done]] = (
            np.log(np.abs(orbits.multipliers[done, 0])) / orbits.period[done]
        )
    return done


def _settled_unforced(
    map_: Stroboscope, points: np.ndarray, who: np.ndarray, near: float, result: SettledMotions
) -> np.ndarray:
    """As :func:`_settled` for rows of a system without forcing: which rest, or go round a limit
    cycle.
    """
    state, window = points[:, -1], ROUND * float(map_.period[0])
    result.scale[who] = np.maximum(result.scale[who], np.ptp(points, axis=1))
    found = unforced.attracted(map_, state, result.scale[who], window, near)
    done = found.orbits.period > 0
    chosen = who[done]
    result.orbits.put(chosen, found.orbits.rows(done))
    result.scale[chosen] = found.scale[done]
    rests = found.orbits.time[done] == 0
    result.kind[chosen], result.exponent_error[chosen] = (
        np.where(rests, Kind.EQUILIBRIUM, Kind.LIMIT_CYCLE),
        0.0,
    )
    leading = found.orbits.multipliers[done, 0].real * map_.period[done]
    # along a limit cycle nothing grows or dies
    result.exponent[chosen] = np.where(rests, leading, 0.0)
    return done


def _classify_aperiodic(
    map_: Stroboscope, start: np.ndarray, who: np.ndarray, result: SettledMotions
) -> np.ndarray:
    """Classify trajectories that don't recur by their exponents; writes what is known, returns
    those that stay unclear.
    """
    maps = map_.rows(who)
    state, kinds = kinds_of(maps, start[who], result.scale[who], [[i] for i in range(len(who))])
    flight = maps.launch(state, KEPT_ITERATES)
    iterates = flight.advance(KEPT_ITERATES)
    # by now
    recurs = recurrence(iterates[:, -ROUND:], result.scale[who])[1] < np.maximum(
        NEAR, maps.noise_of(result.scale[who])
    )
    result.end[who] = flight.state
    unclear = np.ones(len(who), bool)
    if autonomous(map_.system):  # a limit cycle that is reached slowly, and no torus
        recurs |= unforced.nearly_recurs(maps, flight.state, ROUND * float(map_.period[0]))
        away = unforced.runs_away(iterates)
        result.kind[who[away]] = Kind.ESCAPED
    for i in np.flatnonzero(np.isfinite(iterates).all(axis=(1, 2))):
        kind = kinds[i]
        if (
            result.kind[who[i]] != Kind.ESCAPED
            and kind is not None
            and not (recurs[i] and (kind[0] != Kind.CHAOTIC.word or not autonomous(map_.system)))
        ):
            unclear[i], row = False, who[i]
            result.kind[row] = Kind[kind[0].upper()]
            result.exponent[row], result.exponent_error[row] = kind[1:]
            result.iterates[int(row)], result.settled[row] = iterates[i], -1
    return who[unclear & (result.kind[who] != Kind.ESCAPED)]


def motion_range(map_: Stroboscope, state: np.ndarray) -> np.ndarray:
    """Range of each state in the motion from states float64[k, D] on, float64[k, D]; its size where
    it rests, 1 where that is 0.
    """
    samples = map_.run(
        state, RANGE_PERIODS, Schedule.even(RANGE_PERIODS, SAMPLES_PER_PERIOD)
    ).samples
    with np.errstate(all="ignore"):
        lengths, sizes = np.ptp(samples, axis=1), np.abs(samples).max(axis=1)
    scale = np.where(lengths > RESTS * sizes, lengths, sizes)
    return np.where(np.isfinite(scale) & (scale > 0), scale, 1.0)
