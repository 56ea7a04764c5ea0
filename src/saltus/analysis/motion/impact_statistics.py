"""`impact_statistics`: rate, speed, duration, peak force and impulse of contacts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.dataset_parts import motion_values
from saltus.analysis.inputs.given import Starts, Values
from saltus.analysis.inputs.starts import check_system
from saltus.analysis.inputs.verb import verb
from saltus.analysis.motion import contact_peaks, touchdowns
from saltus.analysis.motion.contact_peaks import ContactForces, Peaks
from saltus.analysis.motion.touchdowns import Touchdowns
from saltus.analysis.motion.window import Stretch, computed, dataset, stretch
from saltus.analysis.outcome_messages import warn
from saltus.errors import ParameterError, listed, must_be, nearest, shown
from saltus.flow.counts import whole
from saltus.flow.methods import Method, check_method
from saltus.flow.request import Outcome, Schedule
from saltus.flow.room import check_room
from saltus.interrupt import Interrupted
from saltus.language.evaluate import evaluate
from saltus.results.dataset import schema
from saltus.system import System
from saltus.system.contact_forces import side_that_pushes
from saltus.system.quantity import with_impulses, with_integrals
from saltus.system.read_off import Quantity

#: Blocks whose scatter gives a standard error: consecutive contacts are not independent, blocks
#: nearly are.
BLOCKS = 20
#: Bins of the histogram of speeds.
BINS = 20


@verb
def impact_statistics(
    system: System,
    start: Starts | None = None,
    *,
    periods: int | None = None,
    t_end: float | str | None = None,
    t_start: float | str = 0.0,
    transient: int | float | str = 0,
    force: Mapping[str, Quantity | str] | None = None,
    contact_side: Mapping[str, int] | None = None,
    peaks: bool | None = None,
    bins: int | Sequence[float] = BINS,
    method: Method | None = None,
    values: Mapping[str, Values] | None = None,
    threads: int | None = None,
    progress: bool | Callable[[float], None] | None = None,
) -> xr.Dataset:
    """Rate, speed, duration, peak force and impulse of the contacts, guard by guard and one by one.

    Runs the motion itself, since the impulse of a contact is an integral along it; no samples are
    kept, so runs may be long.

    Parameters
    ----------
    system, start, t_start, method, values, threads, progress
        As for :func:`saltus.simulate`. The method must locate contacts.
    periods : int
        Whole forcing periods after the transient.
    t_end : float or str
        Time at the end [s], in place of periods.
    transient : int, or float or str
        Whole forcing periods before; of an unforced system a time [s].
    force : mapping of str to callable or str, optional
        For guards by name: the force of that contact [N] as a function of (t, states, parameters),
        arguments found by name, or the name of an output, such as that of a sensor
        ``sl.contact_force``; it needs to be right in contact only. Its integral from the beginning
        of a contact to its end is the impulse. Forces that stand in the equations as
        terms that are zero out of contact, as those of :func:`saltus.freeplay` and
        :func:`saltus.hertz`, are found there. Rigid stops need none: theirs is that of their law.
        ``ODE45`` controls the error of the integral of a given force too, so its steps may differ
        from those without.
    contact_side : mapping of str to int, optional
        For guards by name: the sign of the gap in contact. By default it is the side on which the
        state of rest (all states zero, t = 0) does not lie; a gap of zero counts as a tiny one,
        and a boundary at rest itself touches where the equations push.
    peaks : bool, optional
        Whether to find the peak force and the depth of every contact, from the series of the
        motion in it: by default of 10 000 contacts at most, of long equations of fewer, two
        million over their operations (a structure of 40 modes and eight stops: 1200). Where there
        are more, a warning says so.
    bins : int or sequence of float
        Bins of the histogram of speeds: how many between zero and the largest one, or their edges
        [unit of the gap per second].

    Returns
    -------
    Dataset
        Dims ``guard``, ``contact`` (one table for all trajectories: every contact that begins),
        ``speed_bin``, and ``trajectory`` for many. For each guard ``contacts``,
        ``contacts_per_second``, ``contacts_per_period`` (if forced), ``speed_mean``, ``speed_rms``,
        ``speed_max``, ``speed_histogram``, ``duration_mean``, ``duration_min``, ``duration_max``,
        ``share_in_contact``, with a force or a rigid stop ``impulse_mean``, ``impulse_max``, with
        a force ``peak_force``, the largest; for each contact ``contact_time``,
        ``contact_duration``, ``contact_speed``, ``contact_exit_speed``, ``contact_impulse``,
        ``contact_peak_force`` and ``contact_depth``;
        ``<...>_error`` is
        the standard error by the means of 20 blocks (NaN where there are too few; zero for a
        periodic response whose blocks hold whole responses). A contact whose beginning or end isn't
        seen counts in ``share_in_contact``; without an end it has no duration (NaN). Touches
        without a crossing are no contacts. Impacts that come to rest (a chatter) are one contact
        with the rest that follows: it begins with the first impact from which on each flight is
        shorter than the one before it, ``contact_impacts`` is how many were met before the
        infinitely many that are left were summed up (the error is below 1e-8 of their own part),
        ``contact_impulse_of_impacts`` is that of all of them, and ``contact_impulse`` has that of
        the force at rest too, which is also the impulse of the guard ``... at rest``. Of a system
        with outputs ``touchdown_<output>``, their values where each contact begins. Impulses of a
        stop are relative to the mass if ``sl.impact`` has no ``inertia``.

    Raises
    ------
    ParameterError, UnitError
        If an argument can't be used, the system has no boundary, or the method doesn't locate
        contacts.
    TraceError
        If a force can't be traced.
    Interrupted
        On Ctrl-C; its ``partial`` is the Dataset so far.

    References
    ----------
    Standard errors: C. J. Geyer, Practical Markov chain Monte Carlo, Statistical Science 7 (1992)
    473-483, section 3.2 (batch means).

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    >>> impacts = sl.impact_statistics(rig, start=("0.75 mm", 0), periods=30, transient=300)
    >>> impacts.sizes["contact"]  # four in three periods
    40
    """
    check_system(system)
    method = check_method(method, system)
    if not method.records_contacts:
        raise ParameterError(
            f"impact_statistics needs a method that locates contacts, and "
            f'{method.name}(events="ignore") steps over them. Use sl.Taylor() '
            f'or sl.ODE45(..., events="locate").'
        )
    if not system.guards:
        raise ParameterError(f"{system.name} has no boundary, so there is no contact to count.")
    forces = _by_guard(system, force, "force")
    sides = contact_sides(system, _by_guard(system, contact_side, "contact_side"))
    stops = [
        number
        for number, guard in enumerate(system.guards)
        if guard.law and guard.law.mass is not None and number not in forces
    ]
    own = contact_peaks.forces_of(system, forces, sides)
    extended = with_integrals(
        system, {f"impulse_{guard}_": function for guard, function in forces.items()}
    )
    extended = with_impulses(extended, {guard: f"impulse_{guard}_" for guard in stops})
    columns = {guard: len(system.states) + i for i, guard in enumerate([*forces, *stops])}
    columns |= {touchdowns.hold_of(system, guard): columns[guard] for guard in stops}
    seen = stretch(system, start, values, periods, t_end, t_start, transient)
    if np.ndim(bins) == 0:
        check_room(
            8.0 * whole(bins, "bins") * seen.group.size * len(system.guards),
            f"{bins} bins of each boundary of {seen.group.size} trajectories",
            "Take fewer bins.",
        )
    begin = Schedule(np.array([seen.skipped]), np.zeros(1))

    def answer(outcome: Outcome) -> xr.Dataset:
        found = touchdowns.find(seen, outcome, sides, columns)
        ask = partial(_dataset, system, method, seen, sides, found, bins, outcome, own)
        few = len(found.guard) <= contact_peaks.most(system)
        if not (few if peaks is None else peaks):
            return ask()
        try:
            tops = contact_peaks.peaks(seen, method, sides, own, outcome, found)
        except KeyboardInterrupt:
            raise Interrupted(ask) from None
        return ask(tops)

    result = computed(
        extended, method, seen.request(extended, begin, record=True), answer, threads, progress
    )
    warn(result)
    if peaks is None:
        contact_peaks.warn_of_many(system, result.sizes["contact"])
    contact_peaks.warn_of_stops(system, own, "contact_depth" in result)
    return result


def _by_guard(system: System, given: Mapping[str, Any] | None, argument: str) -> dict[int, Any]:
    """A mapping by the names of guards, by their numbers; empty if there is none."""
    names, given = [guard.name for guard in system.guards], {} if given is None else given
    if not isinstance(given, Mapping):
        raise must_be(argument, f"a mapping by the names of boundaries: {listed(names)}", given)
    for name in given:
        if name not in names:
            raise ParameterError(
                lambda say: say.key(argument),
                f" names {shown(name)}, which is no boundary of {system.name}. "
                f"{nearest(name, names)}",
            )
    return {names.index(name): value for name, value in given.items()}


def contact_sides(system: System, given: Mapping[int, Any]) -> np.ndarray:
    """Sign of each gap in contact, int8[guard]: as given, else opposite to that at rest. Gaps of
    zero are opened a little for this test.
    """
    for number, side in given.items():
        if side not in (-1, 1):
            raise must_be(f"contact_side of {system.guards[number].name!r}", "1 or -1", side)
    values = {name: value or np.finfo(float).tiny for name, value in system.values.items()}
    rest = dict.fromkeys(system.states, 0.0)
    bits: list[bool] = []
    for guard in system.guards:
        if guard.law and guard.law.kind in ("hold", "impact"):
            bits.append(guard.law.side > 0)  # at rest is in contact; so is the side not allowed
            continue
        gap = evaluate([guard.gap], states=rest, values=system.values, bits=bits)[0]
        if gap == 0:
            gap = evaluate([guard.gap], states=rest, values=values, bits=bits)[0]
        if gap == 0:  # no gap can open: contact is where the equations push
            gap = -side_that_pushes(system, len(bits))
        bits.append(bool(gap > 0))
    return np.array(
        [given.get(i, -1 if positive else 1) for i, positive in enumerate(bits)], dtype=np.int8
    )


# -- statistics ------------------------------------------------------------------------------------
def _dataset(
    system: System,
    method: Method,
    seen: Stretch,
    sides: np.ndarray,
    found: Touchdowns,
    bins: Any,
    outcome: Outcome,
    forces: ContactForces,
    tops: Peaks | None = None,
) -> xr.Dataset:
    """The contacts and their statistics, by name."""
    size, guards = seen.group.size, len(system.guards)
    found, words = contact_peaks.with_found(system, found, forces, tops)
    ends = np.searchsorted(found.trajectory, np.arange(size + 1))
    cells = [
        (i, g, ends[i] + np.flatnonzero(found.guard[ends[i] : ends[i + 1]] == g))
        for i in range(size)
        for g in range(guards)
    ]
    edges = _edges(bins, found.speed)
    each: dict[str, np.ndarray] = {}

    def put(name: str, i: int, g: int, value: Any) -> None:
        kind = np.int64 if name in ("contacts", "speed_histogram") else float
        each.setdefault(name, np.zeros((size, guards, *np.shape(value)), dtype=kind))[i, g] = value

    for i, g, rows in cells:
        put("contacts", i, g, len(rows))
        put("speed_histogram", i, g, np.histogram(found.speed[rows], edges)[0])
        for name, value in {**_rates(seen, found, i, g, rows), **_sizes(found, rows)}.items():
            put(name, i, g, value)
        if tops is not None and forces.formulas:
            put("peak_force", i, g, _largest(np.abs(tops.force[rows])))
    names = np.array([guard.name for guard in system.guards], dtype=np.str_)
    columns = {
        "contact_time": found.begin,
        "contact_guard": names[found.guard],
        "contact_speed": found.speed,
        "contact_exit_speed": found.exit_speed,
        "contact_duration": found.end - found.begin,
        "contact_trajectory": found.trajectory,
    }
    if found.impacts.any():
        columns["contact_impacts"], columns["contact_impulse_of_impacts"] = (
            found.impacts,
            found.struck,
        )
    if found.impulse is not None:
        columns["contact_impulse"] = found.impulse
    if len(system.outputs):
        table, size = outcome.contacts.rows(found.first), len(system.states)
        known = motion_values(
            system, seen.group, table.time, table.state, table.mode_after, table.trajectory
        )
        columns["touchdown_<state>"] = dict(
            zip(system.outputs.names, known[:, size:].T, strict=True)
        )
    if tops is not None:
        if forces.formulas:
            columns["contact_peak_force"] = tops.force
        columns["contact_depth"] = tops.depth
    columns |= {"contact_side": sides, "speed_low": edges[:-1], "speed_high": edges[1:]}
    return dataset(schema.IMPACTS, seen, system, method, outcome, columns, each, words=words)


def _edges(bins: Any, speed: np.ndarray) -> np.ndarray:
    """Edges of the bins of speed."""
    if np.ndim(bins) == 0:
        largest = float(speed.max(initial=0.0))
        return np.linspace(0.0, largest if largest > 0 else 1.0, int(bins) + 1)
    edges = np.asarray(bins, dtype=float)
    if edges.ndim != 1 or len(edges) < 2 or not (np.diff(edges) > 0).all():
        raise ParameterError("the edges of the bins must be two rising numbers or more.")
    return edges


def _rates(seen: Stretch, found: Touchdowns, i: int, g: int, rows: np.ndarray) -> dict[str, float]:
    """Contacts per time and share of the time in contact, of one trajectory and guard, with
    standard errors by blocks of time.
    """
    borders = _borders(seen, i)
    # (left edges belong to a block; a contact exactly there is a matter of rounding)
    counts = np.histogram(found.begin[rows], borders)[0]
    covered = found.covered(i, g, borders)
    lengths = np.diff(borders)
    duration = float(seen.duration[i])
    rate, error = len(rows) / duration, _error(counts / lengths)
    result = {"contacts_per_second": rate, "contacts_per_second_error": error}
    if seen.system.forced_at is not None:
        period = float(seen.length.period[i])
        result |= {
            "contacts_per_period": rate * period,
            "contacts_per_period_error": error * period,
        }
    share = (
        float(found.covered(i, g, np.array([seen.begin[i], seen.begin[i] + duration]))[0])
        / duration
    )
    return result | {"share_in_contact": share, "share_in_contact_error": _error(covered / lengths)}


def _borders(seen: Stretch, i: int) -> np.ndarray:
    """Borders of equal blocks of time; of a forced system whole periods, as many as fit, at the
    end.
    """
    begin, end = float(seen.begin[i]), float(seen.begin[i] + seen.duration[i])
    if seen.system.forced_at is None:
        return np.linspace(begin, end, BLOCKS + 1)
    period = float(seen.length.period[i])
    periods = int(seen.length.count[i]) - seen.skipped
    blocks = min(BLOCKS, max(periods, 1))
    length = max(periods // blocks, 1) * period
    last = begin + periods * period if periods else end
    return last - length * np.arange(blocks, -1, -1)


def _sizes(found: Touchdowns, rows: np.ndarray) -> dict[str, float]:
    """Speeds, durations and impulses of one trajectory and guard."""
    speed, duration = found.speed[rows], (found.end - found.begin)[rows]
    duration = duration[np.isfinite(duration)]
    result = {
        "speed_mean": _mean(speed),
        "speed_mean_error": _error_of_row(speed),
        "speed_rms": _mean(speed**2) ** 0.5,
        "speed_max": _largest(speed),
        "duration_mean": _mean(duration),
        "duration_mean_error": _error_of_row(duration),
        "duration_min": -_largest(-duration),
        "duration_max": _largest(duration),
    }
    if found.impulse is not None:
        impulse = found.impulse[rows]
        impulse = impulse[np.isfinite(impulse)]
        result |= {
            "impulse_mean": _mean(impulse),
            "impulse_mean_error": _error_of_row(impulse),
            "impulse_max": _largest(np.abs(impulse)),
        }
    return result


def _mean(values: np.ndarray) -> float:
    return float(values.mean()) if len(values) else np.nan


def _largest(values: np.ndarray) -> float:
    return float(values.max()) if len(values) else np.nan


def _error_of_row(values: np.ndarray) -> float:
    """Standard error of the mean of consecutive values, by the means of blocks."""
    blocks = min(BLOCKS, len(values) // 2)
    if blocks < 2:
        return np.nan
    length = len(values) // blocks
    return _error(values[len(values) - blocks * length :].reshape(blocks, length).mean(axis=1))


def _error(means: np.ndarray) -> float:
    """Standard error of the mean from the means of blocks; NaN for one block."""
    return float(means.std(ddof=1) / np.sqrt(len(means))) if len(means) > 1 else np.nan
