"""Responses that are one in several sets of values: an orbit of one set is followed to all others.

All sets are followed at once, each by steps of its own along the straight way between the values.
Newton's method begins on the secant; where it fails, goes to another period or farther than a tenth
of the orbit's range, the step is halved. Allgower & Georg, Introduction to Numerical Continuation
Methods (2003), chapter 6. A single motion is followed by :mod:`saltus.analysis.closed.track`, to a
tighter rule.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from saltus.analysis.attractors.find_responses import motion_range
from saltus.analysis.attractors.grid_responses import GridResponses
from saltus.analysis.closed.motions import ClosedMotion, ClosedMotions
from saltus.analysis.closed.orbits import find_orbits
from saltus.flow.maps import Stroboscope
from saltus.results.dataset.kinds import Kind

#: Shortest step, as a share of the way; an orbit that needs a shorter one is lost.
SHORTEST = 1.0 / 256
#: Most steps that are tried, failed ones included.
MOST_STEPS = 100
#: Tries to reach a set, each from the nearest one in which the orbit is known.
PASSES = 3
#: Farthest that a point goes from where it is expected in one step, in ranges of the orbit.
FARTHEST = 0.1
#: Most responses that are told apart: each is followed to all sets.
MOST_RESPONSES = 24
#: Distance of an orbit of a method with errors from the exact one, at most, in its ranges.
SCATTERED = 0.01
#: Number of a response beyond these.
OTHER = -5


@dataclass(frozen=True)
class TrackedResponse:
    """A response that is known in all sets.

    Attributes
    ----------
    kind : Kind
        Of motion.
    period : int
        n of an nT; 0 of what never repeats, and without forcing.
    exists : bool[m]
        Whether it is there, and attracts, in each set. Of what can't be followed: whether a start
        reaches it.
    complete : bool
        Whether it was followed to all sets.
    """

    kind: Kind
    period: int
    exists: np.ndarray
    complete: bool


def track_all(map_: Stroboscope, motion: ClosedMotion, at: int, scale: np.ndarray) -> ClosedMotions:
    """An orbit of one row of a map followed to all others.

    Where the straight way to a row leaves the range of the orbit, it is tried again from the
    nearest row in which the orbit was found, PASSES times.

    Parameters
    ----------
    map_ : Stroboscope
        A row for each set.
    motion : ClosedMotion
        The orbit.
    at : int
        Its row.
    scale : float64[D]
        Range of each state over it.

    Returns
    -------
    ClosedMotions
        Of each row; of period 0 where it was lost.
    """
    from scipy.spatial import cKDTree

    found = ClosedMotions.none(len(map_), len(scale))
    found.period[at], found.points[at, : motion.period] = motion.period, motion.points
    found.multipliers[at], found.mismatch[at] = motion.multipliers, motion.mismatch
    spread = np.ptp(map_.parameters, axis=0)
    places = map_.parameters[:, spread > 0] / spread[spread > 0]
    for _ in range(PASSES):
        lost, known = np.flatnonzero(found.period == 0), np.flatnonzero(found.period > 0)
        if not len(lost):
            break
        origin = known[cKDTree(places[known]).query(places[lost])[1]]
        _track(map_, found, origin, lost, motion.period, scale)
        if (found.period[lost] == 0).all():
            break
    return found


def _track(
    map_: Stroboscope, found: ClosedMotions, origin: np.ndarray, rows: np.ndarray, n: int,
    scale: np.ndarray,
) -> None:  # fmt: skip
    """Follow the orbits of rows ``origin`` int64[m] to the rows int64[m]; writes those that
    arrive.
    """
    before, after = map_.parameters[origin], map_.parameters[rows]
    share, step, older = np.zeros(len(rows)), np.ones(len(rows)), np.zeros(len(rows))
    here = found.points[origin, 0]
    last, who = here.copy(), np.arange(len(rows))
    for _ in range(MOST_STEPS):
        to = np.minimum(share[who] + step[who], 1.0)
        there = before[who] + to[:, None] * (after[who] - before[who])
        there[to == 1.0] = after[who[to == 1.0]]
        way = Stroboscope(map_.system, map_.method, there, threads=map_.threads)
        gone = share[who] - older[who]
        ahead = np.where(gone > 0, (to - share[who]) / np.where(gone > 0, gone, 1.0), 0.0)
        guess = here[who] + ahead[:, None] * (here[who] - last[who])
        scales, noise = np.broadcast_to(scale, guess.shape), np.full(len(who), map_.noise)
        orbits = find_orbits(way, guess, np.full(len(who), n), scales, noise, max_slow=3)
        apart = np.abs((orbits.points - guess[:, None]) / scale).max(axis=2)
        apart = np.where(np.isnan(apart), np.inf, apart)
        nearest = apart.argmin(axis=1)
        good = (orbits.period == n) & (apart.min(axis=1) <= FARTHEST)
        moved = who[good]
        older[moved], last[moved] = share[moved], here[moved]
        share[moved] = to[good]
        here[moved] = orbits.points[np.flatnonzero(good), nearest[good]]
        step[who] *= np.where(good, 2.0, 0.5)
        arrived = good & (to == 1.0)
        found.put(rows[who[arrived]], orbits.rows(arrived))
        who = who[~arrived & (step[who] >= SHORTEST)]
        if not len(who):
            break


def tell_apart(
    map_: Stroboscope,
    settled: GridResponses,
    starts: int,
    apart: float,
    progress: Callable[[float], None] | None,
) -> tuple[list[TrackedResponse], np.ndarray]:
    """The responses that starts reach in any of the sets, and which one each start reaches.

    The first motion that is no known response is a new one, and is followed to all sets, until
    every motion is known or there are MOST_RESPONSES. What can't be followed is told apart by its
    kind alone: what never repeats, and motions of systems without forcing.

    Parameters
    ----------
    map_ : Stroboscope
        By an exact method, with a row for each set.
    settled : GridResponses
        Motions of each start in each set: row set * starts + start.
    starts : int
        Number of starts.
    apart : float
        Distance at which two orbits are one, in ranges of the motion.
    progress : callable, optional
        Gets the share done.

    Returns
    -------
    responses : list of TrackedResponse
    reached : int64[sets, starts]
        The response, OTHER, or a code of Kind below zero.
    """
    motions = settled.motions
    label = np.where(motions.kind < 0, motions.kind, OTHER)
    of = np.repeat(np.arange(len(map_)), starts)
    open_, found = motions.kind >= 0, list[TrackedResponse]()
    while open_.any() and len(found) < MOST_RESPONSES:
        row = int(np.argmax(open_))
        kind, n = Kind(int(motions.kind[row])), int(motions.orbits.period[row])
        alike = open_ & (motions.kind == kind)
        exists, followed = np.zeros(len(map_), bool), kind == Kind.PERIODIC
        if followed:
            place = map_.rows(of[[row]])
            scale = motion_range(place, motions.orbits.points[row, :1])[0]
            orbits = track_all(map_, motions.orbits[row], int(of[row]), scale)
            exists |= orbits.stable
            rows = np.flatnonzero(alike & (motions.orbits.period == n))
            near = orbits.distance(motions.orbits.points[rows, 0], motions.scale[rows], of[rows])
            alike = np.zeros(len(alike), bool)
            alike[rows] = near <= apart
            alike[row] = True
        label[alike], open_ = len(found), open_ & ~alike
        exists[of[alike]] = True
        period = n if followed else 0
        found.append(TrackedResponse(kind, period, exists, followed))
        if progress:
            progress(1.0 - float(open_.mean()))
    return found, label.reshape(len(map_), starts)
