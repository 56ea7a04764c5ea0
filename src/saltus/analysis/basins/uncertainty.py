"""Trust in a map of basins: shares with intervals, the smallest basin seen, and measures of the
boundaries.

All functions take the labels of the cells of a regular grid, int[nA, nB]. Negative labels are codes
(escaped, unconverged, ...), not attractors: they have no share, but in the measures of boundaries
each code counts as one more class, since a cell that may or may not settle is as uncertain as one
between two attractors. Cells without a motion, whose start lies beyond a stop or wasn't computed,
count nowhere.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from saltus.errors import ParameterError
from saltus.intervals import smallest_seen, wilson
from saltus.results.dataset.kinds import Kind
from saltus.results.dataset.schema import BASINS, check

#: Cells along the side of a box; Daza et al. use 5 in all of their figures.
BOX = 5
#: Largest distance, as a part of the shorter side of the grid: beyond it the sides have an
#: influence.
LARGEST_DISTANCE = 16
#: Least number of distances for a slope, so that it has an error.
FEWEST_DISTANCES = 3
#: Codes of cells without a motion.
NO_MOTION = (Kind.FAILED, Kind.NOT_COMPUTED)


# -- shares ----------------------------------------------------------------------------------------
def fractions(labels: np.ndarray, m: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Share of the starts that lead to each attractor, with a 95 % interval.

    For starts drawn at random the interval is the binomial one: 95 of 100 such samples hold the
    true share. The cells of a regular grid are not drawn at random. There it says how far the share
    of as many random starts would scatter; the error of a grid is mostly smaller (of the order of
    the boundary cells, whose share falls as N^(-alpha/2) with the uncertainty exponent alpha), but
    an evenly spaced grid can also miss or favour structures of its own spacing, which no interval
    tells.

    Parameters
    ----------
    labels : array of int, any shape
        Attractor of each start; negative codes where there is none. Starts that weren't computed
        (-4) don't count; those that escaped or did not settle do, so the shares may sum to less
        than 1.
    m : int
        Number of attractors.

    Returns
    -------
    share, low, high : array, shape (m,)
        NaN if nothing was computed.
    """
    labels = np.asarray(labels)
    cells = int((labels != Kind.NOT_COMPUTED).sum())
    count = np.bincount(labels[labels >= 0], minlength=m)
    if len(count) > m:
        raise ParameterError(
            f"the labels go up to {len(count) - 1}, but there are {m} attractors, "
            f"0 to {m - 1}. Give m={len(count)}."
        )
    share = count / cells if cells else np.full(m, np.nan)
    return (share, *wilson(count, cells))


# -- boundaries ------------------------------------------------------------------------------------
def basin_entropy(labels: np.ndarray, box: int = BOX) -> tuple[float, float]:
    """Basin entropy and boundary basin entropy.

    The grid is cut into boxes of box x box cells; each has the Gibbs entropy -sum p ln p of the
    shares p of the labels in it. Cells left over at the far edges are dropped. The entropy depends
    on the size of the box and on the grid: compare maps of one grid only. A boundary entropy above
    ln 2 proves a fractal boundary (between two smooth pieces at most two labels meet in most
    boxes).

    A. Daza, A. Wagemakers, B. Georgeot, D. Guery-Odelin, M. A. F. Sanjuan, Scientific Reports 6
    (2016) 31416.

    Parameters
    ----------
    labels : array of int, shape (nA, nB)
        Attractor or code of each cell; each code is a class of its own but those in NO_MOTION:
        such cells count in no box.
    box : int
        Cells along the side of a box.

    Returns
    -------
    entropy : float
        Mean over all boxes [nat]; NaN if the grid holds no whole box.
    boundary_entropy : float
        Mean over the boxes that hold more than one label [nat]; NaN if there is none.
    """
    if box < 1:
        raise ParameterError(f"a box of {box} cells holds nothing: give box=1 or more.")
    labels = np.asarray(labels)
    rows, columns = (size // box for size in labels.shape)
    if rows * columns == 0:
        return np.nan, np.nan
    boxes = labels[: rows * box, : columns * box].reshape(rows, box, columns, box)
    cells = (~np.isin(boxes, NO_MOTION)).sum(axis=(1, 3))
    entropy, classes = np.zeros((rows, columns)), np.zeros((rows, columns), dtype=int)
    for label in np.setdiff1d(labels, NO_MOTION):
        count = (boxes == label).sum(axis=(1, 3))
        present = count > 0
        share = count[present] / cells[present]
        entropy[present] -= share * np.log(share)
        classes += present
    mixed, held = entropy[classes > 1], entropy[cells > 0]
    return _mean(held), _mean(mixed)


def _mean(of: np.ndarray) -> float:
    return float(of.mean()) if of.size else np.nan


def uncertain_share(labels: np.ndarray, distance: int) -> float:
    """Share of cells with a neighbour of another label at this distance, along either axis and to
    either side. Cells in NO_MOTION are left out.

    Beyond its edges the grid is continued by its mirror image. That keeps every cell and changes no
    dimension: a share of the cells that have all four neighbours would grow with the distance for a
    straight line, one of all cells would fall for noise.
    """
    labels = np.asarray(labels)
    uncertain, moves = np.zeros(labels.shape, dtype=bool), ~np.isin(labels, NO_MOTION)
    for axis, size in enumerate(labels.shape):
        place = np.arange(size)
        below, above = place - distance, place + distance
        for neighbour in (
            np.where(below < 0, -1 - below, below),
            np.where(above >= size, 2 * size - 1 - above, above),
        ):
            differs = labels != np.take(labels, neighbour, axis=axis)
            uncertain |= differs & np.take(moves, neighbour, axis=axis)
    return float(uncertain[moves].mean()) if moves.any() else 0.0


def uncertainty_exponent(labels: np.ndarray) -> tuple[float, float, float]:
    """Uncertainty exponent of the boundaries and their fractal dimension.

    The share f of uncertain cells (:func:`uncertain_share`) is taken at distances of 1, 2, 4, ...
    cells up to 1/16 of the shorter side of the grid; alpha is the least-squares slope of ln f over
    ln distance. Cells are points, so their distance is exact and no correction for the size of a
    box is needed. A smooth boundary has alpha = 1: twice the accuracy of the start, half the doubt.
    A small alpha means that more accuracy buys little. Where boundaries lie closer to each other
    than the largest distance, f bends towards its ceiling and alpha comes out low: 0.94 on 256 x
    256 cells and 0.96 on 512 x 512 for a smooth boundary that winds.

    S. W. McDonald, C. Grebogi, E. Ott, J. A. Yorke, Physica D 17 (1985) 125.

    Parameters
    ----------
    labels : array of int, shape (nA, nB)
        Attractor or code of each cell; each code is a class of its own.

    Returns
    -------
    exponent : float
        alpha.
    error : float
        Standard error of the slope: how far the points are from a line. It knows nothing of
        structures finer than the grid.
    dimension : float
        2 - alpha.

        All three are NaN where there is no boundary, and on a grid of fewer than 64 cells a side,
        which has fewer than three distances.
    """
    largest = min(np.shape(labels)) // LARGEST_DISTANCE
    distances = 2 ** np.arange(max(largest, 0).bit_length())
    shares = np.array([uncertain_share(labels, int(distance)) for distance in distances])
    seen = shares > 0
    if seen.sum() < FEWEST_DISTANCES:
        return np.nan, np.nan, np.nan
    x, y = np.log(distances[seen]), np.log(shares[seen])
    spread = x - x.mean()
    alpha = float(spread @ y / (spread @ spread))
    residual = y - y.mean() - alpha * spread
    error = float(np.sqrt(residual @ residual / (len(x) - 2) / (spread @ spread)))
    return alpha, error, 2.0 - alpha


# -- a map -----------------------------------------------------------------------------------------
def measure(ds: xr.Dataset) -> dict[str, float | int]:
    """The measures of trust of a map of basins, for its attributes.

    Parameters
    ----------
    ds : Dataset
        The result of ``basins``.

    Returns
    -------
    dict
        ``smallest_basin_seen`` (share of the starts, of those that were computed),
        ``basin_entropy`` and ``boundary_basin_entropy`` [nat], ``uncertainty_exponent``,
        ``uncertainty_exponent_error``, ``boundary_dimension``, ``unresolved_cells`` (on whose way a
        graze was shallower than the local error), ``unsettled_cells`` (that have a code and no
        attractor).
    """
    check(ds, caller="measure", kinds=[BASINS])
    labels = ds["basin"].values
    entropy, boundary_entropy = basin_entropy(labels)
    exponent, error, dimension = uncertainty_exponent(labels)
    return {
        "smallest_basin_seen": smallest_seen(int((labels != Kind.NOT_COMPUTED).sum())),
        "basin_entropy": entropy,
        "boundary_basin_entropy": boundary_entropy,
        "uncertainty_exponent": exponent,
        "uncertainty_exponent_error": error,
        "boundary_dimension": dimension,
        "unresolved_cells": int((ds["grazes_unresolved"].values > 0).sum()),
        "unsettled_cells": int((labels < 0).sum()),
    }
