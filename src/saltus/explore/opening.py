"""The first view of the explorer: ranges of sliders, the box of the map, a start; those of a study
where it gives them, else guesses from the system.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from saltus.analysis.closed.field_zeros import autonomous, jacobian_of
from saltus.analysis.dataset_parts import guards_over
from saltus.analysis.inputs.starts import ensemble
from saltus.analysis.motion.motion_arrays import motion_arrays
from saltus.errors import SaltusError
from saltus.explore.motion import REACHED, bounded
from saltus.flow.methods import Method, default_method
from saltus.system import System
from saltus.system.structures.told import by_modes

#: Periods of the motion from rest, and its samples in each, by which the box of the map is guessed.
LOOKED, SAMPLES = 60, 32
#: Times the largest motion and gap that this box reaches.
WIDER = 5.0
#: Times the widest gap beyond which a motion has left the picture.
FARTHEST = 1e3
#: Rates of a structure below this share of the fastest are those of rigid bodies.
RIGID = 1e-6
#: Starts along each axis of the first map.
SIZE = (160, 160)
#: Steps of a slider between its ends.
STEPS = 400


@dataclass(frozen=True)
class Opening:
    """The first view.

    Attributes
    ----------
    system : System
        Equations and values.
    method : Method
        How to integrate.
    axes : mapping of str to (float, float)
        The two states of the map and their ranges [SI].
    at : mapping of str to float
        Starts of the other states [SI].
    size : (int, int)
        Starts along the axes.
    ranges : mapping of str to (float, float)
        Range of the slider of each parameter [SI].
    turn : float
        Forcing period; without forcing about a turn of the motions [s].
    start : mapping of str to float or None
        A start to show.
    responses : mapping or None
        ``parameter``, ``range`` and ``quantity`` of the responses.
    view : mapping
        What a study asks for first, in the fields of questions.
    results : mapping of str to Dataset
        Results of a finished study, by the stems of their files.
    system_table : mapping
        The table [system] of a study.
    box : mapping of str to (float, float)
        A range of each state and output that holds the motion from rest [SI].
    file : str
        The file of a user's own system, and its name there: ``my_rig.py:rig``.
    """

    system: System
    method: Method
    axes: Mapping[str, tuple[float, float]]
    at: Mapping[str, float] = field(default_factory=dict)
    size: tuple[int, int] = SIZE
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    turn: float = 1.0
    start: Mapping[str, float] | None = None
    responses: Mapping[str, Any] | None = None
    view: Mapping[str, Any] = field(default_factory=dict)
    results: Mapping[str, Any] = field(default_factory=dict)
    system_table: Mapping[str, Any] = field(default_factory=dict)
    box: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    file: str = ""


def opening_of(system: System, method: Method | None = None, **known: Any) -> Opening:
    """The first view of a system; ``known`` are attributes of :class:`Opening` that a study
    gives.
    """
    method = method or default_method(system)
    box, turn = _box(system, method)
    first = {name: box[name] for name in _plane(system)}
    guess = Opening(system, method, first, ranges=sliders(system), turn=turn, box=box)
    given = {name: one for name, one in known.items() if one is not None}
    ranges = {**guess.ranges, **given.pop("ranges", {})}
    found = replace(guess, ranges=ranges, **given)
    return found if found.responses else replace(found, responses=_responses(found))


def sliders(system: System) -> dict[str, tuple[float, float]]:
    """A decade about the value of each parameter, ends of two digits; symmetric about zero for
    values that aren't positive, of zero as wide as for the largest value of its unit [SI].
    """
    found = {}
    for name, value in system.values.items():
        like = [abs(system.values[one]) for one, unit in system.units.items()
                if one in system.values and unit == system.units[name] and unit != "1"]  # fmt: skip
        size = abs(value) or max(like, default=0.0) or 1.0
        low, high = (float(f"{size * by:.1e}") for by in (10**-0.5, 10**0.5))
        found[name] = (low, high) if value > 0 else (-high, high)
    return found


def choices(system: System) -> list[str]:
    """Names that the axes of a map may have: states, and of a structure by its modes first the
    sensors of deflections and velocities, by which a start can be given.
    """
    found = []
    for name in system.outputs.names if by_modes(system) else ():
        with suppress(SaltusError):
            ensemble(system, {name: 1.0}, None)
            found.append(name)
    return [*found, *system.states]


def bounded_states(system: System) -> list[str]:
    """States that meet a boundary, as they stand in the equations."""
    met = {guard.state for guard in system.guards}
    return [name for name in system.states if name in met]


def _plane(system: System) -> tuple[str, str]:
    """The two axes of the first map: a state and its rate where there is one, if it can be a state
    that meets a boundary; of a structure by its modes what a sensor of a deflection and one of a
    velocity show.
    """
    if by_modes(system):
        units = dict(zip(system.outputs.names, system.outputs.units, strict=True))
        shown = {units.get(name): name for name in reversed(choices(system))}
        if "m" in shown and "m/s" in shown:
            return shown["m"], shown["m/s"]
    rate_of = {
        system.states[j]: str(rate.payload)
        for j, rate in reversed(list(enumerate(system.field)))
        if rate.op == "state" and rate.payload != system.states[j]
    }
    if (bound := next((one for one in bounded_states(system) if one in rate_of), None)) is not None:
        return bound, rate_of[bound]
    for name in system.states:
        for place, rate in rate_of.items():
            if rate == name:
                return place, name
    return system.states[0], system.states[1 % len(system.states)]


def _box(system: System, method: Method) -> tuple[dict[str, tuple[float, float]], float]:
    """A range of each state about zero that holds the motion from rest and the gaps, and ends at
    rigid stops; and the time of a turn [s].
    """
    names = (*system.states, *system.outputs.names)
    reach = np.zeros(len(names))
    about = guards_over(system, system.values, ())
    for name, place in zip(about.states, np.ravel(about.boundaries), strict=True):
        if name and np.isfinite(place):
            i = names.index(name)
            reach[i] = max(reach[i], abs(place))
    forced, start = system.forced_at is not None, np.zeros(len(system.states))
    if forced:
        turn = float(np.ravel(system.period(system.values))[0])
    else:
        if autonomous(system):  # else the drive moves it from rest
            start = np.where(reach > 0, reach, 0.5)[: len(start)]
        turn = _turn(system, start)
    length = {"periods": LOOKED} if forced else {"t_end": LOOKED * turn}
    count = SAMPLES if forced else LOOKED * SAMPLES
    seen = motion_arrays(
        system,
        start,
        method=bounded(method, LOOKED),
        samples=count,
        time_errors="local",
        threads=1,
        **length,
    )
    moved = np.abs(seen.values[0]).max(axis=0)
    if int(seen.outcome.status[0]) in REACHED and moved.max() < FARTHEST * (reach.max() or 1.0):
        reach = np.maximum(reach, moved)  # else gaps alone say how wide
    reach = np.where(reach > 0, reach, reach.max() or 1.0)
    ends = [_round_up(WIDER * one) for one in reach]
    box = {name: (-end, end) for name, end in zip(names, ends, strict=True)}
    for guard, place in zip(system.guards, np.ravel(about.boundaries).tolist(), strict=True):
        if guard.law and guard.law.kind == "impact" and guard.state:
            low, high = box[guard.state]
            if low < place < high:  # beyond a rigid stop there is no start
                box[guard.state] = (low, place) if guard.law.side < 0 else (place, high)
    return box, turn


def _turn(system: System, start: np.ndarray) -> float:
    """Time in which the linear part of the equations at a state turns or decays once [s], of a
    structure that of its lowest mode; 1 s where it does neither.
    """
    (matrix,) = jacobian_of(
        system, start[None], {name: np.array([value]) for name, value in system.values.items()}
    )
    rates = np.abs(np.linalg.eigvals(matrix)) if np.isfinite(matrix).all() else np.zeros(1)
    rate = float(rates.max())
    if by_modes(system):
        rate = float(rates[rates >= RIGID * rate].min())
    return float(f"{2.0 * np.pi / rate:.1e}") if rate > 0 else 1.0


def _round_up(value: float) -> float:
    """The next of 1, 2, 5, 10, ..."""
    ten = 10.0 ** math.floor(math.log10(value))
    return next(float(f"{step * ten:.0e}") for step in (1, 2, 5, 10) if step * ten >= value)


def _responses(found: Opening) -> dict[str, Any] | None:
    """The range of responses that is shown first: of the forcing frequency, else of the first
    parameter.
    """
    system = found.system
    name = system.forced_at or next(iter(system.values), None)
    if name is None:
        return None
    low, high = found.ranges[name]
    value = system.values[name]
    if name == system.forced_at:  # an octave: a decade takes minutes
        low, high = (float(f"{value * by:.3g}") for by in (2**-0.5, 2**0.5))
    return {"parameter": name, "range": [low, high], "quantity": first_quantity(system)}


def first_quantity(system: System) -> str:
    """The quantity that histories and responses show first: a sensor, else a state that meets a
    boundary, else the first state.
    """
    names = system.outputs.names if system.outputs.first else (*bounded_states(system),)
    return str((*names, *system.states)[0])
