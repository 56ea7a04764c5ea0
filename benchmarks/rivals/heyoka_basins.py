"""Basins with heyoka: its expert's integrator (heyoka_flow.py), a fixed number of periods, the last
ones compared with the known orbits.

heyoka has no notion of an attractor: the orbits come from our map. Both loops that a user might
write are here, the plain one (:func:`labels`) and one that looks every few periods and goes on with
what hasn't arrived (:func:`labels_early`).
"""

from __future__ import annotations

from collections.abc import Sequence

import heyoka as hy
import numpy as np

from . import known_orbits
from .heyoka_flow import Flow


def flow(tolerance: float) -> Flow:
    """The integrator, compiled: eight trajectories at a time where the processor has AVX-512."""
    return Flow(hy.recommended_simd_size(), tolerance)


def labels(
    flow: Flow, x: np.ndarray, v: np.ndarray, orbits: Sequence[np.ndarray], periods: int, keep: int
) -> np.ndarray:
    """Orbit of each start after ``periods`` and ``keep`` more that are compared, int64[k]; -1: on
    none.

    Parameters
    ----------
    flow : Flow
        The integrator.
    x, v : float64[k]
        Starts [m], [m/s]; none on a boundary, where heyoka hangs.
    orbits : sequence of float64[n, 2]
        Stroboscopic points of the known orbits [m], [m/s].
    periods, keep : int
        Forcing periods left to settle, and those compared with the orbits.
    """
    return known_orbits.label(flow.stroboscope(x, v, periods + keep, keep), orbits)


def labels_early(
    flow: Flow, x: np.ndarray, v: np.ndarray, orbits: Sequence[np.ndarray], most: int, look: int
) -> np.ndarray:
    """Orbit of each start as from :func:`labels`, but a start is done when ``look`` successive
    points follow an orbit; it is tested every ``look`` periods up to ``most``.
    """
    found = np.full(x.size, -1, np.int64)
    going = np.arange(x.size)
    state = np.stack([x, v], axis=1)
    for _ in range(0, most, look):
        # the forcing repeats: each round begins at t = 0
        points = flow.stroboscope(state[going, 0], state[going, 1], look, look)
        found[going] = known_orbits.label(points, orbits)
        state[going] = points[:, -1]
        going = going[found[going] < 0]
        if not going.size:
            break
    return found
