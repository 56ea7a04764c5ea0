"""Branches of periodic orbits with impacts: contact sequence after contact sequence, through the
grazes at which one becomes another.

At a graze with a rigid stop two branches meet, of orbits with the impact and of orbits without it.
They go on from one another in the parameter, *persistence*, or both lie on one side of it, a
*nonsmooth fold*. di Bernardo, Budd, Champneys & Kowalczyk, Piecewise-smooth Dynamical Systems
(2008), section 7.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from saltus.analysis.branches.arclength import both_sides, tangents
from saltus.analysis.branches.branch import Branch
from saltus.analysis.branches.contact_sequences import ContactSequence, sequences
from saltus.analysis.branches.events import Event
from saltus.analysis.branches.leg_arcs import LegWay, SequenceArc, follow_legs
from saltus.analysis.branches.legs import Legs
from saltus.analysis.branches.piece import Piece
from saltus.analysis.branches.resting_branches import resting_pieces
from saltus.analysis.branches.sequence_changes import event_of
from saltus.analysis.branches.shooting import PeriodicOrbits
from saltus.analysis.branches.tracing import Plan, Start


@dataclass
class LegPiece(Piece):
    """A piece of orbits with one contact sequence, in the unknowns of its legs."""

    orbits: Legs

    def by_points(self, z: np.ndarray) -> np.ndarray:
        """Orbits float64[r, z] by their points, limit cycles from one that is well away from
        contacts: next to one, rounding would say whether it is met.
        """
        return self.orbits.orbit(z, self.orbits.begin(z))


@dataclass
class LegBranch(Branch):
    """A branch in pieces: of one contact sequence each, or of orbits that rest. Its points, and its
    events, are known at last.

    Attributes
    ----------
    parts : list of Piece or Event
        Its pieces in their order, and the grazes and corners between them.
    """

    orbits: PeriodicOrbits
    parts: list[Piece | Event] = field(default_factory=list)

    def find_events(self) -> None:
        """Locate what happens within the pieces, and join them."""
        pieces = [part for part in self.parts if isinstance(part, Piece)]
        for piece in pieces:
            piece.find_events()
        self.joined()

    def joined(self) -> LegBranch:
        """The branch with the points and events of its pieces."""
        pieces = [part for part in self.parts if isinstance(part, Piece)]
        self.z = np.concatenate([piece.by_points(piece.z) for piece in pieces])
        self.multipliers = np.concatenate([piece.multipliers for piece in pieces])
        steps = [np.append(0.0, np.diff(piece.length)) for piece in pieces]
        self.length = np.cumsum(np.concatenate(steps))
        self.events, self.unexplained, count = [], [], 0
        for part in self.parts:
            if isinstance(part, Event):
                self.events.append(replace(part, after=max(count - 1, 0)))
                continue
            self.events += [
                replace(event, after=count + event.after, z=part.by_points(event.z[None])[0])
                for event in part.events
            ]
            self.unexplained += [count + place for place in part.unexplained]
            count += len(part.z)
        self._complete(np.concatenate([piece.tangent[:, -1] for piece in pieces]))
        return self

    def _complete(self, onward: np.ndarray) -> None:
        """Tangents and derivatives in the unknowns with the contact sequence left to the flow.
        These jump where an impact crosses the whole period: the sign of a tangent is that by which
        the parameter grows there, ``onward`` float64[p].
        """
        count, places = len(self.z), np.array([*self.z, *(event.z for event in self.events)])
        derivative = self.orbits.evaluate(places, np.full(len(places), self.row))[1]
        known = np.where(np.isfinite(derivative), derivative, 0.0)
        ahead = np.gradient(self.z / self.scale, axis=0) if count > 1 else self.z * 0.0
        self.derivative, self.tangent = derivative[:count], tangents(known[:count], ahead)
        self.tangent[self.tangent[:, -1] * onward < 0] *= -1.0
        ways = tangents(known[count:], self.tangent[[event.after for event in self.events]])
        self.events = [
            replace(event, derivative=matrix, tangent=way)
            for event, matrix, way in zip(self.events, derivative[count:], ways, strict=True)
        ]


def leg_branches(plan: Plan, starts: Sequence[Start]) -> list[Branch | None]:
    """The branches of starts, see :class:`Plan`: contact by contact if their orbits have impacts,
    as others if contacts are held.
    """
    return [_leg_branch(plan, start) for start in starts]


def _leg_branch(plan: Plan, start: Start) -> Branch | None:
    orbits = plan.make(start.n, start.scale[None])
    sequence = sequences(orbits, start.z[None])[0]
    if sequence is not None and sequence.flies:
        return _branch(plan, orbits, sequence, start)
    if start.n > plan.longest:  # a chatter of many periods
        return None
    pieces = resting_pieces(plan, start)
    if not pieces:
        return None
    ends = _where_held(orbits, pieces)
    if len(pieces) == 1:
        pieces[0].ends = ends
        return pieces[0]
    none = np.zeros(0)
    branch = LegBranch(orbits, 0, none, none, none, none, none, ends, parts=[*pieces])
    branch.flying = pieces[0].flying
    for piece in pieces:
        plan.watch.cut.pop(id(piece), None)
    _keep(plan, branch)
    return branch


def _where_held(orbits: PeriodicOrbits, pieces: Sequence[Branch]) -> tuple[str, str]:
    """Reasons for the two ends of a branch in pieces, with ``held`` for ``lost`` where contacts of
    the last orbit are held.
    """
    last = sequences(orbits, np.array([pieces[0].z[0], pieces[-1].z[-1]]))
    begin, end = (
        "held" if why == "lost" and not (one is not None and one.flies) else why
        for why, one in zip((pieces[0].ends[0], pieces[-1].ends[1]), last, strict=True)
    )
    return begin, end


def _branch(
    plan: Plan, orbits: PeriodicOrbits, sequence: ContactSequence, start: Start
) -> Branch | None:
    """The branch of a start in both directions, or in the one in which it leaves another."""
    ways = list[LegWay]()
    try:
        for along in start.sides:
            if not ways or ways[0].end != "closed":
                follow_legs(
                    orbits, sequence, start.z, start.scale, along, plan.limits, plan.points,
                    start.first, plan.stable, plan.watch, ways,
                )  # fmt: skip
    except KeyboardInterrupt:
        for way in ways:
            way.end = way.end or "interrupted"
            way.arcs = [replace(arc, curve=arc.curve.whole()) for arc in way.arcs]
        branch = _joined(orbits, ways) if ways else None
        if branch is not None and len(ways) < len(start.sides):
            branch.ends = "interrupted", branch.ends[1]
        _keep(plan, branch)
        raise
    branch = _joined(orbits, ways)
    _keep(plan, branch)
    return branch


def _keep(plan: Plan, branch: LegBranch | None) -> None:
    """Keep a branch as it is, for Ctrl-C while its events are located."""
    if branch is not None:
        parts = [replace(part) for part in branch.parts]
        plan.watch.cut[id(branch)] = replace(branch, parts=parts)


def _joined(orbits: PeriodicOrbits, ways: list[LegWay]) -> LegBranch | None:
    """One branch from the ways to both sides."""
    ways, ends = both_sides(ways)
    limits = (ways[1].limit if len(ways) > 1 else np.nan, ways[0].limit)
    parts, none = _parts(ways), np.zeros(0)
    if not parts:
        return None
    return LegBranch(orbits, 0, none, none, none, none, none, ends, limits=limits, parts=parts)


def _parts(ways: list[LegWay]) -> list[Piece | Event]:
    """Pieces and events of the ways ahead and back, in the order of the branch: the two arcs from
    the start are one piece.
    """
    arcs = [[arc for arc in way.arcs if arc.curve.z] for way in ways]
    ahead, back = arcs if len(arcs) > 1 else (arcs[0], [])
    parts = list[Piece | Event]()
    for number, arc in reversed(list(enumerate(back))):
        parts += _passage(arc)
        if number or not ahead:
            parts.append(_piece(arc, backwards=True))
    for number, arc in enumerate(ahead):
        begins = back and not number
        parts.append(_piece(replace(arc, curve=arc.curve.behind(back[0].curve)) if begins else arc))
        parts += _passage(arc)
    return parts


def _passage(arc: SequenceArc) -> list[Event]:
    """The event behind an arc, if there is one."""
    if arc.end is None:
        return []
    change = arc.end.change
    begin = float(change.legs.begin(change.z[None])[0])
    return [event_of(change, begin, arc.outcome)]


def _piece(arc: SequenceArc, backwards: bool = False) -> LegPiece:
    """An arc as a piece in the order of the branch.

    The orbit at a graze, from which an arc begins, isn't among its points.
    """
    legs, curve = arc.legs, arc.curve
    columns = [np.array(one) for one in (curve.z, curve.tangent, curve.derivative, curve.length)]
    skip = 1 if arc.after_event and len(curve.z) > 1 else 0
    z, tangent, derivative, length = (column[skip:] for column in columns)
    if backwards:
        z, tangent, derivative, length = z[::-1], -tangent[::-1], derivative[::-1], -length[::-1]
    multipliers = legs.multipliers(z, derivative, np.zeros(len(z), np.int64))
    return LegPiece(legs, 0, z, tangent, derivative, length, multipliers)
