"""Seeds of branches from starts that are run at some values of the parameter, within a budget."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from saltus.analysis.attractors.grid import Grid
from saltus.analysis.attractors.grid_responses import GridResponses, find
from saltus.analysis.branches.seeds import scaled, seeds_at
from saltus.analysis.branches.switching import Seed
from saltus.flow.methods import Method
from saltus.flow.progress import stage

#: Most work on starts, in periods times squares of the states. A period of 20 states and a rigid
#: stop takes 6e-5 s, one of 80 states 1e-3 s: some five minutes.
SEEDING_WORK = 2e9
#: Values that are run together where the budget may not last for all.
TOGETHER = 4


def seeds_in(
    grid: Grid,
    method: Method,
    periods: int,
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> tuple[list[Seed], int]:
    """Seeds from the attractors that starts lead to over a grid of one axis, and the number of its
    values that weren't run since SEEDING_WORK was done.
    """
    seeds, spent, done = list[Seed](), 0.0, 0
    for part in _parts(grid, periods):
        if spent >= SEEDING_WORK:
            break
        share = stage(progress, done / grid.places, (done + len(part)) / grid.places)
        found = find(grid, method, periods, threads, share, places=None if grid.sweeps else part)
        if not found.complete:
            raise KeyboardInterrupt
        seeds += _seeds_of(found, grid, method)
        spent, done = spent + _work(found, periods), done + len(part)
    return seeds, grid.places - done


def _parts(grid: Grid, periods: int) -> list[np.ndarray]:
    """Values int64[..] that are run together, one part after the other: all where the budget lasts,
    else few, spread over the range, then those between them.
    """
    every, states = np.arange(grid.places), grid.starts.shape[1]
    worst = grid.most_spent(periods) * states**2
    if worst <= SEEDING_WORK or grid.sweeps:
        return [every]
    count = -(-grid.places // TOGETHER)
    return sorted(
        (every[k::count] for k in range(count)), key=lambda one: abs(2 * int(one[0]) + 1 - count)
    )


def _work(found: GridResponses, periods: int) -> float:
    """Work on the starts that were run."""
    spent, states = found.motions.spent(periods), found.motions.end.shape[1]
    return float(spent.sum()) * float(states**2)


def _seeds_of(found: GridResponses, grid: Grid, method: Method) -> list[Seed]:
    """Seeds at the responses that lie on a single branch."""
    ((name, values),) = grid.axes.items()
    orbits = found.motions.orbits.rows(found.row)
    isolated = np.where(orbits.neutral, 0, orbits.period)
    seeds = seeds_at(grid.system, orbits.points, isolated, orbits.time, values[found.place])
    return scaled(grid.system, name, list(seeds), method)
