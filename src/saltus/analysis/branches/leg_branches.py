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

from saltus.analysis.branches.arclength import tangents
from saltus.analysis.branches.branch import Branch
from saltus.analysis.branches.contact_sequences import sequences
from saltus.analysis.branches.events import Event
from saltus.analysis.branches.grazing_orbits import sqrt_coefficient
from saltus.analysis.branches.leg_pieces import Piece, follow_legs
from saltus.analysis.branches.legs import Legs
from saltus.analysis.branches.shooting import PeriodicOrbits
from saltus.analysis.branches.tracing import Plan, Start, both_ways


@dataclass
class PieceBranch(Branch):
    """A piece as a branch in the unknowns of its legs."""

    orbits: Legs  # type: ignore[assignment]

    def _contacts(self) -> list[Event]:
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
            z.append(_by_points(branch.orbits, branch.z[again:]))
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

    def _own(self, branch: PieceBranch, event: Event, first: int) -> Event:
        return replace(
            event, after=first + event.after, z=_by_points(branch.orbits, event.z[None])[0]
        )

    def _between(self, after: int, piece: Piece, outcome: str) -> Event:
        """The event behind a piece."""
        assert piece.end is not None
        event = piece.end.event
        legs = event.legs
        orbit = _by_points(legs, event.z[None])[0]
        phase = (event.phase - float(legs.begin(event.z[None])[0])) % legs.n
        return Event(
            event.kind, max(after, 0), orbit, event.multipliers, guards=event.guards,
            phase=phase, outcome=outcome, sqrt_coefficient=sqrt_coefficient(event),
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


def _by_points(legs: Legs, z: np.ndarray) -> np.ndarray:
    """Orbits float64[r, z] by their points, limit cycles from one that is well away from contacts:
    next to one, rounding would say whether it is met.
    """
    return legs.orbit(z, legs.begin(z))


def leg_branches(plan: Plan, starts: Sequence[Start]) -> list[Branch | None]:
    """The branches of starts, see :class:`Plan`: contact by contact if their orbits have impacts,
    as others if contacts are held.
    """
    return [_leg_branch(plan, start) for start in starts]


def _leg_branch(plan: Plan, start: Start) -> Branch | None:
    orbits = plan.make(start.n, start.scale[None])
    sequence = sequences(orbits, start.z[None])[0]
    if sequence is not None and sequence.flies:
        return _branch(plan, orbits, start)
    if start.n > plan.longest:  # a chatter of many periods
        return None
    (branch,) = both_ways(plan, [start])
    if branch is not None:
        branch.ends = _where_held(branch)
    return branch


def _where_held(branch: Branch) -> tuple[str, str]:
    """Reasons for the two ends of a branch, with ``held`` for ``lost`` where contacts of the last
    orbit are held.
    """
    last = sequences(branch.orbits, branch.z[[0, -1]])
    begin, end = (
        "held" if why == "lost" and not (one is not None and one.flies) else why
        for why, one in zip(branch.ends, last, strict=True)
    )
    return begin, end


def _branch(plan: Plan, orbits: PeriodicOrbits, start: Start) -> Branch | None:
    """The branch of a start in both directions, or in the one in which it leaves another."""
    z, scale = start.z, start.scale
    ways: list[tuple[list[Piece], str, float]] = []
    for along in start.sides:
        if not ways or ways[0][1] != "closed":
            ways.append(
                follow_legs(
                    orbits, z, scale, along, plan.limits, plan.points, start.first, plan.stable
                )
            )
    ends = (ways[-1][1], ways[0][1]) if len(ways) == 2 else ("branch", ways[0][1])
    limits = (ways[-1][2] if len(ways) == 2 else np.nan, ways[0][2])
    if ways[0][1] == "closed":
        ends = ("closed", "closed")
    forwards = [_as_branch(piece, False) for piece in ways[0][0] if piece.curve.z]
    back = [_as_branch(piece, True) for piece in ways[1][0] if piece.curve.z] if ways[1:] else []
    if not forwards and not back:
        return None
    none = np.zeros(0)
    result = LegBranch(
        orbits, 0, none, none, none, none, none, ends,
        limits=limits, pieces=[*back[::-1], *forwards], backwards=len(back),
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
