"""Attractors that many trajectories settle to, each with parameter values of its own: the engine of
frequency responses and bifurcation diagrams.

A basin map asks one system of a great many starts, and capture by known attractors answers. Here
every trajectory may have an attractor of its own: each is followed until it nearly recurs, Newton's
method closes the orbit, its multipliers say that it attracts, and the trajectory must lie beside
it. An orbit of more than LONGEST periods is known by its points. What never recurs is typed by its
largest Lyapunov exponent.

All this is bounded by a budget, in iterates of the motion itself (growth.py): closing orbits and
measuring exponents may each cost BUDGET times the iterates that a motion is followed for. What
isn't typed by then is not_repeating, with where it goes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from saltus.analysis.attractors.aperiodic import FLOOR, kinds_of
from saltus.analysis.attractors.early_chaos import SEEN, looked_at, told_early
from saltus.analysis.attractors.growth import (
    BLOCK,
    BUDGET,
    NEWTON,
    growth_rates,
    tangent_cost,
)
from saltus.analysis.attractors.recurrence import late_periods, recurrence, recurring_orbits
from saltus.analysis.attractors.settling import may_settle
from saltus.analysis.closed import unforced
from saltus.analysis.closed.field_zeros import autonomous
from saltus.analysis.closed.motions import ClosedMotions
from saltus.analysis.closed.orbits import neutral_orbits
from saltus.analysis.closed.spread import beyond_rounding
from saltus.analysis.closed.unforced import eigenvalues_of
from saltus.analysis.solve.tolerances import BESIDE, NEAR, RESTS, ROUND, ROUNDING, SETTLED
from saltus.flow.maps import Stroboscope
from saltus.flow.modal import Modal
from saltus.flow.request import Schedule
from saltus.flow.threads import on_threads, usable_processors
from saltus.kernels import status as st
from saltus.results.dataset.kinds import LATEST, Kind

#: Most trajectories that one thread follows at a time, so that all threads have work, and Ctrl-C
#: finds some done.
PIECE = 512
#: Most of them times the square of the number of states: each takes longer.
PIECE_STATES = 2048
#: Trajectories that fill the lanes: fewer aren't followed at a time, but by flows that move one
#: after the other. There a thread computes numbers of one while another one follows the next.
LANES, ALONE = 8, 1
#: Trajectories that each thread gets at least: its lanes are filled some times.
SHARED = 64
#: Share of the work on a trajectory that is done when it has been followed.
FOLLOWED = 0.4
#: Share of the work that is done when its growth is measured.
MEASURED = 0.6
#: Share of the work that is done when its iterates are known.
KEPT = 0.7
#: Periods from which the range of a motion is taken.
RANGE_PERIODS = 4
#: Samples in each of these periods.
SAMPLES_PER_PERIOD = 32
#: Standard errors above zero by which deviations still grow where a motion was chaotic before.
STILL = 2.0
#: Iterates that are kept of a motion that never repeats.
KEPT_ITERATES = 2 * LATEST


@dataclass
class SettledMotions:
    """Motions that k trajectories settle to.

    Attributes
    ----------
    kind : int64[k]
        What it settles to, or why to nothing: :class:`saltus.results.dataset.kinds.Kind`.
    orbits : ClosedMotions
        The orbits of the periodic ones, verified; elsewhere nothing.
    exponent, exponent_error : float64[k]
        Largest Lyapunov exponent and its standard error [per iterate].
    settled : int64[k]
        Iterates after which it was known; -1 if it isn't.
    scale : float64[k, D]
        Range of each state in the motion.
    iterates : dict of int to float64[n, D]
        Points of those that never repeat, or too late, KEPT_ITERATES of them at most.
    end : float64[k, D]
        Where the trajectory stood last.
    share : float64[k]
        Share of the work on each that is done; 1 where it is known.
    """

    kind: np.ndarray
    orbits: ClosedMotions
    exponent: np.ndarray
    exponent_error: np.ndarray
    settled: np.ndarray
    scale: np.ndarray
    iterates: dict[int, np.ndarray]
    end: np.ndarray
    share: np.ndarray

    @classmethod
    def empty(cls, count: int, size: int) -> SettledMotions:
        """Nothing computed yet."""
        nothing = np.full(count, np.nan)
        return cls(
            np.full(count, Kind.NOT_COMPUTED, np.int64),
            ClosedMotions.none(count, size),
            nothing.copy(),
            nothing.copy(),
            np.full(count, -1, np.int64),
            np.ones((count, size)),
            {},
            np.full((count, size), np.nan),
            np.zeros(count),
        )

    def spent(self, most: int) -> np.ndarray:
        """Iterates that each took, where it was followed for ``most`` at most, float64[k]."""
        closing = NEWTON * tangent_cost(self.end.shape[1]) * self.orbits.period
        followed = np.maximum(self.settled, 1) + closing
        return np.where(self.settled >= 0, followed, float(most_spent(most)))

    def put(self, where: np.ndarray, other: SettledMotions) -> None:
        """Write another's results to the rows int64[m]."""
        for name in ("kind", "exponent", "exponent_error", "settled", "scale", "end", "share"):
            getattr(self, name)[where] = getattr(other, name)
        self.orbits.put(where, other.orbits)
        self.iterates.update({int(where[i]): iterates for i, iterates in other.iterates.items()})


def most_spent(most: int) -> int:
    """Iterates that a trajectory which is followed for ``most`` may cost: twice that, and as much
    as closing orbits and measuring exponents may cost.
    """
    return (2 * BUDGET + 2) * most


def find_responses(
    map_: Stroboscope,
    start: np.ndarray,
    most: int,
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
    result: SettledMotions | None = None,
    then: Callable[[np.ndarray, SettledMotions], None] | None = None,
) -> SettledMotions:
    """Find the motion that each trajectory settles to. Start i, of float64[k, D], takes row i of
    the map and is followed for ``most`` iterates at most.

    What is known when Ctrl-C ends it stands in ``result``, if that is given. The result doesn't
    depend on the other trajectories, nor on threads. ``progress`` counts trajectories, and of each
    the stages that it went through. ``then`` is called with the rows int64[m] of trajectories that
    were followed together and what they settled to, on the thread that followed them.
    """
    result = SettledMotions.empty(*start.shape) if result is None else result
    alone = isinstance(map_.method.serving(map_.system.origin), Modal)
    fewest = ALONE if alone else LANES
    shared = len(np.unique(map_.parameters, axis=0)) < len(start)
    kept = KEPT_ITERATES if shared else SEEN  # places tell whether two starts lead to one motion
    pieces = _pieces(len(start), start.shape[1], threads or usable_processors(), fewest)
    parts = [SettledMotions.empty(len(piece), start.shape[1]) for piece in pieces]

    def work(number: int) -> None:
        piece = pieces[number]
        try:
            _settle(map_.rows(piece, threads=1), start[piece], most, parts[number], kept)
            if then is not None:
                then(piece, parts[number])
            parts[number].share[:] = 1.0
        finally:  # each writes to rows of its own
            result.put(piece, parts[number])

    def show(_: float) -> None:
        assert progress is not None
        progress(float(sum(part.share.sum() for part in parts)) / max(len(start), 1))

    on_threads(work, range(len(pieces)), lambda *_: None, threads, show if progress else None)
    return result


def _pieces(count: int, states: int, threads: int, fewest: int = LANES) -> list[np.ndarray]:
    """Trajectories piece by piece, int64[..] each: in their order, so that Ctrl-C finds the first
    ones done; all that are under way at once have some of every place, as hard ones stand together.
    """
    size = min(PIECE, max(fewest, PIECE_STATES // states**2))
    every = np.arange(count)
    if (at_once := min(threads, count // SHARED)) * size > count:
        return [every[first::at_once] for first in range(at_once)]
    return np.split(every, range(size, count, size))


def _settle(
    map_: Stroboscope, start: np.ndarray, most: int, result: SettledMotions, kept: int
) -> None:
    """One piece, on one thread; ``kept``: iterates to be known of chaos that is told early."""
    past = np.full((len(start), KEPT_ITERATES, start.shape[1]), np.nan)
    who = _follow(map_, start, np.arange(len(start)), most, result, SETTLED, FOLLOWED, past, kept)
    if len(who):
        result.scale[who] = motion_range(map_.rows(who), result.end[who])
        who = _follow(map_, result.end, who, ROUND, result, NEAR, FOLLOWED, past)
    who = who[~_long(map_, who, past[who], result)]
    if len(who):
        who, open_ = _classify_aperiodic(map_, who, most, result, past[who])
    if len(who):  # neither a recurrence nor an exponent: once more as long, and from farther away
        who = _follow(map_, result.end, who, most, result, NEAR, 1.0)
        _leave_open(map_, who, open_, result)


def _follow(
    map_: Stroboscope,
    start: np.ndarray,
    who: np.ndarray,
    most: int,
    result: SettledMotions,
    near: float,
    share: float,
    past: np.ndarray | None = None,
    kept: int = SEEN,
) -> np.ndarray:
    """Follow trajectories until they settle on an orbit, or this share of the work is done; writes
    what is known, and their last iterates into ``past``, returns those that haven't.
    """
    flight, begun = map_.rows(who).launch(start[who], most + ROUND), result.share[who]
    purse, looks = np.zeros(len(start)), looked_at(map_, most, kept)
    while len(who) and flight.age < most:
        points = flight.advance(ROUND)
        going = flight.going
        if past is not None:
            past[who] = np.concatenate([past[who, ROUND:], points], axis=1)
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
            purse[who[rows]] += BUDGET * ROUND
            stay[rows[_settled(map_, points[rows], who[rows], near, result, purse)]] = False
            result.settled[who[going & ~stay]] = flight.age
            if past is not None and flight.age < most:
                due = stay & (flight.age == looks[who])
                stay[_told(map_, who, due, result, past[:, -kept:])] = False
        result.share[who] = np.where(stay, begun + (share - begun) * min(flight.age / most, 1), 1)
        flight.keep(stay)
        who, begun = who[stay], begun[stay]
    return who


def _told(
    map_: Stroboscope,
    who: np.ndarray,
    due: np.ndarray,
    result: SettledMotions,
    past: np.ndarray,
) -> np.ndarray:
    """Write what those of trajectories int64[k] that are due, bool[k], are, if they are strongly
    chaotic; returns the indices of these, int64[m].
    """
    at = np.flatnonzero(due)
    if not len(at):
        return at
    rows, seen = who[at], past[who[at]]
    result.scale[rows] = motion_range(map_.rows(rows), result.end[rows])
    kinds = told_early(map_.rows(rows), seen[:, -SEEN:], result.scale[rows])
    told = [i for i, kind in enumerate(kinds) if kind is not None]
    for i in told:
        kind = kinds[i]
        assert kind is not None
        _put_aperiodic(result, int(rows[i]), Kind[kind[0].upper()], kind[1:], seen[i])
    return np.asarray(at[told])


def _settled(
    map_: Stroboscope,
    points: np.ndarray,
    who: np.ndarray,
    near: float,
    result: SettledMotions,
    purse: np.ndarray,
) -> np.ndarray:
    """True where a trajectory of float64[k, ROUND, D] lies on an attracting orbit, bool[k]; writes
    the orbits. ``purse``: budget left for closing them.
    """
    if autonomous(map_.system):
        return _settled_unforced(map_.rows(who), points, who, near, result)
    left = purse[who]
    orbits, apart, noise = recurring_orbits(map_.rows(who), points, result.scale[who], near, left)
    purse[who] = left
    beside = orbits.distance(points[:, -1], result.scale[who]) <= BESIDE * np.maximum(apart, noise)
    done: np.ndarray = (orbits.stable | orbits.neutral) & beside
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
    found, scale = unforced.attracted(map_, state, result.scale[who], window, near)
    period, apart = recurrence(points, scale)
    held = np.flatnonzero((found.period == 0) & (apart < ROUNDING))
    if len(held):
        rest = neutral_orbits(
            map_.rows(held), state[held], period[held], scale[held], np.zeros(len(held))
        )
        rest.multipliers = eigenvalues_of(rest.multipliers, map_.period[held, None])
        rest.time[rest.period > 0] = 0.0
        found.put(held, rest)
    done = found.period > 0
    chosen = who[done]
    result.orbits.put(chosen, found.rows(done))
    result.scale[chosen] = scale[done]
    rests = found.time[done] == 0
    result.kind[chosen], result.exponent_error[chosen] = (
        np.where(rests, Kind.EQUILIBRIUM, Kind.LIMIT_CYCLE),
        0.0,
    )
    leading = found.multipliers[done, 0].real * map_.period[done]
    # along a limit cycle nothing grows or dies
    result.exponent[chosen] = np.where(rests, leading, 0.0)
    return done


def _classify_aperiodic(
    map_: Stroboscope, who: np.ndarray, most: int, result: SettledMotions, past: np.ndarray
) -> tuple[np.ndarray, dict[int, tuple[str, float, float]]]:
    """Classify trajectories that don't recur by their exponents; writes what is known, returns
    those that stay unclear, and, of those among them that don't repeat, or are chaotic but nearly
    recur, the kind, the exponent and its error.
    ``past``: their last iterates, float64[k, KEPT_ITERATES, D].
    """
    maps, groups, start = map_.rows(who), [[i] for i in range(len(who))], result.end[who]
    known = past if np.isfinite(past).all() else None
    state, kinds = kinds_of(maps, start, result.scale[who], groups, BUDGET * most, known)
    result.share[who] = MEASURED
    iterates, recurs = _watched(maps, state, who, result, past)
    chaotic = np.array([one is not None and one[0] == Kind.CHAOTIC.word for one in kinds])
    unclear = np.ones(len(who), bool)
    unclear[~chaotic] = ~_long(map_, who[~chaotic], iterates[~chaotic], result)
    tori = unclear & np.array(
        [one is not None and one[0] == Kind.QUASI_PERIODIC.word for one in kinds]
    )
    if tori.any() and not autonomous(map_.system):
        rows = np.flatnonzero(tori)
        recurs[rows] |= may_settle(maps.rows(rows), iterates[rows], result.scale[who[rows]])
    result.share[who[unclear]] = KEPT
    if autonomous(map_.system):  # a limit cycle that is reached slowly, and no torus
        recurs |= unforced.nearly_recurs(maps, result.end[who], ROUND * float(map_.period[0]))
        away = unforced.runs_away(iterates)
        result.kind[who[away]], result.share[who[away]] = Kind.ESCAPED, 1.0
    open_: dict[int, tuple[str, float, float]] = {}
    for i in np.flatnonzero(unclear & np.isfinite(iterates).all(axis=(1, 2))):
        kind, row = kinds[i], int(who[i])
        if result.kind[row] == Kind.ESCAPED or kind is None:
            continue
        near = recurs[i] and (kind[0] != Kind.CHAOTIC.word or not autonomous(map_.system))
        if kind[0] == Kind.NOT_REPEATING.word or (near and kind[0] == Kind.CHAOTIC.word):
            open_[row] = kind
        elif not near:
            unclear[i] = False
            _put_aperiodic(result, row, Kind[kind[0].upper()], kind[1:], iterates[i])
    return who[unclear & (result.kind[who] != Kind.ESCAPED)], open_


def _watched(
    maps: Stroboscope,
    state: np.ndarray,
    who: np.ndarray,
    result: SettledMotions,
    past: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Iterates float64[k, KEPT_ITERATES, D] from states on, and which of them nearly recur by their
    end, bool[k]. Those that led to a state, ``past``, are taken if it is still there.
    """
    iterates = np.full((len(who), KEPT_ITERATES, state.shape[1]), np.nan) if past is None else past
    new = np.flatnonzero((iterates[:, -1] != state).any(axis=1) | np.isnan(iterates[:, 0, 0]))
    if len(new):
        flight = maps.rows(new).launch(state[new], KEPT_ITERATES)
        iterates[new] = flight.advance(KEPT_ITERATES)
        result.end[who[new]] = flight.state
    apart = recurrence(iterates[:, -ROUND:], result.scale[who])[1]
    return iterates, apart < np.maximum(NEAR, maps.noise_of(result.scale[who]))


def _long(
    map_: Stroboscope, who: np.ndarray, iterates: np.ndarray, result: SettledMotions
) -> np.ndarray:
    """True for trajectories int64[k] that settle to an orbit of more than LONGEST periods, bool[k],
    by their last iterates float64[k, KEPT_ITERATES, D]; writes what is known of it.
    """
    period = np.zeros(len(who), np.int64)
    known = np.flatnonzero(np.isfinite(iterates).all(axis=(1, 2)))
    if not autonomous(map_.system):
        period[known] = late_periods(iterates[known], result.scale[who[known]])
    at = np.flatnonzero(period)
    if len(at):
        rows, seen = who[at], iterates[at]
        rates = _growth_along(map_.rows(rows), seen, result.scale[rows])
        vanishes = np.isneginf(rates).any(axis=0)  # at rest on a stop nothing is left of deviations
        with np.errstate(invalid="ignore"):
            errors = np.where(vanishes, 0.0, rates.std(axis=0, ddof=1) / math.sqrt(len(rates)))
        for i, row in enumerate(rows.tolist()):
            exponent = float(rates[:, i].mean()), float(errors[i])
            last_first = np.roll(seen[i], period[at[i]], axis=0)  # it was nearest in the end
            _put_aperiodic(result, row, Kind.LONG_PERIODIC, exponent, last_first)
        result.orbits.period[rows] = period[at]
    return period > 0


def _growth_along(map_: Stroboscope, iterates: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Rates of growth along iterates float64[k, m, D], float64[blocks, k]."""
    blocks = (iterates.shape[1] - 1) // BLOCK
    return growth_rates(map_, iterates[:, -1], scale, blocks, iterates)[1]


def _leave_open(
    map_: Stroboscope,
    who: np.ndarray,
    exponents: dict[int, tuple[str, float, float]],
    result: SettledMotions,
) -> None:
    """Label trajectories still unclassified: orbits that repeat late; chaotic where it was, and
    deviations still grow; not repeating where the exponent is unclear and nothing recurs; else
    unconverged, since more iterates may tell.
    """
    result.kind[who] = Kind.UNCONVERGED
    forced = not autonomous(map_.system)  # any of these may repeat late
    rows = np.array([row for row in who.tolist() if forced or row in exponents], np.int64)
    if not len(rows):
        return
    iterates, recurs = _watched(map_.rows(rows), result.end[rows], rows, result)
    known = _long(map_, rows, iterates, result) | ~np.isfinite(iterates).all(axis=(1, 2))
    for i in np.flatnonzero(~known):
        row = int(rows[i])
        kind, *exponent = exponents.get(row, ("", np.nan, np.nan))
        sure = kind == Kind.NOT_REPEATING.word and not recurs[i]
        if kind == Kind.CHAOTIC.word:
            rates = _growth_along(map_.rows(rows[[i]]), iterates[[i]], result.scale[[row]])
            sure = bool(rates.mean() > max(STILL * rates.std() / math.sqrt(len(rates)), FLOOR))
        if sure:
            _put_aperiodic(result, row, Kind[kind.upper()], (exponent[0], exponent[1]), iterates[i])


def _put_aperiodic(
    result: SettledMotions,
    row: int,
    kind: Kind,
    exponent: tuple[float, float],
    iterates: np.ndarray,
) -> None:
    """Write what a motion that never repeats is."""
    result.kind[row], result.settled[row], result.share[row] = kind, -1, 1.0
    result.exponent[row], result.exponent_error[row] = exponent
    result.iterates[row] = iterates


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
    scale = beyond_rounding(scale, map_)
    return np.where(np.isfinite(scale) & (scale > 0), scale, 1.0)
