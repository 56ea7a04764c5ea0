"""The periodic orbits of a map in a region, stable and unstable: the search (search.py) for each
period in turn.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from saltus.analysis.closed.motions import (
    ClosedMotion,
    from_smallest,
    least_period,
    phase_distances,
)
from saltus.analysis.closed.search import AGES, BESIDE, Family, Search, parts_of, used_up
from saltus.analysis.closed.shooting import Shooting
from saltus.analysis.solve.newton import leading_first
from saltus.analysis.solve.tolerances import AMPLIFIED, SAME
from saltus.flow.maps import Map
from saltus.flow.progress import stage
from saltus.interrupt import PartInterrupted

#: Most guesses beside known orbits.
MOST_BESIDE = 1024
#: Shares of the work, about: starts are followed before any search; Newton's method starts from
#: them, and what is left of a search is deflation.
FOLLOWED, HUNTED = 0.1, 0.5


class Orbits(Family[ClosedMotion]):
    """Periodic orbits of a map with one row of values, each once.

    Parameters
    ----------
    map_ : Map
        The map.
    scale : float64[D]
        Range of each state.
    """

    rounds = 8

    def __init__(self, map_: Map, scale: np.ndarray) -> None:
        super().__init__()
        self.map, self.scale = map_, scale

    def guess(self, points: np.ndarray) -> Shooting:
        """Guesses of orbits float64[k, n, D]."""
        k = len(points)
        scale = np.broadcast_to(self.scale, (k, len(self.scale)))
        return Shooting(self.map, np.zeros(k, np.int64), points, scale)

    def take(self, closed: Shooting) -> np.ndarray:
        """As that of any family; of orbits by their least period."""
        least, number = least_period(closed.points, self.scale), np.full(len(closed), -1)
        for n in np.unique(least).tolist():
            rows = np.flatnonzero(least == n)
            number[rows] = super().take(self.guess(closed.points[rows, :n]))
        return number

    def motion(self, closed: Shooting) -> ClosedMotion | None:
        """See :class:`Family`."""
        points = from_smallest(closed.points[0])
        end, matrices = self.guess(points[None]).parts().tangent(points, 1)
        mismatch = float(np.abs((end - np.roll(points, -1, axis=0)) / self.scale).max())
        multipliers = multipliers_of(matrices)
        if not (mismatch < AMPLIFIED and np.isfinite(multipliers).all()):
            return None
        return ClosedMotion(points, multipliers, mismatch)

    def same(self, motion: ClosedMotion, closed: Shooting) -> np.ndarray:
        """See :class:`Family`: at some phase. Those whose means differ needn't be compared."""
        equal = np.zeros(len(closed), bool)
        if closed.points.shape[1] == motion.period:
            one, others = motion.points / self.scale, closed.points / self.scale
            apart = np.abs(_marks(others) - _marks(one)).max(axis=1, initial=0.0)
            for i in np.flatnonzero(apart < 4 * SAME * (1.0 + np.abs(one).max())):
                equal[i] = phase_distances(one, others[i]).min() < SAME
        return equal

    def known(self, n: int) -> np.ndarray:
        """Every orbit whose period divides n as n points, from each of its points on,
        float64[m, n D].
        """
        phases = [
            np.tile(np.roll(orbit.points, -i, axis=0), (n // orbit.period, 1)).ravel()
            for orbit in self.motions
            if n % orbit.period == 0
            for i in range(orbit.period)
        ]
        return np.array(phases).reshape(-1, n * len(self.scale))

    def beside(self, n: int, random: np.random.Generator) -> list[Shooting]:
        """See :class:`Family`: of those whose period divides n."""
        known = self.known(n).reshape(-1, n, len(self.scale))
        if not len(known):
            return []
        around = np.repeat(known, len(BESIDE), axis=0)
        far = np.tile(BESIDE, len(known))[:, None, None] * random.standard_normal(around.shape)
        points = around + far * np.ptp(known, axis=(0, 1))
        return [self.guess(points[:: -(-len(points) // MOST_BESIDE)])]

    def place(self, motion: ClosedMotion) -> tuple[float, ...]:
        """See :class:`Family`: by period, then by place."""
        points = motion.points / self.scale
        return (motion.period, *np.round(points[0], 7), *np.round(points, 6).ravel())


def all_orbits(
    map_: Map,
    start: np.ndarray,
    longest: int,
    scale: np.ndarray,
    progress: Callable[[float], None] | None = None,
    before: Map | None = None,
) -> Orbits:
    """The periodic orbits that starts lead to, up to a period.

    Parameters
    ----------
    map_ : Map
        The map, with one row of parameter values.
    start : float64[k, D]
        Newton's method begins at iterates of these: see :data:`AGES`.
    longest : int
        Largest period [iterates].
    scale : float64[D]
        Range of each state.
    progress : callable, optional
        Called with the share done.
    before : Map, optional
        The map by which starts are followed before Newton's method begins: the same, but for the
        budget of its motions, which last longer.

    Returns
    -------
    Orbits
        Ordered by period.

    Raises
    ------
    PartInterrupted
        On Ctrl-C. Its ``partial`` is what was found.
    """
    result = Orbits(map_, scale)
    try:
        _search(result, before or map_, start, longest, progress)
    except KeyboardInterrupt:
        raise PartInterrupted(result.ordered) from None
    return result.ordered()


def _search(
    result: Orbits,
    map_: Map,
    start: np.ndarray,
    longest: int,
    progress: Callable[[float], None] | None,
) -> None:
    """Search for orbits of one period after the other."""
    if progress:
        progress(FOLLOWED / 2)
    iterates = _guesses(map_, start, longest)
    progress = stage(progress, FOLLOWED, 1.0)
    for n in range(1, longest + 1):
        search = Search(n, len(start), given_up=len(start) - len(iterates))
        show = stage(progress, *(m * (m + 1) / (longest * (longest + 1)) for m in (n - 1, n)))
        guesses = result.guess(iterates[:, :n])
        parts = parts_of(guesses, stage(show, 0.0, HUNTED))
        result.hunt(search, ((guesses.rows(part), part) for part in parts))
        result.deflate(search, guesses, stage(show, HUNTED, 1.0))
        if show:
            show(1.0)


def _guesses(map_: Map, start: np.ndarray, longest: int) -> np.ndarray:
    """Successive iterates float64[k, longest, D] from each start on, at its age; without the
    starts whose budget is used up.
    """
    last = AGES[-1] + longest
    flight = map_.launch(start, last)
    points = np.concatenate([start[:, None], flight.advance(last - 1)], axis=1)
    age = np.resize(AGES, len(start))
    iterates = points[np.arange(len(start))[:, None], age[:, None] + np.arange(longest)]
    return np.asarray(iterates[~used_up(flight)])


def _marks(units: np.ndarray) -> np.ndarray:
    """Numbers of orbits float64[..., n, D] that don't depend on where they begin: the means of the
    points and of their squares.
    """
    return np.concatenate([units.mean(axis=-2), (units**2).mean(axis=-2)], axis=-1)


def multipliers_of(matrices: np.ndarray) -> np.ndarray:
    """Floquet multipliers of an orbit from the derivatives along it, float64[n, D, D]:
    complex128[D], the largest first.

    Of a product whose eigenvalues differ by many orders rounding leaves the large ones only; of two
    real ones the small one is the determinant over the large one.
    """
    product = np.eye(matrices.shape[1])
    for one in matrices:
        product = one @ product
    values: np.ndarray = leading_first(product[None])[0]
    if len(values) == 2 and values[0].imag == 0 and values[0] != 0:
        values[1] = np.prod(np.linalg.det(matrices)) / values[0]
    return values
