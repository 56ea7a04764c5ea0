"""Confidence intervals of shares."""

from __future__ import annotations

import numpy as np

#: Two-sided 95 % quantile of the normal distribution.
QUANTILE_95 = 1.959963984540054
#: -ln(0.05): a share p stays unseen in N random cells with probability (1-p)^N < 5 % if p > 3/N.
RULE_OF_THREE = 3.0


def wilson(count: np.ndarray | int, cells: np.ndarray | int) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the 95 % score interval of a share ``count / cells``; NaN for no cells.

    E. B. Wilson, J. Am. Stat. Assoc. 22 (1927) 209. Unlike the textbook interval it stays within 0
    and 1 and has a width at 0 and at 1.
    """
    count, cells = np.broadcast_arrays(
        np.asarray(count, dtype=float), np.where(np.equal(cells, 0), np.nan, cells)
    )
    share, z2 = count / cells, QUANTILE_95**2
    centre = (share + z2 / (2 * cells)) / (1 + z2 / cells)
    half = (
        QUANTILE_95 / (1 + z2 / cells) * np.sqrt(share * (1 - share) / cells + z2 / (4 * cells**2))
    )
    none = np.isnan(cells)
    return np.where(~none & (count == 0), 0.0, centre - half), np.where(
        count == cells, 1.0, centre + half
    )


def smallest_seen(cells: int) -> float:
    """Share above which a basin can't have been missed by this number of starts, with a confidence
    of 95 %: 3/N, the rule of three.

    Hanley & Lippman-Hand, J. Am. Med. Assoc. 249 (1983) 1743. It holds for starts drawn at random.
    On a regular grid it says the same of a basin that is scattered finely; a compact one is met for
    certain as soon as it holds a whole cell, 1/N. 1 if there are fewer than three starts.
    """
    return min(RULE_OF_THREE / cells, 1.0) if cells else 1.0
