"""`poincare`: the states at which a motion crosses a surface."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.dataset_parts import motion_values
from saltus.analysis.inputs.given import Starts, Values
from saltus.analysis.inputs.starts import check_system
from saltus.analysis.inputs.verb import verb
from saltus.analysis.motion.window import Stretch, computed, dataset, stretch
from saltus.analysis.outcome_messages import warn
from saltus.contact.guards import equation_of
from saltus.errors import ParameterError, among, must_be, nearest, shown
from saltus.flow.contact_table import ContactTable
from saltus.flow.methods import Method, check_method
from saltus.flow.request import Outcome, Schedule
from saltus.kernels import status as st
from saltus.results.dataset import schema
from saltus.system import System
from saltus.system.formula import Formula
from saltus.system.quantity import (
    acting_guards,
    turning_surfaces,
    unit_of,
    with_level,
    with_surface,
)
from saltus.system.read_off import Quantity

#: Touches closer than this are one [forcing periods; the span if unforced]: where a gap is flat its
#: minimum is that uncertain.
SAME_TOUCH = 1e-9
#: Every contact state, as (mask, bits).
EVERYWHERE = ((0, 0),)


@verb
def poincare(
    system: System,
    start: Starts | None = None,
    surface: Quantity | str | tuple[str, float | str] | None = None,
    *,
    direction: int = 0,
    periods: int | None = None,
    t_end: float | str | None = None,
    t_start: float | str = 0.0,
    transient: int | float | str = 0,
    method: Method | None = None,
    values: Mapping[str, Values] | None = None,
    threads: int | None = None,
    progress: bool | Callable[[float], None] | None = None,
) -> xr.Dataset:
    """Poincare section: the states at which a motion crosses a surface.

    The surface is located as a contact is: no crossing is missed, and its time is exact to
    rounding. For the section at whole forcing periods see :func:`saltus.stroboscope`.

    Parameters
    ----------
    system, start, t_start, method, values, threads, progress
        As for :func:`saltus.simulate`; without a start, from rest. The method must locate contacts.
        A Taylor flow isn't disturbed by the surface; ``ODE45`` restarts at each crossing, as MATLAB
        does at a terminal event, so its steps and with them its errors are others than without the
        surface.
    surface : callable, str or tuple
        Needed. A function of (t, states, parameters), zero on the surface:
        ``lambda x, v: v + 10 * x``; its arguments are found by name. Or ``("x", "0.3 mm")``, a
        level of a state or an output; or ``"x turns"``, its turning points; or the name of a guard
        of the system. An output that contacts switch, such as the force of a stop, turns where its
        rate is zero between them: it doesn't while the stop is open, and its jumps
        and corners are no turning points.
    direction : {0, 1, -1}
        Keep all crossings, or only those where the function rises (1) or falls (-1).
    periods : int
        Whole forcing periods after the transient.
    t_end : float or str
        Time at the end [s], in place of periods.
    transient : int, or float or str
        Whole forcing periods before the first crossing is kept; of an unforced system a time [s].

    Returns
    -------
    Dataset
        Dims ``crossing`` (one table for all trajectories, sorted by trajectory and time), ``guard``
        (of the system itself), and ``trajectory`` for many. Each state and output
        at the crossings, ``crossing_time``, ``crossing_phase`` (t/T mod 1, NaN if unforced),
        ``crossing_period``,
        ``crossing_direction``, ``crossing_rate`` of the function (zero: a tangency),
        ``crossing_kind`` (``graze_unresolved``: too shallow to be sure of),
        ``crossing_trajectory``; per trajectory ``crossings``, ``tangencies``, ``contacts``,
        ``status``, counters. The run covers the interval (begin, end]: a start on the surface is no
        crossing, an end on it is. ``status`` and ``grazes_unresolved`` count doubtful touches of
        the surface too.

    Raises
    ------
    ParameterError, UnitError
        If an argument can't be used, or the method doesn't locate contacts.
    TraceError
        If the function of the surface can't be traced, or depends on no state.
    Interrupted
        On Ctrl-C; its ``partial`` is the Dataset so far.

    References
    ----------
    M. Henon, On the numerical computation of Poincare maps, Physica D 5 (1982) 412-414.

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    >>> turns = sl.poincare(rig, start=("0.75 mm", 0), surface="x turns", periods=3, transient=300)
    >>> turns.sizes["crossing"]
    6
    """
    check_system(system)
    if surface is None:
        state = (*system.outputs.names, *system.states)[0]
        raise ParameterError(
            lambda say: (
                f"poincare needs a surface, such as {say.key(surface=f'{state} turns')}, or a "
                "function that is zero on it."
            )
        )
    method = check_method(method, system)
    if not method.records_contacts:
        raise ParameterError(
            f'poincare needs a method that locates contacts, and {method.name}(events="ignore") '
            f"steps over them: a crossing would be where "
            f'a step happens to end. Use sl.Taylor() or sl.ODE45(..., events="locate").'
        )
    if not isinstance(direction, int | float | np.integer | np.floating) or direction not in (
        -1,
        0,
        1,
    ):
        raise must_be("direction", "0, 1 or -1", direction)
    found = crossed(system, surface, values if isinstance(values, Mapping) else {})
    seen = stretch(found.system, start, values, periods, t_end, t_start, transient)

    result = computed(
        found.system,
        method,
        seen.request(found.system, Schedule.none(), record=True),
        partial(_dataset, system, method, seen, found, direction),
        threads,
        progress,
    )
    warn(result)
    return result


@dataclass(frozen=True)
class Crossed:
    """The system with the surface among its guards, the numbers of these guards with the contact
    states in which they are the surface (mask, bits), the unit of its function, and the surface in
    words.
    """

    system: System
    guards: Mapping[int, tuple[tuple[int, int], ...]]
    unit: str
    text: str

    def rows(self, table: ContactTable) -> np.ndarray:
        """True for the rows of a table that are crossings or touches of the surface, bool[c]."""
        found = np.zeros(len(table), dtype=bool)
        for number, places in self.guards.items():
            here = [(table.mode_before & mask) == bits for mask, bits in places]
            found |= (table.guard == number) & np.any(here, axis=0)
        return found


def crossed(system: System, surface: Any, values: Mapping[str, Any]) -> Crossed:
    """The system with a user's surface; ``values`` may hold its level. Raises as :func:`poincare`
    does.
    """
    if callable(surface):
        text = f"{surface.text} = 0" if isinstance(surface, Formula) else ""
        return _last(with_surface(system, surface), "", text)
    if isinstance(surface, tuple | list):
        if len(surface) != 2 or not isinstance(surface[0], str):
            raise ParameterError(
                f"a surface at a level is a pair of a state and a value, such as "
                f'("x", "0.3 mm"), not {shown(surface)}.'
            )
        leveled = with_level(system, surface[0], surface[1])
        level = leveled.guards[-1].name
        return _last(
            leveled,
            unit_of(system, surface[0]),
            "" if level in values else f"{surface[0]} = {leveled.parameter_text(level)}",
        )
    names = [guard.name for guard in system.guards]
    if among(surface, names):
        owner = system.guards[names.index(surface)].state
        number = names.index(surface)
        unit, text = system.units[owner] if owner else "", equation_of(number, system.guards)
        return Crossed(system, {number: EVERYWHERE}, unit, text)
    turns = {f"{name} turns": name for name in (*system.states, *system.outputs.names)}
    if among(surface, turns):
        found, of = turning_surfaces(system, turns[surface])
        return Crossed(found, of, schema.rate_unit(unit_of(system, turns[surface])), surface)
    raise ParameterError(
        f"{system.name} has no boundary {shown(surface)}. {nearest(surface, (*names, *turns))} Or "
        f"give a function, or a level such as "
        f'("{system.states[0]}", 0.0).'
    )


def _last(system: System, unit: str, text: str) -> Crossed:
    """The last guard as the surface; without a text its equation describes it."""
    number = len(system.guards) - 1
    return Crossed(system, {number: EVERYWHERE}, unit, text or equation_of(number, system.guards))


def _dataset(
    system: System,
    method: Method,
    seen: Stretch,
    crossed: Crossed,
    direction: int,
    outcome: Outcome,
) -> xr.Dataset:
    """The crossings in the wanted direction, by name."""
    table = outcome.contacts
    who, guard, time = table.trajectory, table.guard, table.time
    flips = table.changes_side | (table.kind == st.IMPACT)
    late = time > seen.begin[who]
    ours = late & crossed.rows(table)
    wanted = ours & flips & ((direction == 0) | (table.direction == direction))
    crossings, rows = table.rows(wanted), who[wanted]

    def count(of: np.ndarray) -> np.ndarray:
        return np.bincount(who[of], minlength=seen.group.size)

    columns = {
        "<state>": motion_values(
            system, seen.group, crossings.time, crossings.state, crossings.mode_after, rows
        ),
        "crossing_time": crossings.time,
        "crossing_time_error": crossings.time_error,
        "crossing_period": crossings.period,
        "crossing_phase": _phases(seen, crossings.phase, rows),
        "crossing_direction": crossings.direction,
        "crossing_rate": crossings.velocity,
        "crossing_kind": crossings.kind_name,
        "crossing_trajectory": rows,
    }
    contacts = late & flips & np.isin(guard, acting_guards(system))
    counts = {
        "crossings": wanted,
        "tangencies": _distinct(seen, who, time, ours & ~flips),
        "contacts": contacts,
    }
    return dataset(
        schema.SECTION, seen, system, method, outcome, columns,
        {name: count(rows) for name, rows in counts.items()},
        {"surface": crossed.text, "direction": direction, "transient": _transient(seen)},
        words={"<surface rate>": schema.rate_unit(crossed.unit)},
    )  # fmt: skip


def _distinct(seen: Stretch, who: np.ndarray, time: np.ndarray, touches: np.ndarray) -> np.ndarray:
    """The touches without repeats: a touch at the instant of another event is seen from the step
    before it and from the step after it.
    """
    rows = np.flatnonzero(touches)
    again = np.zeros(len(rows), dtype=bool)
    again[1:] = (np.diff(who[rows]) == 0) & (
        np.diff(time[rows]) <= SAME_TOUCH * seen.length.period[who[rows[1:]]]
    )
    distinct = touches.copy()
    distinct[rows[again]] = False
    return distinct


def _phases(seen: Stretch, elapsed: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """t/T mod 1 from the time since the last whole period after the start."""
    if seen.system.forced_at is None:
        return np.full(len(rows), np.nan)
    period = seen.length.period[rows]
    phases: np.ndarray = (elapsed / period + (seen.length.t_start / period) % 1.0) % 1.0
    return phases


def _transient(seen: Stretch) -> float:
    """The transient as the user gave it: forcing periods, or seconds."""
    return float(
        seen.skipped if seen.system.forced_at is not None else seen.begin[0] - seen.length.t_start
    )
