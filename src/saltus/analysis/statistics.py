"""Means of correlated series and how sure they are: batch means with growing batches.

Neighbours are averaged again and again; the standard error that the averages claim grows with the
length of the batches until these are independent. Flyvbjerg & Petersen, J. Chem. Phys. 91 (1989)
461-466. The batch is the shortest of length B with B^3 > 2 n (e_B / e_1)^4, e_B being the error
claimed at length B: Wolff, Comput. Phys. Commun. 156 (2004) 143-153; Lee, Conduit, Nemec, Lopez
Rios & Drummond, Physical Review E 83 (2011) 066706. Growth rates are often anticorrelated, so that
the error falls with B: the ratio then counts as 1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

#: Batches from which an error is estimated at least: its own error is then a quarter of it.
LEAST = 8
#: Two-sided confidence of the intervals.
CONFIDENCE = 0.95
#: ln 50, rounded up: bounded (non-exponential) growth of a perturbation over an orbit. Over n
#: blocks an exponent below BOUNDED / n can't be told from zero; one above it isn't zero, whatever
#: its error.
BOUNDED = 4.0
#: Standard error [per iterate] beyond which an exponent says nothing.
UNCLEAR = 0.1
#: Points at which running means are kept: what a picture needs.
RUNNING = 200


@dataclass(frozen=True)
class Means:
    """Means of the beginnings of each series, and how sure they are: m lengths.

    Attributes
    ----------
    mean, error : float64[..., m]
        Mean and its standard error; the error is NaN where the values are too few for one.
    half_width : float64[..., m]
        Half of the 95 % confidence interval, by Student's t.
    batches : int64[..., m]
        Independent batches that the error comes from; 0 where there is none.
    """

    mean: np.ndarray
    error: np.ndarray
    half_width: np.ndarray
    batches: np.ndarray


def batch_means(values: np.ndarray, ends: np.ndarray) -> Means:
    """Means of the first ``ends`` values, int64[m], of series float64[..., n]."""
    values, ends = np.asarray(values, float), np.asarray(ends, np.int64)
    centre = values.mean(axis=-1, keepdims=True)
    centre = np.where(np.isfinite(centre), centre, np.nan)
    centred = values - centre
    mean = centre + np.cumsum(centred, axis=-1)[..., ends - 1] / ends
    levels = max(int(np.log2(max(values.shape[-1] // LEAST, 1))), 0) + 1
    errors = np.stack([_claimed(centred, 2**level, ends) for level in range(levels)])
    size = 2.0 ** np.arange(levels).reshape(-1, *([1] * mean.ndim))
    with np.errstate(all="ignore"):
        enough = size**3 > 2 * ends * np.maximum(np.nan_to_num(errors / errors[0]), 1.0) ** 4
    known = np.isfinite(errors)
    enough &= known
    # Where no batch is long enough the largest error claimed is taken: the true one is at least
    # that.
    level = np.where(
        enough.any(axis=0), enough.argmax(axis=0), np.where(known, errors, -np.inf).argmax(axis=0)
    )
    error = np.take_along_axis(errors, level[None], axis=0)[0]
    batches = np.where(np.isfinite(error), ends // 2**level, 0)
    return Means(
        mean, error, error * stdtrit(np.maximum(batches - 1, 1), 0.5 + 0.5 * CONFIDENCE), batches
    )


def _claimed(centred: np.ndarray, size: int, ends: np.ndarray) -> np.ndarray:
    """Standard error of the mean of the first ``ends`` values, were batches of this size
    independent; NaN with less than LEAST batches.
    """
    count = centred.shape[-1] // size
    batches = centred[..., : count * size].reshape(*centred.shape[:-1], count, size).mean(axis=-1)
    full = ends // size
    last = np.maximum(full, 1) - 1
    first, second = (
        np.cumsum(batches, axis=-1)[..., last],
        np.cumsum(batches**2, axis=-1)[..., last],
    )
    with np.errstate(all="ignore"):
        variance = np.maximum(second / full - (first / full) ** 2, 0.0) / (full - 1)
        return np.where(full >= LEAST, np.sqrt(variance), np.nan)


def running_ends(count: int) -> np.ndarray:
    """Blocks after which running means are kept, int64[m]."""
    return np.unique(np.ceil(np.linspace(0, count, RUNNING + 1)[1:]).astype(np.int64))
