"""Descents on ever longer beginnings of a history.

What a motion is sensitive to grows with its length, and with it the number of valleys: from a short
beginning most starts lead to the right one, and each longer beginning is predicted well by what the
shorter one has told. Pisarenko & Sornette, Phys. Rev. E 69 (2004) 036122, on why a misfit over a
long chaotic history has no use.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from saltus.analysis.fits.search import MisfitSearch, Point
from saltus.analysis.fits.verdict import FEW, FOLLOW, follow, valleys
from saltus.analysis.fits.windows import shoot
from saltus.flow.progress import stage

#: The first beginning, in shares of the history, and its samples for each unknown at least.
FIRST, LEAST = 1 / 32, 4
#: Most ways from there.
WAYS = 6
#: A longer beginning follows where its data are predicted to within this share of their standard
#: deviations; else a shorter step does.
PREDICTED = 0.25
#: Factors between beginnings: the first one, and the shortest.
LONGER, SHORTEST = 2.0, 1.05
#: Share of the work that finds the minima on the first beginning.
BEGIN = 0.2
#: Share of the work on a way that comes before its windows.
FOLLOWED = 0.5


def grow(
    search: MisfitSearch,
    starts: np.ndarray,
    described: Callable[[MisfitSearch], bool],
    show: Callable[[float], None] | None,
) -> None:
    """Descend along such ways, from the minima on the first beginning, until one describes the
    data; where a way's motion can't be followed from its start, through windows.
    """
    whole = len(search.data)
    least = min(max(LEAST * (len(search.unknowns) + 1), FEW + 1), whole)
    count = max(round(FIRST * whole), least)
    while True:
        part = search.beginning(count)
        part.run(starts, stage(show, 0.0, BEGIN), descend=1.0)
        search.take(part)
        if search.spent or count == least or (part.minima and _noise(search, part.minima[0])):
            break
        count = max(count // 2, least)
    search.minima.clear()
    for i, (one, count) in enumerate(valleys(part.minima)[:WAYS]):
        begin, middle, end = (BEGIN + (1.0 - BEGIN) * j / WAYS for j in (i, i + FOLLOWED, i + 1))
        search.ended = None
        here = _follow(search, one, i, stage(show, begin, middle))
        if search.ended is not None:  # as many descents as led to where it began
            search.minima += [search.ended] * (count - 1)
        if search.spent or (described(search) and _noise(search, search.minima[0])):
            return
        if (
            here is not None
            and shoot(search, here, count, stage(show, middle, end))
            and described(search)
        ):
            return


def _noise(search: MisfitSearch, here: Point) -> bool:
    """True if noise is left of a beginning: neighbouring residuals don't follow each other."""
    return bool((follow(search.data[: len(here.fitted)] - here.fitted) <= FOLLOW).all())


def _off(search: MisfitSearch, here: Point) -> float:
    """Root mean square of what a beginning is missed by, in standard deviations of the data."""
    data = search.data
    off = (here.fitted - data[: len(here.fitted)]) / np.nanstd(data, axis=0)
    return float(np.sqrt(np.nanmean(off**2)))


def _follow(
    search: MisfitSearch, here: Point, i: int, show: Callable[[float], None] | None
) -> Point | None:
    """Follow the minimum number i on a beginning to the whole history. The minimum on the longest
    beginning of which noise is left; None if there is none.
    """
    whole, factor, longest = len(search.data), LONGER, here if _noise(search, here) else None
    while (count := len(here.fitted)) < whole and not search.spent:
        longer = min(max(round(count * factor), count + 1), whole)
        part = search if longer == whole else search.beginning(longer)
        there = part.at(here.shares)
        if _off(part, there) > max(PREDICTED, 1.5 * _off(search, here)) and factor > SHORTEST:
            factor = np.sqrt(factor)
        else:
            part.descend(here.shares, stage(show, count / whole, longer / whole))
            if part is search or not part.minima:
                return longest
            here = part.minima[0]
            if _noise(search, here):
                longest = here
            if i and _off(search, here) > PREDICTED:  # others are better
                return longest
        if part is not search:
            search.take(part)
    return longest
