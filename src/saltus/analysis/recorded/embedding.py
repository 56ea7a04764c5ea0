"""Delay embedding: the states behind one recorded quantity.

Delay: the first minimum of the mutual information, Fraser & Swinney, Physical Review A 33 (1986)
1134-1140. Dimension: the least that leaves no false neighbours, Kennel, Brown & Abarbanel, Physical
Review A 45 (1992) 3403-3411.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

#: Longest delay tried, as a share of the series: a shorter series doesn't show so slow a motion.
LONGEST = 0.05
#: Samples for each cell of the histogram of the mutual information.
PER_CELL = 40
#: Growth of a distance by one more coordinate from which a neighbour is false (Kennel's value).
STRETCHED = 15.0
#: Distance relative to the series from which a neighbour is false (Kennel's value).
SPREAD = 2.0
#: Share of false neighbours that counts as none.
NONE_FALSE = 0.01
#: Largest dimension tried.
MOST = 10
#: Points whose neighbours are tested.
ASKED = 4000


def embed(series: np.ndarray, dimension: int, delay: int) -> np.ndarray:
    """Points float64[n - (m - 1) delay, m] whose coordinates are the series now and one, two, ...
    delays later.
    """
    count = len(series) - (dimension - 1) * delay
    return np.stack([series[i * delay : i * delay + count] for i in range(dimension)], axis=1)


def cells_of(series: np.ndarray) -> tuple[np.ndarray, int]:
    """The cell of each sample, of cells of equal probability, and their number."""
    cells = max(int(np.sqrt(len(series) / PER_CELL)), 4)
    rank = np.empty(len(series), np.int64)
    rank[np.argsort(series, kind="stable")] = np.arange(len(series))
    return rank * cells // len(series), cells


def mutual_information(cell: np.ndarray, cells: int, lag: int) -> float:
    """Information of the cell of a sample about that of the one ``lag`` later [nat]."""
    joint = np.bincount(cell[:-lag] * cells + cell[lag:], minlength=cells * cells).reshape(
        cells, cells
    ) / (len(cell) - lag)
    product = joint.sum(axis=1, keepdims=True) * joint.sum(axis=0, keepdims=True)
    there = joint > 0
    return float((joint[there] * np.log(joint[there] / product[there])).sum())


def first_minimum(series: np.ndarray) -> int:
    """Delay in samples: the first minimum of the mutual information, the least over two neighbours
    on either side.
    """
    longest = max(int(LONGEST * len(series)), 3)
    cell, cells = cells_of(series)
    values: list[float] = []
    for lag in range(1, longest + 3):
        values.append(mutual_information(cell, cells, lag))
        if lag > 4 and values[-3] == min(values[-5:]):
            return lag - 2
    return int(np.argmin(values)) + 1


def false_neighbours(series: np.ndarray, dimension: int, delay: int, exclude: int) -> float:
    """Share of nearest neighbours in this dimension that one more coordinate shows to be false; NaN
    if no point has a neighbour.
    """
    longer = embed(series, dimension + 1, delay)
    points = longer[:, :dimension]
    asked = np.unique(np.linspace(0, len(points) - 1, min(ASKED, len(points))).round().astype(int))
    distance, place = _nearest_allowed(points, asked, exclude)
    some = place >= 0
    near, partner = distance[some], place[some]
    step = np.abs(longer[asked[some], dimension] - longer[partner, dimension])
    # neighbours on a motion that repeats lie on one another but for rounding
    floor = 1e-9 * np.ptp(series)
    false = (step > STRETCHED * np.maximum(near, floor)) | (
        np.hypot(step, near) > SPREAD * series.std()
    )
    return float(false.mean()) if some.any() else float("nan")


def _nearest_allowed(
    points: np.ndarray, asked: np.ndarray, exclude: int
) -> tuple[np.ndarray, np.ndarray]:
    """Distance and index of the nearest point more than ``exclude`` samples away from each tested
    point; inf and -1 if there is none.

    The few nearest are tried first, then four times as many while all are too near in time: for
    most points a few are enough.
    """
    tree, most = cKDTree(points), min(2 * exclude + 2, len(points))
    distance, index = np.full(len(asked), np.inf), np.full(len(asked), -1)
    left, count = np.arange(len(asked)), min(8, most)
    while True:
        near, who = (
            each.reshape(len(left), count) for each in tree.query(points[asked[left]], k=count)
        )
        allowed = np.abs(who - asked[left, None]) > exclude
        rows, first = np.flatnonzero(allowed.any(axis=1)), allowed.argmax(axis=1)
        distance[left[rows]], index[left[rows]] = near[rows, first[rows]], who[rows, first[rows]]
        left = np.delete(left, rows)
        if not len(left) or count == most:
            return distance, index
        count = min(4 * count, most)


def least_dimension(series: np.ndarray, delay: int, exclude: int) -> int:
    """The least dimension without false neighbours; MOST if there is none, as for noise."""
    for dimension in range(1, MOST):
        if len(series) <= dimension * delay + 2 * exclude + 2:
            return dimension
        if false_neighbours(series, dimension, delay, exclude) < NONE_FALSE:
            return dimension
    return MOST


def hardly_correlated(series: np.ndarray) -> bool:
    """True if neighbouring samples are hardly correlated, as those of a map: autocorrelation below
    1/e in magnitude.
    """
    centred = series - series.mean()
    return bool(abs(np.dot(centred[:-1], centred[1:])) < np.dot(centred, centred) / np.e)
