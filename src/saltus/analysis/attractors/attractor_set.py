"""The attractors of a map, as they are found: where they capture, what they are, and their ids."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from saltus.analysis.attractors.aperiodic import SampledMotion, merge
from saltus.analysis.attractors.noisy import Noisy, Stray
from saltus.analysis.closed.capture import Neighbourhoods, neighbourhoods
from saltus.analysis.closed.motions import ClosedMotion
from saltus.flow.maps import Map

#: Share of a trajectory's points that must lie in an attractor's boxes, or beside its orbit, to
#: belong to it.
INSIDE = 0.9


@dataclass
class AttractorSet:
    """Attractors of a map, in the order of their ids.

    Attributes
    ----------
    near : Neighbourhoods
        Where the periodic ones capture.
    orbits : list of ClosedMotion
        The periodic ones, stable.
    sampled : list of SampledMotion
        Those that never repeat: their ids follow.
    unstable : list of ClosedMotion
        Periodic orbits met on the way that don't attract.
    astray : list of Stray
        Of an inexact map: motions that never settled. Of the last search only; no store keeps them.
    """

    near: Neighbourhoods
    orbits: list[ClosedMotion] = field(default_factory=list)
    sampled: list[SampledMotion] = field(default_factory=list)
    unstable: list[ClosedMotion] = field(default_factory=list)
    astray: list[Stray] = field(default_factory=list)

    @property
    def every(self) -> list[ClosedMotion | SampledMotion]:
        """All of them, in the order of their ids."""
        return [*self.orbits, *self.sampled]

    def __len__(self) -> int:
        return len(self.orbits) + len(self.sampled)

    def add(
        self, map_: Map, orbit: ClosedMotion, scale: np.ndarray, like: Neighbourhoods | None = None
    ) -> None:
        """One more periodic attractor, and where it captures; ``like`` as for
        :func:`saltus.analysis.closed.capture.neighbourhoods`.
        """
        self.near = self.near.joined(neighbourhoods(map_, orbit, len(self.orbits), scale, like))
        self.orbits.append(orbit)

    def add_sampled(self, one: SampledMotion) -> None:
        """One more that is known by where it goes, unless it is there. Orbits that turn out to be
        scatter about it are no longer others.
        """
        self.sampled = merge([*self.sampled, one])
        kept = [i for i, orbit in enumerate(self.orbits) if not is_about(one, orbit)]
        self.near = self.near.of(np.array(kept, np.int64))
        self.orbits = [self.orbits[i] for i in kept]

    def index(self, one: ClosedMotion | SampledMotion) -> int:
        """The id of an attractor that was found."""
        for i, other in enumerate(self.every):
            if other is one or (isinstance(one, ClosedMotion) and is_about(other, one)):
                return i
        raise AssertionError("an attractor that wasn't found")

    def ids(self, before: AttractorSet) -> np.ndarray:
        """The id that each of fewer attractors has among these, int64[m]."""
        return np.array([self.index(one) for one in before.every], np.int64)

    def ordered(self, scale: np.ndarray) -> AttractorSet:
        """The same with ids that don't depend on the order of discovery: by period, then by size,
        then by place.
        """
        order = sorted(
            range(len(self.orbits)),
            key=lambda i: (self.orbits[i].period, *_rounded(self.orbits[i], scale)),
        )
        sampled = sorted(self.sampled, key=lambda w: (w.kind, *w.first))
        near = self.near.renumbered(np.argsort(np.array(order, np.int64)))
        return AttractorSet(
            near, [self.orbits[i] for i in order], sampled, self.unstable, self.astray
        )


def is_about(one: ClosedMotion | SampledMotion, orbit: ClosedMotion) -> bool:
    """True where an orbit is scatter about a noisy one."""
    return isinstance(one, Noisy) and bool(one.share(orbit.points[None])[0] >= INSIDE)


def _rounded(orbit: ClosedMotion, scale: np.ndarray) -> tuple[float, ...]:
    """Size and place of an orbit, coarse enough that rounding can't change their order."""
    sizes = np.sqrt(np.mean((orbit.points / scale) ** 2, axis=0))
    return tuple(np.round(np.concatenate([sizes, orbit.points[0] / scale]), 7).tolist())
