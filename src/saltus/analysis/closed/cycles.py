"""Limit cycles of systems without forcing: periodic motions whose period is theirs, found by
Newton's method on a state and the period.

A motion comes back to the plane through one of its states, across the flow, near that state: state
and time are the first guess. Newton's method then solves phi_T(x) = x with x on that plane, for x
and T; the derivative is the tangent flow, jumps at contacts included. Parker & Chua, Practical
Numerical Algorithms for Chaotic Systems (1989), chapter 5. Of the multipliers one is 1, along the
flow; the others are those of the monodromy matrix across it, so that none is mistaken for the
trivial one.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from saltus.analysis.closed.field_zeros import field_of, jacobian_of
from saltus.analysis.closed.motions import ClosedMotions
from saltus.analysis.closed.shooting import Shooting
from saltus.analysis.solve.floquet import nontrivial
from saltus.analysis.solve.newton import newton
from saltus.analysis.solve.tolerances import (
    AMPLIFIED,
    BESIDE,
    CONVERGED,
    DECAYED,
    LONGEST,
    RESTS,
    ROUNDING,
)
from saltus.flow.maps import Stroboscope
from saltus.flow.polynomials import between
from saltus.flow.request import Schedule

#: A state that stays smaller than this is zero [SI].
ZERO = 1e-15
#: Samples of the motion in which a return is searched.
SAMPLES = 4096
#: Ratio of the lengths of two windows.
ZOOM = 8
#: Most windows that are tried, from that of the samples on.
MOST_WINDOWS = 6
#: Cosine of the turn between two samples that follow the motion: 18 degrees.
TURN = 0.95
#: Share of the samples for which that must hold.
FOLLOWED = 0.9
#: A return farther than this, in units of the scale, may be none: a longer window is searched.
FAR = 0.05
#: Rotations in a window after which none is.
ENOUGH = 8
#: Returns that samples can't tell apart: the error of the cubic between them, in units of the
#: scale.
SAMPLED = 1e-6
#: Steps that locate the return.
LOCATED = 3
#: Farthest that a cycle found lies from where it was looked for, in units of the scale.
FARTHEST = 1.0
#: Most turns of a cycle that may have been taken for one: a return is seen in SAMPLES samples, of
#: which a turn has 20 where they follow it.
MOST_PARTS = SAMPLES // 16
#: A point of a limit cycle at which the first state doesn't turn: it is least at point 0.
ASIDE = 23
#: Range of the motion, in units of the scale, below which it is no cycle but rest.
NO_CYCLE = 1e-7


@dataclass
class Returns:
    """The first near return of k motions to the plane across the flow at their start.

    Attributes
    ----------
    time : float64[k]
        When [s]; NaN where none was seen.
    apart : float64[k]
        How far from the start, in units of the scale; inf where none was seen.
    scale : float64[k, D]
        Range of each state in the window that was looked at.
    """

    time: np.ndarray
    apart: np.ndarray
    scale: np.ndarray


def units(high: np.ndarray, low: np.ndarray) -> np.ndarray:
    """Units of states between bounds: their range, their size where they rest, 1 where they have
    decayed to nothing.
    """
    ranges, sizes = high - low, np.maximum(np.abs(high), np.abs(low))
    return np.where(sizes > ZERO, np.where(ranges > RESTS * sizes, ranges, sizes), 1.0)


# -- the first guess -------------------------------------------------------------------------------
def returns(map_: Stroboscope, start: np.ndarray, window: float) -> Returns:
    """The near returns of motions from float64[k, D], looked for over some ``window`` [s]: a finer
    or a longer one where that is needed.
    """
    k, size = start.shape
    result = Returns(np.full(k, np.nan), np.full(k, np.inf), np.ones((k, size)))
    length, rows, refined = np.full(k, float(window)), np.arange(k), np.zeros(k, bool)
    for _ in range(MOST_WINDOWS):
        time, apart, scale, followed, count = _seen(map_.rows(rows), start[rows], length[rows])
        result.scale[rows] = scale
        done = followed & np.isfinite(apart)
        result.time[rows[done]], result.apart[rows[done]] = time[done], apart[done]
        longer = followed & ((count == 0) | (count < ENOUGH) & (apart > FAR)) & ~refined[rows]
        refined[rows[~followed]] = True
        length[rows] *= np.where(followed, ZOOM, 1.0 / ZOOM)
        rows = rows[~followed | longer]
        if not len(rows):
            break
    seen = np.flatnonzero(np.isfinite(result.apart))
    if len(seen):
        _locate(map_.rows(seen), start[seen], seen, result)
    return result


def directions(
    map_: Stroboscope, start: np.ndarray, length: np.ndarray
) -> tuple[np.ndarray, np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """From samples over a window each: the directions of the motion float64[k, SAMPLES, D] in units
    of the ranges of the states, these ranges float64[k, D], and the samples and their rates.
    """
    k, size = start.shape
    samples = map_.with_period(length).run(start, 1, Schedule.even(1, SAMPLES)).samples
    values = {name: np.repeat(column, SAMPLES) for name, column in map_.values.items()}
    rates = field_of(map_.system, samples.reshape(-1, size), values).reshape(k, SAMPLES, size)
    with np.errstate(all="ignore"):
        ranges, sizes = np.ptp(samples, axis=1), np.abs(samples).max(axis=1)
        scale = np.where(
            np.isfinite(ranges) & (ranges > RESTS * sizes), ranges, np.where(sizes > 0, sizes, 1.0)
        )
        scale = np.where(np.isfinite(scale), scale, 1.0)
        across = rates / scale[:, None]
        across /= np.linalg.norm(across, axis=2, keepdims=True)
    return across, scale, (samples, rates)


def _crossings(
    start: np.ndarray,
    across: np.ndarray,
    scale: np.ndarray,
    samples: np.ndarray,
    step: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Crossings, along the flow, of the plane across the flow at the start of each motion.

    Parameters
    ----------
    start, across, scale
        As :func:`directions` has them.
    samples, step : float64[k, SAMPLES, D]
        Samples of the motions, and what their rates make from one to the next.

    Returns
    -------
    time, apart : float64[k, SAMPLES - 2]
        Time in samples, and the distance from the start in units of the scale: inf in an interval
        without a crossing.
    rises : bool[k, SAMPLES - 2]
        Which intervals have one.
    """
    offset, ahead = (samples - start[:, None]) / scale[:, None], step / scale[:, None]
    height = np.einsum("kij,kj->ki", offset, across[:, 0])
    share = height[:, 1:-1] / (height[:, 1:-1] - height[:, 2:])
    rises = (height[:, 1:-1] < 0) & (height[:, 2:] >= 0)
    at = between(offset[:, 1:-1], offset[:, 2:], ahead[:, 1:-1], ahead[:, 2:], share[..., None])
    apart = np.where(rises, np.abs(at).max(axis=2), np.inf)
    time = 1 + np.arange(share.shape[1]) + np.where(np.isfinite(share), share, 0.0)
    return time, np.where(np.isfinite(apart), apart, np.inf), rises


def _first_of_the_nearest(time: np.ndarray, apart: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of the crossings float64[k, m] of k motions: time and distance of the first one that is
    nearly as near as the nearest.
    """
    best, rows = apart.min(axis=1), np.arange(len(apart))
    first = np.argmax(apart <= np.maximum(4.0 * best, SAMPLED)[:, None], axis=1)
    return time[rows, first], np.where(np.isfinite(best), apart[rows, first], np.inf)


def _seen(map_: Stroboscope, start: np.ndarray, length: np.ndarray) -> tuple[np.ndarray, ...]:
    """From samples over a window each: time and distance of the return, range of the states,
    whether samples follow the motion, turns.
    """
    across, scale, (samples, rates) = directions(map_, start, length)
    step = (length / SAMPLES)[:, None, None]
    with np.errstate(all="ignore"):
        cosines = np.einsum("kij,kij->ki", across[:, 1:], across[:, :-1])
        followed = (cosines > TURN).mean(axis=1) >= FOLLOWED
        time, apart, rises = _crossings(start, across, scale, samples, step * rates)
    time, apart = _first_of_the_nearest(time, apart)
    return time * length / SAMPLES, apart, scale, followed, rises.sum(axis=1)


def close_returns(map_: Stroboscope, start: np.ndarray, edges: np.ndarray) -> list[Returns]:
    """The nearest returns of motions from float64[k, D] in each of some windows of time, which meet
    at the edges float64[m + 1] [s].

    Distances are in units of the motion up to the return, so that a slow spiral isn't nearer than a
    loop that almost closes; ``scale`` is the range of each state up to there.
    """
    longest, rows = edges[-1], np.arange(len(start))
    across, scale, (samples, rates) = directions(map_, start, np.full(len(start), longest))
    with np.errstate(all="ignore"):
        time, apart, _ = _crossings(start, across, scale, samples, longest / SAMPLES * rates)
        high, low = (extreme.accumulate(samples, axis=1) for extreme in (np.maximum, np.minimum))
        ranges = high - low
        apart = apart / (ranges / scale[:, None]).max(axis=2)[:, 1:-1]
        apart = np.where(apart < np.inf, apart, np.inf)
        moves = np.isfinite(ranges) & (ranges > RESTS * np.abs(start)[:, None])
    result = []
    for low_edge, high_edge in itertools.pairwise(edges * (SAMPLES / longest)):
        inside = (time >= low_edge) & (time <= high_edge)
        when, far = _first_of_the_nearest(time, np.where(inside, apart, np.inf))
        at = rows, when.astype(int)
        when = np.where(np.isfinite(far), when * (longest / SAMPLES), np.nan)
        result.append(Returns(when, far, np.where(moves[at], ranges[at], scale)))
    return result


def _locate(map_: Stroboscope, start: np.ndarray, which: np.ndarray, result: Returns) -> None:
    """Move the times of return onto the plane, and measure the distance there."""
    time, scale = result.time[which], result.scale[which]
    normal = field_of(map_.system, start, map_.values) / scale
    for _ in range(LOCATED):
        end = map_.with_period(time).run(start, 1).state
        speed = np.einsum("kj,kj->k", field_of(map_.system, end, map_.values) / scale, normal)
        with np.errstate(all="ignore"):
            step = -np.einsum("kj,kj->k", (end - start) / scale, normal) / speed
        time = np.where(np.isfinite(step) & (np.abs(step) < 0.1 * time), time + step, time)
    end = map_.with_period(time).run(start, 1).state
    with np.errstate(invalid="ignore"):
        apart = np.abs((end - start) / scale).max(axis=1)
    result.time[which], result.apart[which] = time, np.where(np.isfinite(apart), apart, np.inf)


# -- Newton's method -------------------------------------------------------------------------------
def find_cycles(
    map_: Stroboscope, start: np.ndarray, time: np.ndarray, scale: np.ndarray
) -> tuple[ClosedMotions, np.ndarray]:
    """The limit cycles near states float64[k, D] that nearly recur after times float64[k] [s].

    Parameters
    ----------
    map_ : Stroboscope
        k flows without forcing.
    start, time
        A first guess of each.
    scale : float64[k, D]
        Range of each state.

    Returns
    -------
    cycles : ClosedMotions
        Each by points in equal steps of its time, from where the first state that moves is least.
    moved : float64[k]
        How far from the first guess Newton's method arrived, in units of the scale; NaN where it
        found none.
    """
    result, moved = ClosedMotions.none(*start.shape), np.full(len(start), np.nan)
    scale = np.maximum(scale, DECAYED)
    x, time, found = _newton(map_, start, time, scale)
    rows = np.flatnonzero(found)
    if not len(rows):
        return result, moved
    mine = map_.rows(rows)
    time = least_part(mine, x[rows], time[rows], scale[rows])
    first = first_point(mine, x[rows], time)
    points = mine.with_period(time).run(first, 1, Schedule.even(1, LONGEST)).samples
    moves = (np.ptp(points, axis=1) / scale[rows]).max(axis=1) > NO_CYCLE
    multipliers = _multipliers(mine.with_period(time), first)
    good = moves & np.isfinite(points).all(axis=(1, 2)) & np.isfinite(multipliers).all(axis=1)
    rows, period = rows[good], np.full(np.count_nonzero(good), LONGEST)
    result.put(
        rows,
        ClosedMotions(
            period, points[good], multipliers[good], time[good], np.full(len(rows), np.nan)
        ),
    )
    moved[rows] = np.abs((x[rows] - start[rows]) / scale[rows]).max(axis=1)
    return result, moved


def attracting_cycles(
    map_: Stroboscope, state: np.ndarray, window: float, near: float
) -> tuple[ClosedMotions, np.ndarray, np.ndarray]:
    """The limit cycles of trajectories that nearly return.

    Parameters
    ----------
    map_ : Stroboscope
        k flows without forcing.
    state : float64[k, D]
        Where each trajectory stands.
    window : float
        Time over which a return is looked for first [s].
    near : float
        Distance of a return, in units of the range of the motion, that is worth a try by Newton's
        method.

    Returns
    -------
    cycles : ClosedMotions
        What Newton's method found.
    beside : bool[k]
        Which attract, and lie beside their trajectory.
    scale : float64[k, D]
        Range of each state in the window.
    """
    seen = returns(map_, state, window)
    noise = map_.noise_of(seen.scale)
    cycles, moved = find_cycles(
        map_, state, np.where(seen.apart < np.maximum(near, noise), seen.time, np.nan), seen.scale
    )
    with np.errstate(invalid="ignore"):
        beside = cycles.stable & (
            moved <= BESIDE * np.maximum(np.maximum(seen.apart, ROUNDING), noise)
        )
    return cycles, beside, seen.scale


def _newton(
    map_: Stroboscope, start: np.ndarray, time: np.ndarray, scale: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """States float64[k, D] and periods float64[k] [s] that solve phi_T(x) = x, and where the
    iteration converged, bool[k].
    """
    guess = Shooting(map_, np.arange(len(start)), start[:, None], scale, time=time)
    enough = CONVERGED if map_.exact else map_.noise_of(scale)
    zeros = newton(guess, guess.unknowns, guess.units, enough=enough, farthest=FARTHEST)
    return zeros.z[:, :-1], zeros.z[:, -1], zeros.found


def least_part(
    map_: Stroboscope, x: np.ndarray, period: np.ndarray, scale: np.ndarray
) -> np.ndarray:
    """The smallest part of each period after which the motion is back already."""
    parts = np.arange(MOST_PARTS, 1, -1)
    states = map_.with_period(period).run(x, 1, Schedule(0 * parts, 1.0 / parts)).samples
    with np.errstate(invalid="ignore"):
        back = np.abs((states - x[:, None]) / scale[:, None]).max(axis=2) < 10 * AMPLIFIED
    return period / np.where(back.any(axis=1), parts[np.argmax(back, axis=1)], 1)


def first_point(map_: Stroboscope, x: np.ndarray, period: np.ndarray) -> np.ndarray:
    """The state of each cycle at which the first state that moves is least: where its points begin,
    whoever found it.
    """
    samples = map_.with_period(period).run(x, 1, Schedule.even(1, SAMPLES)).samples
    ranges = np.ptp(samples, axis=1)
    rows, column = (
        np.arange(len(x)),
        np.argmax(ranges > RESTS * np.abs(samples).max(axis=1), axis=1),
    )
    least = np.argmin(samples[rows, :, column], axis=1)
    state: np.ndarray = samples[rows, least]
    for _ in range(LOCATED):  # where its rate vanishes
        rate = field_of(map_.system, state, map_.values)
        slope = np.einsum(
            "kj,kj->k", jacobian_of(map_.system, state, map_.values)[rows, column], rate
        )
        with np.errstate(all="ignore"):
            step = -rate[rows, column] / slope
        step = np.where(np.abs(step) < 2 * period / SAMPLES, step, 0.0)
        moved = map_.with_period(np.where(step <= 0, step + period, step)).run(state, 1).state
        state = np.where((step != 0)[:, None], moved, state)
    return state


def _multipliers(map_: Stroboscope, x: np.ndarray) -> np.ndarray:
    """1, and the eigenvalues of the monodromy matrix across the flow, the largest first;
    complex128[k, D].
    """
    _, matrices = map_.tangent(x, 1)
    rates = field_of(map_.system, x, map_.values)
    size = x.shape[1]
    result = np.full((len(x), size), np.nan + 0j)
    for i, (matrix, rate) in enumerate(zip(matrices, rates, strict=True)):
        if np.isfinite(matrix).all() and np.isfinite(rate).all() and rate.any():
            result[i] = with_trivial(matrix[None], rate[None])
    return result


def with_trivial(segments: np.ndarray, flows: np.ndarray) -> np.ndarray:
    """1, and the multipliers of a limit cycle across the flow, the largest first, complex128[D];
    see :func:`saltus.analysis.solve.floquet.nontrivial`.
    """
    return np.append(1.0, nontrivial(segments, flows))[: segments.shape[1]]
