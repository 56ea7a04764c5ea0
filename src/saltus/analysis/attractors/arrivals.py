"""Arrivals of trajectories of a map at attractors, those of new orbits where some recur."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from saltus.analysis.attractors.aperiodic import SampledMotion, merge
from saltus.analysis.attractors.attractor_set import INSIDE, AttractorSet, is_about
from saltus.analysis.attractors.families import on_families
from saltus.analysis.attractors.growth import NEWTON, tangent_cost
from saltus.analysis.attractors.limit_cycles import limit_cycles
from saltus.analysis.attractors.noisy import Noisy, blurred, keep_to
from saltus.analysis.attractors.recurrence import recurrence
from saltus.analysis.closed.field_zeros import autonomous
from saltus.analysis.closed.motions import ClosedMotion, same
from saltus.analysis.closed.orbits import find_orbits
from saltus.analysis.solve.tolerances import NEAR, ROUND, SAME
from saltus.flow.maps import Map, Stroboscope, Travel
from saltus.results.dataset.kinds import Kind

#: Candidates for orbits in one round; what isn't tried has its turn in the next.
MAX_CANDIDATES = 12


@dataclass(frozen=True)
class Arrivals:
    """The attractors that are known, and which of them each trajectory has arrived at.

    Attributes
    ----------
    map_ : Map
        The map.
    scale : float64[D]
        Range of each state.
    exactly : callable
        The orbits to which the exact map settles from states float64[k, D], None where to none.
    found : AttractorSet
        The attractors, more and more.
    owner : list, one for each trajectory
        Its attractor; None as long as it isn't known.
    settled : int64[k]
        Iterates after which it was captured; -1 if it wasn't.
    """

    map_: Map
    scale: np.ndarray
    exactly: Callable[[np.ndarray], list[ClosedMotion | None]]
    found: AttractorSet
    owner: list[ClosedMotion | SampledMotion | None]
    settled: np.ndarray

    @property
    def turns(self) -> bool:
        """True for an unforced flow, whose motions have periods of their own."""
        return isinstance(self.map_, Stroboscope) and autonomous(self.map_.system)

    @property
    def blurs(self) -> bool:
        """True where the map has errors beyond rounding, and its motions have periods to blur."""
        return self.map_.exact_map is not None and not self.turns

    def captured(self, points: np.ndarray, who: np.ndarray, age: int) -> np.ndarray:
        """Note which of the trajectories float64[k, m, D] are captured, and after how many
        iterates; bool[k].
        """
        label, when = self.found.near.capture(points)
        caught = label >= 0
        for i, orbit, at in zip(who[caught], label[caught], when[caught], strict=True):
            self.owner[i], self.settled[i] = self.found.orbits[orbit], age + at + 1
        return caught

    def keeping(self, kind: str, points: np.ndarray, who: np.ndarray, age: int) -> np.ndarray:
        """Note which trajectories float64[k, m, D] keep to an attractor of a kind that is known by
        where it goes, bool[k].
        """
        ones = [one for one in self.found.sampled if one.kind == kind]
        on = keep_to(ones, points, INSIDE)
        for i in np.flatnonzero(on >= 0):
            self.owner[who[i]], self.settled[who[i]] = ones[on[i]], age
        return on >= 0

    def on_families(self, points: np.ndarray, who: np.ndarray, age: int) -> np.ndarray:
        """Note which trajectories float64[k, m, D] are on families of orbits, bool[k]."""
        homes = on_families(self.map_, points, self.scale, self.found)
        for i, home in zip(who, homes, strict=True):
            if home is not None:
                self.owner[i], self.settled[i] = home, age
        return np.array([home is not None for home in homes])

    def on_cycles(
        self, points: np.ndarray, who: np.ndarray, travel: Travel, rows: np.ndarray
    ) -> np.ndarray:
        """Note which trajectories of an unforced flow are on a limit cycle, bool[k]. Looks for new
        cycles first.
        """
        cycles = [one for one in self.found.sampled if one.kind == Kind.LIMIT_CYCLE.word]
        alone = np.flatnonzero(keep_to(cycles, points, INSIDE) < 0)
        few = np.linspace(0, len(alone) - 1, min(MAX_CANDIDATES, len(alone))).astype(int)
        some = alone[np.unique(few)]
        some = some[travel.going[rows[some]]]
        if len(some) and isinstance(self.map_, Stroboscope):
            time = ROUND * float(self.map_.period[0])
            fresh = limit_cycles(self.map_, points[some, -1], time, self.scale)
            self.found.sampled = merge([*self.found.sampled, *fresh])
        return self.keeping(Kind.LIMIT_CYCLE.word, points, who, travel.age)

    def add_orbits(self, points: np.ndarray, purse: np.ndarray) -> bool:
        """Add the attracting orbits not known yet that some of the trajectories
        float64[k, ROUND, D] follow; whether there are any. What closing orbits costs is taken off
        the purse [iterates].
        """
        near = max(NEAR, self.map_.noise)
        tried, period = self._candidates(points, near, purse)
        place = points[tried, -1]
        scales, noise = np.broadcast_to(self.scale, place.shape), self.map_.noise
        orbits = find_orbits(self.map_, place, period, scales, np.full(len(tried), noise))
        right = (orbits.period > 0) & (orbits.distance(place, scales) < 100 * near)
        added = False
        for i in np.flatnonzero(right).tolist():
            orbit = orbits[i]
            if any(is_about(one, orbit) for one in self.found.sampled):
                continue
            known_ones = self.found.orbits if orbits.stable[i] else self.found.unstable
            if any(same(orbit, one, self.scale, max(SAME, 4 * noise)) for one in known_ones):
                continue
            if not orbits.stable[i]:
                self.found.unstable.append(orbit)
                continue
            noisy = self._behind(orbit)
            if noisy is None:
                self.found.add(self.map_, orbit, self.scale)
            else:
                self.found.add_sampled(noisy)
            added = True
        return added

    def _candidates(
        self, points: np.ndarray, near: float, purse: np.ndarray
    ) -> tuple[list[int], np.ndarray]:
        """Trajectories that recur where no unstable orbit is known, and their periods; their price
        is taken off the purse.
        """
        period, apart = recurrence(points, self.scale)
        tried: list[int] = []
        for i in np.argsort(apart, kind="stable")[: np.count_nonzero(apart < near)]:
            known = any(
                _lies_on(points[i, -1], orbit, self.scale, 10 * apart[i])
                for orbit in self.found.unstable
            )
            price = NEWTON * period[i] * tangent_cost(len(self.scale))
            apart_now = np.abs((points[i, -1] - points[tried, -1]) / self.scale).max(axis=1)
            alike = bool((apart_now < near).any())
            if not (known or alike) and price <= purse[0]:
                tried.append(i)
                purse -= price
            if len(tried) == MAX_CANDIDATES:
                break
        return tried, period[tried]

    def _behind(self, orbit: ClosedMotion) -> Noisy | None:
        """The exact orbit of another period about which an inexact map's orbit is scatter: its
        loops are made, or lost, by errors.
        """
        exact = self.exactly(orbit.points[:1])[0] if self.blurs else None
        if exact is None or exact.period == orbit.period:
            return None
        noisy = blurred(self.map_, exact, self.scale)
        return noisy if noisy is not None and is_about(noisy, orbit) else None


def _lies_on(place: np.ndarray, orbit: ClosedMotion, scale: np.ndarray, tolerance: float) -> bool:
    return bool(np.abs((orbit.points - place) / scale).max(axis=1).min() < tolerance)
