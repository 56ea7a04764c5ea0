"""Growth rates of small deviations from a motion, and the cost to measure them.

Costs are counted in iterates of the motion itself. D + 1 of them is what an iterate of the tangent
flow costs, which carries D deviations of D states. Of many states the distance from a neighbour is
measured instead, which costs two, and compiles nothing; or one deviation is carried, where a flow
can do that, which costs two also. All are renormalised at every block:
Benettin, Galgani & Strelcyn, Phys. Rev. A 14 (1976) 2338-2345; Benettin, Galgani, Giorgilli &
Strelcyn, Meccanica 15 (1980) 9-20.
"""

from __future__ import annotations

import math

import numpy as np

from saltus.flow.maps import Map, Stroboscope

#: Iterates of one block.
BLOCK = 8
#: Blocks of one measurement.
BLOCKS = 192
#: Part of a measurement in which the direction finds its way: 1 in so many blocks.
ALIGNING = 4
#: Most states whose deviations the tangent flow carries: it costs up to 5 times the motion.
MOST_STATES = 4
#: Distance of a neighbour, in units of the scale. Rounding is 1e-8 of it; growth by 1e7 in a block
#: still is that of a small deviation.
APART = 1e-8
#: Least range of a state, as a part of the largest. That of a mode which nothing excites goes on
#: decaying: in its units rounding of the others, 1e-8 of APART, would be growth without bound.
LEAST = 1e-7
#: Iterates of the tangent flow that closing an orbit of period 1 takes, its multipliers included.
NEWTON = 5
#: Most iterates that telling the kind of a motion may take, in multiples of those that it was
#: followed for: four measurements of a motion of two states.
BUDGET = 10


def tangent_cost(size: int) -> int:
    """Cost of an iterate of the tangent flow of so many states [iterates]."""
    return 1 + size


def growth_cost(map_: Map, size: int) -> int:
    """Cost of measuring growth over an iterate [iterates]."""
    return 2 if by_neighbours(map_, size) or _by_one_direction(map_) else tangent_cost(size)


def by_neighbours(map_: Map, size: int) -> bool:
    """True where growth is measured by the distance from a neighbour: with many states, by a flow
    that can't carry one deviation alone, with errors of rounding only, and no law at a contact,
    which could take a neighbour for a start behind its wall.
    """
    return (
        size > MOST_STATES
        and isinstance(map_, Stroboscope)
        and map_.exact
        and not map_.carries(1)
        and all(guard.law is None for guard in map_.system.guards)
    )


def _by_one_direction(map_: Map) -> bool:
    """True where the flow carries one deviation without the others."""
    return isinstance(map_, Stroboscope) and map_.carries(1)


def growth_rates(
    map_: Map,
    start: np.ndarray,
    scale: np.ndarray,
    blocks: int = BLOCKS,
    past: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Ends float64[k, D] of trajectories, and growth rates per iterate of their largest direction,
    block by block, float64[blocks, k]: those after it has found its way. With ``past``
    float64[k, m, D], iterates that led to the starts, along the last of these: neighbours go alone.
    """
    scale = np.maximum(scale, LEAST * scale.max(axis=-1, keepdims=True))
    stretched = _neighbours if by_neighbours(map_, start.shape[1]) else _tangents
    state, begin, growths = start, scale / math.sqrt(start.shape[1]), []
    direction, known = begin, None
    for left in range(blocks, 0, -1):
        if past is not None:
            state = past[:, -1 - left * BLOCK]
            known = past[:, -1 - (left - 1) * BLOCK]
        state, image = stretched(map_, state, direction, known)
        length = np.linalg.norm(image / scale, axis=1)
        with np.errstate(all="ignore"):
            growths.append(np.log(length) / BLOCK)
            ahead = (length > 0) & np.isfinite(length)  # at rest on a stop nothing is left of it
            direction = np.where(ahead[:, None], image / length[:, None], begin)
    return state, np.array(growths[blocks // ALIGNING :])


def _tangents(
    map_: Map, start: np.ndarray, direction: np.ndarray, end: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray]:
    """States after a block from float64[k, D], and the image of a direction of each; ``end``: these
    states, where they are known.
    """
    if isinstance(map_, Stroboscope) and map_.carries(1):
        state, images = map_.images(start, BLOCK, direction[:, :, None])
    else:
        k, size = start.shape
        directions = np.zeros((k, size, size))
        directions[:, :, 0] = direction
        state, images = map_.tangent(start, BLOCK, directions)
    return state if end is None else end, images[:, :, 0]


def _neighbours(
    map_: Map, start: np.ndarray, direction: np.ndarray, end: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray]:
    """As :func:`_tangents`, by the distance from a neighbour; where the states after the block are
    known, float64[k, D], the neighbour alone is moved.
    """
    aside, k = start + APART * direction, len(start)
    if end is None:
        pairs = map_.rows(np.tile(np.arange(k), 2))
        ends = pairs.launch(np.concatenate([start, aside]), BLOCK).advance(BLOCK)[:, -1]
        end, beside = ends[:k], ends[k:]
    else:
        beside = map_.launch(aside, BLOCK).advance(BLOCK)[:, -1]
    return end, (beside - end) / APART
