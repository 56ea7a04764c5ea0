"""Turning points of sums of waves (flow/waves.py), and their smallest and largest values: by the
compiled search of kernels/waves, motion by motion.
"""

from __future__ import annotations

import numpy as np

from saltus.codegen.module import WAVE_LANES, waves_module
from saltus.flow.waves import WaveLegs
from saltus.interrupt import check_stop
from saltus.kernels.waves import layout

#: Turning points of a motion for which there is room at first.
ROOM = 256


def extremes(one: WaveLegs) -> np.ndarray:
    """Smallest and largest value of each quantity, float64[2, M, R]."""
    quantities, search = one.rows.shape[1], _Search(one)
    found = np.empty((2, one.motions, quantities))
    for motion in range(one.motions):
        limits = np.repeat([[np.inf], [-np.inf]], quantities, axis=1)
        search(layout.EXTREMES, motion, limits)
        found[:, motion] = limits
    return found


def least_turns(one: WaveLegs, rows: np.ndarray) -> np.ndarray:
    """Smallest magnitude that one of the quantities int64[r] has where it turns, float64[M]; inf of
    a motion in which none does.
    """
    search = _Search(one, rows)
    found = np.full(one.motions, np.inf)
    for motion in range(one.motions):
        search(layout.LEAST, motion, found[motion : motion + 1, None])
    return found


def turns(one: WaveLegs, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Legs int64[t], quantities int64[t] among ``rows`` int64[r], and times float64[t] since the
    beginnings of the legs at which they turn, between the ends of the legs.
    """
    search = _Search(one, rows)
    each = [search(layout.TURNS, motion, np.empty((0, 0))) for motion in range(one.motions)]
    leg, quantity, time = np.concatenate(each).T
    return leg.astype(np.int64), quantity.astype(np.int64), time


class _Search:
    """The legs of motions, and some of their quantities, as the kernel reads them.

    Parameters
    ----------
    one : WaveLegs
        The motions.
    rows : int64[r], optional
        The quantities that are looked at; default all.
    """

    def __init__(self, one: WaveLegs, rows: np.ndarray | None = None) -> None:
        asked = one.rows if rows is None else one.rows[:, rows]
        count, waves = asked.shape[1:]
        groups = -(-waves // WAVE_LANES)
        self._begins = np.searchsorted(one.owner, np.arange(one.motions + 1))
        self._sizes = np.array([0, groups, count, 0, 0])
        self._legs = (_in_lanes(one.rates), _in_lanes(one.amplitudes), one.state, one.length)
        self._quantities = _in_lanes(asked)
        halvings = layout.DEEPEST + 2
        self._work = (
            np.empty((layout.WORK * groups, WAVE_LANES)),
            np.empty((1, WAVE_LANES)),
            np.empty((halvings, max(count, 1)), np.int64),
            np.empty(halvings, np.int64),
        )

    def __call__(self, goal: int, motion: int, limits: np.ndarray) -> np.ndarray:
        """Turning points of a motion: leg, quantity and time of each, float64[t, 3]; smallest and
        largest values to ``limits`` (kernels/waves/layout.py).
        """
        check_stop()
        first, behind = self._begins[motion : motion + 2]
        self._sizes[[layout.GOAL, layout.FIRST, layout.BEHIND]] = goal, first, behind
        room = ROOM if goal == layout.TURNS else 0
        while True:
            turning = np.empty((room, 3))
            found = waves_module().propagate(
                self._sizes, *self._legs, self._quantities, limits, turning, *self._work
            )
            if found <= room or goal != layout.TURNS:
                return turning[:found]
            room = found


def _in_lanes(waves: np.ndarray) -> np.ndarray:
    """Real parts, imaginary parts and sizes of waves complex128[.., E], LANES of them in a row."""
    more = -waves.shape[-1] % WAVE_LANES
    padded = np.pad(waves, [(0, 0)] * (waves.ndim - 1) + [(0, more)])
    parts = np.stack([padded.real, padded.imag, np.abs(padded)], axis=-2)
    return np.ascontiguousarray(parts).reshape(-1, WAVE_LANES)
