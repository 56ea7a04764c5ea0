"""Families of branches: from seeds in both directions, through folds, onto doubled and crossing
branches, each once.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from saltus.analysis.branches.arclength import FIRST, Curve, correct, follow, tangents
from saltus.analysis.branches.sequence_changes import contact_points
from saltus.analysis.branches.shooting import PeriodicOrbits
from saltus.analysis.branches.special_points import SpecialPoint, locate, outside, tests

#: How far a new branch begins from the point where it leaves another, in units of the scale.
ASIDE = 0.001
#: A branch that ends so near to where another is to leave is that one, in units of the scale.
BORN = 0.015
#: Radius of a limit cycle that is lost because it shrinks to an equilibrium, in units of the scale.
SHRUNK = 0.005
#: Farthest that a seed lies from its orbit, in units of the scale.
ASTRAY = 0.5
#: A fold so near to a branch point is none, in units of the scale: it is located less well there.
VERTEX = 1e-4
#: Orbits nearer than this, in units of the scale, are one.
SAME = 1e-6
#: An orbit may lie on a branch whose points, joined by lines, pass it by less.
PASSES = 0.3
#: Shortest interval that is halved, in units of the scale.
LEAST = 1e-9
#: The parameter's share of a tangent that is nothing but rounding.
STILL = 1e-8
#: A test that comes down to less than this share of what it is beside may vanish twice there; so
#: often points are put where it may.
DIP, DIVES = 0.5, 4
#: How often an interval is halved in which changes of stability don't add up.
HALVINGS = 6


@dataclass(frozen=True)
class Seed:
    """Where a branch begins.

    Attributes
    ----------
    points : float64[n, D]
        An orbit.
    own : float64[..]
        The other unknowns: its period [s] if the system isn't forced, and the parameter.
    scale : float64[D]
        Ranges of the states.
    along : float64[z] or None
        The side on which to leave, in units of the scale; None for both sides of the parameter.
    parent : (int, int) or None
        The branch and its event that the new one leaves.
    """

    points: np.ndarray
    own: np.ndarray
    scale: np.ndarray
    along: np.ndarray | None = None
    parent: tuple[int, int] | None = None

    @property
    def z(self) -> np.ndarray:
        """All unknowns."""
        return np.concatenate([self.points.ravel(), self.own])


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
        Why it ends at its first and at its last point: see :class:`Curve`; ``period_doubling``
        where it becomes an orbit of half the period, ``hopf`` where a limit cycle shrinks to an
        equilibrium, ``boundary_equilibrium`` where an equilibrium meets a boundary.
    events : list of SpecialPoint
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
    events: list[SpecialPoint] = field(default_factory=list)
    unexplained: list[int] = field(default_factory=list)
    parent: tuple[int, int] | None = None

    @property
    def closed(self) -> bool:
        """Whether it returns to where it began."""
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
        for left in reversed(range(HALVINGS)):
            self.events = _located(self)
            self.unexplained = _unexplained(self)
            if not left or not self.unexplained or not len(refine(self, self.unexplained)):
                break
        self.unexplained = _unexplained(self, turning=True)
        self.events = _in_order(self, [*self.events, *self._contacts()])

    def _contacts(self) -> list[SpecialPoint]:
        """Where the contact sequence changes."""
        return contact_points(self.orbits, self.row, self.z, self.tangent)

    def is_known(self, branches: Sequence[Branch]) -> bool:  # noqa: ARG002
        """Whether another one has come this way, from elsewhere."""
        return False

    def children(self, plan: Plan, number: int) -> Iterator[Seed]:
        """Seeds at its events, and the orbits of half the period at its ends; ``number`` is its
        own.
        """
        return _children(plan, self, number)


@dataclass(frozen=True)
class Plan:
    """What is followed, and how far.

    Attributes
    ----------
    make : callable
        The equations of orbits of n periods with a scale float64[k, z].
    limits : (float, float)
        Range of the parameter.
    points : int
        Most points of a branch in each direction.
    longest : int
        Doubled branches are followed to orbits of this number of periods.
    switch : set of str
        Kinds of events at which the branches that leave are followed.
    follow : callable
        The branch of a start, such as :func:`both_ways`; None where there is none.
    """

    make: Callable[[int, np.ndarray], PeriodicOrbits]
    limits: tuple[float, float]
    points: int
    longest: int
    switch: frozenset[str]
    follow: Callable[[Plan, Start], Branch | None]


def trace(
    plan: Plan,
    seeds: Sequence[Seed],
    branches: list[Branch],
    progress: Callable[[float], None] | None = None,
) -> None:
    """Add all branches that seeds lie on, and those that leave them at their events, to a list.

    Seeds that lie on a branch already followed, or on its mirror image, are not followed again.
    """
    waiting, begun = list(seeds), 0
    while waiting:
        seed, begun = waiting.pop(0), begun + 1
        start = Start.of(plan, seed)
        known = start is None or _known(start.z, start.n, branches)
        if start is not None and not known and not _ends_there(seed, branches):
            branch = plan.follow(plan, start)
            if branch is not None and not branch.is_known(branches):
                branches.append(branch)
                branch.find_events()
                waiting += branch.children(plan, len(branches) - 1)
        if progress is not None:
            progress(begun / (begun + len(waiting)))


# -- following -------------------------------------------------------------------------------------
@dataclass(frozen=True)
class Start:
    """The orbit of a seed, closed by Newton's method: float64[z], and the units of its unknowns."""

    seed: Seed
    z: np.ndarray
    scale: np.ndarray

    @property
    def n(self) -> int:
        """Periods of the orbit."""
        return len(self.seed.points)

    @property
    def sides(self) -> np.ndarray:
        """In which directions the branch is followed, in units of the scale, float64[1 or 2, z]."""
        if self.seed.along is not None:
            return self.seed.along[None]
        up = np.zeros(len(self.z))
        up[-1] = 1.0
        return np.stack([up, -up])

    @property
    def first(self) -> float:
        """The first step, in units of the scale."""
        return FIRST if self.seed.along is None else ASIDE

    @classmethod
    def of(cls, plan: Plan, seed: Seed) -> Start | None:
        """At the parameter of the seed, beside it where a branch leaves another; None if there is
        no orbit.
        """
        n, z = len(seed.points), seed.z
        scale = np.concatenate([np.tile(seed.scale, n), np.abs(seed.own)])
        scale[-1] = plan.limits[1] - plan.limits[0]
        normal = np.zeros(len(z))
        normal[-1] = 1.0
        if seed.along is not None:
            z, normal = z + ASIDE * seed.along * scale, seed.along
        row, orbits = np.zeros(1, np.int64), plan.make(n, scale[None])
        orbits.accepted(z[None], row)
        point = correct(orbits, z[None], normal[None], row, ASTRAY)
        return cls(seed, point.z[0], scale) if point.found[0] else None


def _halved(orbits: PeriodicOrbits, curve: Curve) -> str:
    """``period_doubling`` if an orbit of 2m periods has just passed one of m periods; ``hopf`` if a
    limit cycle has shrunk to nothing.
    """
    if len(curve.z) < 2:
        return ""
    ahead, behind = curve.z[-1], curve.z[-2]
    if orbits.n % 2 == 0:
        half = orbits.n // 2
        apart = [(p[:half] - p[half:]).ravel() for p in map(orbits.points, (ahead, behind))]
        if apart[0] @ apart[1] < 0.0:
            return "period_doubling"
    return "hopf" if orbits.free and orbits.turned(ahead, behind) else ""


def both_ways(
    plan: Plan,
    start: Start,
    ends: Callable[[Any, Curve], str] = _halved,
    kind: type[Branch] = Branch,
) -> Branch | None:
    """The branch of an orbit over one period; None if there is none."""
    sides = start.sides
    rows = np.arange(len(sides))
    z = np.tile(start.z, (len(sides), 1))
    orbits = plan.make(start.n, np.tile(start.scale, (len(sides), 1)))
    orbits.accepted(z, rows)
    curves = follow(
        orbits, z, sides, {orbits.width - 1: plan.limits}, plan.points, start.first,
        ends=functools.partial(ends, orbits), group=0 * rows,
    )  # fmt: skip
    for curve in curves:
        shrunk = curve.end == "lost" and orbits.free and len(curve.z) > 1
        if shrunk and orbits.radius(curve.z[-1]) < SHRUNK:
            curve.end = "hopf"
    return _joined(orbits, [curve for curve in curves if curve.z], start.seed, kind)


def _joined(
    orbits: PeriodicOrbits, curves: list[Curve], seed: Seed, kind: type[Branch]
) -> Branch | None:
    """One branch from the curves to both sides."""
    if not curves:
        return None
    for curve in curves:
        if curve.end == "closed":
            return _of(orbits, curve, ("closed", "closed"), seed, kind)
    if len(curves) == 1:
        return _of(orbits, curves[0], ("branch", curves[0].end), seed, kind)
    up, down = curves
    whole = Curve(
        down.z[:0:-1] + up.z,
        [-tangent for tangent in down.tangent[:0:-1]] + up.tangent,
        down.derivative[:0:-1] + up.derivative,
        [-length for length in down.length[:0:-1]] + up.length,
    )
    return _of(orbits, whole, (down.end, up.end), seed, kind)


def _of(
    orbits: PeriodicOrbits,
    curve: Curve,
    ends: tuple[str, str],
    seed: Seed,
    kind: type[Branch],
) -> Branch:
    z, tangent, derivative = (np.array(one) for one in (curve.z, curve.tangent, curve.derivative))
    length = np.array(curve.length) - curve.length[0]
    own = orbits.multipliers(z, derivative, np.zeros(len(z), np.int64))
    return kind(orbits, 0, z, tangent, derivative, length, own, ends, parent=seed.parent)


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


def _located(branch: Branch) -> list[SpecialPoint]:
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
    """Where a branch stays at one value of the parameter, bool[p]: a family of orbits about the
    centre of a linear system, of which none is isolated and a multiplier is 1.
    """
    still = np.abs(branch.tangent[:, -1]) < STILL
    beside = np.append(still[1:], False) | np.append(False, still[:-1])
    return still & beside


def _in_order(branch: Branch, events: Sequence[SpecialPoint]) -> list[SpecialPoint]:
    """Events in the order in which the branch comes by."""
    return sorted(events, key=lambda event: (event.after, _ahead(branch, event)))


def _is_vertex(event: SpecialPoint, events: Sequence[SpecialPoint], branch: Branch) -> bool:
    """Whether a fold is where a branch point's crossing branch turns back."""
    return event.kind == "fold" and any(
        other.kind == "branch_point" and np.abs((other.z - event.z) / branch.scale).max() < VERTEX
        for other in events
    )


def _is_real(point: SpecialPoint) -> bool:
    """Whether a zero of the test for tori is a complex pair on the unit circle."""
    if point.kind != "neimark_sacker":
        return True
    on = np.abs(np.abs(point.multipliers) - 1.0) < 1e-6
    return bool((on & (np.abs(point.multipliers.imag) > 1e-7)).sum() >= 2)


def _ahead(branch: Branch, point: SpecialPoint) -> float:
    step = (point.z - branch.z[point.after]) / branch.scale
    return float(step @ branch.tangent[point.after])


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
    new = {"z": point.z[good], "tangent": tangent, "derivative": derivative}
    for name, values in {**new, "multipliers": own, "length": between[good]}.items():
        setattr(branch, name, np.insert(getattr(branch, name), after[good] + 1, values, axis=0))
    placed = after[good] + 1 + np.arange(len(good))
    branch.events = [replace(event, after=_moved(branch, event, placed)) for event in branch.events]
    return placed


def _moved(branch: Branch, event: SpecialPoint, placed: np.ndarray) -> int:
    """The point that comes before an event, once new points have been put in."""
    place = event.after
    for new in placed:
        if new <= place:
            place += 1
        elif new == place + 1:
            step = (event.z - branch.z[new]) / branch.scale
            place += int(step @ branch.tangent[new] >= 0)
    return place


# -- identity --------------------------------------------------------------------------------------
def branch_of(z: np.ndarray, n: int, branches: Sequence[Branch]) -> int:
    """The branch on which an orbit of n periods or its mirror image lies, -1 if it is none of
    these.
    """
    mine = [
        i
        for i, branch in enumerate(branches)
        if branch.orbits.n == n and branch.z.shape[1] == len(z)  # equilibria are no limit cycles
    ]
    same = [z]
    if mine and branches[mine[0]].orbits.symmetric:
        same.append(branches[mine[0]].orbits.mirrored(z[None])[0])
    there = (i for one in same for i in mine if _lies_on(one, branches[i]))
    return next(there, -1)


def has_twin(branch: Branch) -> bool:
    """Whether the mirror image of a branch is another one."""
    middle = branch.z[len(branch.z) // 2][None]
    return branch.orbits.symmetric and not _lies_on(branch.orbits.mirrored(middle)[0], branch)


def _known(z: np.ndarray, n: int, branches: Sequence[Branch]) -> bool:
    """Whether an orbit of n periods lies on a branch that has been followed."""
    return branch_of(z, n, branches) >= 0


def _lies_on(z: np.ndarray, branch: Branch) -> bool:
    normal = np.zeros((1, len(z)))
    normal[0, -1] = 1.0
    for guess in _passes(branch, float(z[-1])):
        if _apart(z, guess, branch) > PASSES:
            continue
        orbits = branch.orbits.near(guess[None], np.array([branch.row]))
        point = correct(orbits, guess[None], normal, np.array([0]), 2 * PASSES)
        if point.found[0] and _apart(z, point.z[0], branch, exact=True) < SAME:
            return True
    return False


def _passes(branch: Branch, value: float) -> np.ndarray:
    """Where a branch passes a value of the parameter, float64[g, z]: by cubics between its points,
    which turn back beyond a fold as it does.
    """
    step = np.diff(branch.z, axis=0) / branch.scale
    length = np.append(0.0, np.cumsum(np.linalg.norm(step, axis=1)))
    each = np.append(True, np.diff(length) > 0.0)
    if each.sum() < 2:
        return np.zeros((0, len(branch.scale)))
    curve = CubicHermiteSpline(
        length[each], branch.z[each] / branch.scale, branch.tangent[each], extrapolate=False
    )
    own = CubicHermiteSpline(
        curve.x, branch.z[each, -1] / branch.scale[-1], branch.tangent[each, -1]
    )
    places = own.solve(value / branch.scale[-1], extrapolate=False)
    result = curve(places[np.isfinite(places)]) * branch.scale
    result[:, -1] = value
    return np.asarray(result)


def _apart(a: np.ndarray, b: np.ndarray, branch: Branch, exact: bool = False) -> float:
    """How far two orbits lie apart, in units of the scale, from whichever point they begin; for
    limit cycles only roughly unless ``exact``.
    """
    orbits, row = branch.orbits, branch.row
    size = orbits.n * orbits.size
    if orbits.free:
        periods = abs(a[size] - b[size]) / abs(b[size])
        return max(periods, orbits.beside(b, a[: orbits.size], row) if exact else 0.0)
    others = orbits.alike(a[None], np.array([row]))[0]
    return float(np.abs((others - b)[:, :size] / branch.scale[:size]).max(axis=1).min())


def _ends_there(seed: Seed, branches: Sequence[Branch]) -> bool:
    """Whether the branch that leaves a period doubling or a Hopf point is one that was seen to end
    there.
    """
    if seed.along is None:
        return False
    for branch in branches:
        if branch.orbits.n != len(seed.points) or branch.z.shape[1] != len(seed.z):
            continue
        others = branch.orbits.alike(seed.z[None], np.array([branch.row]))[0]
        for place in (0, -1):
            apart = np.linalg.norm((others - branch.z[place]) / branch.scale, axis=1)
            born = branch.ends[place] in ("period_doubling", "hopf")
            if born and apart.min() < BORN:
                return True
    return False


# -- branches that leave others --------------------------------------------------------------------
def _children(plan: Plan, branch: Branch, number: int) -> Iterator[Seed]:
    """Seeds at the events of a branch, and the orbits of half the period at its ends."""
    size = branch.orbits.size
    for index, event in enumerate(branch.events):
        if event.kind not in plan.switch:
            continue
        points = branch.orbits.points(event.z)
        own = event.z[branch.orbits.n * size :]
        unit = branch.scale[:size]
        if event.kind == "period_doubling" and 2 * branch.orbits.n <= plan.longest:
            yield Seed(
                np.concatenate([points, points]), own, unit,
                _doubled(branch, event), (number, index),
            )  # fmt: skip
        elif event.kind == "branch_point":
            aside = crossing(event)
            for sign in (1.0, -1.0):
                yield Seed(points, own, unit, sign * aside, (number, index))
    for place, end in zip((0, -1), branch.ends, strict=True):
        if end == "period_doubling":
            z = branch.z[place]
            half = branch.orbits.n // 2
            points = branch.orbits.points(z)
            middle = 0.5 * (points[:half] + points[half:])
            yield Seed(middle, z[branch.orbits.n * size :], branch.scale[:size])


def _doubled(branch: Branch, event: SpecialPoint) -> np.ndarray:
    """The direction of the branch of twice the period."""
    segments = branch.orbits.segments(event.derivative, branch.row)
    product = np.eye(branch.orbits.size)
    for one in segments:
        product = one @ product
    vector = np.linalg.svd(product + np.eye(len(product)))[2][-1]
    way = [vector]
    for one in segments[:-1]:
        way.append(one @ way[-1])
    way = np.array(way) / branch.scale[: branch.orbits.size]
    whole = np.concatenate([way.ravel(), -way.ravel(), np.zeros(branch.orbits.free + 1)])
    return np.asarray(whole / np.linalg.norm(whole))


def crossing(event: SpecialPoint) -> np.ndarray:
    """The direction of the branch that crosses at a branch point."""
    null = np.linalg.svd(event.derivative)[2][-2:]
    rest = null - np.outer(null @ event.tangent, event.tangent)
    longest = rest[np.argmax(np.linalg.norm(rest, axis=1))]
    return np.asarray(longest / np.linalg.norm(longest))
