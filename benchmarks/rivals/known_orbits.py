"""Find the known orbit that a trajectory has settled on: the label that rivals need and don't have,
given to them for free.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

#: Ranges of the map's axes, 10 mm and 2 m/s: the units of a distance.
RANGES = np.array([10e-3, 2.0])
#: Distance within which all the last points must follow an orbit. Any two orbits of the rig are
#: further apart, and so are the halves of its 24T (1.5e-3); at 1e-4, three of 400 cells are still
#: on their way after 648 periods.
MATCH = 1e-3


def label(points: np.ndarray, orbits: Sequence[np.ndarray]) -> np.ndarray:
    """Number of the orbit that each trajectory follows, int64[k]; -1 for none.

    Parameters
    ----------
    points : float64[k, m, 2]
        Last stroboscopic points of the trajectories [m], [m/s].
    orbits : sequence of float64[n, 2]
        Stroboscopic points of the orbits, in order.
    """
    distance = np.stack([_distance(points, orbit) for orbit in orbits], axis=1)
    return np.where(distance.min(axis=1) < MATCH, distance.argmin(axis=1), -1)


def _distance(points: np.ndarray, orbit: np.ndarray) -> np.ndarray:
    """Largest distance of the points from an orbit at its best phase, in units of the ranges,
    float64[k].
    """
    steps = np.arange(points.shape[1])
    phases = [
        np.abs((points - orbit[(steps + phase) % len(orbit)]) / RANGES).max(axis=(1, 2))
        for phase in range(len(orbit))
    ]
    return np.min(phases, axis=0)
