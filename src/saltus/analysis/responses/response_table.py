"""From a grid to the Dataset of its responses: what `frequency_response` and `bifurcation_diagram` share."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.dataset_parts import gap_unit, guards_over, provenance
from saltus.analysis.outputs import Outputs, outputs_of
from saltus.analysis.responses import branches
from saltus.analysis.responses.followed import Followed
from saltus.analysis.responses.grid import Grid
from saltus.analysis.responses.responses import Found, find, numbers_of, table_of
from saltus.analysis.responses.samples import sampled
from saltus.flow.counts import whole
from saltus.flow.methods import Method, check_method
from saltus.flow.progress import reporting
from saltus.interrupt import Interrupted
from saltus.results import Events, OutputNumbers, Responses, Starts, responses_dataset


def respond(
    grid: Grid,
    method: Method | None,
    periods: int,
    threads: int | None,
    progress: bool | Callable[[float], None] | None,
    sample: str = "",
    outputs: Mapping[str, Any] | None = None,
) -> xr.Dataset:
    """The Dataset of a grid's responses. Raises Interrupted, with the Dataset of what is known, on Ctrl-C."""
    method, periods = check_method(method), whole(periods, "periods")
    wanted = outputs_of(grid.system, outputs)
    with reporting(progress) as show:
        found = find(grid, method, periods, threads, show)
    if not found.complete:
        raise Interrupted(lambda: _dataset(grid, method, periods, found, threads, sample, wanted))
    return _dataset(grid, method, periods, found, threads, sample, wanted)


def _dataset(grid: Grid, method: Method, periods: int, found: Found, threads: int | None, sample: str, outputs: Outputs) -> xr.Dataset:
    numbers = numbers_of(found, outputs, grid, method, threads)
    table = table_of(found, numbers, grid, method)
    branch, happened = np.full(len(found), -1, np.int64), []
    if len(grid.axes) == 1 and found.complete:  # after Ctrl-C nothing more is computed
        followed = Followed(found, grid, method, threads)
        branch = branches.follow(found, followed, grid.places)
        happened = branches.events(found, table, branch, followed, grid, method.exact)
    (name, *_) = grid.axes
    system = grid.system
    fixed = {key: value for key, value in system.values.items() if key not in grid.axes}
    varied = dict(zip(grid.axes, np.meshgrid(*grid.axes.values(), indexing="ij"), strict=True))
    return responses_dataset(
        states=system.states,
        units=system.units,
        axes=grid.axes,
        starts=Starts({key: grid.starts[:, i] for i, key in enumerate(system.states)}, grid.sweeps),
        response_of=found.of.reshape(*grid.shape, len(grid.starts)),
        responses=Responses(
            table, np.stack(np.unravel_index(found.place, grid.shape), axis=1), branch,
            sampled(sample, numbers, grid, method, found, threads) if sample else None,
            OutputNumbers(outputs.names, outputs.units, numbers.by_name()),
        ),
        events=Events(
            {name: np.array([event.value for event in happened])}, [event.kind for event in happened],
            np.array([event.branch for event in happened], np.int64),
        ) if len(grid.axes) == 1 else None,
        guards=guards_over(system, fixed | varied, grid.shape),
        sample=sample,
        gap_unit=gap_unit(system),
        attrs=provenance(system, method, fixed, grid.axes) | {"periods": periods, "random_starts": int(grid.drawn)},
    )  # fmt: skip
