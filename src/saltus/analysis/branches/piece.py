"""A piece of a branch: orbits of one set of equations, and the bifurcations between them."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from saltus.analysis.branches.arclength import Arc, correct, follow, passes, tangents
from saltus.analysis.branches.equations import OrbitEquations
from saltus.analysis.branches.events import Event
from saltus.analysis.branches.special_points import COMPLEX, locate, outside, tests

#: Drop folds closer than this to a branch point (units of the scale): the branch point is located
#: better.
VERTEX = 1e-4
#: Shortest interval that is halved, in units of the scale.
LEAST = 1e-9
#: A quantity smaller than this at the zero of a test vanishes there.
VANISHES = 1e-6
#: Below this the parameter's entry in the unit tangent is rounding: the branch is vertical.
STILL = 1e-8
#: Two zeros of a test may hide where it dips below this share of its neighbours.
DIP = 0.5
#: Rounds in which points are inserted there, at most.
DIVES = 4
#: Halvings of an interval in which a change of stability is unexplained.
HALVINGS = 6
#: Retries of it with shorter steps.
RETRACED = 3
#: Ratio of these steps.
SHORTER = 16
#: Most points of a retry.
MOST_POINTS = 400
#: A way between two points that is longer than the step by this factor is another one.
LONGER = 1.02
#: It isn't looked for in a step shorter than this, in units of the scale.
NARROW = 1e-4


@dataclass
class Piece:
    """A piece of a branch, and all of it where one set of equations holds along it.

    Attributes
    ----------
    orbits : OrbitEquations
        The equations, of which it is a row.
    row : int
        Which.
    z : float64[p, z]
        Its points: unknowns of the equations.
    tangent, derivative : float64[p, ...]
        There, in units of the scale.
    length : float64[p]
        Arclength from its first point, in units of the scale.
    multipliers : complex128[p, D]
        Floquet multipliers, the largest first, without a trivial one.
    events : list of Event
        In the order of the branch.
    unexplained : list of int
        Points after which the number of multipliers outside the unit circle changes by more or less
        than the events there explain.
    """

    orbits: OrbitEquations
    row: int
    z: np.ndarray
    tangent: np.ndarray
    derivative: np.ndarray
    length: np.ndarray
    multipliers: np.ndarray
    events: list[Event] = field(default_factory=list, kw_only=True)
    unexplained: list[int] = field(default_factory=list, kw_only=True)
    #: True if multipliers are those of the equations that are followed, which events then explain.
    audited: ClassVar[bool] = True

    @property
    def scale(self) -> np.ndarray:
        """Unit of each unknown."""
        return np.asarray(self.orbits.scale[self.row])

    def by_points(self, z: np.ndarray) -> np.ndarray:
        """Orbits float64[r, z] by their points."""
        return z

    def find_events(self) -> None:
        """Locate the bifurcations; halve the intervals where stability doesn't add up."""
        for _ in range(DIVES):
            if not len(refine(self, *_dips(self))):
                break
        for _ in range(RETRACED):
            self._halve()
            if not retrace(self, self.unexplained):
                break
        else:
            self._halve()
        self.unexplained = _unexplained(self, turning=True)
        self.events = in_order(self, self.events)

    def _halve(self) -> None:
        """Locate bifurcations; halve the intervals in which they don't explain what changes."""
        for left in reversed(range(HALVINGS)):
            self.events = _located(self)
            self.unexplained = _unexplained(self)
            if not left or not self.unexplained or not len(refine(self, self.unexplained)):
                break


def _tests(piece: Piece) -> np.ndarray:
    """The functions whose zeros are bifurcations, at the points of a branch, float64[tests, p]."""
    values = tests(piece.tangent, piece.derivative, piece.multipliers, piece.z.shape[1] - 1)
    values[0, _vertical(piece)] = 0.0
    return values


def _dips(piece: Piece) -> tuple[list[int], np.ndarray]:
    """Points between which and the next ones a test may vanish twice, and where, in shares of the
    step: at the vertex of the parabola through three points if it is much nearer to zero than they
    are, or to both sides of a point that is much nearer than those beside it.
    """
    if len(piece.z) < 3:
        return [], np.zeros(0)
    values, step = _tests(piece), np.diff(piece.length)
    middle, beside = values[:, 1:-1], np.stack([values[:, :-2], values[:, 2:]])
    with np.errstate(invalid="ignore", divide="ignore"):
        slope = np.diff(values, axis=1) / step
        bend = np.diff(slope, axis=1) / (step[:-1] + step[1:])
        slope = slope[:, :-1] + bend * step[:-1]
        vertex, least = -0.5 * slope / bend, middle - 0.25 * slope**2 / bend
        side, next_least = np.sign(middle), np.abs(beside).min(axis=0)
        one_side = (beside * side > 0).all(axis=0)
        low = one_side & (np.abs(middle) < DIP * next_least)
        lower = (least * side < DIP * np.minimum(np.abs(middle), next_least)) & (bend * side > 0)
        lower &= one_side & (vertex > -step[:-1]) & (vertex < step[1:])
    found = {int(place) + i: 0.5 for place in np.flatnonzero(low.any(axis=0)) for i in (0, 1)}
    for which, place in zip(*np.nonzero(lower), strict=True):
        at = vertex[which, place]
        after = int(place) + int(at > 0)
        found[after] = (at / step[after]) % 1.0
    places = sorted(found)
    return places, np.array([found[after] for after in places])


def _located(piece: Piece) -> list[Event]:
    values = _tests(piece)
    kinds, after = np.nonzero(values[:, 1:] * values[:, :-1] < 0)
    ends, rows = np.stack([after, after + 1], axis=1), np.full(len(after), piece.row)
    each = values[kinds[:, None], ends]
    found = locate(piece.orbits, rows, piece.z[ends], piece.tangent[ends], kinds, each)
    events = [
        replace(point, after=int(place))
        for place, point in zip(after, found, strict=True)
        if point is not None and _is_real(point)
    ]
    events = [event for event in events if not _is_vertex(event, events, piece)]
    return in_order(piece, events)


def _vertical(piece: Piece) -> np.ndarray:
    """True at points where a branch stays at one value of the parameter, bool[p]: a family of
    orbits about the centre of a linear system, of which none is isolated and a multiplier is 1.
    """
    still = np.abs(piece.tangent[:, -1]) < STILL
    beside = np.append(still[1:], False) | np.append(False, still[:-1])
    vertical: np.ndarray = still & beside
    return vertical


def in_order(piece: Piece, events: Sequence[Event]) -> list[Event]:
    """Sort events in the order in which the branch comes by."""
    return sorted(events, key=lambda event: (event.after, _ahead(piece, event)))


def _is_vertex(event: Event, events: Sequence[Event], piece: Piece) -> bool:
    """True if a fold is the point where the crossing branch of a branch point turns back."""
    return event.kind == "fold" and any(
        other.kind == "branch_point" and np.abs((other.z - event.z) / piece.scale).max() < VERTEX
        for other in events
    )


def _is_real(point: Event) -> bool:
    """True if the test of a bifurcation vanishes at a point. A test may also change its sign by a
    jump, between branches that run alongside or at two real multipliers whose product is one.
    """
    multipliers = point.multipliers
    if point.kind == "fold":
        return bool(abs(point.tangent[-1]) < VANISHES)
    if point.kind == "period_doubling":
        return bool(np.abs(multipliers + 1.0).min() < VANISHES)
    if point.kind == "neimark_sacker":
        on = np.abs(np.abs(multipliers) - 1.0) < VANISHES
        return bool((on & (np.abs(multipliers.imag) > COMPLEX)).sum() >= 2)
    return True


def _ahead(piece: Piece, point: Event) -> float:
    step = (point.z - piece.z[point.after]) / piece.scale
    return float(step @ piece.tangent[point.after])


#: Multipliers that cross the unit circle at each kind of event.
_CROSSING = {"fold": 1, "branch_point": 1, "period_doubling": 1, "neimark_sacker": 2}


def _unexplained(piece: Piece, turning: bool = False) -> list[int]:
    """Points after which the count of multipliers outside the circle isn't explained by events;
    ``turning``: a branch may keep its stability where it turns back at a branch point.
    """
    if not piece.audited:
        return []
    count = outside(piece.multipliers).sum(axis=1)
    vertical = _vertical(piece)
    result = []
    for place, change in enumerate(np.diff(count)):
        if vertical[place] or vertical[place + 1]:
            continue
        ways = piece.tangent[max(place - 1, 0) : place + 3, -1]
        turns = turning and ways.min() < 0 < ways.max()
        changes = [
            (-crossing, 0, crossing)
            if turns and event.kind == "branch_point"
            else (-crossing, crossing)
            for event in piece.events
            if event.after == place
            or (turns and event.kind == "branch_point" and abs(event.after - place) == 1)
            for crossing in [_CROSSING.get(event.kind, 0)]
        ]
        sums = {sum(one) for one in itertools.product(*changes)}
        if int(change) not in sums:
            result.append(place)
    return result


def refine(piece: Piece, places: Sequence[int], shares: np.ndarray | float = 0.5) -> np.ndarray:
    """Put a point into each of some intervals, by the points before them; the numbers of the new
    points, int64[r]. ``shares``: where in them.
    """
    after = np.array(places, np.int64)
    step = (piece.z[after + 1] - piece.z[after]) / piece.scale
    length = np.einsum("ki,ki->k", step, piece.tangent[after])
    orbits = piece.orbits.near(piece.z[after], np.full(len(after), piece.row))
    rows = np.arange(len(after))
    along = (shares * length)[:, None] * piece.tangent[after]
    guess = piece.z[after] + along * piece.scale
    point = correct(orbits, guess, piece.tangent[after], rows, np.abs(length))
    good = np.flatnonzero(point.found & (np.abs(length) > LEAST))
    if not len(good):
        return good
    derivative = point.derivative[good]
    tangent = tangents(derivative, piece.tangent[after[good]])
    multipliers = orbits.multipliers(point.z[good], derivative, rows[good])
    between = piece.length[after] + shares * (piece.length[after + 1] - piece.length[after])
    return _put(piece, after[good], point.z[good], tangent, derivative, multipliers, between[good])


def _put(
    piece: Piece,
    after: np.ndarray,
    z: np.ndarray,
    tangent: np.ndarray,
    derivative: np.ndarray,
    multipliers: np.ndarray,
    length: np.ndarray,
) -> np.ndarray:
    """Put new points behind the points int64[r]; their numbers, int64[r]."""
    new = {"z": z, "tangent": tangent, "derivative": derivative, "multipliers": multipliers}
    for name, values in {**new, "length": length}.items():
        setattr(piece, name, np.insert(getattr(piece, name), after + 1, values, axis=0))
    placed = after + 1 + np.arange(len(after))
    piece.events = [replace(event, after=_moved(piece, event, placed)) for event in piece.events]
    return placed


def retrace(piece: Piece, places: Sequence[int]) -> bool:
    """Follow a branch anew in some intervals, by shorter steps: a step across a loop leads to the
    same branch beyond it. Whether another way was found.
    """
    found = False
    for after in sorted(places, reverse=True):
        ahead, unit = piece.z[after + 1], piece.scale
        whole = float(np.linalg.norm((ahead - piece.z[after]) / unit))
        if whole < NARROW:
            continue
        orbits = piece.orbits.near(piece.z[[after]], np.array([piece.row]))
        (curve,) = follow(
            orbits,
            piece.z[[after]],
            piece.tangent[[after]],
            {},
            MOST_POINTS,
            whole / SHORTER,
            ends=functools.partial(_arrived, ahead, unit),
            longest=whole / SHORTER,
        )
        if curve.end != "arrived" or curve.length[-1] < LONGER * whole:
            continue
        z, tangent, derivative = (
            np.array(one[1:]) for one in (curve.z, curve.tangent, curve.derivative)
        )
        length = piece.length[after] + np.array(curve.length[1:])
        end = length[-1] + np.linalg.norm((ahead - z[-1]) / unit)
        piece.length[after + 1 :] += end - piece.length[after + 1]
        multipliers = orbits.multipliers(z, derivative, np.zeros(len(z), np.int64))
        _put(piece, np.full(len(z), after), z, tangent, derivative, multipliers, length)
        found = True
    return found


def _arrived(point: np.ndarray, unit: np.ndarray, curve: Arc) -> str:
    return "arrived" if len(curve.z) > 1 and passes(curve, point, unit) else ""


def _moved(piece: Piece, event: Event, placed: np.ndarray) -> int:
    """The point that comes before an event, once new points have been put in."""
    place = event.after
    for new in placed:
        if new <= place:
            place += 1
        elif new == place + 1:
            step = (event.z - piece.z[new]) / piece.scale
            place += int(step @ piece.tangent[new] >= 0)
    return place
