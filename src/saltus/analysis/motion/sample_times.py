"""The times at which :func:`saltus.simulate` keeps the states of a run."""

from __future__ import annotations

from collections.abc import Mapping, Sized
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from saltus.analysis.inputs.spans import Span
from saltus.analysis.inputs.starts import Ensemble
from saltus.errors import ParameterError, shown
from saltus.flow.counts import MOST, whole
from saltus.flow.request import Outcome, Request, Schedule
from saltus.flow.room import check_room
from saltus.system import System
from saltus.units import to_si

#: Default samples per forcing period, enough for a picture; contacts are exact without them.
PER_PERIOD = 200
#: Samples over the whole span of an unforced system: a smooth curve over a hundred oscillations.
MOST_PER_SPAN = 10_000
#: Least number of these, for each of many trajectories.
LEAST_PER_SPAN = 2000
#: Largest amount by which a given time may lie beyond the end, and then is the end: rounding [times
#: the end].
AT_THE_END = 4.0 * float(np.finfo(float).eps)


@dataclass(frozen=True)
class SampleTimes:
    """The samples and contacts of a run that are kept.

    Attributes
    ----------
    schedule : Schedule
        When samples are taken, in forcing periods.
    first : int
        First period whose contacts are kept.
    given : float64[M], optional
        Times that the user gave, in the user's order [s]; the schedule is then empty.
    """

    schedule: Schedule
    first: int
    given: np.ndarray | None = None

    def request(self, group: Ensemble, length: Span, states: int) -> Request:
        """The request of a run; states beyond those of the starts begin at zero."""
        more = ((0, 0), (0, states - group.start.shape[1]))
        times = None if self.given is None else np.sort(self.given) - length.t_start
        return replace(
            length.request(np.pad(group.start, more), group.parameters, self.schedule, self.first),
            t_end=length.t_end,
            times=times,
        )

    def reached(self, outcome: Outcome) -> np.ndarray | slice:
        """The samples that were reached, in the order of the result: places in the outcome's."""
        if self.given is None:
            return slice(outcome.reached())
        order = np.argsort(self.given, kind="stable")
        places = np.empty(len(order), np.int64)
        places[order] = np.arange(len(order))
        return places[places < outcome.reached()]

    def of_result(
        self, outcome: Outcome, length: Span, forced: bool
    ) -> tuple[np.ndarray, np.ndarray | None]:
        """Times of the samples that were reached [s], for each trajectory where its forcing period
        is its own; the same in forcing periods since the start, None where these have no single
        value.
        """
        own = forced and bool(np.ptp(length.period) > 0)
        kept = self.reached(outcome)
        if self.given is not None:
            time = np.sort(self.given)[kept]
            return time, None if own else (time - length.t_start) / length.period[0]
        count, fraction = self.schedule.count[kept], self.schedule.fraction[kept]
        scale = length.period[:, None] if own else length.period[0]
        time = np.minimum(length.t_start + (count * scale + fraction * scale), length.t_end)
        return time, count + fraction


#: No samples at all, and all contacts.
NO_SAMPLES = SampleTimes(Schedule.none(), 0)


def planned(
    system: System, group: Ensemble, length: Span, samples: Any, keep: Any, states: int
) -> SampleTimes:
    """Equal parts of each forcing period, or of the span of an unforced system."""
    per = _whole(
        samples, "samples", _per_span(group.size) if system.forced_at is None else PER_PERIOD
    )
    first = first_kept(system, length, keep)
    longest = np.max((length.count + length.phase / length.period) * per)
    count = int(min(longest + 1e-9, MOST)) + 1 - first * per
    check_samples(system, group.size, count, states)
    periods = np.arange(first, first - (-count // per))
    return SampleTimes(
        Schedule(
            np.repeat(periods, per)[:count], np.tile(np.arange(per) / per, len(periods))[:count]
        ),
        first,
    )


def evenly(
    system: System, group: Ensemble, t_start: float, elapsed: float, samples: Any
) -> SampleTimes:
    """Equal parts of a stretch from the start on, as of the span of an unforced system."""
    per = _whole(samples, "samples", _per_span(group.size))
    check_samples(system, group.size, per + 1)
    times = np.unique(t_start + np.linspace(0.0, elapsed, per + 1))
    return SampleTimes(Schedule.none(), 0, times)


def last_of(given: np.ndarray, t_start: Any) -> float:
    """The last of a user's times [s], which is the end of the run. Raises ParameterError if it
    isn't after the start.
    """
    last = float(given.max())
    if not last > to_si(t_start, "s", "t_start"):
        raise ParameterError(
            lambda say: (
                f"at: the last time, {last:.9g} s, isn't after the start, t_start = "
                f"{shown(t_start)}. Give a later one, or {say.key('t_end')}."
            )
        )
    return last


def at_times(length: Span, first: int, given: np.ndarray) -> SampleTimes:
    """The times of :func:`times_of` as the samples of a run.

    Raises
    ------
    ParameterError
        If one of them lies before the start, or beyond the end of a trajectory.
    """
    early = np.flatnonzero(given < length.t_start)
    if len(early):
        raise ParameterError(
            f"at: {given[early[0]]:.9g} s lies before the start at {length.t_start:.9g} s. Give "
            f"times from t_start on."
        )
    ends = np.minimum(length.t_start + length.count * length.period + length.phase, length.t_end)
    shortest = int(np.argmin(ends))
    end = float(ends[shortest])
    late = np.flatnonzero(given > end + AT_THE_END * abs(end))
    if len(late):
        whose = f" of trajectory {shortest}" if np.ptp(ends) > 0 else ""
        raise ParameterError(
            lambda say: (
                f"at: {given[late[0]]:.9g} s lies beyond the end{whose} at {end:.9g} s. Give a "
                f"longer {say.key('t_end')} or {say.key('periods')}, or leave both out to end at "
                f"the last time."
            )
        )
    return SampleTimes(Schedule.none(), first, np.minimum(given, end))


def times_of(system: System, trajectories: int, at: Any) -> np.ndarray:
    """A user's times [s], in the user's order.

    Raises
    ------
    ParameterError, UnitError
        If there is none, one isn't a finite time, or so many don't fit into memory.
    """
    if isinstance(at, Sized) and not isinstance(at, str) and getattr(at, "shape", None) != ():
        check_samples(system, trajectories, len(at), len(system.states), "times")
    try:
        rows = np.asarray(() if isinstance(at, Mapping | set) else at)
    except (TypeError, ValueError):
        rows = np.empty((0, 0))
    if rows.ndim > 1 or rows.dtype.kind not in "iufOU" or isinstance(at, Mapping | set):
        raise ParameterError(
            lambda say: (
                f"at must be times in a row, such as {say.key(at=[0.1, '250 ms'])}, not "
                f"{shown(at)}."
            )
        )
    if rows.dtype.kind in "OU":
        given = at if isinstance(at, list | tuple) else np.ravel(rows).tolist()
        rows = np.array([to_si(one, "s", "at") for one in given])
    times = np.atleast_1d(rows).astype(float)
    if not times.size:
        raise ParameterError(
            lambda say: (
                f"at is empty. Give times, such as {say.key(at=[0.1, 0.2])}, or leave it out for "
                f"samples in equal steps."
            )
        )
    if not np.isfinite(times).all():
        raise ParameterError(
            f"at[{int(np.argmin(np.isfinite(times)))}] isn't a finite time. Every time must be a "
            f"number."
        )
    return times


def first_kept(system: System, length: Span, keep: Any) -> int:
    """First period that is kept, of those since the start."""
    if keep is None:
        return 0
    periods = whole(keep, "keep")
    if system.forced_at is None:
        raise ParameterError(
            lambda say: (
                f"{system.name} has no forcing period, so {say.key('keep')} has no "
                f"meaning. Start later, or take fewer {say.key('samples')}."
            )
        )
    return max(int(np.min(length.count)) - periods, 0)


def least_samples(system: System, trajectories: int, periods: Any, samples: Any, keep: Any) -> int:
    """Least number of samples of each trajectory, known before any array is made."""
    if system.forced_at is None:
        return _whole(samples, "samples", _per_span(trajectories)) + 1
    if periods is None:
        return 1
    kept = whole(periods, "periods")
    return min(kept, _whole(keep, "keep", kept)) * _whole(samples, "samples", PER_PERIOD) + 1


def check_samples(
    system: System,
    trajectories: int,
    samples: int,
    states: int | None = None,
    what: str = "samples",
) -> None:
    """Raise a ParameterError if samples of so many trajectories don't fit into memory."""
    check_room(
        samples
        * trajectories
        * (16.0 * ((states or len(system.states)) + len(system.outputs)) + 16.0),
        f"{trajectories} trajectories with {samples} {what} each",
        lambda say: (
            f"Give {say.key('keep')} (last periods) or fewer {say.key('samples')}, or use "
            f"{say.verb('stroboscope')}."
            if what == "samples"
            else f"Give fewer times in {say.key('at')}, or run fewer trajectories in one call."
        ),
    )


def _per_span(trajectories: int) -> int:
    """Samples of a motion without forcing: enough for a smooth curve, fewer for many
    trajectories.
    """
    return max(MOST_PER_SPAN // max(trajectories // 20, 1), LEAST_PER_SPAN)


def _whole(value: int | None, name: str, default: int) -> int:
    return default if value is None else whole(value, name)
