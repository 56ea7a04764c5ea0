"""Sampling interval of unforced motions: about one rotation.

A turn is the time in which the direction of the motion, states in units of their ranges, goes round
once. It needs no return, so chaotic motions have one too. What is told of attractors doesn't depend
on it; how long it takes does.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from saltus.analysis.closed.cycles import directions
from saltus.analysis.closed.field_zeros import autonomous, jacobian_of
from saltus.errors import ParameterError, must_be
from saltus.flow.maps import Stroboscope, forced
from saltus.flow.taylor import Taylor
from saltus.sentences import Dialect
from saltus.system import System
from saltus.system.structures.told import by_modes
from saltus.units import to_si

#: Motions that are asked.
ASKED = 8
#: Fastest times of the linear part after which they are.
SETTLING = 64
#: Windows that are tried.
WINDOWS = 8
#: Ratio of the lengths of two windows.
ZOOM = 8.0
#: Rotations that a window must hold.
TURNS = 2.0
#: Angle between two samples that they can follow [rad].
FOLLOWED = 0.3
#: Share of the steps from sample to sample that must be followed: impacts turn a motion at once.
SHARE = 0.9


def looks_every(
    system: System, every: Any, start: np.ndarray, parameters: np.ndarray | None = None
) -> float | None:
    """Time between two looks at motions [s]; None for a forced system.

    Parameters
    ----------
    system : System
        Equations and values.
    every : float, str or None
        What was asked for; None to have a turn of the motions found.
    start : float64[k, D]
        Where the motions start.
    parameters : float64[k, P], optional
        Values in the order of ``system.values`` of each; default those of the system.

    Raises
    ------
    ParameterError, UnitError
        If it isn't a positive time, the system is forced, or it depends on time without a period.
    """
    if system.forced_at is not None:
        if every is not None:
            raise ParameterError(f"{system.name} ", forced)
        return None
    if every is None:
        if not autonomous(system):
            raise ParameterError(
                lambda say: (
                    f"{system.name} depends on time, but no parameter is named as the frequency "
                    f"of its forcing: {_naming(system, say)}. If the forcing repeats otherwise, "
                    f"give {say.key('every')}, its period, such as {say.key(every='0.1 s')}; if it "
                    f"doesn't, {say.verb('simulate')} follows its motions, which settle to nothing."
                )
            )
        return _turn(system, start, parameters)
    seconds = to_si(every, "s", "every")
    if not 0 < seconds < math.inf:
        raise must_be("every", "a positive time", every)
    return seconds


def _naming(system: System, say: Dialect) -> str:
    """The name of the frequency of a forcing."""
    if by_modes(system):
        return f"give {say.key('frequency')} of the structure"
    return f"name it by {say.key('forced_at')} in {say.system()}"


def _turn(system: System, start: np.ndarray, parameters: np.ndarray | None) -> float:
    """A turn of the motions from float64[k, D], to two digits: it is the same on every machine."""
    chosen = np.unique(np.linspace(0, len(start) - 1, min(ASKED, len(start))).astype(int))
    rows = None if parameters is None else parameters[chosen]
    begin = np.asarray(start[chosen], float)
    map_ = Stroboscope(system, Taylor(), rows, 1.0).rows(np.arange(len(chosen)))
    fastest = _fastest(map_, begin)
    flight = map_.with_period(fastest).launch(begin, SETTLING)
    state = flight.advance(SETTLING)[:, -1]
    kept = np.isfinite(state).all(axis=1)
    rotation = np.where(np.isfinite(fastest), fastest, 1.0)
    if kept.any():
        rows_kept = np.flatnonzero(kept)
        rotation[rows_kept] = _turning(map_.rows(rows_kept), state[kept], fastest[kept])
    return float(f"{float(np.median(rotation)):.1e}")


def _fastest(map_: Stroboscope, start: np.ndarray) -> np.ndarray:
    """Time of the fastest eigenvalue at each start [s], float64[k]; 1 where none is known."""
    matrices = jacobian_of(map_.system, start, map_.values)
    times = np.ones(len(start))
    for i, matrix in enumerate(matrices):
        rate = np.abs(np.linalg.eigvals(matrix)).max() if np.isfinite(matrix).all() else 0.0
        times[i] = 2.0 * np.pi / rate if rate > 0 else 1.0
    return times


def _turning(map_: Stroboscope, state: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Time of a turn of the motions from float64[k, D] [s]; that of the first guess where a motion
    doesn't turn.
    """
    length, result = 8.0 * first, first.copy()
    rows = np.arange(len(state))
    for _ in range(WINDOWS):
        toward, _, _ = directions(map_.rows(rows), state[rows], length[rows])
        angle = np.arccos(np.clip(np.einsum("kij,kij->ki", toward[:, 1:], toward[:, :-1]), -1, 1))
        with np.errstate(invalid="ignore"):
            followed = (angle < FOLLOWED).mean(axis=1) >= SHARE
            rotations = np.nansum(angle, axis=1) / (2.0 * np.pi)
        done = followed & (rotations >= TURNS)
        result[rows[done]] = length[rows[done]] / rotations[done]
        length[rows] *= np.where(followed, ZOOM, 1.0 / ZOOM)
        rows = rows[~done]
        if not len(rows):
            break
    return result
