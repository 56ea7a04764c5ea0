"""Responses of a grid continued to unstable orbits: the branches that they lie on."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from saltus.analysis.branches.branch import Branch
from saltus.analysis.branches.branch_table import attributes_of, values_of
from saltus.analysis.branches.plans import plan_of
from saltus.analysis.branches.same_branch import branch_of
from saltus.analysis.branches.seeds import scaled, seeds_at
from saltus.analysis.branches.switching import Seed
from saltus.analysis.branches.tracing import trace
from saltus.analysis.orbits.tolerances import LONGEST
from saltus.analysis.outputs import Outputs
from saltus.analysis.responses.grid import Grid
from saltus.analysis.responses.responses import GridResponses
from saltus.errors import ParameterError
from saltus.flow.methods import Method, exact_method

#: Doubled branches are followed to orbits of this number of periods, each way over this number of
#: points.
LONGEST_DOUBLED, POINTS = 2, 1000
#: Events at which the branches that leave are followed.
SWITCHES = ("period_doubling", "branch_point", "hopf")


def check_continued(unstable: bool, grid: Grid, method: Method) -> None:
    """Raise a ParameterError unless branches of these responses can be followed."""
    if unstable and len(grid.axes) != 1:
        raise ParameterError(
            "unstable=True follows branches over one parameter; this grid has two."
        )
    if unstable and len(next(iter(grid.axes.values()))) < 2:
        raise ParameterError(
            "unstable=True follows branches over a range: give two values or more."
        )
    if unstable:
        exact_method(method, "unstable=True")


def seeds_of_grid(found: GridResponses, grid: Grid, method: Method) -> list[Seed]:
    """The periodic responses of a grid of one parameter as seeds of branches, in their order."""
    ((name, values),) = grid.axes.items()
    points = np.full((len(found), LONGEST, len(grid.system.states)), np.nan)
    for i in range(len(found)):
        own = found.points(i)[:LONGEST]
        points[i, : len(own)] = own
    seeds = seeds_at(grid.system, points, found.period, found.time, values[found.place])
    return scaled(grid.system, name, list(seeds), method)


def continued(
    found: GridResponses,
    grid: Grid,
    method: Method,
    outputs: Outputs,
    threads: int | None,
    progress: Callable[[float], None] | None,
) -> tuple[dict[str, Any], dict[str, Any], np.ndarray]:
    """The variables and attributes of the branches, and the branch of each response, int64[m]; -1
    of what doesn't repeat.
    """
    ((name, values),) = grid.axes.items()
    system, limits = grid.system, (float(values[0]), float(values[-1]))
    plan = plan_of(system, name, limits, method, threads, POINTS, LONGEST_DOUBLED, SWITCHES)
    branches = list[Branch]()
    trace(plan, seeds_of_grid(found, grid, method), branches, progress)
    of = np.full(len(found), -1, np.int64)
    for i in np.flatnonzero(found.period > 0):
        free = system.forced_at is None
        if free and not found.time[i] > 0:
            continue
        points = found.points(int(i))[: 1 if free else int(found.period[i])]
        own = [found.time[i]] if free else []
        z = np.concatenate([points.ravel(), own, [values[found.place[i]]]])
        of[i] = branch_of(z, len(points), branches)
    table = values_of(system, name, branches, outputs, method)
    return table, attributes_of(name, limits, branches), of
