"""Motions as arrays: what is asked is read, run, and comes back as numbers and codes.

A Dataset is made of them in simulate.py; whoever draws a motion many times a second takes these.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.analysis.dataset_parts import before_jumps, motion_values
from saltus.analysis.inputs.spans import Span, span
from saltus.analysis.inputs.starts import Ensemble, check_system, ensemble, trajectories
from saltus.analysis.motion import time_errors as measure
from saltus.analysis.motion.sample_times import (
    NO_SAMPLES,
    SampleTimes,
    at_times,
    check_samples,
    first_kept,
    last_of,
    least_samples,
    planned,
    times_of,
)
from saltus.errors import ParameterError, among, must_be
from saltus.flow import engine
from saltus.flow.contact_table import ContactTable
from saltus.flow.methods import Method, check_method
from saltus.flow.request import Outcome, Request
from saltus.system import System
from saltus.system.quantity import jumping_states, remembering

if TYPE_CHECKING:
    from saltus.analysis.inputs.given import Starts, UntilTrue, Values
    from saltus.analysis.motion.ending import Ending

Show = Callable[[float], None]


@dataclass(frozen=True)
class MotionArrays:
    """n motions: M samples, c contacts, and K values at each, the states and then the outputs.

    Attributes
    ----------
    outcome : Outcome
        The ends in codes and counters, ``status``, ``counters``, ``minima``
        (kernels/status.py, flow/until.py), and the table of contacts, ``contacts``.
    time : float64[M] or float64[n, M]
        Of the samples [s]; for each trajectory where its forcing period is its own.
    period : float64[M] or None
        The same in forcing periods since the start, where these have a single value.
    values : float64[n, M, K]
        NaN behind the end of a trajectory.
    mode : int64[n, M]
        Sides of the guards: bit i is set where gap i is positive; -1 behind the end.
    time_error : float64[c]
        Estimated errors of the times of the contacts [s].
    contact_values : float64[c, K]
        Behind the contacts.
    before : float64[c, K] or None
        Before them; None where nothing jumps.
    end_values : float64[n, K]
        Where the trajectories end.
    """

    outcome: Outcome
    time: np.ndarray
    period: np.ndarray | None
    values: np.ndarray
    mode: np.ndarray
    time_error: np.ndarray
    contact_values: np.ndarray
    before: np.ndarray | None
    end_values: np.ndarray

    @property
    def contacts(self) -> ContactTable:
        """Guards, directions, kinds in numbers, times [s] and rates of the gaps."""
        return self.outcome.contacts


def motion_arrays(
    system: System,
    start: Starts | None = None,
    periods: int | None = None,
    t_end: float | str | None = None,
    *,
    threads: int | None = None,
    **more: Any,
) -> MotionArrays:
    """Motions from given starts, as arrays.

    Parameters
    ----------
    system, start, periods, t_end, threads, **more
        As for :func:`saltus.simulate`, which makes a Dataset of the same numbers.

    Raises
    ------
    ParameterError, UnitError
        If an argument can't be used.
    RunInterrupted
        On Ctrl-C.
    """
    asked = asked_motion(system, start, periods, t_end, **more).with_end(threads, None)
    return asked.arrays(*asked.run(threads, None))


def asked_motion(
    system: System,
    start: Starts | None,
    periods: int | None,
    t_end: float | str | None,
    *,
    t_start: float | str = 0.0,
    method: Method | None = None,
    samples: int | None = None,
    at: Values | None = None,
    until: UntilTrue | None = None,
    keep: int | None = None,
    values: Mapping[str, Values] | None = None,
    time_errors: str = "measured",
) -> AskedMotion:
    """The arguments of a run, read and checked: those of :func:`saltus.simulate`.

    Raises
    ------
    ParameterError, UnitError
        If one of them can't be used.
    """
    method = check_method(method, system)
    check_system(system)
    many = trajectories(start, values)
    times = None if at is None else _given_times(system, many, at, samples)
    if times is not None and periods is None and t_end is None:
        t_end = last_of(times, t_start)
    if times is None and until is None:
        check_samples(system, many, least_samples(system, many, periods, samples, keep))
    group = ensemble(system, start, values)
    length = span(system, group, periods, t_end, t_start)
    end = None if until is None else _ending(system, method, group, length, until, keep)
    flown = remembering(system if end is None else end.condition.system)
    if not among(time_errors, ("measured", "local")):
        raise must_be("time_errors", '"measured" or "local"', time_errors)
    plan = NO_SAMPLES
    if times is not None:
        plan = at_times(length, first_kept(system, length, keep), times)
    elif end is None:
        plan = planned(system, group, length, samples, keep, len(flown.states))
    measured = time_errors == "measured"
    given = times is not None
    return AskedMotion(system, flown, method, group, length, plan, given, samples, end, measured)


def _ending(
    system: System, method: Method, group: Ensemble, length: Span, until: Any, keep: Any
) -> Ending:
    from saltus.analysis.motion.ending import ending  # few runs need it

    return ending(system, method, group, length, until, keep)


def _given_times(system: System, trajectories: int, at: Any, samples: Any) -> np.ndarray:
    """The times that are asked for, in place of samples."""
    if samples is not None:
        raise ParameterError(
            lambda say: (
                f"give {say.key('at')} (times) or {say.key('samples')} (how many), and only one of "
                f"them."
            )
        )
    return times_of(system, trajectories, at)


@dataclass(frozen=True)
class AskedMotion:
    """The arguments of a run, as they were read.

    Attributes
    ----------
    system, flown : System
        The user's; and the one that moves, which remembers what jumps and holds the condition that
        ends a run.
    method, group, length
        How, from where and how long.
    plan : SampleTimes
        Samples; those up to a condition aren't known before :meth:`with_end`.
    given : bool
        Whether the user gave their times.
    samples : int or None
        How many the user asks for.
    end : Ending or None
        A condition that ends trajectories.
    measured : bool
        Whether errors of contact times are measured by copies.
    """

    system: System
    flown: System
    method: Method
    group: Ensemble
    length: Span
    plan: SampleTimes
    given: bool
    samples: int | None
    end: Ending | None
    measured: bool

    def with_end(self, threads: int | None, show: Show | None) -> AskedMotion:
        """The same with samples up to the last end, where a condition ends the run. Raises
        RunInterrupted on Ctrl-C.
        """
        if self.end is None or self.given:
            return self
        return self.until(self.end.times(self.method, self.group, self.length, threads, show))

    def until(self, times: np.ndarray) -> AskedMotion:
        """The same with samples up to the last of the times at which trajectories end [s]."""
        assert self.end is not None
        args = self.system, self.group, self.length, self.samples, len(self.flown.states)
        return replace(self, plan=self.end.plan(*args, times))

    def rows(self, which: slice) -> AskedMotion:
        """Some of the trajectories, with the samples of all."""
        end = None if self.end is None else self.end.rows(which)
        return replace(self, group=self.group.rows(which), length=self.length.rows(which), end=end)

    @property
    def request(self) -> Request:
        """The request to the engine."""
        request = self.plan.request(self.group, self.length, len(self.flown.states))
        return request if self.end is None else self.end.asked(request)

    def run(self, threads: int | None, show: Show | None) -> tuple[Outcome, np.ndarray]:
        """The outcome, and the errors of its contact times [s]. Raises RunInterrupted on Ctrl-C."""
        request = self.request
        if self.measured and self.flown.guards and self.method.records_contacts:
            return measure.measured(self.flown, self.method, request, threads, show)
        method = self.method.suited_to(self.group.size)
        outcome = engine.run(self.flown, method, request, threads, show)
        return outcome, measure.local(outcome)

    @property
    def own_periods(self) -> bool:
        """True where the trajectories have forcing periods of their own."""
        return self.system.forced_at is not None and bool(np.ptp(self.length.period) > 0)

    def arrays(self, outcome: Outcome, errors: np.ndarray) -> MotionArrays:
        """The arrays of an outcome and the errors of its contact times [s]; those of an interrupted
        one as far as it went.
        """
        system, group = self.system, self.group
        time, period = self.plan.of_result(outcome, self.length, system.forced_at is not None)
        kept = self.plan.reached(outcome)
        samples = outcome.samples[:, kept, : len(system.states)]
        modes = outcome.sample_mode[:, kept]
        if self.end is not None:
            outcome, errors = self.end.of_the_user(outcome, errors)
            samples, modes = self.end.with_ends(outcome, samples, modes, time)
        table, before = outcome.contacts, None
        if jumping_states(system) or len(system.outputs):  # an output may jump where no state does
            states = before_jumps(system, table) if jumping_states(system) else table.state
            before = motion_values(
                system, group, table.time, states, table.mode_before, table.trajectory
            )
        return MotionArrays(
            outcome,
            time,
            period,
            motion_values(system, group, time, samples, modes),
            modes,
            errors,
            motion_values(
                system, group, table.time, table.state, table.mode_after, table.trajectory
            ),
            before,
            motion_values(system, group, outcome.time, outcome.state, outcome.mode),
        )
