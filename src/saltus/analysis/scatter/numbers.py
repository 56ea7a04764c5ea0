"""Statistics of the numbers of many sets of values: quantiles and Sobol indices, with their
95 % intervals.
"""

from __future__ import annotations

import numpy as np

from saltus.interrupt import check_stop

#: Quantiles that are told.
QUANTILES = (0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99)
#: Resamples for the intervals of Sobol indices.
RESAMPLES = 400
#: Ends of the 95 % intervals.
TAILS = (0.025, 0.975)


def quantiles(numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Quantiles of numbers float64[n, ...] and the ends of their 95 % intervals, float64[Q, ...]
    each; numbers that are NaN are left out.

    The ends are order statistics, so that they hold for every distribution: of n independent values
    B lie below the quantile q, where B is binomial (n, q). An end is NaN where n is too small.
    Conover, Practical Nonparametric Statistics (1999), section 3.2. Sobol points are spread more
    evenly than independent ones: the intervals are then too wide rather than too narrow.
    """
    from scipy.stats import binom

    columns = numbers.reshape(len(numbers), int(np.prod(numbers.shape[1:])))
    found = np.full((3, len(QUANTILES), columns.shape[1]), np.nan)
    for k, column in enumerate(columns.T):
        known = np.sort(column[np.isfinite(column)])
        if not len(known):
            continue
        found[0, :, k] = np.quantile(known, QUANTILES)
        fenced = np.concatenate([[np.nan], known, [np.nan]])
        for end, tail, beyond in zip((1, 2), TAILS, (0, 1), strict=True):
            place = binom.ppf(tail, len(known), QUANTILES).astype(int) + beyond
            found[end, :, k] = fenced[np.clip(place, 0, len(known) + 1)]
    value, low, high = found.reshape(3, len(QUANTILES), *numbers.shape[1:])
    return value, low, high


def sobol_indices(
    first: np.ndarray, other: np.ndarray, swapped: np.ndarray, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """First and total Sobol indices, with the ends of their intervals.

    The first index is the share of the variance that the parameter alone explains, the total one
    that which is gone when all others are known but it. Sets of which a number is missing are left
    out.

    Parameters
    ----------
    first, other : float64[n]
        The number in n sets, and in n others.
    swapped : float64[d, n]
        In the first sets, with the values of one parameter from the others.
    seed : int
        Of the resampling.

    Returns
    -------
    first, total : float64[3, d]
        The index, and the ends of its 95 % interval by the bootstrap; NaN where nothing varies.

    References
    ----------
    Saltelli et al., Comput. Phys. Commun. 181 (2010) 259-270: first indices by their table 2 (b),
    total ones by (f) (Jansen); Archer, Saltelli & Sobol, J. Stat. Comput. Simul. 58 (1997) 99-120
    (bootstrap).
    """
    known = np.isfinite(first) & np.isfinite(other) & np.isfinite(swapped).all(axis=0)
    a, b, ab = first[known], other[known], swapped[:, known]
    found = np.full((2, 3, len(swapped)), np.nan)
    if len(a) < 2 or np.ptp(a) == 0:
        return found[0], found[1]
    centre = np.concatenate([a, b]).mean()
    a, b, ab = a - centre, b - centre, ab - centre
    products = np.stack([b * (ab - a), 0.5 * (a - ab) ** 2])  # 2, d, n
    squares = 0.5 * (a**2 + b**2)
    means = 0.5 * (a + b)

    def index(weight: np.ndarray) -> np.ndarray:
        variance = squares @ weight - (means @ weight) ** 2
        return np.asarray((products @ weight) / (variance if variance > 0 else np.nan))

    found[:, 0] = index(np.full(len(a), 1.0 / len(a)))
    rng, again = np.random.default_rng([seed, 1]), []
    for _ in range(RESAMPLES):
        check_stop()
        rows = np.bincount(rng.integers(len(a), size=len(a)), minlength=len(a))
        again.append(index(rows / len(a)))
    found[:, 1:] = np.nanquantile(again, TAILS, axis=0).transpose(1, 0, 2)
    return found[0], found[1]
