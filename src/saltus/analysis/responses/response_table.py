"""The Dataset of a grid's responses, shared by `frequency_response` and `bifurcation_diagram`."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.attractors.grid import Grid
from saltus.analysis.attractors.grid_responses import GridResponses, find, table_of
from saltus.analysis.dataset_parts import guards_over, provenance, subject
from saltus.analysis.inputs.outputs import Outputs, outputs_of
from saltus.analysis.responses.arcs import Arcs, arc_values, check_unstable, follow_arcs
from saltus.analysis.responses.matching import matched
from saltus.analysis.responses.samples import sampled
from saltus.flow.counts import whole
from saltus.flow.methods import Method, check_method
from saltus.flow.progress import reporting, stage
from saltus.interrupt import Interrupted
from saltus.results import build
from saltus.results.dataset import schema
from saltus.results.dataset.attractors import padded
from saltus.results.dataset.responses import SAMPLES, grid_values, response_values

#: States from which on most of the time goes into branches.
MANY = 16


@dataclass(frozen=True)
class ResponsePlan:
    """Responses to be computed.

    Attributes
    ----------
    grid : Grid
        Values of parameters, and starts.
    method : Method
        The method of integration.
    periods : int
        Forcing periods that a trajectory is followed at most.
    sample : str
        What is kept of each response; empty for nothing.
    outputs : Outputs
        What is read off each.
    unstable : bool
        Whether unstable parts of branches are followed.
    """

    grid: Grid
    method: Method
    periods: int
    sample: str
    outputs: Outputs
    unstable: bool

    @property
    def settling(self) -> float:
        """Share of the progress at which all starts have settled."""
        many = len(self.grid.system.states) >= MANY
        return 0.3 if many else 0.4 if self.unstable else 0.8


def response_plan(
    grid: Grid,
    method: Method | None,
    periods: int,
    sample: str = "",
    outputs: Mapping[str, Any] | None = None,
    unstable: bool = False,
) -> ResponsePlan:
    """A checked plan. Raises ParameterError or UnitError if an argument can't be used."""
    method, periods = check_method(method, grid.system), whole(periods, "periods")
    check_unstable(unstable, grid, method)
    asked = outputs_of(grid.system, outputs)
    return ResponsePlan(
        grid, method, periods, sample if len(grid.axes) == 1 else "", asked, unstable
    )


def respond(
    plan: ResponsePlan, threads: int | None, progress: bool | Callable[[float], None] | None
) -> xr.Dataset:
    """The Dataset of a grid's responses, with the branches that they lie on if it has one axis.
    Raises Interrupted, with the Dataset of what is known, on Ctrl-C.
    """
    with reporting(progress) as show:
        settling = stage(show, 0.0, plan.settling)
        found = find(plan.grid, plan.method, plan.periods, threads, settling, plan.outputs)
        return finished(found, plan, threads, show)


def finished(
    found: GridResponses,
    plan: ResponsePlan,
    threads: int | None,
    show: Callable[[float], None] | None,
) -> xr.Dataset:
    """The Dataset of responses that were found: their branches are followed first."""
    arcs, grid = Arcs(unstable=plan.unstable), plan.grid
    part = functools.partial(_dataset, plan, threads, arcs)
    if not found.complete:
        raise Interrupted(lambda: part(found))
    try:
        if len(grid.axes) == 1 and grid.places > 1:
            rest = stage(show, plan.settling, 0.95)
            follow_arcs(found, grid, plan.method, arcs, threads, rest)
        return part(found)
    except KeyboardInterrupt:
        found.complete = False  # the responses are known, not all of their branches
        raise Interrupted(lambda: part(found)) from None


def _dataset(
    plan: ResponsePlan, threads: int | None, arcs: Arcs, found: GridResponses
) -> xr.Dataset:
    grid, method, sample, outputs = plan.grid, plan.method, plan.sample, plan.outputs
    numbers = found.numbers
    table = table_of(found, numbers, grid, method)
    on, branch = np.full(len(found), -1, np.int64), np.full(len(found), -1, np.int64)
    on[: len(arcs.branch_of)] = arcs.branch_of
    if len(grid.axes) == 1 and (found.complete or len(arcs.branch_of)):
        branch = matched(found, on, grid.places, len(arcs.branches))
    followed, about_branches = arc_values(arcs, grid, method, outputs)
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
        **grid_values(found.response_of.reshape(*grid.shape, len(grid.starts)), table),
        **response_values(table, branch, at, size),
        "output": list(outputs.names),
        "output_units": list(outputs.units),
        **{f"output_{name}": column for name, column in numbers.by_name().items()},
        **(
            {
                "sample_<state>": padded(
                    sampled(sample, numbers, grid, method, found, outputs, threads),
                    size + len(system.outputs),
                )
            }
            if sample
            else {}
        ),
        **followed,
    }
    output = outputs.units[0] if len(set(outputs.units)) == 1 else ""
    words = {"<when>": table.points_when, "<output>": output, "<sampled>": SAMPLES.get(sample, "")}
    watched = found.watched(grid, method, plan.periods)
    attrs = provenance(system, method, fixed, grid.axes) | {
        "periods": plan.periods,
        "random_starts": int(grid.drawn),
        **({"periods_watched": watched} if watched < plan.periods else {}),
        **about_branches,
    }
    about = subject(
        system,
        attrs | ({"sample": sample} if sample else {}),
        guards_over(system, fixed | varied, grid.shape) if system.guards else None,
    )
    return build(schema.RESPONSES, about, values, grid=tuple(grid.axes), words=words)
