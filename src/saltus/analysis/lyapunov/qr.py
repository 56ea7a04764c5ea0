"""Growth of small deviations along trajectories, block by block and in all directions, by the QR
method.

The derivatives of all blocks of a segment are computed in one batch, as the states at which they
begin are known from the trajectory itself. Then an orthogonal frame is carried through them: block
by block M Q = Q' R, and the logarithms of the diagonal of R are the growth of the frame's axes;
their means are the Lyapunov exponents. A frame of fewer axes than states has the largest of them:
only its images are computed, block after block. Benettin, Galgani, Giorgilli & Strelcyn, Meccanica
15 (1980) 9-20 and 21-30; Eckmann & Ruelle, Reviews of Modern Physics 57 (1985) 617-656, section V.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from saltus.analysis.closed.spread import beyond_rounding
from saltus.analysis.lyapunov.segments import Segment, TangentFlow
from saltus.flow.maps import Map
from saltus.flow.progress import stage
from saltus.kernels import status as st

#: Blocks of a segment. A trajectory restarts after each, so this number is part of the result and
#: never depends on the batch.
SEGMENT = 1024
#: Most blocks for the alignment of the frame before growth counts, taken from the transient.
ALIGNING = 128
#: A motion whose range is below this share of its distance from the start is at rest.
AT_REST = 1e-6
#: Statuses with which a trajectory goes on, in ascending order.
GOOD = (st.OK, st.GRAZE_UNRESOLVED)


@dataclass(frozen=True)
class Growth:
    """Growth along k trajectories.

    Attributes
    ----------
    rates : float64[k, n, m]
        Logarithm of the growth of the frame's m axes in each block.
    volume : float64[k, n]
        Logarithm of the growth of volumes, found without the tangent.
    zeros : int64[k]
        Directions that vanish: contacts that are held keep no deviation from them.
    scale : float64[k, D]
        Range of each state.
    segment : Segment
        Status and grazes after the transient; its points are those of the last SEGMENT blocks, or
        all if they are fewer.
    """

    rates: np.ndarray
    volume: np.ndarray
    zeros: np.ndarray
    scale: np.ndarray
    segment: Segment


def grow(
    flow: TangentFlow,
    start: np.ndarray,
    count: int,
    transient: int,
    axes: int,
    progress: Callable[[float], None] | None = None,
) -> Growth:
    """Growth over ``count`` blocks after a transient.

    Parameters
    ----------
    flow : TangentFlow
        The trajectories.
    start : float64[k, D]
        Their starts.
    count, transient : int
        Blocks that count, and blocks before them.
    axes : int
        Of the frame.
    progress : callable, optional
        Called with the share done.
    """
    k, size = start.shape
    aligning = min(ALIGNING, transient)
    before = flow.advance(start, transient, transient - aligning)
    scale = _scale(
        flow.map,
        start,
        np.concatenate([before.points, flow.sample(before.points[:, -1])], axis=1),
    )
    frame = np.broadcast_to(_first_frame(size, axes), (k, size, axes))
    if aligning:
        _, frame = _carried(flow, before.points[:, :-1], frame, scale)
    rates, volume, segments, state = (
        np.full((k, count, axes), np.nan),
        np.full((k, count), np.nan),
        [before],
        before.points[:, -1],
    )
    zeros = np.zeros(k, np.int64)
    for first in range(0, count, SEGMENT):
        last = min(first + SEGMENT, count)
        segment = flow.advance(state, last - first)
        blocks = segment.points[:, :-1]
        part = stage(progress, first / count, last / count)
        rates[:, first:last], frame = _carried(flow, blocks, frame, scale, part)
        volume[:, first:last], lost = flow.divergences(blocks)
        zeros = np.maximum(zeros, lost.max(axis=1))
        segments.append(segment)
        state = segment.points[:, -1]
        if progress:
            progress(last / count)
    return Growth(rates, volume, zeros, scale, _joined(segments))


def _scale(map_: Map, start: np.ndarray, motion: np.ndarray) -> np.ndarray:
    """Range of each state, float64[k, D], in the motion float64[k, m, D]: it makes lengths of
    different units comparable.

    A motion that has come to rest has the range of all that came before, as what is left of it is
    rounding.
    """
    with np.errstate(invalid="ignore"):
        own, whole = (
            np.ptp(motion, axis=1),
            np.ptp(np.concatenate([start[:, None], motion], axis=1), axis=1),
        )
    wide = beyond_rounding(np.where(own > AT_REST * whole, own, whole), map_)
    return np.where((wide > 0) & np.isfinite(wide), wide, 1.0)


def _first_frame(size: int, axes: int) -> np.ndarray:
    """Orthogonal directions in which no motion stays by its symmetry, float64[D, m]; all of them
    are those of the states.
    """
    if axes == size:
        return np.eye(size)
    return np.linalg.qr(np.random.default_rng(0).normal(size=(size, axes)))[0]


def _carried(
    flow: TangentFlow,
    states: np.ndarray,
    frame: np.ndarray,
    scale: np.ndarray,
    progress: Callable[[float], None] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Carry frames float64[k, D, m] through the blocks that begin at float64[k, n, D]: growth
    float64[k, n, m], and the frames.
    """
    if frame.shape[1] == frame.shape[2]:
        return carry(flow.derivatives(states), frame, scale)
    (k, n, _), units = states.shape, scale[:, :, None]
    diagonal = np.empty((k, n, frame.shape[2]))
    for j in range(n):
        image = flow.images(states[:, j], frame * units) / units
        frame, triangle = np.linalg.qr(image)
        diagonal[:, j] = np.diagonal(triangle, axis1=1, axis2=2)
        if progress:
            progress((j + 1) / n)
    with np.errstate(divide="ignore"):
        return np.log(np.abs(diagonal)), frame


def carry(
    matrices: np.ndarray, frame: np.ndarray, scale: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Carry frames float64[k, D, D] through matrices float64[k, n, D, D] in units of the scale:
    growth float64[k, n, D], and the frames.
    """
    matrices = matrices * scale[:, None, None, :] / scale[:, None, :, None]
    diagonal = np.empty(matrices.shape[:3])
    for j in range(matrices.shape[1]):
        frame, triangle = np.linalg.qr(matrices[:, j] @ frame)
        diagonal[:, j] = np.diagonal(triangle, axis1=1, axis2=2)
    with np.errstate(divide="ignore"):
        return np.log(np.abs(diagonal)), frame


def _joined(segments: list[Segment]) -> Segment:
    """Sums and minima after the transient, the first status that isn't a success, and the last
    points.
    """
    after = segments[1:]
    status = segments[0].status
    for segment in after:
        status = np.where(np.isin(status, GOOD), np.maximum(status, segment.status), status)
    points = np.concatenate(
        [*(segment.points[:, :-1] for segment in after[-2:]), after[-1].points[:, -1:]], axis=1
    )
    return Segment(
        points[:, -SEGMENT - 1 :],
        status,
        np.sum([segment.grazes for segment in after], axis=0),
        np.sum([segment.unresolved for segment in after], axis=0),
        np.min([segment.margin for segment in after], axis=0),
    )
