"""`simulate`: trajectories with every contact."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from saltus.analysis import dataset_parts
from saltus.analysis.inputs.spans import Span, span
from saltus.analysis.inputs.starts import Ensemble, check_system, ensemble, trajectories
from saltus.analysis.inputs.verb import verb
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
from saltus.analysis.outcome_messages import warn
from saltus.errors import ParameterError, among, must_be
from saltus.flow import engine
from saltus.flow.methods import Method, check_method
from saltus.flow.progress import reporting
from saltus.flow.request import Outcome
from saltus.interrupt import Interrupted
from saltus.results import build
from saltus.results.dataset import schema
from saltus.system import System
from saltus.system.quantity import remembering

if TYPE_CHECKING:
    from saltus.analysis.inputs.given import Starts, UntilTrue, Values
    from saltus.analysis.motion.ending import Ending


@verb
def simulate(
    system: System,
    start: Starts | None = None,
    periods: int | None = None,
    t_end: float | str | None = None,
    *,
    t_start: float | str = 0.0,
    method: Method | None = None,
    samples: int | None = None,
    at: Values | None = None,
    until: UntilTrue | None = None,
    keep: int | None = None,
    values: Mapping[str, Values] | None = None,
    time_errors: str = "measured",
    threads: int | None = None,
    progress: bool | Callable[[float], None] | None = None,
) -> xr.Dataset:
    """Run one trajectory, or many, and keep samples and every contact.

    Parameters
    ----------
    system : System
        Equations, contacts and parameter values.
    start : sequence, mapping or array
        State at the start: ``(0.0, 0.0)``, ``("1 mm", 0)``, ``{"x": [...], "v": [...]}`` or an
        array (trajectory, state). Numbers are SI. Default: all zero. Of a structure by its modes
        also deflections and velocities that sensors show, ``{"tip": "1 mm"}``: the state of least
        energy that shows them.
    periods : int
        Whole forcing periods to run.
    t_end : float or str
        Time at the end [s], in place of periods.
    t_start : float or str
        Time at the start [s]; the phase of the forcing is that of this time.
    method : Method
        Default :class:`saltus.Taylor`, or :class:`saltus.Modal` from eight states on where
        it serves; :class:`saltus.ODE45` for MATLAB's.
    samples : int
        Samples per forcing period (default 200), or over the whole span if the system isn't forced
        (default 10 000, and down to 2000 for many trajectories).
    at : float, str or sequence, optional
        Times at which the states are wanted [s], in any order, in place of ``samples``; text has a
        unit: ``["10 ms", "25 ms"]``. The result has these times in this order, each state with the
        flow's own precision. Without ``periods`` and ``t_end`` the run ends at the last of them.
    until : str or callable, optional
        Condition at which a trajectory ends, at the instant at which it becomes true:
        ``"x > 2 mm"``, ``"x > 2 mm and v < 0"``, with a name of several words in quotes,
        ``"'stop force' > 5 N"``; or a function of (t, states, parameters) by their names,
        ``lambda x: x > 2e-3``. A number, such as ``lambda x: x - 2e-3``, ends it where it crosses
        zero. Its status is then ``until``; ``periods`` or ``t_end`` are the end of those
        for which it never does. Samples reach as far as the last end.
    keep : int
        Number of periods at the end whose samples and contacts are kept (default all); with ``at``
        whose contacts.
    values : mapping
        Parameter values of this call: one each, or an array with one for each trajectory (the
        forcing frequency included).
    time_errors : {"measured", "local"}
        ``"measured"``: ``contact_time_error`` is estimated from three more runs of every
        trajectory, by a more exact method and nudged by roundings. ``"local"``: the error of the
        step that holds the contact only, at a quarter of the cost.
    threads : int
        Default all processors. Results don't depend on it.
    progress : bool or callable
        Default: a bar on the terminal if the work lasts more than two seconds. A callable gets the
        share done.

    Returns
    -------
    Dataset
        Dims ``time``, ``contact``, ``guard``, and ``trajectory`` for many starts or values.
        Variables: each state, ``mode``, ``contact_time``, ``contact_time_error``,
        ``contact_guard``, ``contact_direction``, ``contact_velocity``, ``contact_kind``, ...,
        each state at the contact (``contact_x``, behind it where it jumps; ``contact_x_before`` of
        systems with impacts or jumps), ``status``, counters. If the trajectories have forcing
        periods of their own, samples lie along ``period``; those of ``at`` along ``time``.

    Raises
    ------
    ParameterError, UnitError
        If an argument can't be used.
    Interrupted
        On Ctrl-C; its ``partial`` is the Dataset so far.

    References
    ----------
    Jorba & Zou, Exp. Math. 14 (2005) 99-117 (Taylor series); Shampine & Reichelt, SIAM J. Sci.
    Comput. 18 (1997) 1-22 (ode45).

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    >>> run = sl.simulate(rig, start=("1 mm", 0), periods=10)
    >>> run.sizes["contact"], bool(run["contact_time_error"].max() < 1e-12)
    (21, True)
    """
    method = check_method(method, system)
    check_system(system)
    many = trajectories(start, values)
    times = None if at is None else _given_times(system, many, at, samples)
    if times is not None and periods is None and t_end is None:
        t_end = last_of(times, t_start)
    if times is None and until is None:
        check_samples(system, many, least_samples(system, many, periods, samples, keep))
    group = ensemble(system, np.zeros(len(system.states)) if start is None else start, values)
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
    asked = _Asked(system, method, group, length, plan, times is not None, end)

    def so_far(outcome: Outcome) -> xr.Dataset:
        return _dataset(asked, outcome, measure.local(outcome))

    outcome = None
    with reporting(progress) as show:
        try:
            if end is not None and times is None:
                plan = end.plan(system, method, group, length, samples, threads, show)
                asked, show = replace(asked, plan=plan), end.afterwards(show)
            outcome, errors = asked.run(flown, time_errors == "measured", threads, show)
            result = _dataset(asked, outcome, errors)
        except KeyboardInterrupt as stop:
            if outcome is not None:
                raise Interrupted(partial(so_far, outcome)) from None
            raise stop.then(so_far) if isinstance(stop, engine.RunInterrupted) else stop from None
    if end is not None:
        end.warn_of_starts()
    warn(result, length, system)
    return result


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
class _Asked:
    """The arguments of a run, as they were read."""

    system: System
    method: Method
    group: Ensemble
    length: Span
    plan: SampleTimes
    given: bool
    end: Ending | None

    def run(
        self,
        flown: System,
        measured: bool,
        threads: int | None,
        show: Callable[[float], None] | None,
    ) -> tuple[Outcome, np.ndarray]:
        """The outcome of the system ``flown``, and the errors of its contact times [s]."""
        request = self.plan.request(self.group, self.length, len(flown.states))
        if self.end is not None:
            request = self.end.asked(request)
        if measured and self.system.guards and self.method.records_contacts:
            return measure.measured(flown, self.method, request, threads, show)
        method = self.method.suited_to(self.group.size)
        outcome = engine.run(flown, method, request, threads, show)
        return outcome, measure.local(outcome)


def _dataset(asked: _Asked, outcome: Outcome, errors: np.ndarray) -> xr.Dataset:
    """The Dataset of a run."""
    system, group, length, plan = asked.system, asked.group, asked.length, asked.plan
    forced = system.forced_at is not None
    own_periods = forced and bool(np.ptp(length.period) > 0)
    time, period = plan.of_result(outcome, length, forced)
    kept = plan.reached(outcome)
    samples, modes = outcome.samples[:, kept, : len(system.states)], outcome.sample_mode[:, kept]
    attrs: dict[str, Any] = {"sample_times": "given"} if asked.given else {}
    if asked.end is not None:
        outcome, errors = asked.end.of_the_user(outcome, errors)
        samples, modes = asked.end.with_ends(outcome, samples, modes, time)
        attrs["until"] = asked.end.condition.text
    subject = dataset_parts.trajectories(
        system,
        asked.method,
        group,
        (length.period if own_periods else float(length.period[0])) if forced else None,
    )
    subject = replace(subject, attrs={**subject.attrs, **attrs})
    values = {
        "trajectory": np.arange(group.size),
        **({"period": period} if forced and period is not None else {}),
        "time": time,
        "<state>": dataset_parts.motion_values(system, group, time, samples, modes),
        "mode": modes,
        **dataset_parts.contacts(system, group, outcome, errors),
        **dataset_parts.endings(outcome),
        **dataset_parts.minima(outcome),
        "end_time": outcome.time,
        "end_<state>": dataset_parts.motion_values(
            system, group, outcome.time, outcome.state, outcome.mode
        ),
    }
    return build(
        schema.TRAJECTORY,
        subject,
        values,
        along={"time": "period"} if own_periods and plan.given is None else {},
    )
