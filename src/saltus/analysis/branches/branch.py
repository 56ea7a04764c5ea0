"""A branch: the orbits on it, what happens along it, and why it ends."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from saltus.analysis.branches.closed_harmonics import ClosedHarmonics
from saltus.analysis.branches.equilibrium_curves import EquilibriumCurves
from saltus.analysis.branches.events import Event
from saltus.analysis.branches.piece import Piece, in_order
from saltus.analysis.branches.sequence_changes import contact_points
from saltus.analysis.branches.shooting import PeriodicOrbits
from saltus.analysis.branches.special_points import outside

#: Data of each point of a branch.
_COLUMNS = ("z", "tangent", "derivative", "length", "multipliers")
#: Events at which orbits lose stability, before those at which they may.
_LOSES_STABILITY = ("fold", "branch_point", "period_doubling", "neimark_sacker", "hopf")


@dataclass
class Branch(Piece):
    """A branch of periodic orbits of n periods, by their points at whole periods, of motions of a
    few harmonics, or of equilibria.

    Attributes
    ----------
    ends : (str, str)
        Why it ends at its first and at its last point: see :class:`Arc`; ``period_doubling``
        where it becomes an orbit of half the period, ``hopf`` where a limit cycle shrinks to an
        equilibrium, ``boundary_equilibrium`` where an equilibrium meets a boundary; ``accumulates``
        where its grazes do, ``held`` where it is lost with contacts that are held; ``unstable``
        where its orbits lose stability, and no more was asked for.
    limits : (float, float)
        The parameter at which they do, at either end; NaN otherwise.
    parent : (int, int) or None
        The branch and its event that it leaves.
    flying : list of float64[z]
        Orbits beyond its ends on which no contact is held any more: they are on another branch.
    """

    orbits: PeriodicOrbits | EquilibriumCurves | ClosedHarmonics
    ends: tuple[str, str]
    parent: tuple[int, int] | None = None
    limits: tuple[float, float] = (np.nan, np.nan)
    flying: list[np.ndarray] = field(default_factory=list)

    @property
    def closed(self) -> bool:
        """True if the branch returns to where it began."""
        return self.ends == ("closed", "closed")

    def find_events(self) -> None:
        """Locate what happens along the branch: bifurcations, and changes of the contacts."""
        super().find_events()
        self.events = in_order(self, [*self.events, *self._contacts()])

    def joined(self) -> Branch:
        """The branch as far as it is known, when Ctrl-C ends it."""
        return self

    def _contacts(self) -> list[Event]:
        """Events at which the contact sequence changes; of truncated motions they aren't known."""
        orbits = self.orbits
        if not isinstance(orbits, PeriodicOrbits):
            return []
        return contact_points(orbits, self.row, self.z, self.tangent)

    def stable_parts(self) -> list[Branch]:
        """The stretches of orbits that attract, each up to the orbits at which stability is lost;
        the branch itself where none does.
        """
        attract = ~outside(self.multipliers).any(axis=1)
        turns = np.flatnonzero(np.diff(np.concatenate([[False], attract, [False]])))
        parts = [self._part(int(a), int(b)) for a, b in turns.reshape(-1, 2)]
        return parts or [self]

    def _part(self, first: int, behind: int) -> Branch:
        """The points from a first one on, with the events at which stability is lost on both
        sides; where no event explains it, with the next point.
        """
        begin = self._loss(first - 1, -1) if first else None
        end = self._loss(behind - 1, 0) if behind < len(self.z) else None
        low = first - int(first > 0 and begin is None)
        kept = slice(low, behind + int(behind < len(self.z) and end is None))
        new = {name: getattr(self, name)[kept] for name in _COLUMNS}
        for event, place in ((begin, 0), (end, len(new["z"]))):
            if event is not None:
                beside = new["z"][min(place, len(new["z"]) - 1)]
                step = float(np.linalg.norm((event.z - beside) / self.scale))
                length = new["length"][-1] + step if place else new["length"][0] - step
                for name in _COLUMNS:
                    value = length if name == "length" else getattr(event, name)
                    at = len(new[name]) if place else 0
                    new[name] = np.insert(new[name], at, value, axis=0)
        shift = low - int(begin is not None)
        mine = [e for e in self.events if low - int(begin is not None) <= e.after < kept.stop]
        mine = mine[mine.index(begin) if begin else 0 : mine.index(end) + 1 if end else None]
        return replace(
            self,
            **new,
            events=[replace(one, after=one.after - shift) for one in mine],
            unexplained=[i - shift for i in self.unexplained if low <= i < kept.stop - 1],
            ends=(
                "unstable" if first else self.ends[0],
                "unstable" if behind < len(self.z) else self.ends[1],
            ),
        )

    def _loss(self, after: int, which: int) -> Event | None:
        """The event behind a point at which stability is lost, the first (0) or the last (-1)."""
        mine = [event for event in self.events if event.after == after]
        mine = [event for event in mine if event.kind in _LOSES_STABILITY] or mine
        return mine[which] if mine else None
