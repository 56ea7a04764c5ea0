"""A grid of parameter values, and starts that are followed at each: what frequency responses and
bifurcation diagrams run over.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from saltus.analysis.attractors.find_responses import most_spent
from saltus.analysis.closed.turns import ASKED, looks_every
from saltus.analysis.inputs.axes import along, count_along
from saltus.analysis.inputs.random_starts import random_count, random_starts
from saltus.analysis.inputs.starts import at_values, check_system, ensemble, single, trajectories
from saltus.analysis.solve.tolerances import LONGEST
from saltus.errors import ParameterError, unknown
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import Method
from saltus.flow.room import check_room
from saltus.sentences import Word
from saltus.system import System
from saltus.units import from_si

#: Directions of a sweep by what users write.
SWEEPS = {"sweep_up": "up", "sweep_down": "down"}


#: Memory of what is known of one response, for each state [bytes]: the points of its orbit, twice.
RESPONSE = 16.0 * LONGEST


@dataclass(frozen=True)
class Grid:
    """Parameter values and starts.

    Attributes
    ----------
    system : System
        Equations, and the values of the parameters that stay.
    axes : mapping of str to float64[n]
        One or two parameters and their values [SI], ascending.
    starts : float64[s, D]
        States at the start [SI], the same at every value; of a sweep the first one.
    sweeps : tuple of str
        ``"up"`` or ``"down"`` where the end at one value is the start at the next; empty otherwise.
    drawn : bool
        Whether the starts are random: then shares of them are shares of their box.
    every : float or None
        Time between two samples [s] at a system without forcing.
    """

    system: System
    axes: Mapping[str, np.ndarray]
    starts: np.ndarray
    sweeps: tuple[str, ...] = ()
    drawn: bool = False
    every: float | None = None

    @property
    def shape(self) -> tuple[int, ...]:
        """Values along each axis."""
        return tuple(len(values) for values in self.axes.values())

    def most_spent(self, most: int) -> int:
        """Iterates that all starts at all values may cost, each followed for ``most`` at most."""
        return most_spent(most) * len(self.starts) * self.places

    @property
    def places(self) -> int:
        """Points of the grid of parameters."""
        return int(np.prod(self.shape))

    @property
    def rows(self) -> np.ndarray:
        """Parameter values at every point of the grid, float64[places, P]."""
        names = list(self.system.values)
        rows = np.tile(np.array(list(self.system.values.values())), (self.places, 1))
        for name, column in zip(
            self.axes, np.meshgrid(*self.axes.values(), indexing="ij"), strict=True
        ):
            rows[:, names.index(name)] = column.ravel()
        return rows

    def map(self, method: Method, threads: int | None = None) -> Stroboscope:
        """A map for every point of the grid."""
        return Stroboscope(self.system, method, self.rows, self.every, threads)


def grid_of(
    system: System,
    axes: Mapping[str, Any],
    start: Any,
    box: Any,
    values: Any,
    seed: int,
    follow: bool | None,
    every: Any = None,
) -> Grid:
    """A grid from what users write, checked.

    Parameters
    ----------
    system : System
        Its values, but for those in ``values``, are those of the parameters that don't vary.
    axes : mapping
        For each parameter a range (first, last, count) or (first, last, count, "log"), or a list or
        array of values.
    start : sequence, mapping, array or str
        As for :func:`saltus.simulate`; ``"random 20"``; ``"sweep_up"`` or ``"sweep_down"``.
    box : mapping or None
        Range of each state, for random starts.
    values : mapping or None
        Values of other parameters.
    seed : int
        Of random starts.
    follow : bool or None
        Whether each start is followed from value to value, upwards.
    every : float, str or None
        Time between two samples [s] at a system without forcing; None for about a turn of its
        motions.

    Raises
    ------
    ParameterError, UnitError
        If a name is unknown, a range is empty, or the grid too large.
    """
    check_system(system)
    system = at_values(system, values)
    if len(axes) not in (1, 2):
        raise ParameterError(f"one or two parameters may vary, not {len(axes)}.")
    check_grid(system, math.prod(count_along(given) for given in axes.values()), start)
    points = {name: axis(system, name, given) for name, given in axes.items()}
    starts, sweeps, drawn = _starts(system, start, box, seed)
    if follow:
        sweeps = sweeps or ("up",) * len(starts)
    if sweeps and len(points) > 1:
        raise ParameterError(
            lambda say: (
                "a sweep follows one parameter; this grid has two. Leave "
                f"{say.key('follow')} and sweeps out."
            )
        )
    grid = Grid(system, points, starts, sweeps, drawn)
    corners = {name: np.array([column.min(), column.max()]) for name, column in points.items()}
    # ranges and periodicity of the forcing are checked there
    ensemble(system, np.zeros(len(system.states)), corners)
    some = np.unique(np.linspace(0, grid.places - 1, ASKED).astype(int))
    begin = starts[np.arange(len(some)) % len(starts)]
    return replace(grid, every=looks_every(system, every, begin, grid.rows[some]))


def check_grid(system: System, places: int, start: Any) -> None:
    """Raise ParameterError if responses from these starts at so many values of parameters don't fit
    into memory.
    """
    starts = max(random_count(start), 1) if isinstance(start, str) else trajectories(start, None)
    check_room(
        places * (starts * (400.0 + RESPONSE * len(system.states)) + 16.0 * len(system.values)),
        f"{places} values with {starts} starts each",
        "Take a coarser grid or fewer starts.",
    )


def axis(system: System, name: str, given: Any) -> np.ndarray:
    """Values along one parameter [SI], ascending, from (first, last, count[, scale]) or a list or
    array of values.
    """
    if name not in system.values:
        raise unknown(f"{system.name} has no parameter", name, system.values)
    example = {name: (_text(system, name, 0.5), _text(system, name, 2.0), 200)}
    values = along(name, given, lambda value: single(system, name, value), "values", example)
    if not len(values) or not np.isfinite(values).all() or not (np.diff(values) > 0).all():
        raise ParameterError(
            lambda say: (
                f"the values of {name} must ascend and be finite, such as {say.key(**example)}."
            )
        )
    return values


def _text(system: System, name: str, factor: float) -> str:
    """A multiple of a parameter's value as it is written in Python; of 1 where the
    value is zero.
    """
    value = factor * (system.values[name] or 1.0)
    return (
        from_si(value, system.units[name])
        if system.units[name] not in ("", "1")
        else Word(f"{value:g}")
    )


def _starts(
    system: System, start: Any, box: Any, seed: int
) -> tuple[np.ndarray, tuple[str, ...], bool]:
    """Starts, the directions of their sweeps, and whether they are random."""
    if isinstance(start, str) and start in SWEEPS:
        return np.zeros((1, len(system.states))), (SWEEPS[start],), False
    if isinstance(start, str):
        return random_starts(system, start, box, seed, tuple(SWEEPS)), (), True
    if box is not None:
        raise ParameterError(
            lambda say: f"{say.key('box')} is for random starts: {say.key(start='random 20')}."
        )
    return ensemble(system, start, None).start, (), False
