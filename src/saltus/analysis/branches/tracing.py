"""Families of branches: from seeds in both directions, through folds, onto doubled and crossing
branches, each once.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from saltus.analysis.branches.arclength import (
    ENDING,
    FIRST,
    Arc,
    both_sides,
    correct,
    follow,
    tangents,
)
from saltus.analysis.branches.branch import Branch
from saltus.analysis.branches.events import Event
from saltus.analysis.branches.legs import Legs
from saltus.analysis.branches.same_branch import SAME, branch_of
from saltus.analysis.branches.shooting import PeriodicOrbits
from saltus.analysis.branches.special_points import unstable
from saltus.analysis.branches.switching import Seed, children, ends_there
from saltus.analysis.branches.watch import Watch
from saltus.flow.progress import stage

#: Distances from the point where a branch leaves another, in units of the scale: it begins at the
#: first of these at which Newton's method finds it.
ASIDE = (1e-3, 2e-4, 4e-5)
#: Radius of a limit cycle that is lost because it shrinks to an equilibrium, in units of the scale.
SHRUNK = 0.005
#: Farthest that a seed lies from its orbit, in units of the scale.
ASTRAY = 0.5
#: Residual of points of a branch that aren't corrected again, in units of the scale: they were
#: foreseen, and their derivatives alone are missing.
FORESEEN = 1e-13
#: Points of a branch that are corrected at a time, times the square of the states: 16 of 80 states,
#: so that a modal flow has the contact states of points before them.
TOGETHER = 102_400
#: Branches that are followed side by side, times the square of the unknowns of their orbits.
ABREAST = 512


@dataclass(frozen=True)
class Plan:
    """Rules by which branches are followed, and how far.

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
        The branches of starts of one shape, such as :func:`both_ways`; None where there is none, or
        it is that of a start before.
    abreast : bool
        That follows several starts side by side, which costs little more than one.
    leave : callable
        Seeds of the branches that leave one: see :func:`children`.
    crossed : bool
        A branch may have been followed through where another one crosses it, which can't be known
        from where they cross: what was followed is compared with the others once more.
    stable : bool
        Branches are followed up to where their orbits lose stability.
    watch : Watch
        Their budget and progress.
    """

    make: Callable[[int, np.ndarray], PeriodicOrbits]
    limits: tuple[float, float]
    points: int
    longest: int
    switch: frozenset[str]
    follow: Callable[[Plan, Sequence[Start]], list[Branch | None]]
    abreast: bool = True
    leave: Callable[[Any, int, frozenset[str], int], Iterator[Seed]] = children
    crossed: bool = False
    stable: bool = False
    watch: Watch = field(default_factory=Watch)


def trace(
    plan: Plan,
    seeds: Sequence[Seed],
    branches: list[Branch],
    progress: Callable[[float], None] | None = None,
) -> None:
    """Add all branches that seeds lie on, and those that leave them at their events, to a list.

    Seeds that lie on a branch already followed, or on its mirror image, are not followed again.
    After a KeyboardInterrupt the list also holds the branches that weren't finished, as far as
    their points are known.
    """
    waiting, begun, share = list(seeds), 0, 0.0
    try:
        while waiting and not plan.watch.over:
            beside = _abreast(waiting) if plan.abreast else [waiting.pop(0)]
            begun += len(beside)
            before, share = share, max(share, begun / (begun + len(waiting)))
            plan.watch.begin(stage(progress, before, share))
            _trace_beside(plan, beside, waiting, branches)
            if progress is not None:
                progress(share)
        plan.watch.left += len(waiting)
    except KeyboardInterrupt:
        branches += [one.joined() for one in plan.watch.cut.values()]
        raise


def _trace_beside(
    plan: Plan, beside: list[Seed], waiting: list[Seed], branches: list[Branch]
) -> None:
    """Add the branches that some seeds lie on to a list, and the seeds of those that leave them to
    those that wait.
    """
    found = [Start.of(plan, seed) for seed in beside]
    starts = [one for one in found if one is not None and not _is_known(one, branches)]
    beside = [start.seed for start in starts]
    for start, branch in zip(starts, plan.follow(plan, starts), strict=True):
        seed, followed = beside.pop(0), id(branch)
        if start is not starts[0] and _is_known(start, branches):
            plan.watch.cut.pop(followed, None)
            continue
        if branch is None and start is not starts[0]:
            (branch,) = plan.follow(plan, [start])  # those beside it only seemed to be it
            followed = id(branch)
        if branch is None or _was_followed(plan, branch, branches):
            plan.watch.cut.pop(followed, None)
            continue
        branch.parent = seed.parent
        branch.find_events()
        number = _place(branch, branches, beside, waiting)
        plan.watch.cut.pop(followed, None)
        waiting += plan.leave(branch, number, plan.switch, plan.longest)


def _abreast(waiting: list[Seed]) -> list[Seed]:
    """Take the seeds that are followed side by side, which costs little more than one where orbits
    have few unknowns.

    Several may lie on one branch: limit cycles aren't known again by those who pass them. Of
    neighbours on a branch the second stays behind, since most often it is the other end of what
    leaves at the first.
    """
    first = waiting[0]
    free = len(first.others) > 1
    most = 1 if free and first.along is None else max(ABREAST // first.points.size**2, 1)
    taken, left = list[Seed](), list[Seed]()
    for place, seed in enumerate(waiting):
        alike = (
            (seed.along is None) == (first.along is None)
            and seed.points.shape == first.points.shape
            and (not free or np.array_equal(seed.scale, first.scale))
        )
        if not alike or len(taken) == most:
            left += waiting[place:]
            break
        if place > 0 and waiting[place - 1] is taken[-1] and _leave_one(taken[-1], seed):
            left.append(seed)
        else:
            taken.append(seed)
    waiting[:] = left
    return taken


def _leave_one(seed: Seed, other: Seed) -> bool:
    """True if two seeds leave the same branch."""
    return None not in (seed.parent, other.parent) and seed.parent[0] == other.parent[0]  # type: ignore[index]


def _is_known(start: Start, branches: Sequence[Branch]) -> bool:
    """True if an orbit lies on a branch already followed, or leaves where one was seen to end."""
    return branch_of(start.z, start.n, branches) >= 0 or ends_there(start.seed, branches)


def _was_followed(plan: Plan, branch: Branch, branches: Sequence[Branch]) -> bool:
    if not plan.crossed:
        return False
    return branch_of(branch.z[len(branch.z) // 2], branch.orbits.n, branches) >= 0


def _place(branch: Branch, branches: list[Branch], *waiting: list[Seed]) -> int:
    """Add a branch to a list and return its number: that of the first one that it holds from end to
    end. Those stepped over where the new one began, or were lost on the way, and leave the list.
    """
    held = {i: one for i, one in enumerate(branches) if _holds(branch, one)}
    if not held:
        branches.append(branch)
        return len(branches) - 1
    number, *others = held
    branch.parent, branches[number] = held[number].parent, branch
    kept = [i for i in range(len(branches)) if i not in others]
    branches[:] = [branches[i] for i in kept]

    def now(parent: tuple[int, int] | None) -> tuple[int, int] | None:
        if parent is None or parent[0] not in held:
            return parent and (kept.index(parent[0]), parent[1])
        event = _same_event(held[parent[0]].events[parent[1]], branch)
        return None if event is None else (number, event)

    for one in branches:
        one.parent = now(one.parent)
    for seeds in waiting:
        seeds[:] = [replace(seed, parent=now(seed.parent)) for seed in seeds]
    return number


def _holds(branch: Branch, other: Branch) -> bool:
    """True if a branch passes both ends of another."""
    ends = other.z[[1, -2]] if len(other.z) > 2 else other.z
    n = other.orbits.n
    return n == branch.orbits.n and all(branch_of(z, n, [branch]) == 0 for z in ends)


def _same_event(event: Event, branch: Branch) -> int | None:
    """The number of an event among those of another branch."""
    apart = [
        np.abs((other.z - event.z) / branch.scale).max() if other.kind == event.kind else np.inf
        for other in branch.events
    ]
    return int(np.argmin(apart)) if apart and min(apart) < SAME else None


# -- following -------------------------------------------------------------------------------------
@dataclass(frozen=True)
class Start:
    """The orbit of a seed, closed by Newton's method: float64[z], the units of its unknowns, and
    the first step from there, in these.
    """

    seed: Seed
    z: np.ndarray
    scale: np.ndarray
    first: float = FIRST

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

    @classmethod
    def of(cls, plan: Plan, seed: Seed) -> Start | None:
        """At the parameter of the seed, beside it where a branch leaves another; None if there is
        no orbit.
        """
        n, z = len(seed.points), seed.z
        scale = np.concatenate([np.tile(seed.scale, n), np.abs(seed.others)])
        scale[-1] = plan.limits[1] - plan.limits[0]
        row, orbits = np.zeros(1, np.int64), plan.make(n, scale[None])
        up = np.eye(len(z))[-1]
        for aside in (0.0,) if seed.along is None else ASIDE:
            normal = up if seed.along is None else seed.along
            begin = z + aside * normal * scale
            orbits.accepted(begin[None], row)
            point = correct(orbits, begin[None], normal[None], row, ASTRAY)
            if point.found[0]:
                return cls(seed, point.z[0], scale, aside or FIRST)
        return None


def halved(orbits: PeriodicOrbits | Legs, curve: Arc) -> str:
    """``period_doubling`` if an orbit of 2m periods has just passed one of m periods."""
    if orbits.n % 2 or len(curve.z) < 2:
        return ""
    half, points = orbits.n // 2, orbits.points(np.array(curve.z[-2:]))
    apart = (points[:, :half] - points[:, half:]).reshape(2, -1)
    return "period_doubling" if apart[0] @ apart[1] < 0.0 else ""


def _shrunk(orbits: PeriodicOrbits, curve: Arc) -> str:
    """The same; ``hopf`` if a limit cycle has shrunk to nothing."""
    why = halved(orbits, curve)
    turns = not why and orbits.free and len(curve.z) > 1 and orbits.turned(*curve.z[:-3:-1])
    return "hopf" if turns else why


def both_ways(
    plan: Plan,
    starts: Sequence[Start],
    ends: Callable[[Any, Arc], str] = _shrunk,
    kind: type[Branch] = Branch,
) -> list[Branch | None]:
    """The branches of orbits over one period, side by side: see :class:`Plan`."""
    if not starts:
        return []
    sides = [(number, one, side) for number, one in enumerate(starts) for side in one.sides]
    which, rows = np.array([number for number, _, _ in sides]), np.arange(len(sides))
    z = np.array([one.z for _, one, _ in sides])
    orbits = plan.make(starts[0].n, np.array([one.scale for _, one, _ in sides]))
    orbits.accepted(z, rows)
    curves, work = list[Arc](), starts[0].n * orbits.size**2

    def passed(curve: Arc) -> str:
        if plan.watch.point(work):
            curve.end = curve.end or "points"
        return ends(orbits, curve)

    try:
        follow(
            orbits,
            z,
            np.array([side for _, _, side in sides]),
            {orbits.width - 1: plan.limits},
            plan.points,
            np.array([one.first for _, one, _ in sides]),
            ends=passed,
            group=which,
            foresee=True,
            enough=functools.partial(unstable, orbits.multipliers) if plan.stable else None,
            curves=curves,
        )
    except KeyboardInterrupt:
        for number in range(len(starts) if curves else 0):
            known = [curves[row].whole() for row in np.flatnonzero(which == number)]
            branch = _joined(orbits, [way for way in known if way.z], kind, final=False)
            if branch is not None:
                plan.watch.cut[id(branch)] = branch
        raise
    for curve in curves:
        curve.end = "unstable" if curve.end == "enough" else curve.end
        shrunk = curve.end == "lost" and orbits.free and len(curve.z) > 1
        if shrunk and orbits.radius(curve.z[-1]) < SHRUNK:
            curve.end = "hopf"
    result: list[Branch | None] = []
    for number in range(len(starts)):
        mine = np.flatnonzero(which == number)
        ways = [curves[row] for row in mine]
        if any(way.end == "met" for way in ways):
            result.append(None)
            continue
        equations = orbits.near(z[mine], mine) if len(starts) > 1 else orbits
        branch = _joined(equations, [way for way in ways if way.z], kind)
        result.append(branch)
        if branch is not None:
            plan.watch.cut[id(branch)] = replace(branch)
    return result


def _joined(
    orbits: PeriodicOrbits, curves: list[Arc], kind: type[Branch], final: bool = True
) -> Branch | None:
    """One branch from the curves to both sides."""
    if not curves:
        return None
    (curve, *back), ends = both_sides(curves)
    return _of(orbits, curve.behind(back[0]) if back else curve, ends, kind, final)


def _of(
    orbits: PeriodicOrbits, curve: Arc, ends: tuple[str, str], kind: type[Branch], final: bool
) -> Branch:
    """The branch of a curve, with the derivatives at its points themselves if it is ``final``, else
    with those beside them by which it was followed.
    """
    z, tangent, derivative = (np.array(one) for one in (curve.z, curve.tangent, curve.derivative))
    length = np.array(curve.length) - curve.length[0]
    here, rows = orbits.near(z, np.zeros(len(z), np.int64)), np.arange(len(z))
    most = max(TOGETHER // orbits.size**2, 1)
    for some in np.split(rows, range(most, len(rows), most)) if final else ():
        point = correct(here, z[some], tangent[some], some, ENDING, enough=FORESEEN)
        good = some[point.found]
        z[good], derivative[good] = point.z[point.found], point.derivative[point.found]
        tangent[good] = tangents(derivative[good], tangent[good])
    multipliers = here.multipliers(z, derivative, rows)
    return kind(orbits, 0, z, tangent, derivative, length, multipliers, ends)
