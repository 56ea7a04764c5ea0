"""Verdict of the data: standard errors, combinations that they leave open, and valleys."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from saltus.analysis.fits.search import Point, same_place

#: Standard deviation of an unknown of which the bounds are all that is known, in their width.
UNKNOWN = 1.0 / np.sqrt(12.0)
#: Correlation of neighbouring residuals beyond which they aren't noise.
FOLLOW = 0.5
#: Fewer neighbouring residuals than these tell nothing.
FEW = 20


@dataclass(frozen=True)
class Verdict:
    """Verdict of the data on p unknowns.

    Attributes
    ----------
    error : float64[p]
        Standard errors of the shares; infinite where the data say nothing.
    correlation : float64[p, p]
    combination : float64[p, p]
        Directions in the shares, a row each, that known worst first.
    combination_error : float64[p]
        Standard errors along these.
    """

    error: np.ndarray
    correlation: np.ndarray
    combination: np.ndarray
    combination_error: np.ndarray


def verdict(point: Point) -> Verdict:
    """Verdict of the data at the best place, by the linear terms there.

    The singular vectors of the derivatives are the combinations whose errors are independent; that
    of a combination is one over its singular value.
    """
    count = len(point.shares)
    _, singular, vectors = np.linalg.svd(point.slopes, full_matrices=False)
    rounding = np.finfo(float).eps * max(point.slopes.shape) * singular.max()
    open_ = singular <= rounding
    with np.errstate(divide="ignore"):
        errors = np.where(open_, np.inf, 1.0 / singular)
    finite = np.where(open_, 0.0, errors)
    covariance = np.einsum("ki,k,kj->ij", vectors, finite**2, vectors)
    scale = np.sqrt(np.diag(covariance))
    with np.errstate(divide="ignore", invalid="ignore"):
        correlation = covariance / scale[:, None] / scale
    beyond = (np.abs(vectors[open_]) > np.sqrt(np.finfo(float).eps)).any(axis=0)
    correlation[beyond] = correlation[:, beyond] = np.nan
    np.fill_diagonal(correlation, 1.0)
    order = np.argsort(-errors, kind="stable")
    turned = vectors * np.sign(vectors[np.arange(count), np.abs(vectors).argmax(axis=1)])[:, None]
    return Verdict(np.where(beyond, np.inf, scale), correlation, turned[order], errors[order])


def noise_of(
    residual: np.ndarray, deviation: np.ndarray, there: np.ndarray, unknowns: int
) -> np.ndarray:
    """Noise of each output, from residuals float64[m] in units of deviations float64[M, K]:
    factors on these, float64[K].
    """
    whole = np.zeros(deviation.shape)
    whole[there] = residual
    counts = there.sum(axis=0)
    left = counts * (1.0 - unknowns / counts.sum())
    return np.asarray(np.sqrt((whole**2).sum(axis=0) / left))


def follow(residual: np.ndarray) -> np.ndarray:
    """Correlation of neighbouring residuals of each output, float64[K], of float64[M, K] with NaN
    where a sample is missing; 0 of fewer than :data:`FEW` neighbours.
    """
    both = np.isfinite(residual[1:] * residual[:-1])
    product = np.where(both, residual[1:] * residual[:-1], 0.0).sum(axis=0)
    power = 0.5 * sum(
        np.where(both, one**2, 0.0).sum(axis=0) for one in (residual[1:], residual[:-1])
    )
    known = (both.sum(axis=0) >= FEW) & (power > 0)
    return np.asarray(np.where(known, product / np.where(known, power, 1.0), 0.0))


def valleys(minima: Sequence[Point]) -> list[tuple[Point, int]]:
    """The different minima among those at which descents ended, the best first, and how many ended
    in each.
    """
    found: list[tuple[Point, int]] = []
    for one in minima:
        for i, (other, count) in enumerate(found):
            if same_place(one.shares, other, 1.0):
                found[i] = other, count + 1
                break
        else:
            found.append((one, 1))
    return found
