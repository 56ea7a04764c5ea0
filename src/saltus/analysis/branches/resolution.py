"""Resolution of branches: as many orbits as a picture of their size needs."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from saltus.analysis.branches.branch import Branch
from saltus.analysis.branches.piece import refine

#: Largest change of the size of the orbit from one point to the next, relative to the larger.
CHANGE = 0.08
#: Changes smaller than this share of the largest orbit can't be seen.
SEEN = 0.005
#: Halvings of an interval.
ROUNDS = 4
#: Cosine between a step and the tangents at its ends below which the states jump on the way: an
#: impact crosses the whole period at which they are told.
ALONG = 0.5

#: Sizes float64[r] of orbits float64[r, z] of a branch.
Sizes = Callable[[Branch, np.ndarray], np.ndarray]


def resolve(branches: Sequence[Branch], sizes: Sizes) -> None:
    """Put orbits between neighbours whose sizes differ by more than can be drawn as a line."""
    known = [sizes(branch, branch.z) for branch in branches]
    largest = max((float(np.nanmax(size, initial=0.0)) for size in known), default=0.0)
    for number, branch in enumerate(branches):
        size = known[number]
        for _ in range(ROUNDS):
            change = np.abs(np.diff(size))
            larger = np.maximum(size[1:], size[:-1])
            seen = (change > CHANGE * larger) & (change > SEEN * largest)
            wide = np.flatnonzero(seen & _smooth(branch))
            new = refine(branch, wide.tolist()) if len(wide) else wide
            if not len(new):
                break
            size = np.insert(size, new - np.arange(len(new)), sizes(branch, branch.z[new]))


def _smooth(branch: Branch) -> np.ndarray:
    """True for steps from point to point along the tangents at both ends, bool[p - 1]."""
    step = np.diff(branch.z, axis=0) / branch.scale
    least = ALONG * np.linalg.norm(step, axis=1)
    ways = [np.einsum("ki,ki->k", step, one) for one in (branch.tangent[:-1], branch.tangent[1:])]
    smooth: np.ndarray = np.minimum(*ways) >= least
    return smooth
