"""How small deviations grow along trajectories, block by block and in all directions: the QR method.

The derivatives of all blocks of a stretch are computed in one batch, as the states at which they begin are known from the trajectory
itself. Then an orthogonal frame is carried through them: block by block M Q = Q' R, and the logarithms of the diagonal of R are the growth
of the frame's axes; their means are the Lyapunov exponents. Benettin, Galgani, Giorgilli & Strelcyn, Meccanica 15 (1980) 9-20 and 21-30;
Eckmann & Ruelle, Reviews of Modern Physics 57 (1985) 617-656, section V.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from saltus.analysis.lyapunov.segments import Stretch, Walk
from saltus.kernels import status as st

#: Blocks of a stretch. A trajectory starts afresh after each, so this number is part of the result and never depends on the batch.
STRETCH = 1024
#: Blocks at most in which the frame finds its way before growth counts, taken from the transient.
ALIGNING = 128
#: Share of the distance from its start below which a motion is taken to be at rest.
AT_REST = 1e-6
#: Statuses with which a trajectory goes on, in ascending order.
GOOD = (st.OK, st.GRAZE_UNRESOLVED)


@dataclass(frozen=True)
class Growth:
    """What became of k trajectories.

    Attributes
    ----------
    rates : float64[k, n, D]
        Logarithm of the growth of the frame's axes in each block.
    volume : float64[k, n]
        Logarithm of the growth of volumes, found without the tangent.
    scale : float64[k, D]
        Range of each state.
    stretch : Stretch
        Status and grazes after the transient; the trail holds the last STRETCH blocks, or all if they are fewer.
    """

    rates: np.ndarray
    volume: np.ndarray
    scale: np.ndarray
    stretch: Stretch


def grow(
    walk: Walk,
    start: np.ndarray,
    count: int,
    transient: int,
    progress: Callable[[float], None] | None = None,
) -> Growth:
    """Growth over ``count`` blocks after a transient.

    Parameters
    ----------
    walk : Walk
        The trajectories.
    start : float64[k, D]
        Their starts.
    count, transient : int
        Blocks that count, and blocks before them.
    progress : callable, optional
        Called with the share done.
    """
    k, size = start.shape
    aligning = min(ALIGNING, transient)
    before = walk.move(start, transient, transient - aligning)
    scale = _scale(start, np.concatenate([before.trail, walk.look(before.trail[:, -1])], axis=1))
    frame = np.broadcast_to(np.eye(size), (k, size, size))
    if aligning:
        _, frame = carry(walk.matrices(before.trail[:, :-1]), frame, scale)
    rates, volume, stretches, state = np.full((k, count, size), np.nan), np.full((k, count), np.nan), [before], before.trail[:, -1]
    for first in range(0, count, STRETCH):
        last = min(first + STRETCH, count)
        stretch = walk.move(state, last - first)
        blocks = stretch.trail[:, :-1]
        rates[:, first:last], frame = carry(walk.matrices(blocks), frame, scale)
        volume[:, first:last] = walk.divergences(blocks)
        stretches.append(stretch)
        state = stretch.trail[:, -1]
        if progress:
            progress(last / count)
    return Growth(rates, volume, scale, _joined(stretches))


def _scale(start: np.ndarray, motion: np.ndarray) -> np.ndarray:
    """Range of each state, float64[k, D], in the motion float64[k, m, D]: it makes lengths of different units comparable.

    A motion that has come to rest has the range of all that came before, as what is left of it is rounding.
    """
    with np.errstate(invalid="ignore"):
        own, whole = np.ptp(motion, axis=1), np.ptp(np.concatenate([start[:, None], motion], axis=1), axis=1)
    wide = np.where(own > AT_REST * whole, own, whole)
    return np.where((wide > 0) & np.isfinite(wide), wide, 1.0)


def carry(matrices: np.ndarray, frame: np.ndarray, scale: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Carry frames float64[k, D, D] through matrices float64[k, n, D, D] in units of the scale: growth float64[k, n, D], and the frames."""
    matrices = matrices * scale[:, None, None, :] / scale[:, None, :, None]
    diagonal = np.empty(matrices.shape[:3])
    for j in range(matrices.shape[1]):
        frame, triangle = np.linalg.qr(matrices[:, j] @ frame)
        diagonal[:, j] = np.diagonal(triangle, axis1=1, axis2=2)
    with np.errstate(divide="ignore"):
        return np.log(np.abs(diagonal)), frame


def _joined(stretches: list[Stretch]) -> Stretch:
    """Sums and minima after the transient, the first status that isn't a success, and the last part of the trail."""
    after = stretches[1:]
    status = stretches[0].status
    for stretch in after:
        status = np.where(np.isin(status, GOOD), np.maximum(status, stretch.status), status)
    trail = np.concatenate([*(stretch.trail[:, :-1] for stretch in after[-2:]), after[-1].trail[:, -1:]], axis=1)
    return Stretch(
        trail[:, -STRETCH - 1 :],
        status,
        np.sum([stretch.grazes for stretch in after], axis=0),
        np.sum([stretch.unresolved for stretch in after], axis=0),
        np.min([stretch.margin for stretch in after], axis=0),
    )
