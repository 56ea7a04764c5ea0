"""The branches that the steady responses over one parameter lie on.

1. Some responses that repeat are taken as seeds: at few values of the parameter first, then at
   those between.
2. From each a branch is followed by arclength in both directions, up to where its orbits lose
   stability; with its unstable part, and onto those that leave it, if that is asked for.
3. All responses on what was followed are told by Newton's method, so that they need no branch of
   their own. The next seeds are taken from the others.

Whether two responses are one therefore never rests on their amplitudes, which crossing branches
share, nor on the starts that lead to them. Motions that never repeat aren't followed: see
matching.py.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from saltus.analysis.attractors.grid import Grid
from saltus.analysis.attractors.grid_responses import GridResponses
from saltus.analysis.branches.branch import Branch
from saltus.analysis.branches.branch_table import attributes_of, values_of
from saltus.analysis.branches.equilibrium_branches import trace_equilibria
from saltus.analysis.branches.plans import LONGEST_DOUBLED, POINTS, SWITCHES, plan_of
from saltus.analysis.branches.same_branch import on_branch
from saltus.analysis.branches.seeds import equilibria_at, scaled, seeds_at
from saltus.analysis.branches.tracing import Plan, trace
from saltus.analysis.closed.motions import ClosedMotions, phase_distances
from saltus.analysis.closed.orbits import find_orbits
from saltus.analysis.closed.unforced import close_again
from saltus.analysis.inputs.outputs import Outputs
from saltus.errors import ParameterError
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import Method, exact_method
from saltus.flow.progress import stage
from saltus.results.dataset.kinds import CLOSED, Kind
from saltus.system.parametric import parametric

#: Seeds of each number of periods that are followed at a time.
TAKEN = 8
#: Most unknowns of an orbit that is followed: each point of its branch asks for their square in
#: memory, and for their cube in work.
MOST_UNKNOWNS = 400
#: Most work on the branches of responses, see :class:`saltus.analysis.branches.watch.Watch`: 470
#: points of 80 states, ten seconds to forty by the machine and the orbits.
MOST_WORK = 3e6
#: Largest distance of a response of an inexact method from its exact orbit, in units of its range.
INEXACT = 0.05


@dataclass
class Arcs:
    """Branches that responses lie on.

    Attributes
    ----------
    branches : list of Branch
        Those that were followed, in the order of their first responses.
    branch_of : int64[m]
        Branch of each response; -1 of those on none.
    unstable : bool
        Whether unstable orbits are followed too, and branches that leave others.
    refused : str
        Why none can be followed of this system over this parameter; empty if they can.
    left : int
        Responses that repeat whose branches weren't followed: they repeat after too many periods,
        or the work was done.
    """

    branches: list[Branch] = field(default_factory=list)
    branch_of: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    unstable: bool = False
    refused: str = ""
    left: int = 0


def check_unstable(unstable: bool, grid: Grid, method: Method) -> None:
    """Raise a ParameterError unless branches of these responses have unstable parts to follow."""
    if unstable and len(grid.axes) != 1:
        raise ParameterError(
            lambda say: (
                f"{say.key(unstable=True)} follows branches over one parameter; this grid has two."
            )
        )
    if unstable and len(next(iter(grid.axes.values()))) < 2:
        raise ParameterError(
            lambda say: (
                f"{say.key(unstable=True)} follows branches over a range: give two values or more."
            )
        )
    if unstable:
        exact_method(method, grid.system, "unstable=True")


def follow_arcs(
    found: GridResponses,
    grid: Grid,
    method: Method,
    arcs: Arcs,
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Follow the branches of all responses that repeat, into ``arcs``. After a KeyboardInterrupt it
    holds the finished ones.

    Parameters
    ----------
    found : GridResponses
        The responses of a grid with one axis of two values or more. Those of an inexact method are
        on the branches of the exact orbits that they stand for.
    grid, method
        As they were computed.
    arcs : Arcs
        What is asked for; what is found is added to it.
    threads, progress
        As for :func:`saltus.frequency_response`.
    """
    ((name, values),) = grid.axes.items()
    exact = method if method.exact else method.companion()
    plan = plan_of(
        grid.system,
        name,
        (float(values[0]), float(values[-1])),
        exact,
        threads,
        POINTS,
        LONGEST_DOUBLED,
        SWITCHES if arcs.unstable else (),
        stable=not arcs.unstable,
        twins=True,
        most=MOST_WORK,
    )
    arcs.branch_of = np.full(len(found), -1, np.int64)
    try:
        parametric(grid.system, (name,))
    except ParameterError as error:
        if arcs.unstable:
            raise
        arcs.refused = str(error)
        return
    orbits = _exact_orbits(found, grid, method, threads)
    try:
        _follow_equilibria(found, orbits, grid, plan, arcs)
        _follow_orbits(found, orbits, grid, plan, exact, arcs, progress)
    finally:
        _in_order(arcs)


def _follow_equilibria(
    found: GridResponses, orbits: ClosedMotions, grid: Grid, plan: Plan, arcs: Arcs
) -> None:
    """Follow the branches of equilibria, and those of limit cycles born at Hopf points if unstable
    orbits are followed.
    """
    equilibria = np.flatnonzero((found.kind == Kind.EQUILIBRIUM) & (orbits.period > 0))
    if not len(equilibria):
        return
    ((name, values),) = grid.axes.items()
    usual = np.concatenate([grid.starts, found.motions.scale[found.row[equilibria]]])
    seeds = equilibria_at(orbits.points[equilibria, 0], values[found.place[equilibria]], usual)
    born = trace_equilibria(plan, grid.system, name, seeds, arcs.branches)
    _number(found, orbits, grid, plan, equilibria, arcs, 0)
    if "hopf" in plan.switch:
        trace(plan, born, arcs.branches)


def _follow_orbits(
    found: GridResponses,
    orbits: ClosedMotions,
    grid: Grid,
    plan: Plan,
    method: Method,
    arcs: Arcs,
    progress: Callable[[float], None] | None,
) -> None:
    """Follow the branches of periodic orbits and limit cycles."""
    ((name, values),) = grid.axes.items()
    left = np.flatnonzero(
        np.isin(found.kind, CLOSED)
        & (found.kind != Kind.EQUILIBRIUM)
        & (orbits.period > 0)
        & ~orbits.neutral  # of a family no single curve leads on
    )
    # through unstable orbits few branches hold all seeds: they are followed side by side
    rank, most = found.place[left], len(left)
    if plan.stable:
        rank, most = _coarse_first(rank, grid.places), TAKEN
    left = left[np.lexsort((rank, orbits.period[left]))]
    points = np.where(np.isfinite(orbits.time[left]), 1, orbits.period[left])
    short = points * orbits.points.shape[2] <= MOST_UNKNOWNS
    left, long = left[short], left[~short]
    number, known = len(left), 0
    while len(left) and not plan.watch.over:
        first = np.flatnonzero(np.append(True, np.diff(orbits.period[left]) != 0))
        rank = np.arange(len(left)) - np.repeat(first, np.diff(np.append(first, len(left))))
        some, left = left[rank < most], left[rank >= most]
        seeds = seeds_at(
            grid.system,
            orbits.points[some],
            orbits.period[some],
            orbits.time[some],
            values[found.place[some]],
        )
        beginnings = scaled(grid.system, name, list(seeds), method)
        done = number - len(some) - len(left)
        part = stage(progress, done / number, (done + len(some)) / number)
        try:
            trace(plan, beginnings, arcs.branches, part if plan.stable else progress)
        finally:  # also with the results so far, when interrupted
            every = np.concatenate([some, left, long])
            _number(found, orbits, grid, plan, every, arcs, known)
        left, known = left[arcs.branch_of[left] < 0], len(arcs.branches)
        if progress is not None:
            progress(1.0 - len(left) / number)
    over = np.append(left, some) if plan.watch.over else left
    arcs.left = int((arcs.branch_of[np.append(over, long)] < 0).sum())


def _coarse_first(index: np.ndarray, places: int) -> np.ndarray:
    """The rank of indices int64[k] among all: every other one first, then those between, and so
    on.
    """
    result, left = np.zeros(len(index), np.int64), index.copy()
    for _ in range(int(places).bit_length()):
        result, left = 2 * result + left % 2, left // 2
    return result


def _number(
    found: GridResponses,
    orbits: ClosedMotions,
    grid: Grid,
    plan: Plan,
    some: np.ndarray,
    arcs: Arcs,
    known: int,
) -> None:
    """Assign responses int64[k] to the branches after the first ``known``. These are split into
    their stable parts if unstable orbits weren't asked for.
    """
    (values,) = grid.axes.values()
    if plan.stable:
        for number in range(known, len(arcs.branches)):
            arcs.branches[number], *others = arcs.branches[number].stable_parts()
            arcs.branches += others
    for z, n, which in _unknowns(found, orbits, values, some):
        for number, branch in enumerate(arcs.branches[known:], known):
            mine = which[arcs.branch_of[which] < 0]
            if len(mine):
                here = on_branch(z[arcs.branch_of[which] < 0], n, branch)
                arcs.branch_of[mine[here]] = number


def _unknowns(
    found: GridResponses, orbits: ClosedMotions, values: np.ndarray, some: np.ndarray
) -> Iterator[tuple[np.ndarray, int, np.ndarray]]:
    """Responses by their number of points: their unknowns float64[r, z], that number, and their
    indices, int64[r].
    """
    times, free = orbits.time[some], np.isfinite(orbits.time[some])
    points = np.where(free, 1, orbits.period[some])
    for n in np.unique(points):
        for cycles in (False, True):
            which = some[(points == n) & ((times > 0) == cycles)]
            if not len(which):
                continue
            parts = [orbits.points[which, :n].reshape(len(which), -1)]
            parts += [orbits.time[which, None]] if cycles else []
            parts += [values[found.place[which], None]]
            yield np.concatenate(parts, axis=1), int(n), which


def _in_order(arcs: Arcs) -> None:
    """Number branches in the order of their first responses; those without a response come last."""
    first = np.full(len(arcs.branches), len(arcs.branch_of))
    for response in np.flatnonzero(arcs.branch_of >= 0)[::-1]:
        first[arcs.branch_of[response]] = response
    order = np.argsort(first, kind="stable")
    rank = np.argsort(order)
    arcs.branch_of = np.where(arcs.branch_of >= 0, np.append(rank, -1)[arcs.branch_of], -1)
    arcs.branches[:] = [arcs.branches[i] for i in order]
    for branch in arcs.branches:
        if branch.parent is not None:
            branch.parent = (int(rank[branch.parent[0]]), branch.parent[1])


# -- inexact methods -------------------------------------------------------------------------------
def _exact_orbits(
    found: GridResponses, grid: Grid, method: Method, threads: int | None
) -> ClosedMotions:
    """The orbit of each response; for an inexact method the exact one near it, with period 0 where
    there is none.
    """
    orbits = found.motions.orbits.rows(found.row)
    closed = np.flatnonzero(np.isin(found.kind, CLOSED))
    if method.exact or not len(closed):
        return orbits
    map_ = Stroboscope(
        grid.system, method.companion(), grid.rows[found.place[closed]], grid.every, threads
    )
    scale, mine = found.motions.scale[found.row[closed]], orbits.rows(closed)
    if grid.every is None:
        exact = find_orbits(
            map_, mine.points[:, 0], mine.period, scale, map_.noise_of(scale), max_slow=1
        )
    else:
        exact = close_again(map_, mine.points[:, 0], mine.time, scale)
    for i, n in enumerate(mine.period.tolist()):
        if exact.period[i] != n or (
            phase_distances(mine.points[i, :n], exact.points[i, :n], scale[i]).min() > INEXACT
        ):
            exact.period[i] = 0
    orbits.put(closed, exact)
    return orbits


# -- the Dataset -----------------------------------------------------------------------------------
def arc_values(
    arcs: Arcs, grid: Grid, method: Method, outputs: Outputs
) -> tuple[dict[str, Any], dict[str, Any]]:
    """The variables and attributes of the branches, empty if there are none."""
    about: dict[str, Any] = {"branches_refused": arcs.refused} if arcs.refused else {}
    about |= {"responses_not_followed": arcs.left} if arcs.left else {}
    if not arcs.branches or not method.exact:
        return {}, about
    ((name, values),) = grid.axes.items()
    limits = float(values[0]), float(values[-1])
    return (
        values_of(grid.system, name, arcs.branches, outputs, method),
        attributes_of(name, limits, arcs.branches) | {"unstable": int(arcs.unstable)} | about,
    )
