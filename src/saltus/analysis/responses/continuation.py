"""Natural continuation: orbits followed from one value of a parameter to another, in steps as short
as each of them needs.

Newton's method, started on an orbit at the next value, may arrive at another one: of a chaotic
motion there are unrelated orbits of every period nearby. So a step counts only if it arrives at an
orbit of the same period that attracts, not far away. Where the orbit moved by more than a little,
two steps of half the length must arrive at the same orbit, the middle one about halfway. A step
that doesn't count is halved; two that do in a row are doubled. Allgower & Georg, Introduction to
Numerical Continuation Methods (2003), chapter 6.
"""

from __future__ import annotations

import numpy as np

from saltus.analysis.orbits.find_responses import motion_range
from saltus.analysis.orbits.orbits import OrbitBatch, find_orbits, orbit_distance, phase_distances
from saltus.analysis.orbits.special_equilibria import fold_point, hopf_point
from saltus.analysis.orbits.tolerances import SAME
from saltus.analysis.orbits.unforced import close_again
from saltus.analysis.responses.grid import Grid
from saltus.analysis.responses.responses import GridResponses
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import Method

#: Farthest that an orbit moves in one step, in units of its own range.
LINK = 0.35
#: An orbit that moves less than this in one step is taken for the same one without a step at the
#: middle.
SURE = 0.02
#: Farthest that the middle of a step lies from halfway, in units of the step: 0.21 right at a fold,
#: half if one of the steps is a jump.
ASTRAY = 0.25
#: How often the distance to the target is halved at most, and steps towards it at most.
HALVINGS, STEPS = 14, 400
#: Farthest that a response of an inexact method lies from the exact orbit that it stands for, in
#: units of its range.
INEXACT = 0.05


def closed_near(
    map_: Stroboscope, start: np.ndarray, period: np.ndarray, time: np.ndarray, scale: np.ndarray
) -> OrbitBatch:
    """Orbits of the stroboscope (time NaN), limit cycles and equilibria (time 0) near states
    float64[k, D], as a map_ has them.
    """
    if np.isnan(time).all():
        return find_orbits(map_, start, period, scale, map_.noise_of(scale), max_slow=1)
    return close_again(map_, start, time, scale)


def _in_phase(orbits: OrbitBatch, others: OrbitBatch, scale: np.ndarray) -> np.ndarray:
    """Let each orbit begin with the point that lies by the first of another; how far they are
    apart, float64[k], inf if they can't be.
    """
    apart = np.full(len(scale), np.inf)
    for i in np.flatnonzero((orbits.period == others.period) & (orbits.period > 0)):
        n = int(orbits.period[i])
        distance = phase_distances(others.points[i, :n], orbits.points[i, :n], scale[i])
        orbits.points[i, :n] = np.roll(orbits.points[i, :n], -int(distance.argmin()), axis=0)
        apart[i] = distance.min()
    return apart


class Follower:
    """Some periodic orbits, limit cycles or equilibria among the responses of a grid with one axis,
    each followed on its own.

    Parameters
    ----------
    found : GridResponses
        The responses.
    grid, method, threads
        As they were computed. Responses of an inexact method are followed by the exact orbits that
        they stand for.
    rows : int64[k]
        Which responses.

    Attributes
    ----------
    orbits : OrbitBatch
        The orbit that each has become.
    value : float64[k]
        The value of the parameter [SI] that it is of.
    step : float64[k]
        The last step that didn't count, where one as short as steps may be didn't, else the next
        one [SI].
    narrow : bool[k]
        Whether it was that short.
    known : bool[k]
        Whether there is an exact orbit to follow.
    """

    def __init__(
        self,
        found: GridResponses,
        grid: Grid,
        method: Method,
        rows: np.ndarray,
        threads: int | None = None,
    ):
        ((name, values),) = grid.axes.items()
        self._column = list(grid.system.values).index(name)
        self._map = Stroboscope(
            grid.system,
            method if method.exact else method.companion(),
            grid.rows[found.place[rows]],
            grid.every,
            threads,
        )
        self._every = grid.every
        self._scale = found.motions.scale[found.row[rows]]
        self.orbits, self.value = (
            found.motions.orbits.rows(found.row[rows]),
            values[found.place[rows]],
        )
        self.step, self.narrow, self.known = (
            np.zeros(len(rows)),
            np.zeros(len(rows), bool),
            np.ones(len(rows), bool),
        )
        if not method.exact and len(rows):
            exact, apart = self._near(np.arange(len(rows)), self.value, self.orbits)
            self.known = apart < INEXACT
            self.orbits.put(np.flatnonzero(self.known), exact.rows(self.known))

    def to(self, target: np.ndarray, which: np.ndarray, halvings: int = HALVINGS) -> np.ndarray:
        """Follow those of ``which``, bool[k], to values float64[k] while they attract; which
        arrive, bool[k].

        The others stay at the last value that they were followed to. The distance is halved a
        limited number of times.
        """
        going, in_a_row = which & self.known, np.zeros(len(which), np.int64)
        self.step = np.where(going, target - self.value, self.step)
        least = np.abs(self.step) * 0.5**halvings
        for _ in range(STEPS):
            rows = np.flatnonzero(going)
            if not len(rows):
                break
            left = target[rows] - self.value[rows]
            step = np.where(np.abs(self.step[rows]) < np.abs(left), self.step[rows], left)
            counts = self._try(rows, np.where(step == left, target[rows], self.value[rows] + step))
            in_a_row[rows] = np.where(counts, in_a_row[rows] + 1, 0)
            self.narrow[rows] = ~counts & (np.abs(step) < 1.5 * least[rows])
            factor = np.where(
                counts,
                np.where(in_a_row[rows] > 1, 2.0, 1.0),
                np.where(self.narrow[rows], 1.0, 0.5),
            )
            self.step[rows] = factor * step
            going[rows] = (self.value[rows] != target[rows]) & ~self.narrow[rows]
            self._measure(rows[counts & going[rows]])
        return np.asarray(which & self.known & (self.value == target))

    def at(self, rows: np.ndarray, value: np.ndarray) -> tuple[OrbitBatch, np.ndarray]:
        """What Newton's method finds near some rows int64[m] at values float64[m], and which of it
        is the same orbit, moved, bool[m].
        """
        found, apart = self._near(rows, value, self.orbits.rows(rows))
        return found, apart < LINK

    def special(self, row: int, kind: str, state: np.ndarray, place: float) -> float:
        """The value at the Hopf point or fold of an equilibrium, by Newton's method on its defining
        system from a state float64[D] and a value near it; that value itself where there is none.
        """
        system = self._map.system
        values = dict(zip(system.values, self._map.parameters[row].tolist(), strict=True))
        values[list(values)[self._column]] = place
        find = {"hopf": hopf_point, "fold": fold_point}[kind]
        name = list(values)[self._column]
        found = find(system.with_values(**values), name, state, self._scale[row])
        near = 1e-3 * max(abs(place), abs(self._map.parameters[row, self._column] - place))
        return found.value if found is not None and abs(found.value - place) <= near else place

    def beside(self, row: int, points: np.ndarray) -> float:
        """How far a row's orbit lies from that with points float64[n, D], in units of its range."""
        n = int(self.orbits.period[row])
        return orbit_distance(self.orbits.points[row, :n], points, self._scale[row])

    def _near(
        self, rows: np.ndarray, value: np.ndarray, orbits: OrbitBatch
    ) -> tuple[OrbitBatch, np.ndarray]:
        """The orbits at values float64[m] that Newton's method finds from others, in phase with
        these, and how far these lie apart.
        """
        scale = self._scale[rows]
        arrived = closed_near(
            self._at(rows, value), orbits.points[:, 0], orbits.period, orbits.time, scale
        )
        return arrived, _in_phase(arrived, orbits, scale)

    def _at(self, rows: np.ndarray, value: np.ndarray) -> Stroboscope:
        """The maps of some rows at other values of the parameter."""
        parameters = self._map.parameters[rows]
        parameters[:, self._column] = value
        return Stroboscope(
            self._map.system, self._map.method, parameters, self._every, self._map.threads
        )

    def _try(self, rows: np.ndarray, value: np.ndarray) -> np.ndarray:
        """Go on to values float64[m] where the step counts; where it did, bool[m]."""
        here = self.orbits.rows(rows)
        there, moved = self._near(rows, value, here)
        counts = there.stable & (moved < LINK)
        unsure = np.flatnonzero(counts & (moved > SURE))
        if len(unsure):
            counts[unsure] = self._by_halves(
                rows[unsure], value[unsure], here.rows(unsure), there.rows(unsure), moved[unsure]
            )
        self.orbits.put(rows[counts], there.rows(counts))
        self.value[rows[counts]] = value[counts]
        return counts

    def _by_halves(
        self,
        rows: np.ndarray,
        value: np.ndarray,
        here: OrbitBatch,
        there: OrbitBatch,
        moved: np.ndarray,
    ) -> np.ndarray:
        """Whether two steps of half the length arrive where one does, the middle one about halfway,
        bool[m].
        """
        middle, apart = self._near(rows, 0.5 * (self.value[rows] + value), here)
        off = np.abs(middle.points - 0.5 * (here.points + there.points)) / self._scale[rows, None]
        # beyond the last point of each there is nothing
        astray = np.nan_to_num(off).max(axis=(1, 2))
        right = np.flatnonzero(middle.stable & (apart < LINK) & (astray <= ASTRAY * moved))
        if len(right):
            again, _ = self._near(rows[right], value[right], middle.rows(right))
            right = right[
                again.stable
                & (_in_phase(again, there.rows(right), self._scale[rows[right]]) < SAME)
            ]
        result = np.zeros(len(rows), bool)
        result[right] = True
        return result

    def _measure(self, rows: np.ndarray) -> None:
        """Take the range of some motions anew. That of an equilibrium stays."""
        if not len(rows):
            return
        if self._every is None:
            self._scale[rows] = motion_range(
                self._at(rows, self.value[rows]), self.orbits.points[rows, 0]
            )
        else:
            turning = rows[self.orbits.time[rows] > 0]
            self._scale[turning] = np.ptp(self.orbits.points[turning], axis=1)
