"""From a grid to the Dataset of its responses: what `frequency_response` and `bifurcation_diagram`
share.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.dataset_parts import guards_over, provenance, subject
from saltus.analysis.outputs import Outputs, outputs_of
from saltus.analysis.responses import branches
from saltus.analysis.responses.bifurcations import Event
from saltus.analysis.responses.continued import check_continued, continued
from saltus.analysis.responses.followed import Followed
from saltus.analysis.responses.grid import Grid
from saltus.analysis.responses.responses import GridResponses, find, numbers_of, table_of
from saltus.analysis.responses.samples import sampled
from saltus.flow.counts import whole
from saltus.flow.methods import Method, check_method
from saltus.flow.progress import reporting, stage
from saltus.interrupt import Interrupted
from saltus.results import build
from saltus.results.dataset import schema
from saltus.results.dataset.attractors import padded
from saltus.results.dataset.responses import SAMPLES, grid_values, response_values


def respond(
    grid: Grid,
    method: Method | None,
    periods: int,
    threads: int | None,
    progress: bool | Callable[[float], None] | None,
    sample: str = "",
    outputs: Mapping[str, Any] | None = None,
    unstable: bool = False,
) -> xr.Dataset:
    """The Dataset of a grid's responses, with the branches that they lie on if ``unstable``. Raises
    Interrupted, with the Dataset of what is known, on Ctrl-C.
    """
    method, periods = check_method(method), whole(periods, "periods")
    check_continued(unstable, grid, method)
    wanted = outputs_of(grid.system, outputs)
    part = functools.partial(_dataset, grid, method, periods)
    with reporting(progress) as show:
        found = find(grid, method, periods, threads, stage(show, 0.0, 0.4) if unstable else show)
        if not found.complete:
            raise Interrupted(lambda: part(found, threads, sample, wanted))
        try:
            if not unstable:
                return part(found, threads, sample, wanted)
            more = continued(found, grid, method, wanted, threads, stage(show, 0.4, 0.95))
            return part(found, threads, sample, wanted, more)
        except KeyboardInterrupt:
            found.complete = False  # the responses are known, their branches aren't
            raise Interrupted(lambda: part(found, threads, sample, wanted)) from None


def _dataset(
    grid: Grid,
    method: Method,
    periods: int,
    found: GridResponses,
    threads: int | None,
    sample: str,
    outputs: Outputs,
    more: tuple[dict[str, Any], dict[str, Any], np.ndarray] | None = None,
) -> xr.Dataset:
    numbers = numbers_of(found, outputs, grid, method, threads)
    table = table_of(found, numbers, grid, method)
    branch, happened = np.full(len(found), -1, np.int64), []
    if more is not None:
        branch = more[2]
    elif len(grid.axes) == 1 and found.complete:  # after Ctrl-C nothing more is computed
        followed = Followed(found, grid, method, threads)
        branch = branches.follow(found, followed, grid.places)
        happened = branches.events(found, table, branch, followed, grid, method.exact)
    system, size = grid.system, len(grid.system.states)
    fixed = {key: value for key, value in system.values.items() if key not in grid.axes}
    varied = dict(zip(grid.axes, np.meshgrid(*grid.axes.values(), indexing="ij"), strict=True))
    place = np.unravel_index(found.place, grid.shape)
    at = {
        name: values[index] for (name, values), index in zip(grid.axes.items(), place, strict=True)
    }
    values = {
        "<parameter>": grid.axes,
        "start": np.arange(len(grid.starts)),
        **({"start_direction": list(grid.sweeps)} if grid.sweeps else {}),
        "start_<state>": grid.starts,
        **grid_values(found.of.reshape(*grid.shape, len(grid.starts)), table),
        **response_values(table, branch, at, size),
        "output": list(outputs.names),
        "output_units": list(outputs.units),
        **{f"output_{name}": column for name, column in numbers.by_name().items()},
        **(
            {"sample_<state>": padded(sampled(sample, numbers, grid, method, found, threads), size)}
            if sample
            else {}
        ),
        # netCDF-3 has room for one empty dim only
        **(_events(happened, grid) if len(table) and more is None else {}),
        **(more[0] if more is not None else {}),
    }
    output = outputs.units[0] if len(set(outputs.units)) == 1 else ""
    words = {"<when>": table.points_when, "<output>": output, "<sampled>": SAMPLES.get(sample, "")}
    attrs = provenance(system, method, fixed, grid.axes) | {
        "periods": periods,
        "random_starts": int(grid.drawn),
        **(more[1] if more is not None else {}),
    }
    about = subject(
        system,
        attrs | ({"sample": sample} if sample else {}),
        guards_over(system, fixed | varied, grid.shape) if system.guards else None,
    )
    return build(schema.RESPONSES, about, values, grid=tuple(grid.axes), words=words)


def _events(happened: list[Event], grid: Grid) -> dict[str, Any]:
    """What happens to the branches between neighbouring values."""
    return {
        "event": np.arange(len(happened)),
        "event_kind": [event.kind for event in happened],
        "event_branch": np.array([event.branch for event in happened], np.int64),
        "event_<parameter>": {
            name: np.array([event.value for event in happened], float) for name in grid.axes
        },
    }
