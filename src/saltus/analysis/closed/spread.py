"""Ranges of the states over motions: the unit of distances between their points."""

from __future__ import annotations

import numpy as np

from saltus.analysis.closed.search import used_up
from saltus.analysis.solve.tolerances import RESTS
from saltus.flow.maps import Map, Stroboscope
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
    wide = beyond_rounding(np.ptp(points, axis=0), map_)
    return np.where(wide > 0, wide, 1.0)


def beyond_rounding(ranges: np.ndarray, map_: Map) -> np.ndarray:
    """Ranges of the states of a flow, float64[..., D], of which one that is rounding beside others
    of its unit is the largest of these: a body that is held moves by the rounding of others.
    """
    if not isinstance(map_, Stroboscope):  # its states have no units
        return ranges
    units = np.array([map_.system.units[name] for name in map_.states])
    result = np.array(ranges)
    for unit in set(units):
        some = ranges[..., units == unit]
        largest = np.fmax.reduce(some, axis=-1)[..., None]
        result[..., units == unit] = np.where(some > RESTS * largest, some, largest)
    return result
