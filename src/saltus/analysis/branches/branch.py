"""A branch of periodic orbits: the points on it, and the bifurcations between them."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from saltus.analysis.branches.arclength import Arc, correct, follow, passes, tangents
from saltus.analysis.branches.events import Event
from saltus.analysis.branches.sequence_changes import contact_points
from saltus.analysis.branches.shooting import PeriodicOrbits
from saltus.analysis.branches.special_points import COMPLEX, locate, outside, tests

#: A fold so near to a branch point is none, in units of the scale: it is located less well there.
VERTEX = 1e-4
#: Shortest interval that is halved, in units of the scale.
LEAST = 1e-9
#: What is smaller at the zero of a test vanishes there.
VANISHES = 1e-6
#: The parameter's share of a tangent that is nothing but rounding.
STILL = 1e-8
#: A test that comes down to less than this share of what it is beside may vanish twice there; so
#: often points are put where it may.
DIP, DIVES = 0.5, 4
#: How often an interval is halved in which changes of stability don't add up; how often it is then
#: followed anew, with how many times shorter steps, and to how many points at most.
HALVINGS, RETRACED, SHORTER, MOST_POINTS = 6, 3, 16, 400
#: A way between two points that is longer than the step by this factor is another one; it isn't
#: looked for in a step shorter than this, in units of the scale.
LONGER, NARROW = 1.02, 1e-4


@dataclass
class Branch:
    """A branch of periodic orbits of n periods.

    Attributes
    ----------
    orbits : PeriodicOrbits
        The equations, of which it is a row.
    row : int
        Which.
    z : float64[p, z]
        Its points: see :class:`PeriodicOrbits`.
    tangent, derivative : float64[p, ...]
        There, in units of the scale.
    length : float64[p]
        Arclength from its first point, in units of the scale.
    multipliers : complex128[p, D]
        Floquet multipliers, the largest first, without a trivial one.
    ends : (str, str)
        Why it ends at its first and at its last point: see :class:`Arc`; ``period_doubling``
        where it becomes an orbit of half the period, ``hopf`` where a limit cycle shrinks to an
        equilibrium, ``boundary_equilibrium`` where an equilibrium meets a boundary; ``accumulates``
        where its grazes do, ``held`` where it is lost with contacts that are held; ``unstable``
        where its orbits lose stability, and no more was asked for.
    limits : (float, float)
        The parameter at which they do, at either end; NaN otherwise.
    events : list of Event
        In the order of the branch.
    unexplained : list of int
        Points after which the number of multipliers outside the unit circle changes by more or less
        than the events there explain.
    parent : (int, int) or None
        The branch and its event that it leaves.
    """

    orbits: PeriodicOrbits
    row: int
    z: np.ndarray
    tangent: np.ndarray
    derivative: np.ndarray
    length: np.ndarray
    multipliers: np.ndarray
    ends: tuple[str, str]
    events: list[Event] = field(default_factory=list)
    unexplained: list[int] = field(default_factory=list)
    parent: tuple[int, int] | None = None
    limits: tuple[float, float] = (np.nan, np.nan)

    @property
    def closed(self) -> bool:
        """True if the branch returns to where it began."""
        return self.ends == ("closed", "closed")

    @property
    def scale(self) -> np.ndarray:
        """Unit of each unknown."""
        return np.asarray(self.orbits.scale[self.row])

    def find_events(self) -> None:
        """Locate what happens along the branch; halve the intervals where stability doesn't add
        up.
        """
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
        self.events = _in_order(self, [*self.events, *self._contacts()])

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
            self, **new,
            events=[replace(one, after=one.after - shift) for one in mine],
            unexplained=[i - shift for i in self.unexplained if low <= i < kept.stop - 1],
            ends=(
                "unstable" if first else self.ends[0],
                "unstable" if behind < len(self.z) else self.ends[1],
            ),
        )  # fmt: skip

    def _loss(self, after: int, which: int) -> Event | None:
        """The event behind a point at which stability is lost, the first (0) or the last (-1)."""
        mine = [event for event in self.events if event.after == after]
        mine = [event for event in mine if event.kind in _LOSES_STABILITY] or mine
        return mine[which] if mine else None

    def _halve(self) -> None:
        """Locate bifurcations; halve the intervals in which they don't explain what changes."""
        for left in reversed(range(HALVINGS)):
            self.events = _located(self)
            self.unexplained = _unexplained(self)
            if not left or not self.unexplained or not len(refine(self, self.unexplained)):
                break

    def _contacts(self) -> list[Event]:
        """Events at which the contact sequence changes."""
        return contact_points(self.orbits, self.row, self.z, self.tangent)


# -- events ----------------------------------------------------------------------------------------
def _tests(branch: Branch) -> np.ndarray:
    """The functions whose zeros are bifurcations, at the points of a branch, float64[tests, p]."""
    values = tests(branch.tangent, branch.derivative, branch.multipliers, branch.z.shape[1] - 1)
    values[0, _vertical(branch)] = 0.0
    return values


def _dips(branch: Branch) -> tuple[list[int], np.ndarray]:
    """Points between which and the next ones a test may vanish twice, and where, in shares of the
    step: at the vertex of the parabola through three points if it is much nearer to zero than they
    are, or to both sides of a point that is much nearer than those beside it.
    """
    if len(branch.z) < 3:
        return [], np.zeros(0)
    values, step = _tests(branch), np.diff(branch.length)
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


def _located(branch: Branch) -> list[Event]:
    values = _tests(branch)
    kinds, after = np.nonzero(values[:, 1:] * values[:, :-1] < 0)
    ends, rows = np.stack([after, after + 1], axis=1), np.full(len(after), branch.row)
    found = locate(branch.orbits, rows, branch.z[ends], branch.tangent[ends], kinds)
    events = [
        replace(point, after=int(place))
        for place, point in zip(after, found, strict=True)
        if point is not None and _is_real(point)
    ]
    events = [event for event in events if not _is_vertex(event, events, branch)]
    return _in_order(branch, events)


def _vertical(branch: Branch) -> np.ndarray:
    """True at points where a branch stays at one value of the parameter, bool[p]: a family of
    orbits about the centre of a linear system, of which none is isolated and a multiplier is 1.
    """
    still = np.abs(branch.tangent[:, -1]) < STILL
    beside = np.append(still[1:], False) | np.append(False, still[:-1])
    vertical: np.ndarray = still & beside
    return vertical


def _in_order(branch: Branch, events: Sequence[Event]) -> list[Event]:
    """Events in the order in which the branch comes by."""
    return sorted(events, key=lambda event: (event.after, _ahead(branch, event)))


def _is_vertex(event: Event, events: Sequence[Event], branch: Branch) -> bool:
    """True if a fold is the point where the crossing branch of a branch point turns back."""
    return event.kind == "fold" and any(
        other.kind == "branch_point" and np.abs((other.z - event.z) / branch.scale).max() < VERTEX
        for other in events
    )


def _is_real(point: Event) -> bool:
    """True if the test of a bifurcation vanishes at a point. A test may also change its sign by a
    jump, between branches that run alongside or at two real multipliers whose product is one.
    """
    own = point.multipliers
    if point.kind == "fold":
        return bool(abs(point.tangent[-1]) < VANISHES)
    if point.kind == "period_doubling":
        return bool(np.abs(own + 1.0).min() < VANISHES)
    if point.kind == "neimark_sacker":
        on = np.abs(np.abs(own) - 1.0) < VANISHES
        return bool((on & (np.abs(own.imag) > COMPLEX)).sum() >= 2)
    return True


def _ahead(branch: Branch, point: Event) -> float:
    step = (point.z - branch.z[point.after]) / branch.scale
    return float(step @ branch.tangent[point.after])


#: What a branch knows of each of its points.
_COLUMNS = ("z", "tangent", "derivative", "length", "multipliers")
#: Events at which orbits lose stability, before those at which they may.
_LOSES_STABILITY = ("fold", "branch_point", "period_doubling", "neimark_sacker", "hopf")
#: How many multipliers cross the unit circle at each kind of event.
_CROSSING = {"fold": 1, "branch_point": 1, "period_doubling": 1, "neimark_sacker": 2}


def _unexplained(branch: Branch, turning: bool = False) -> list[int]:
    """Points after which the count of multipliers outside the circle isn't explained by events;
    ``turning``: a branch may keep its stability where it turns back at a branch point.
    """
    count = outside(branch.multipliers).sum(axis=1)
    vertical = _vertical(branch)
    result = []
    for place, change in enumerate(np.diff(count)):
        if vertical[place] or vertical[place + 1]:
            continue
        ways = branch.tangent[max(place - 1, 0) : place + 3, -1]
        turns = turning and ways.min() < 0 < ways.max()
        changes = [
            (-crossing, 0, crossing)
            if turns and event.kind == "branch_point"
            else (-crossing, crossing)
            for event in branch.events
            if event.after == place
            or (turns and event.kind == "branch_point" and abs(event.after - place) == 1)
            for crossing in [_CROSSING.get(event.kind, 0)]
        ]
        sums = {sum(one) for one in itertools.product(*changes)}
        if int(change) not in sums:
            result.append(place)
    return result


def refine(branch: Branch, places: Sequence[int], shares: np.ndarray | float = 0.5) -> np.ndarray:
    """Put a point into each of some intervals, by the points before them; the numbers of the new
    points, int64[r]. ``shares``: where in them.
    """
    after = np.array(places, np.int64)
    step = (branch.z[after + 1] - branch.z[after]) / branch.scale
    length = np.einsum("ki,ki->k", step, branch.tangent[after])
    orbits = branch.orbits.near(branch.z[after], np.full(len(after), branch.row))
    rows = np.arange(len(after))
    along = (shares * length)[:, None] * branch.tangent[after]
    guess = branch.z[after] + along * branch.scale
    point = correct(orbits, guess, branch.tangent[after], rows, np.abs(length))
    good = np.flatnonzero(point.found & (np.abs(length) > LEAST))
    if not len(good):
        return good
    derivative = point.derivative[good]
    tangent = tangents(derivative, branch.tangent[after[good]])
    own = orbits.multipliers(point.z[good], derivative, rows[good])
    between = branch.length[after] + shares * (branch.length[after + 1] - branch.length[after])
    return _put(branch, after[good], point.z[good], tangent, derivative, own, between[good])


def _put(
    branch: Branch,
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
        setattr(branch, name, np.insert(getattr(branch, name), after + 1, values, axis=0))
    placed = after + 1 + np.arange(len(after))
    branch.events = [replace(event, after=_moved(branch, event, placed)) for event in branch.events]
    return placed


def retrace(branch: Branch, places: Sequence[int]) -> bool:
    """Follow a branch anew in some intervals, by shorter steps: a step across a loop leads to the
    same branch beyond it. Whether another way was found.
    """
    found = False
    for after in sorted(places, reverse=True):
        ahead, unit = branch.z[after + 1], branch.scale
        whole = float(np.linalg.norm((ahead - branch.z[after]) / unit))
        if whole < NARROW:
            continue
        orbits = branch.orbits.near(branch.z[[after]], np.array([branch.row]))
        (curve,) = follow(
            orbits, branch.z[[after]], branch.tangent[[after]], {}, MOST_POINTS, whole / SHORTER,
            ends=functools.partial(_arrived, ahead, unit), longest=whole / SHORTER,
        )  # fmt: skip
        if curve.end != "arrived" or curve.length[-1] < LONGER * whole:
            continue
        z, tangent, derivative = (
            np.array(one[1:]) for one in (curve.z, curve.tangent, curve.derivative)
        )
        length = branch.length[after] + np.array(curve.length[1:])
        end = length[-1] + np.linalg.norm((ahead - z[-1]) / unit)
        branch.length[after + 1 :] += end - branch.length[after + 1]
        own = orbits.multipliers(z, derivative, np.zeros(len(z), np.int64))
        _put(branch, np.full(len(z), after), z, tangent, derivative, own, length)
        found = True
    return found


def _arrived(point: np.ndarray, unit: np.ndarray, curve: Arc) -> str:
    return "arrived" if len(curve.z) > 1 and passes(curve, point, unit) else ""


def _moved(branch: Branch, event: Event, placed: np.ndarray) -> int:
    """The point that comes before an event, once new points have been put in."""
    place = event.after
    for new in placed:
        if new <= place:
            place += 1
        elif new == place + 1:
            step = (event.z - branch.z[new]) / branch.scale
            place += int(step @ branch.tangent[new] >= 0)
    return place
