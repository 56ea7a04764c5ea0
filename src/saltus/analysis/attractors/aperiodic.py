"""Attractors that never repeat: quasi-periodic and chaotic ones, distinguished by their largest
Lyapunov exponent, known by the region that they visit.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from saltus.analysis.attractors.growth import BLOCK, BLOCKS, MOST_STATES, growth_cost, growth_rates
from saltus.analysis.attractors.recurrence import REPEATS
from saltus.analysis.statistics import BOUNDED, UNCLEAR
from saltus.flow.maps import Map
from saltus.results.dataset.kinds import Kind

#: Times that the exponent is measured at most, each time going on from where the last ended, until
#: it says what the motion is.
MEASURED = 4
#: Blocks of a first look at a motion of many states, a fifth of a measurement: it is enough to tell
#: strong chaos.
FIRST_LOOK = BLOCKS // 5
#: Standard errors that an exponent must be from zero.
SURE = 4.0
#: Exponent [per iterate] that is taken for zero whatever its error.
FLOOR = 2e-3
#: A recurrence that falls to this share of itself means converging.
SETTLING = 0.05
#: Iterates by which such an attractor is known.
SURVEY_ITERATES = 4096
#: Boxes across the range of a state. The finest is taken at which one half of the points knows the
#: places of the other.
BOXES = (64, 32, 16, 8)
#: Share of every second point that must lie in the boxes of the others. Attractors of a higher
#: dimension need larger boxes.
KNOWN = 0.9
#: Boxes away from zero beyond which nothing is on an attractor.
FARTHEST = 2048
#: Share of the places of one attractor that must lie in the other's boxes for both to be one.
ALIKE = 0.6


@dataclass(frozen=True)
class SampledMotion:
    """An attractor that is known by points on it: one that never repeats, a limit cycle, or a noisy
    orbit.

    Attributes
    ----------
    kind : str
        ``"chaotic"``, ``"quasi_periodic"``, ``"limit_cycle"`` or ``"noisy_periodic"``.
    exponent, exponent_error : float
        Largest Lyapunov exponent of the map and its standard error [per iterate].
    points : float64[SURVEY_ITERATES, D]
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
    def _places(self) -> tuple[int, np.ndarray]:
        """Boxes across the range of a state, and the codes of those it visits and of their
        neighbours.
        """
        for across in BOXES:
            half = _around(self.points[::2], self.scale, across)
            if _inside(self.points[None, 1::2], self.scale, across, half)[0] >= KNOWN:
                break
        return across, _around(self.points, self.scale, across)

    def share(self, points: np.ndarray) -> np.ndarray:
        """Share of the points of trajectories float64[k, n, D] that lie in its boxes,
        float64[k].
        """
        across, boxes = self._places
        return _inside(points, self.scale, across, boxes)


def _around(points: np.ndarray, scale: np.ndarray, across: int) -> np.ndarray:
    """Codes of the boxes that points float64[n, D] visit and of their neighbours along each axis,
    ascending int64.
    """
    visited = np.unique(_codes(np.floor(points / scale * across).astype(np.int64)))
    own = np.eye(points.shape[1], dtype=np.int64)
    steps = _codes(np.concatenate([0 * own[:1], own, -own]))
    return np.unique(visited[:, None] + steps)


def _inside(points: np.ndarray, scale: np.ndarray, across: int, boxes: np.ndarray) -> np.ndarray:
    """Share of the points of trajectories float64[k, n, D] that lie in boxes, float64[k]."""
    inside = np.isfinite(points).all(axis=2)
    cells = np.floor(np.where(inside[:, :, None], points, 0.0) / scale * across)
    inside &= (np.abs(cells) < FARTHEST).all(axis=2)
    codes = _codes(np.where(inside[:, :, None], cells, 0).astype(np.int64))
    share: np.ndarray = (inside & np.isin(codes, boxes)).mean(axis=1)
    return share


def _codes(cells: np.ndarray) -> np.ndarray:
    """One number for each box; boxes of more than five states may share one, which only makes the
    test for an attractor weaker.
    """
    return cells @ (2 * FARTHEST) ** np.arange(cells.shape[-1], dtype=np.int64)


def survey(
    map_: Map, start: np.ndarray, points: np.ndarray, scale: np.ndarray
) -> list[SampledMotion]:
    """The aperiodic attractors of trajectories that have not settled for long.

    Parameters
    ----------
    map_ : Map
        The map.
    start : float64[k, D]
        Where trajectories stand that have not settled for long.
    points : float64[k, SURVEY_ITERATES, D]
        Where they were.
    scale : float64[D]
        Range of each state.
    """
    usable = [
        i
        for i in range(len(start))
        if np.isfinite(points[i]).all() and not _settles(points[i], scale)
    ]
    if not usable:
        return []
    groups: list[list[int]] = []
    runs = [SampledMotion("", 0.0, 0.0, points[i], scale) for i in usable]
    for i, iterates in enumerate(runs):
        home = next((group for group in groups if alike(runs[group[0]], iterates)), None)
        if home is None:
            groups.append([i])
        else:
            home.append(i)
    _, kinds = kinds_of(map_, start[usable], np.broadcast_to(scale, start[usable].shape), groups)
    return [
        SampledMotion(*kind, points[usable[group[0]]], scale)
        for group, kind in zip(groups, kinds, strict=True)
        if kind is not None and kind[0] != Kind.NOT_REPEATING.word
    ]


def _settles(iterates: np.ndarray, scale: np.ndarray) -> bool:
    """True where iterates float64[m, D] recur, or recur better with time: they are on an orbit or
    approach one.
    """
    part = len(iterates) // 16
    early, late = (mismatch(piece, scale) for piece in (iterates[:part], iterates[-part:]))
    return late < REPEATS or late < SETTLING * early


def mismatch(iterates: np.ndarray, scale: np.ndarray) -> float:
    """Smallest n-step difference, n up to half of them: the largest of it over the last quarter."""
    last, half = len(iterates) // 4, len(iterates) // 2
    # n = 1, ..., half - 1 steps before the last quarter
    before = sliding_window_view(iterates, last, axis=0)[-half:-1]
    apart = np.abs((iterates[-last:].T - before) / scale[:, None])
    return float(apart.max(axis=(1, 2)).min())


def kind_of_growth(blocks: np.ndarray) -> tuple[str, float, float] | None:
    """(kind, exponent, its standard error) from growth rates per iterate, float64[blocks, members];
    None if they don't say.
    """
    if not np.isfinite(blocks).all():
        return None
    first, second = np.array_split(blocks, 2)
    exponent, error = (
        float(blocks.mean()),
        float(blocks.mean(axis=1).std(ddof=1) / math.sqrt(len(blocks))),
    )
    # growth like t seems exponential at first
    if exponent > max(SURE * error, FLOOR) and second.mean() > 0.5 * first.mean():
        return Kind.CHAOTIC.word, exponent, error  # however unsure its size is
    if error > UNCLEAR:
        return None
    zero = max(FLOOR, min(SURE * error, BOUNDED / (len(second) * BLOCK)))
    bounded = max(abs(second.mean()), abs(exponent)) <= zero
    return (Kind.QUASI_PERIODIC.word, exponent, error) if bounded else None


def kinds_of(
    map_: Map,
    start: np.ndarray,
    scale: np.ndarray,
    groups: Sequence[Sequence[int]],
    budget: float = math.inf,
    past: np.ndarray | None = None,
) -> tuple[np.ndarray, list[tuple[str, float, float] | None]]:
    """Classify motions that never repeat by their largest Lyapunov exponent. It is measured for
    longer while its sign is unclear and the budget lasts.

    Parameters
    ----------
    map_ : Map
        The map, with a row for each trajectory or one for all.
    start, scale : float64[k, D]
        Where trajectories stand, and the range of each state.
    groups : sequence of sequence of int
        Trajectories that are on one attractor.
    budget : float
        What the exponents of a trajectory may cost (see growth.py) [iterates].
    past : float64[k, m, D], optional
        Iterates that led to the starts: a first look is taken along the last of these.

    Returns
    -------
    end : float64[k, D]
        Where they stand then.
    kinds : list
        (kind, exponent, its standard error) of each group. ``"not_repeating"`` if the exponents
        don't say even then, None if they say that deviations die out, or where there are none.
    """
    state, rates = np.array(start), [np.zeros(0)] * len(start)
    past = past if past is not None and past.shape[1] > FIRST_LOOK * BLOCK else None
    kinds: list[tuple[str, float, float] | None] = [None] * len(groups)
    again = list(range(len(groups)))
    for blocks in _measurements(map_, start.shape[1], budget):
        rows = np.concatenate([groups[n] for n in again])
        before = past[rows] if past is not None and blocks == FIRST_LOOK else None
        state[rows], more = growth_rates(map_.rows(rows), state[rows], scale[rows], blocks, before)
        for i, one in zip(rows.tolist(), more.T, strict=True):
            rates[i] = np.append(rates[i], one)
        for n in again:
            kind = kind_of_growth(np.stack([rates[i] for i in groups[n]], axis=1))
            # for so short a time a weak decay looks like a torus
            short = blocks == FIRST_LOOK and kind is not None and kind[0] != Kind.CHAOTIC.word
            kinds[n] = None if short else kind
        again = [
            n
            for n in again
            if kinds[n] is None and all(np.isfinite(rates[i]).all() for i in groups[n])
        ]
        if not again:
            break
    for n in again:
        kinds[n] = _undecided(np.stack([rates[i] for i in groups[n]], axis=1))
    return state, kinds


def first_look(
    map_: Map, past: np.ndarray, scale: np.ndarray
) -> list[tuple[str, float, float] | None]:
    """(kind, exponent, its standard error) of motions, row i by row i of a map, that strong growth
    along the last of their iterates float64[k, m, D] tells to be chaotic; None of others.
    """
    _, rates = growth_rates(map_, past[:, -1], scale, FIRST_LOOK, past)
    kinds = [kind_of_growth(one[:, None]) for one in rates.T]
    return [one if one is not None and one[0] == Kind.CHAOTIC.word else None for one in kinds]


def _measurements(map_: Map, size: int, budget: float) -> Iterator[int]:
    """Blocks of one measurement after the other: of many states a first look comes before them; the
    last is shorter where the budget ends.
    """
    whole, left = BLOCK * growth_cost(map_, size), budget
    lengths = ([FIRST_LOOK] if size > MOST_STATES else []) + [BLOCKS] * MEASURED
    for blocks in lengths:
        blocks = min(blocks, int(min(left / whole, BLOCKS)))
        if blocks < FIRST_LOOK:
            return
        yield blocks
        left -= whole * blocks


def _undecided(blocks: np.ndarray) -> tuple[str, float, float] | None:
    """As :func:`kind_of_growth`, of growth that says neither: None where deviations die out."""
    if not blocks.size or not np.isfinite(blocks).all():
        return None
    exponent, error = blocks.mean(), blocks.mean(axis=1).std(ddof=1) / math.sqrt(len(blocks))
    dies_out = exponent < -max(SURE * error, FLOOR)
    return None if dies_out else (Kind.NOT_REPEATING.word, float(exponent), float(error))


def alike(one: SampledMotion, other: SampledMotion) -> bool:
    """True where two attractors visit the same boxes."""
    return (
        min(float(other.share(one.points[None])[0]), float(one.share(other.points[None])[0]))
        > ALIKE
    )


def merge(found: list[SampledMotion]) -> list[SampledMotion]:
    """Those of a list that are different: of two that visit the same boxes the first is kept."""
    kept: list[SampledMotion] = []
    for one in found:
        if not any(alike(one, other) for other in kept):
            kept.append(one)
    return kept
