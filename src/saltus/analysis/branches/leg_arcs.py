"""Branches of orbits from contact to contact in one direction, in arcs of one contact sequence
each, up to the changes at which one becomes another.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, field

import numpy as np

from saltus.analysis.branches.arclength import Arc, correct, follow, tangents
from saltus.analysis.branches.contact_sequences import ContactSequence
from saltus.analysis.branches.ladders import accumulation
from saltus.analysis.branches.leg_ends import Passage, end_of
from saltus.analysis.branches.legs import Legs
from saltus.analysis.branches.shooting import PeriodicOrbits
from saltus.analysis.branches.special_points import unstable
from saltus.analysis.branches.tracing import halved
from saltus.analysis.branches.watch import Watch

#: Contact sequences of one branch in one direction.
MOST_PIECES = 40
#: Distance at which a branch may pass its start sideways, over the step that passes it.
SIDEWAYS = 0.3
#: Distance of the last point of an arc from the event behind it, in steps.
NEXT_TO = 1e-3
#: Shortest last step for which such a point is added, in units of the scale.
LEAST = 1e-7
#: First step behind an event, in units of the scale.
AFTER = 1e-4
_ROW = np.zeros(1, np.int64)


@dataclass
class SequenceArc:
    """A curve in one direction, of orbits with one contact sequence.

    Attributes
    ----------
    legs : Legs
        Its equations.
    curve : Arc
        Its points, all of the free flow.
    after_event : bool
        Whether its first point is an event.
    end : Passage or None
        What is behind its last point.
    """

    legs: Legs
    curve: Arc
    after_event: bool = False
    end: Passage | None = None

    @property
    def outcome(self) -> str:
        """Continuation of the branch behind the end, ``persistence`` or ``nonsmooth_fold``; empty
        if there is none.
        """
        if self.end is None or self.end.onto is None or not self.curve.tangent:
            return ""
        into = self.end.into(self.legs, self.curve.tangent[-1])
        return "persistence" if into[-1] * self.end.along[-1] > 0 else "nonsmooth_fold"

    def close_up(self) -> None:
        """Add a point next to the end, so that what lies before it isn't overlooked."""
        legs, curve = self.legs, self.curve
        if self.end is None or not curve.z:
            return
        ahead = self.end.z - curve.z[-1]
        normal = ahead / legs.scale[0]
        length = float(np.linalg.norm(normal))
        if length < LEAST:
            return
        guess = curve.z[-1] + (1.0 - NEXT_TO) * ahead
        point = correct(legs, guess[None], normal[None] / length, _ROW, length)
        if point.found[0] and legs.admissible(point.z)[0]:
            curve.z.append(point.z[0])
            curve.derivative.append(point.derivative[0])
            curve.tangent.append(tangents(point.derivative, curve.tangent[-1][None])[0])
            curve.length.append(curve.length[-1] + length)


@dataclass
class LegWay:
    """A branch in one direction.

    Attributes
    ----------
    limits, points, first, stable
        See :func:`follow_legs`.
    home : (Legs, float64[z])
        Where it begins.
    watch : Watch
        Of its budget and progress.
    arcs : list of SequenceArc
        The contact sequences one after the other.
    end : str
        Why it ends: see :class:`saltus.analysis.branches.arclength.Arc`; ``graze`` or ``corner``
        where it isn't known how it goes on; ``accumulates`` where its grazes do.
    limit : float
        The parameter at which they do, NaN otherwise.
    """

    limits: tuple[float, float]
    points: int
    first: float
    stable: bool
    home: tuple[Legs, np.ndarray]
    watch: Watch
    arcs: list[SequenceArc] = field(default_factory=list)
    end: str = ""
    limit: float = np.nan

    def follow(self, legs: Legs, z: np.ndarray, along: np.ndarray) -> None:
        """Follow the branch from an orbit on, arc by arc."""
        for _ in range(MOST_PIECES):
            end = self._arc(legs, z, along)
            if end is None:
                return
            if end.onto is None:
                self.end = end.change.kind
                return
            self.limit = self._accumulation()
            if np.isfinite(self.limit):
                self.end = "accumulates"
                return
            legs, z, along = end.onto, end.start, end.along
        self.end = "points"

    def _accumulation(self) -> float:
        """The parameter at which the events behind the arcs accumulate; NaN if they don't."""
        ends = [arc.end for arc in self.arcs if arc.end is not None]
        contacts = [len(arc.legs.contacts) for arc in self.arcs]
        return accumulation(contacts, [float(end.change.z[-1]) for end in ends])

    def _arc(self, legs: Legs, z: np.ndarray, along: np.ndarray) -> Passage | None:
        """One contact sequence, and where it ends if that is at an event."""
        again, virtual, curves = bool(self.arcs), list[np.ndarray](), list[Arc]()

        def ends(curve: Arc) -> str:
            if self.watch.point(legs.n * legs.size**2):
                curve.end = curve.end or "points"
            if not legs.admissible(curve.z[-1][None])[0]:
                virtual.append(curve.z[-1])
                return "virtual"
            if again and self._returns(legs, curve):
                return "closed"
            return halved(legs, curve)

        left = self.points - sum(len(arc.curve.z) for arc in self.arcs)
        step = AFTER if again else self.first
        limits = {legs.width - 1: self.limits}
        enough = functools.partial(unstable, legs.multipliers) if self.stable else None
        try:
            follow(
                legs, z[None], along[None], limits, max(left, 2), step, ends=ends, enough=enough,
                curves=curves,
            )  # fmt: skip
        finally:  # also with the points so far, when interrupted
            self.arcs += [SequenceArc(legs, one, again) for one in curves]
        (curve,), arc = curves, self.arcs[-1]
        curve.end = "unstable" if curve.end == "enough" else curve.end
        if curve.end != "virtual":
            self.end = curve.end
            return None
        arc.end = end_of(legs, curve.z[-1], virtual[-1], curve.tangent[-1])
        arc.close_up()
        if arc.end is None:
            self.end = "lost"
        return arc.end

    def _returns(self, legs: Legs, curve: Arc) -> bool:
        """True if the last step passed the orbit from which the branch was followed."""
        own, start = self.home
        if legs.contacts != own.contacts or len(curve.z) < 2:
            return False
        scale = legs.scale[0]
        step = (curve.z[-1] - curve.z[-2]) / scale
        length = np.linalg.norm(step)
        for same in own.alike(start[None], _ROW)[0]:
            there = (same - curve.z[-2]) / scale
            ahead = there @ step / length
            aside = np.linalg.norm(there - ahead * step / length)
            if 0 <= ahead <= length and aside <= SIDEWAYS * length:
                return True
        return False


def follow_legs(
    orbits: PeriodicOrbits,
    sequence: ContactSequence,
    z: np.ndarray,
    scale: np.ndarray,
    along: np.ndarray,
    limits: tuple[float, float],
    points: int,
    first: float,
    stable: bool,
    watch: Watch,
    ways: list[LegWay],
) -> None:
    """Follow a branch of periodic orbits in one direction, contact by contact.

    Parameters
    ----------
    orbits : PeriodicOrbits
        The equations.
    sequence : ContactSequence
        The contacts of the orbit.
    z, scale : float64[z]
        An orbit of the free flow by its points, and the units of these unknowns.
    along : float64[z]
        On which side to leave, in units of the scale.
    limits : (float, float)
        Range of the parameter, the last unknown.
    points : int
        Most points.
    first : float
        First step, in units of the scale.
    stable : bool
        See :class:`saltus.analysis.branches.tracing.Plan`.
    watch : Watch
        Of its budget and progress.
    ways : list of LegWay
        Takes the branch, which grows: what is known when Ctrl-C ends this.
    """
    legs, start = Legs.of(orbits, sequence, z, scale)
    legs.accepted(start[None], _ROW)
    tangent = legs.tangent(start)
    step = 1e-6 * tangent * legs.scale[0]
    moved = np.subtract(*legs.orbit(np.array([start + step, start - step])))
    side = 1.0 if (moved / scale) @ along > 0 else -1.0
    ways.append(LegWay(limits, points, first, stable, (legs, start), watch))
    ways[-1].follow(legs, start, side * tangent)
