"""Ranges of the states over motions: the unit of distances between their points."""

from __future__ import annotations

import numpy as np

from saltus.analysis.closed.search import used_up
from saltus.flow.maps import Stroboscope
from saltus.flow.request import Schedule

#: Iterates after which the range of the states is taken, where no box gives it.
SPREAD = 32
#: Trajectories that are watched between two iterates for it.
WATCHED = 64


def spread(map_: Stroboscope, start: np.ndarray) -> np.ndarray:
    """Range of each state over the starts, their first iterates and the time between two of them; 1
    for a state that never moves. Starts whose budget is used up aren't looked at.
    """
    flight = map_.launch(start, SPREAD)
    iterates = flight.advance(SPREAD)
    if (followed := ~used_up(flight)).any():
        start, iterates = start[followed], iterates[followed]
    last = iterates[:WATCHED, -1][np.isfinite(iterates[:WATCHED, -1]).all(axis=1)]
    between = map_.run(last, 1, Schedule.even(1, SPREAD)).samples
    points = np.concatenate(
        [start, iterates.reshape(-1, start.shape[1]), between.reshape(-1, start.shape[1])]
    )
    points = points[np.isfinite(points).all(axis=1)]
    wide = np.ptp(points, axis=0)
    return np.where(wide > 0, wide, 1.0)
