"""Limit cycles among the attractors of a flow without forcing: found from where trajectories stand, known by the places they pass."""

from __future__ import annotations

import numpy as np

from saltus.analysis.orbits.aperiodic import TRAIL, Wandering
from saltus.analysis.orbits.cycles import Cycles, find_cycles, returns
from saltus.flow.engine import Schedule
from saltus.flow.maps import Stroboscope

#: Looks at the motion whose time is the first window for returns.
ROUND = 128
#: Name of the kind.
LIMIT_CYCLE = "limit_cycle"
#: A return so near, in units of the range of the motion, is worth a try by Newton's method.
NEAR = 1e-3
#: Farthest that the cycle found may lie from the trajectory, in returns: 1/(1 - multiplier) is the ratio of the two.
BESIDE, ROUNDING = 30.0, 1e-9


def limit_cycles(map_: Stroboscope, state: np.ndarray, window: float, scale: np.ndarray) -> list[Wandering]:
    """Attracting limit cycles on which some trajectories float64[k, D] lie, each by places in equal steps of its time.

    Parameters
    ----------
    map_ : Stroboscope
        Of a system without forcing.
    state : float64[k, D]
        Where they stand.
    window : float
        Time over which returns are looked for first [s].
    scale : float64[D]
        Range of each state, for boxes.
    """
    cycles, near = _closed(map_, state, window)
    rows = np.flatnonzero(cycles.stable & near)
    if not len(rows):
        return []
    once = map_.rows(rows).with_period(cycles.period[rows])
    points = once.run(cycles.points[rows, 0], 1, Schedule.even(1, TRAIL)).samples
    return [Wandering(LIMIT_CYCLE, 0.0, 0.0, one, scale) for one in points]


def cycle_of(map_: Stroboscope, one: Wandering) -> Cycles:
    """Period, points and multipliers of a limit cycle that is known by its places: its first one is where it begins."""
    return _closed(map_, one.points[:1], ROUND * float(map_.period[0]))[0]


def _closed(map_: Stroboscope, state: np.ndarray, window: float) -> tuple[Cycles, np.ndarray]:
    """What Newton's method makes of the returns of trajectories, and whether each lies beside its cycle, bool[k]."""
    map_ = map_.rows(np.arange(len(state)))
    seen = returns(map_, state, window)
    tried = np.where(seen.apart < np.maximum(NEAR, map_.noise_of(seen.scale)), seen.time, np.nan)
    cycles = find_cycles(map_, state, tried, seen.scale)
    with np.errstate(invalid="ignore"):
        near = cycles.moved <= BESIDE * np.maximum(np.maximum(seen.apart, ROUNDING), map_.noise_of(seen.scale))
    return cycles, near
