"""Limit cycles among the attractors of a flow without forcing: found from where trajectories stand,
known by the places they pass.
"""

from __future__ import annotations

import numpy as np

from saltus.analysis.attractors.aperiodic import SURVEY_ITERATES, SampledMotion
from saltus.analysis.closed.cycles import attracting_cycles
from saltus.analysis.closed.motions import ClosedMotions
from saltus.analysis.solve.tolerances import NEAR, ROUND
from saltus.flow.maps import Stroboscope
from saltus.flow.request import Schedule
from saltus.results.dataset.kinds import Kind

#: Places on a cycle, as shares of its time, from which it is looked for.
PLACES = np.array([0.0, 0.36, 0.71, 0.87])


def limit_cycles(
    map_: Stroboscope, state: np.ndarray, window: float, scale: np.ndarray
) -> list[SampledMotion]:
    """Attracting limit cycles on which some trajectories float64[k, D] lie, each by places in equal
    steps of its time.

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
    map_ = map_.rows(np.arange(len(state)))
    cycles, beside, _ = attracting_cycles(map_, state, window, NEAR)
    rows = np.flatnonzero(beside)
    if not len(rows):
        return []
    once = map_.rows(rows).with_period(cycles.time[rows])
    points = once.run(cycles.points[rows, 0], 1, Schedule.even(1, SURVEY_ITERATES)).samples
    return [SampledMotion(Kind.LIMIT_CYCLE.word, 0.0, 0.0, one, scale) for one in points]


def cycle_of(map_: Stroboscope, one: SampledMotion) -> ClosedMotions:
    """A limit cycle that is known by its places.

    Newton's method begins at several of them: at a jump of the state there is no derivative.
    """
    start = one.points[(PLACES * len(one.points)).astype(int)]
    cycles, _, _ = attracting_cycles(
        map_.rows(np.zeros(len(start), np.int64)), start, ROUND * float(map_.period[0]), NEAR
    )
    return cycles.rows(np.array([np.argmax(cycles.period > 0)]))
