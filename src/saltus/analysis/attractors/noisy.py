"""Periodic motions that errors of the map itself keep from closing: how far its points scatter
about an orbit of the exact map.

Errors of ode45 at a loose tolerance act as bounded noise does. An orbit that such noise blurs is
known by the exact one: each point of the motion lies beside the point of the orbit at the same
phase, for the whole survey. Loops closer together than the scatter can't be told apart in the
motion itself: Crutchfield, Farmer & Huberman, Physics Reports 92 (1982) 45-82, who call it noisy
periodic.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from saltus.analysis.attractors.aperiodic import SURVEY_ITERATES, SampledMotion
from saltus.analysis.closed.motions import ClosedMotion
from saltus.flow.maps import Map, Stroboscope
from saltus.flow.request import Schedule
from saltus.results.dataset.kinds import Kind
from saltus.results.dataset.schema import period_text

#: Largest distance from the orbit, in units of the range of the motion, that is still scatter about
#: it. Returns of ode45 on the rig scatter by 0.05 to 4 % (decision 11); wrong phases of an orbit,
#: and other orbits, lie tens of per cent away.
NARROW = 0.05
#: A stretch of the motion belongs to the orbit if it strays no farther than this multiple of what
#: was seen when the orbit was found.
ROOM = 2.0
#: Iterates of one call, as in the search for attractors: a step of ode45 ends at each.
ITERATES_PER_CALL = 128
#: Samples of the exact motion in each period, for its range.
BETWEEN = 32


@dataclass(frozen=True)
class Noisy(SampledMotion):
    """An orbit about which errors of a map keep its motion scattered; ``points`` and ``exponent``
    are the orbit's.

    Attributes
    ----------
    orbit : ClosedMotion
        Of the exact map; it attracts.
    size : float64[D]
        Range of each state in the exact motion.
    scatter : float64[D]
        Root mean square distance of the map's points from those of the orbit at the same phase
        [units of the states].
    stray : float
        Largest such distance, in units of the range.
    """

    orbit: ClosedMotion
    size: np.ndarray
    scatter: np.ndarray
    stray: float

    def share(self, points: np.ndarray) -> np.ndarray:
        """Share of the points of trajectories float64[k, n, D] that lie beside the orbit's at the
        phase, float64[k]; 0 if not the last.
        """
        width, result = ROOM * self.stray, np.zeros(len(points))
        last = np.abs((points[:, -1:] - self.orbit.points) / self.size).max(axis=2).min(axis=1)
        there = np.flatnonzero(last <= width)
        result[there] = (
            np.abs(apart(points[there], self.orbit.points, self.size)).max(axis=2) <= width
        ).mean(axis=1)
        return result


@dataclass(frozen=True)
class Stray:
    """A motion that never settles: what the exact map makes of it.

    Attributes
    ----------
    period : int
        Period of the exact orbit that it would settle to; 0 if there is none.
    distance : float
        Largest distance from this orbit, in units of the range of the exact motion; NaN without
        one.
    """

    period: int
    distance: float


def apart(runs: np.ndarray, points: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Differences of trajectories float64[k, m, D] from an orbit float64[n, D], each at its best
    shift of the phase, in units of ``size``.

    The best shift is that of the smallest mean square: one for the whole trajectory. Where a
    trajectory isn't finite, inf.
    """
    n, m = len(points), runs.shape[1]
    best, least = np.full(runs.shape, np.inf), np.full(len(runs), np.inf)
    for shift in range(n):
        difference = (runs - points[(np.arange(m) + shift) % n]) / size
        square = np.mean(difference**2, axis=(1, 2))
        nearer = square < least
        best[nearer], least[nearer] = difference[nearer], square[nearer]
    return best


def blurred(map_: Map, orbit: ClosedMotion, scale: np.ndarray) -> Noisy | None:
    """What errors of a map make of an orbit of the exact one: scatter about it; None if the motion
    leaves it.

    The map is started on each point of the orbit for SURVEY_ITERATES iterates. So the scatter is a
    property of map and orbit: the starts from which the orbit was found change it by what the
    orbit's last bits do, some per cent.

    Parameters
    ----------
    map_ : Map
        An inexact map.
    orbit : ClosedMotion
        Of ``map_.exact_map``; it attracts.
    scale : float64[D]
        Range of each state in all motions.
    """
    travel = map_.launch(orbit.points, SURVEY_ITERATES)
    runs = np.concatenate(
        [travel.advance(ITERATES_PER_CALL) for _ in range(SURVEY_ITERATES // ITERATES_PER_CALL)],
        axis=1,
    )
    size = motion_size(map_, orbit, scale)
    distance = apart(runs, orbit.points, size)
    stray = float(np.abs(distance).max())
    if not stray <= NARROW:
        return None
    scatter = size * np.sqrt(np.mean(distance**2, axis=(0, 1)))
    return Noisy(
        Kind.NOISY_PERIODIC.word,
        orbit.exponent,
        0.0,
        orbit.points,
        scale,
        orbit,
        size,
        scatter,
        stray,
    )


def motion_size(map_: Map, orbit: ClosedMotion, scale: np.ndarray) -> np.ndarray:
    """Range of each state in the exact motion on an orbit, float64[D]; where a state rests, that of
    all motions.
    """
    exact, between = map_.exact_map, orbit.points
    if isinstance(exact, Stroboscope):
        between = exact.run(
            orbit.points[:1], orbit.period, Schedule.even(orbit.period, BETWEEN)
        ).samples[0]
    wide = np.ptp(between, axis=0)
    return np.where(wide > 0, wide, scale)


def stray_of(
    map_: Map, orbit: ClosedMotion | None, iterates: np.ndarray, scale: np.ndarray
) -> Stray:
    """How far a trajectory float64[m, D] of an inexact map strays from an exact orbit; unknown if
    there is none.
    """
    if orbit is None:
        return Stray(0, np.nan)
    return Stray(
        orbit.period,
        float(np.abs(apart(iterates[None], orbit.points, motion_size(map_, orbit, scale))).max()),
    )


def stray_attrs(strays: Sequence[Stray]) -> dict[str, str | float]:
    """What a result says of motions that never settled for errors of the method: attributes, none
    if there are none.
    """
    if not strays:
        return {}
    far = [one.distance for one in strays if one.period]
    words = ", ".join(period_text(n) for n in sorted({one.period for one in strays if one.period}))
    return {"unconverged_exactly": words, "unconverged_stray": max(far, default=np.nan)}


def keep_to(attractors: Sequence[SampledMotion], runs: np.ndarray, inside: float) -> np.ndarray:
    """Which of some attractors, known by where they go, trajectories float64[k, m, D] keep to with
    such a share, int64[k]; -1 for none.
    """
    if not attractors:
        return np.full(len(runs), -1, np.int64)
    shares = np.stack([one.share(runs) for one in attractors], axis=1)
    return np.where(shares.max(axis=1) >= inside, shares.argmax(axis=1), -1)
