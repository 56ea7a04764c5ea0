"""Basins with pynamicalsys 1.7: RK4 at fixed steps without event location, DBSCAN on the mean of
each trajectory's last points.

As kind to it as its interface allows, knowing the answer. Time counts periods, so that steps of
1/128 meet whole periods exactly: where they don't, it interpolates linearly between the previous
*whole period* and the step beyond this one. 120 points are kept, a multiple of every period on the
rig: means over 48 split the 5T in several clusters, by its phase. Its adaptive RK45 can't be used:
``basin_of_attraction`` hands the whole ensemble to the estimate of the first step, as if it were
one state. A cluster has no name: its first member's points are compared with the known orbits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numba
import numpy as np
from pynamicalsys import ContinuousDynamicalSystem

from . import known_orbits, rig

#: RK4 steps a period: 5e-7 m of error after five periods (median). Cost is proportional to it,
#: agreement with our labels hardly depends on it: on 160 cells 71 % with 64 and 128, 69 % with 256;
#: on 64 cells 73 % with 1024.
STEPS = 128
#: Number of last points whose mean is clustered.
KEEP = 120
#: Reach of a cluster, of means in mm and m/s: 5T and 24T are 3.2e-3 apart, trajectories that reach
#: one orbit 5e-5 at most.
REACH = 1e-3
#: Metres in a millimetre: the means are clustered in mm and m/s, in which both states are of like
#: size.
MM = 1e-3

_PERIOD, _LOWER, _UPPER = rig.PERIOD, -rig.LOWER_GAP, rig.UPPER_GAP
_SPRING, _CONTACT, _DRIVE, _DECAY, _HARDENING = (
    rig.WN**2,
    rig.STIFFNESS,
    rig.DRIVE,
    rig.DECAY,
    rig.HARDENING,
)


@numba.njit
def _rate(t, y, _):
    """Right-hand side, t in periods, y in mm and m/s."""
    x, v = MM * y[0], y[1]
    beyond = max(x - _UPPER, 0.0) + min(x - _LOWER, 0.0)
    force = (
        _DRIVE * math.cos(2.0 * math.pi * t)
        - _DECAY * v
        - x * (_SPRING + _HARDENING * x * x)
        - _CONTACT * beyond
    )
    return np.array([_PERIOD * v / MM, _PERIOD * force])


class Rig:
    """The rig as pynamicalsys takes it, on one thread, compiled."""

    def __init__(self):
        numba.set_num_threads(1)
        self.system = ContinuousDynamicalSystem(
            equations_of_motion=_rate, system_dimension=2, parameters=[0.0]
        )
        self.system.integrator("rk4", time_step=1.0 / STEPS)
        self.clusters(np.zeros(2), np.ones(2), KEEP + 1)

    def clusters(self, x: np.ndarray, v: np.ndarray, periods: int) -> np.ndarray:
        """The answer of pynamicalsys after so many periods: a number for each start, equal within a
        basin.
        """
        start = np.stack([x / MM, v], axis=1)
        return self.system.basin_of_attraction(
            start, KEEP, transient_time=float(periods - KEEP), sampling_time=1.0, eps=REACH
        )

    def named(
        self,
        clusters: np.ndarray,
        x: np.ndarray,
        v: np.ndarray,
        orbits: Sequence[np.ndarray],
        periods: int,
    ) -> np.ndarray:
        """The orbit of each start, int64[k], by that of the first member of its cluster; -1: none
        that is known.
        """
        which, first = np.unique(clusters, return_index=True)
        points = np.stack([self._points(x[i], v[i], periods) for i in first])
        names = known_orbits.label(points, orbits)
        return np.where(clusters < 0, -1, names[np.searchsorted(which, clusters)])

    def _points(self, x: float, v: float, periods: int) -> np.ndarray:
        """Last points of one trajectory [m], [m/s], float64[KEEP, 2]."""
        map_ = self.system.stroboscopic_map(
            [x / MM, v], KEEP, 1.0, transient_time=float(periods - KEEP)
        )
        return map_[:, 1:] * np.array([MM, 1.0])
