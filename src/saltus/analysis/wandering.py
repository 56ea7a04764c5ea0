"""Attractors that never repeat: quasi-periodic and chaotic ones, told apart by their largest Lyapunov exponent, known by where they go.

Exponents: Benettin, Galgani, Giorgilli & Strelcyn, Meccanica 15 (1980), one direction renormalised at every block.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np

from saltus.flow.maps import Map

#: Iterates of one block of the exponent, and blocks.
BLOCK, BLOCKS = 8, 64
#: Standard errors that an exponent must be from zero.
SURE = 4.0
#: Standard error [per iterate] beyond which an exponent says nothing.
UNCLEAR = 0.1
#: Iterates whose places are noted.
TRAIL = 4096
#: Boxes across the range of a state.
BOXES = 64
#: Boxes away from zero beyond which nothing is on an attractor.
FARTHEST = 2048
#: Share of the places of one attractor that must lie in the other's boxes for both to be one.
ALIKE = 0.6


@dataclass(frozen=True)
class Wandering:
    """An attractor that never repeats.

    Attributes
    ----------
    kind : str
        ``"chaotic"`` or ``"quasi_periodic"``.
    exponent, exponent_error : float
        Largest Lyapunov exponent of the map and its standard error [per iterate].
    points : float64[TRAIL, D]
        Points on it.
    scale : float64[D]
        Range of each state.
    """

    kind: str
    exponent: float
    exponent_error: float
    points: np.ndarray
    scale: np.ndarray

    @property
    def first(self) -> tuple[float, ...]:
        """Its mean place, for sorting."""
        return tuple(np.round(self.points.mean(axis=0) / self.scale, 3).tolist())

    @functools.cached_property
    def boxes(self) -> np.ndarray:
        """Codes of the boxes that it visits and of their neighbours along each axis, ascending int64."""
        cells = np.unique(np.floor(self.points / self.scale * BOXES).astype(np.int64), axis=0)
        size = cells.shape[1]
        steps = np.concatenate([np.zeros((1, size), np.int64), np.eye(size, dtype=np.int64), -np.eye(size, dtype=np.int64)])
        return np.unique(_codes((cells[:, None] + steps).reshape(-1, size)))

    def share(self, points: np.ndarray) -> np.ndarray:
        """Share of the points of trajectories float64[k, n, D] that lie in its boxes, float64[k]."""
        inside = np.isfinite(points).all(axis=2)
        cells = np.floor(np.where(inside[:, :, None], points, 0.0) / self.scale * BOXES)
        inside &= (np.abs(cells) < FARTHEST).all(axis=2)
        codes = _codes(np.where(inside[:, :, None], cells, 0).astype(np.int64))
        return (inside & np.isin(codes, self.boxes)).mean(axis=1)


def _codes(cells: np.ndarray) -> np.ndarray:
    """One number for each box; boxes of more than five states may share one, which only makes the test for an attractor weaker."""
    return cells @ (2 * FARTHEST) ** np.arange(cells.shape[-1], dtype=np.int64)


def survey(map_: Map, start: np.ndarray, points: np.ndarray, scale: np.ndarray) -> list[Wandering | None]:
    """What trajectories are, from where they stand, float64[k, D], and were, float64[k, TRAIL, D]; None where that isn't clear."""
    exponents, errors = largest_exponents(map_, start, scale)
    found: list[Wandering | None] = []
    for exponent, error, trail in zip(exponents, errors, points, strict=True):
        if not (np.isfinite(trail).all() and math.isfinite(exponent)) or exponent < -SURE * error or error > UNCLEAR:
            found.append(None)
        else:
            found.append(Wandering("chaotic" if exponent > SURE * error else "quasi_periodic", float(exponent), float(error), trail, scale))
    return found


def largest_exponents(map_: Map, start: np.ndarray, scale: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Largest Lyapunov exponent [per iterate] and its standard error, of trajectories from float64[k, D]."""
    k, size = start.shape
    direction = np.zeros((k, size, size))
    direction[:, :, 0] = scale / math.sqrt(size)
    state, growths = start, []
    for _ in range(BLOCKS):
        state, image = map_.tangent(state, BLOCK, direction)
        length = np.linalg.norm(image[:, :, 0] / scale, axis=1)
        growths.append(np.log(length) / BLOCK)
        direction = np.zeros((k, size, size))
        direction[:, :, 0] = image[:, :, 0] / length[:, None]
    blocks = np.array(growths[4:])
    return blocks.mean(axis=0), blocks.std(axis=0, ddof=1) / math.sqrt(len(blocks))


def merge(found: list[Wandering]) -> list[Wandering]:
    """Those of a list that are different: of two that visit the same boxes the first is kept."""
    kept: list[Wandering] = []
    for one in found:
        if not any(
            other.kind == one.kind and min(other.share(one.points[None])[0], one.share(other.points[None])[0]) > ALIKE for other in kept
        ):
            kept.append(one)
    return kept
