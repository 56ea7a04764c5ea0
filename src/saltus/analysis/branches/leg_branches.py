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

from saltus.analysis.branches.arclength import FIRST, Curve, correct, follow, tangents
from saltus.analysis.branches.contact_sequences import sequences
from saltus.analysis.branches.leg_ends import End, end_of
from saltus.analysis.branches.legs import Legs
from saltus.analysis.branches.shooting import PeriodicOrbits
from saltus.analysis.branches.special_points import SpecialPoint
from saltus.analysis.branches.tracing import ASIDE, Branch, Plan, Starts, both_ways

#: Contact sequences of one branch in one direction.
MOST_PIECES = 40
#: How far a branch may pass its start sideways, over the step that passes it.
SIDEWAYS = 0.3
#: Where before an event the last point of a piece lies, in steps, and the shortest such step in
#: units of the scale.
NEXT_TO, LEAST = 1e-3, 1e-7
#: First step behind an event, in units of the scale.
AFTER = 1e-4
_ROW = np.zeros(1, np.int64)


@dataclass
class Piece:
    """A part of a branch, of orbits with one contact sequence.

    Attributes
    ----------
    legs : Legs
        Its equations.
    curve : Curve
        Its points, all of the free flow.
    after_event : bool
        Whether its first point is an event.
    end : End or None
        The event behind its last point.
    """

    legs: Legs
    curve: Curve
    after_event: bool = False
    end: End | None = None

    @property
    def outcome(self) -> str:
        """How the branch goes on behind the end: see above; empty if it doesn't."""
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
class _Way:
    """A branch in one direction."""

    limits: tuple[float, float]
    points: int
    first: float
    home: tuple[Legs, np.ndarray]
    pieces: list[Piece] = field(default_factory=list)
    end: str = ""

    def follow(self, legs: Legs, z: np.ndarray, along: np.ndarray) -> None:
        """Follow the branch from an orbit on, piece by piece."""
        for _ in range(MOST_PIECES):
            end = self._piece(legs, z, along)
            if end is None:
                return
            if end.onto is None:
                self.end = end.event.kind
                return
            legs, z, along = end.onto, end.start, end.along
        self.end = "points"

    def _piece(self, legs: Legs, z: np.ndarray, along: np.ndarray) -> End | None:
        """One contact sequence, and where it ends if that is at an event."""
        again, virtual = bool(self.pieces), list[np.ndarray]()

        def ends(curve: Curve) -> str:
            if not legs.admissible(curve.z[-1][None])[0]:
                virtual.append(curve.z[-1])
                return "virtual"
            if again and self._returns(legs, curve):
                return "closed"
            return _halved(legs, curve)

        left = self.points - sum(len(piece.curve.z) for piece in self.pieces)
        step = AFTER if again else self.first
        limits = {legs.width - 1: self.limits}
        curve = follow(legs, z[None], along[None], limits, max(left, 2), step, ends=ends)[0]
        piece = Piece(legs, curve, again)
        self.pieces.append(piece)
        if curve.end != "virtual":
            self.end = curve.end
            return None
        piece.end = end_of(legs, curve.z[-1], virtual[-1], curve.tangent[-1])
        piece.close_up()
        if piece.end is None:
            self.end = "lost"
        return piece.end

    def _returns(self, legs: Legs, curve: Curve) -> bool:
        """Whether the last step passed the orbit from which the branch was followed."""
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


def _halved(legs: Legs, curve: Curve) -> str:
    """``period_doubling`` if an orbit of 2m periods has just passed one of m periods."""
    if legs.n % 2 or len(curve.z) < 2:
        return ""
    half, points = legs.n // 2, legs.orbits.points(legs.orbit(np.array(curve.z[-2:])))
    apart = (points[:, :half] - points[:, half:]).reshape(2, -1)
    return "period_doubling" if apart[0] @ apart[1] < 0.0 else ""


def follow_legs(
    orbits: PeriodicOrbits,
    z: np.ndarray,
    scale: np.ndarray,
    along: np.ndarray,
    limits: tuple[float, float],
    points: int,
    first: float = FIRST,
) -> tuple[list[Piece], str]:
    """A branch of periodic orbits in one direction, contact by contact.

    Parameters
    ----------
    orbits : PeriodicOrbits
        The equations.
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

    Returns
    -------
    list of Piece, str
        The contact sequences one after the other, and why the branch ends: see
        :class:`saltus.analysis.branches.arclength.Curve`; ``graze`` or ``corner`` where it isn't
        known how it goes on.
    """
    sequence = sequences(orbits, z[None])[0]
    if sequence is None:
        return [], "lost"
    legs, start = Legs.of(orbits, sequence, z, scale)
    legs.accepted(start[None], _ROW)
    tangent = legs.tangent(start)
    step = 1e-6 * tangent * legs.scale[0]
    moved = np.subtract(*legs.orbit(np.array([start + step, start - step])))
    side = 1.0 if (moved / scale) @ along > 0 else -1.0
    way = _Way(limits, points, first, (legs, start))
    way.follow(legs, start, side * tangent)
    return way.pieces, way.end


# -- branches --------------------------------------------------------------------------------------
@dataclass
class PieceBranch(Branch):
    """A piece as a branch in the unknowns of its legs."""

    orbits: Legs  # type: ignore[assignment]

    def _contacts(self) -> list[SpecialPoint]:
        """None: all of its orbits have the same contacts."""
        return []


@dataclass
class LegBranch(Branch):
    """A branch in pieces of one contact sequence each.

    Attributes
    ----------
    pieces : list of (PieceBranch, Piece)
        In the order of the branch; each as a branch of its own equations, and what is behind it in
        the direction in which it was followed.
    backwards : int
        How many of the first pieces were followed against that order.
    """

    pieces: list[tuple[PieceBranch, Piece]] = field(default_factory=list)
    backwards: int = 0

    def find_events(self) -> None:
        """Locate what happens within the pieces; between them are the grazes and corners."""
        for branch, _ in self.pieces:
            branch.find_events()
        self.join()

    def join(self) -> None:
        """Make one branch of the pieces."""
        z, lengths, multipliers, events = list[np.ndarray](), [0.0], list[np.ndarray](), []
        self.unexplained = []
        for number, (branch, piece) in enumerate(self.pieces):
            again = int(0 < self.backwards == number)  # the orbit from which both ways begin
            first = sum(map(len, z)) - again
            back = number < self.backwards
            if back and piece.end is not None:
                events.append(self._between(first - 1, piece, piece.outcome))
            z.append(branch.orbits.orbit(branch.z[again:]))
            multipliers.append(branch.multipliers[again:])
            steps = np.append(0.0, np.diff(branch.length))[again:]
            lengths += list(lengths[-1] + np.cumsum(steps))
            events += [self._own(branch, event, first) for event in branch.events]
            self.unexplained += [first + place for place in branch.unexplained]
            if not back and piece.end is not None:
                events.append(self._between(first + len(branch.z) - 1, piece, piece.outcome))
        self.z, self.multipliers = np.concatenate(z), np.concatenate(multipliers)
        self.length = np.array(lengths[1:]) - lengths[1]
        self.events = events
        self._complete()

    def _own(self, branch: PieceBranch, event: SpecialPoint, first: int) -> SpecialPoint:
        return replace(event, after=first + event.after, z=branch.orbits.orbit(event.z[None])[0])

    def _between(self, after: int, piece: Piece, outcome: str) -> SpecialPoint:
        """The event behind a piece."""
        assert piece.end is not None
        event = piece.end.event
        none = np.zeros(0)
        return SpecialPoint(
            event.kind, max(after, 0), event.orbit, none, event.legs.multipliers_at(event.z), none,
            event.guards, event.phase, outcome,
        )  # fmt: skip

    def _complete(self) -> None:
        """Tangents and derivatives in the unknowns with the contact sequence left to the flow."""
        rows = np.full(len(self.z), self.row)
        self.derivative = self.orbits.evaluate(self.z, rows)[1]
        known = np.where(np.isfinite(self.derivative), self.derivative, 0.0)
        ahead = np.gradient(self.z / self.scale, axis=0) if len(self.z) > 1 else self.z * 0.0
        self.tangent = tangents(known, ahead)
        for i, event in enumerate(self.events):
            matrix = self.orbits.evaluate(event.z[None], rows[:1])[1]
            way = tangents(np.where(np.isfinite(matrix), matrix, 0.0), self.tangent[[event.after]])
            self.events[i] = replace(event, derivative=matrix[0], tangent=way[0])


def leg_branches(plan: Plan, starts: Starts, which: Sequence[int]) -> list[Branch | None]:
    """The branches of some seeds, see :class:`Plan`: contact by contact where orbits have impacts,
    as others where contacts are held.
    """
    orbits = plan.make(starts.n, starts.scale)
    known = dict(zip(which, sequences(orbits, starts.z[which]), strict=True)) if which else {}
    result = []
    for i in which:
        sequence = known[i]
        if sequence is not None and sequence.flies:
            result.append(_branch(plan, orbits, i, starts))
        elif starts.n <= plan.longest:
            result += both_ways(plan, starts, [i])
        else:  # a chatter of many periods
            result.append(None)
    return result


def _branch(plan: Plan, orbits: PeriodicOrbits, row: int, starts: Starts) -> Branch | None:
    """The branch of one seed in both directions, or in the one in which it leaves another."""
    seed, z, scale = starts.seeds[row], starts.z[row], starts.scale[row]
    up = np.zeros(len(z))
    up[-1] = 1.0
    sides, first = ((up, -up), FIRST) if seed.along is None else ((seed.along,), ASIDE)
    ways: list[tuple[list[Piece], str]] = []
    for along in sides:
        if not ways or ways[0][1] != "closed":
            ways.append(follow_legs(orbits, z, scale, along, plan.limits, plan.points, first))
    ends = (ways[-1][1], ways[0][1]) if len(ways) == 2 else ("branch", ways[0][1])
    if ways[0][1] == "closed":
        ends = ("closed", "closed")
    forwards = [_as_branch(piece, False) for piece in ways[0][0] if piece.curve.z]
    back = [_as_branch(piece, True) for piece in ways[1][0] if piece.curve.z] if ways[1:] else []
    if not forwards and not back:
        return None
    none = np.zeros(0)
    result = LegBranch(
        orbits, row, none, none, none, none, none, ends, parent=seed.parent,
        pieces=[*back[::-1], *forwards], backwards=len(back),
    )  # fmt: skip
    result.join()
    return result


def _as_branch(piece: Piece, backwards: bool) -> tuple[PieceBranch, Piece]:
    """A piece as a branch of its own equations, in the order of the whole.

    The orbit at a graze, from which a piece begins, isn't among its points.
    """
    legs, curve = piece.legs, piece.curve
    columns = [np.array(one) for one in (curve.z, curve.tangent, curve.derivative, curve.length)]
    skip = 1 if piece.after_event and len(curve.z) > 1 else 0
    z, tangent, derivative, length = (column[skip:] for column in columns)
    if backwards:
        z, tangent, derivative, length = z[::-1], -tangent[::-1], derivative[::-1], -length[::-1]
    own = legs.multipliers(z, derivative, np.zeros(len(z), np.int64))
    return PieceBranch(legs, 0, z, tangent, derivative, length, own, ("", "")), piece
