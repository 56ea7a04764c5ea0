"""Equilibria and limit cycles that motions without forcing come to, found and verified in the same
way for many trajectories at once.
"""

from __future__ import annotations

import numpy as np

from saltus.analysis.closed.cycles import attracting_cycles, find_cycles, returns
from saltus.analysis.closed.field_zeros import captured, find_equilibria
from saltus.analysis.closed.measures import Measures
from saltus.analysis.closed.motions import ClosedMotions
from saltus.analysis.inputs.outputs import Outputs
from saltus.contact.guards import is_hold
from saltus.flow.maps import Stroboscope
from saltus.language.evaluate import evaluate
from saltus.system import margin_gaps
from saltus.system.modes import mode_number, sides

#: Parts of a motion that must each be larger than the one before, to run away.
EIGHTHS = 8
#: Ratio of the last of them to the first, at least.
GROWN = 3.0
#: Returns farther than this, in units of the range, are no sign of a limit cycle.
TORUS = 1e-2


def attracted(
    map_: Stroboscope, state: np.ndarray, scale: np.ndarray, window: float, near: float
) -> tuple[ClosedMotions, np.ndarray]:
    """Find the equilibria that capture trajectories, and the attracting limit cycles that they have
    come to.

    Parameters
    ----------
    map_ : Stroboscope
        k flows without forcing.
    state : float64[k, D]
        Where each trajectory stands.
    scale : float64[k, D]
        Range of each state in its motion.
    window : float
        Time over which a return is looked for first [s].
    near : float
        Distance of a return, in units of the scale, that is worth a try by Newton's method.

    Returns
    -------
    motions : ClosedMotions
        Their equilibria and limit cycles; period 0 where there is none yet.
    scale : float64[k, D]
        Range of each state on the limit cycle; of an equilibrium that which was given.
    """
    result, size = ClosedMotions.none(*state.shape), scale.copy()
    equilibria = find_equilibria(map_, state, scale)
    here = np.flatnonzero(captured(map_, equilibria, state, scale))
    result.put(here, equilibria.rows(here))
    size[here] = np.maximum(scale[here], np.abs(equilibria.points[here, 0]))
    rows = np.flatnonzero(result.period == 0)
    if len(rows):
        cycles, beside, own = attracting_cycles(map_.rows(rows), state[rows], window, near)
        result.put(rows[beside], cycles.rows(beside))
        size[rows[beside]] = own[beside]
    return result, size


def nearly_recurs(map_: Stroboscope, state: np.ndarray, window: float) -> np.ndarray:
    """True where a motion returns so near to its start that it may approach a cycle, bool[k]."""
    return np.asarray(returns(map_, state, window).apart < TORUS)


def runs_away(iterates: np.ndarray) -> np.ndarray:
    """True where a motion of float64[k, m, D] only grows: more in each eighth than before, and much
    in all, bool[k].
    """
    sizes = np.stack(
        [np.abs(part).max(axis=(1, 2)) for part in np.array_split(iterates, EIGHTHS, axis=1)]
    )
    with np.errstate(invalid="ignore"):
        return np.asarray((np.diff(sizes, axis=0) > 0).all(axis=0) & (sizes[-1] > GROWN * sizes[0]))


def measure_equilibria(
    map_: Stroboscope,
    place: np.ndarray,
    rows: np.ndarray,
    numbers: Measures,
    outputs: Outputs | None = None,
) -> None:
    """Fill in the rows int64[m] of equilibria float64[m, D]: the size of their states and outputs,
    and the distance to the nearest boundary.
    """
    held = any(is_hold(guard) for guard in map_.system.guards)
    if outputs is not None and not held:
        mode = mode_number(sides(map_.system, 0.0, place.T, map_.values))
        place = outputs.values(0.0, place, map_.values, mode)
    size = place.shape[1]
    numbers.maximum[rows, :size] = numbers.minimum[rows, :size] = numbers.mean[rows, :size] = place
    numbers.deviation[rows, :size], numbers.span[rows] = 0.0, 0.0
    states, values = dict(zip(map_.system.states, place.T, strict=False)), map_.values
    bits: list[np.ndarray] = []
    nearest = np.full(len(rows), np.inf)
    counted, _ = margin_gaps(map_.system)
    for number, guard in enumerate(map_.system.guards):
        if is_hold(guard):
            continue
        (gap,) = evaluate([guard.gap], states=states, values=values, bits=bits)
        bits.append(np.broadcast_to(gap, len(rows)) > 0)
        if number in counted:
            nearest = np.minimum(nearest, np.abs(gap))
    numbers.margin[rows] = nearest
    for row in rows:
        numbers.turning[row] = numbers.mean[row][None]


def multipliers_and_eigenvalues(
    values: np.ndarray, equilibria: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Floquet multipliers, and eigenvalues [1/s] of what rests, complex128[m, D]; each NaN where it
    is the other.
    """
    return np.where(equilibria[:, None], np.nan + 0j, values), np.where(
        equilibria[:, None], values, np.nan + 0j
    )


def eigenvalues_of(multipliers: np.ndarray, time: np.ndarray | float) -> np.ndarray:
    """Eigenvalues [1/s] of what rests, complex128[..., D], from the multipliers over a time [s];
    -inf of directions that vanish.
    """
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(np.abs(multipliers)) / time + 1j * np.angle(multipliers) / time)


def close_again(
    map_: Stroboscope, start: np.ndarray, time: np.ndarray, scale: np.ndarray
) -> ClosedMotions:
    """Equilibria (time 0) and limit cycles (their period) from those at other parameter values."""
    result = ClosedMotions.none(len(start), start.shape[1])
    equilibria, turns = np.flatnonzero(time == 0), np.flatnonzero(time > 0)
    if len(equilibria):
        result.put(
            equilibria, find_equilibria(map_.rows(equilibria), start[equilibria], scale[equilibria])
        )
    if len(turns):
        result.put(turns, find_cycles(map_.rows(turns), start[turns], time[turns], scale[turns])[0])
    return result
