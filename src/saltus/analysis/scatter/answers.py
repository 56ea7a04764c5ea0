"""Answers for each set of values: its responses, or numbers that a user's function computes.

Each answer is a pure function of the sets' values: how they are divided changes no bit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.attractors.grid import Grid
from saltus.analysis.attractors.grid_responses import GridResponses, find
from saltus.analysis.inputs.outputs import Outputs
from saltus.analysis.scatter.sets import Design
from saltus.analysis.scatter.tracked import SCATTERED, TrackedResponse, tell_apart
from saltus.analysis.solve.tolerances import SAME
from saltus.errors import ParameterError, shown
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import Method
from saltus.flow.progress import stage
from saltus.interrupt import check_stop
from saltus.results.dataset.kinds import Kind

#: Sets that a user's function gets at a time: what Ctrl-C loses at most.
CHUNK = 1024
#: Numbers of each output of a response.
NUMBERS = ("peak", "maximum", "minimum", "rms")

#: A function of the system and of the values of some sets, float64[m] each.
Ask = Callable[..., Mapping[str, Any]]


@dataclass
class Answers:
    """Responses and numbers of m sets from s starts.

    Attributes
    ----------
    names, units : list of str
        Of the K numbers.
    numbers : float64[m, s, K]
        NaN where there is none.
    reached : int64[m, s]
        Response of each start, or a code of Kind.
    responses : list of TrackedResponse
    complete : bool
        False after Ctrl-C.
    """

    names: list[str]
    units: list[str]
    numbers: np.ndarray
    reached: np.ndarray
    responses: list[TrackedResponse] = field(default_factory=list)
    complete: bool = True


@dataclass(frozen=True)
class SetGrid(Grid):
    """Sets of values as the places of a grid.

    Attributes
    ----------
    values : float64[m, P]
        Of all parameters, a row for each set.
    """

    values: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of sets."""
        return (len(self.values),)

    @property
    def rows(self) -> np.ndarray:
        """Parameter values of each set, float64[m, P]."""
        return self.values


def steady(
    grid: SetGrid,
    method: Method,
    periods: int,
    outputs: Outputs,
    threads: int | None,
    progress: Callable[[float], None] | None,
) -> Answers:
    """The response that each start reaches in each set, and the numbers of its outputs.

    After Ctrl-C the responses of the sets that were finished, told apart by kind alone.
    """
    found = find(grid, method, periods, threads, stage(progress, 0.0, 0.8), outputs)
    return told(found, grid, method, outputs, threads, stage(progress, 0.8, 1.0))


def told(
    found: GridResponses,
    grid: SetGrid,
    method: Method,
    outputs: Outputs,
    threads: int | None,
    progress: Callable[[float], None] | None,
) -> Answers:
    """The answers of sets in which all starts have settled; if some haven't, responses are told
    apart by kind alone.
    """
    count = len(grid.starts)
    names = [f"{name} {number}" for name in outputs.names for number in NUMBERS]
    units = [unit for unit in outputs.units for _ in NUMBERS]
    numbers = np.full((grid.places, count, len(names)), np.nan)
    if len(found):
        known = found.numbers.by_name()
        of_each = np.stack([known[name] for name in NUMBERS], axis=-1)
        there = found.response_of >= 0
        numbers[there] = of_each.reshape(len(found), -1)[found.response_of[there]]
    exact = method if method.exact else method.companion()
    map_ = Stroboscope(grid.system, exact, grid.rows, grid.every, threads)
    motions, complete = found.motions, found.complete
    apart = SAME if method.exact else SCATTERED
    reached, responses = motions.kind.reshape(grid.places, count), list[TrackedResponse]()
    if complete:
        try:
            responses, reached = tell_apart(map_, found, count, apart, progress)
        except KeyboardInterrupt:
            complete = False
    if not complete:  # what each start reaches is known by its numbers, not by its response
        reached = np.where(reached >= 0, Kind.UNCONVERGED, reached)
    return Answers(names, units, numbers, reached, responses, complete)


def asked(
    design: Design, values: np.ndarray, ask: Ask, progress: Callable[[float], None] | None
) -> Answers:
    """The numbers that a user's function gives for sets float64[m, d], some sets at a time; after
    Ctrl-C those of the sets that were finished.
    """
    found = Answers([], [], np.full((len(values), 1, 0), np.nan), np.full((len(values), 1), 0))
    found.reached[:] = Kind.NOT_COMPUTED
    try:
        for first in range(0, len(values), CHUNK):
            check_stop()
            rows = slice(first, min(first + CHUNK, len(values)))
            names, units, numbers = _checked(design, values[rows], ask)
            if not first:
                wide = np.full((len(values), 1, len(names)), np.nan)
                found = replace(found, names=names, units=units, numbers=wide)
            elif names != found.names:
                raise ParameterError(
                    f"ask gives {', '.join(names)} for some sets and {', '.join(found.names)} for "
                    "others. It must give the same names always."
                )
            found.numbers[rows, 0], found.reached[rows] = numbers, 0
            if progress:
                progress(rows.stop / len(values))
    except KeyboardInterrupt:
        found.complete = False
    return found


def _checked(
    design: Design, values: np.ndarray, ask: Ask
) -> tuple[list[str], list[str], np.ndarray]:
    """Names, units and numbers float64[m, K] of one call of a user's function."""
    count = len(values)
    columns = {name: one.copy() for name, one in zip(design.uncertain, values.T, strict=True)}
    given = ask(design.system, columns)
    if not isinstance(given, Mapping) or not given or not all(isinstance(n, str) for n in given):
        raise ParameterError(
            'ask must give numbers by name, such as {"peak": array}, not '
            f"{shown(type(given).__name__)}."
        )
    units, numbers = [], []
    for name, one in given.items():
        units.append(str(one.attrs.get("units", "")) if isinstance(one, xr.DataArray) else "")
        array = np.asarray(one)
        if array.dtype.kind not in "fiub" or array.shape != (count,):
            what = f"shape {array.shape}" if array.dtype.kind in "fiub" else "no numbers"
            raise ParameterError(
                f"ask gives {what} as {shown(name)}. It gets an array of {count} values of each "
                f"uncertain parameter, and must give one number for each of these sets."
            )
        numbers.append(array.astype(float))
    return list(given), units, np.stack(numbers, axis=1)
