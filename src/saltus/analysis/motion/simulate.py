"""`simulate`: trajectories with every contact."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis import dataset_parts
from saltus.analysis.inputs.starts import Ensemble, Span, check_system, ensemble, span, trajectories
from saltus.analysis.inputs.verb import verb
from saltus.analysis.motion import time_errors as measure
from saltus.analysis.outcome_messages import warn
from saltus.errors import ParameterError, among, must_be
from saltus.flow import engine
from saltus.flow.counts import whole
from saltus.flow.methods import Method, check_method
from saltus.flow.progress import reporting
from saltus.flow.request import Outcome, Request, Schedule
from saltus.flow.room import check_room
from saltus.interrupt import Interrupted
from saltus.results import build
from saltus.results.dataset import schema
from saltus.system import System
from saltus.system.quantity import remembering

#: Default samples per forcing period, enough for a picture; contacts are exact without them.
PER_PERIOD = 200
#: Samples over the whole span of an unforced system: a smooth curve over a hundred oscillations.
MOST_PER_SPAN = 10_000
#: Least number of these, for each of many trajectories.
LEAST_PER_SPAN = 2000


@verb
def simulate(
    system: System,
    start: Any = None,
    periods: int | None = None,
    t_end: float | str | None = None,
    *,
    t_start: float | str = 0.0,
    method: Method | None = None,
    samples: int | None = None,
    keep: int | None = None,
    values: Mapping[str, Any] | None = None,
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
        array (trajectory, state). Numbers are SI. Default: all zero.
    periods : int
        Whole forcing periods to run.
    t_end : float or str
        Time at the end [s], in place of periods.
    t_start : float or str
        Time at the start [s]; the phase of the forcing is that of this time.
    method : Method
        Default :class:`saltus.Taylor`; :class:`saltus.ODE45` for MATLAB's.
    samples : int
        Samples per forcing period (default 200), or over the whole span if the system isn't forced
        (default 10 000, and down to 2000 for many trajectories).
    keep : int
        Number of periods at the end whose samples and contacts are kept (default all).
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
        periods of their own, samples lie along ``period``.

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
    method = check_method(method)
    check_system(system)
    many = trajectories(start, values)
    _check_room(system, many, _least_samples(system, many, periods, samples, keep))
    group = ensemble(system, np.zeros(len(system.states)) if start is None else start, values)
    length = span(system, group, periods, t_end, t_start)
    flown = remembering(system)
    plan = _plan(system, group, length, samples, keep, len(flown.states))
    if not among(time_errors, ("measured", "local")):
        raise must_be("time_errors", '"measured" or "local"', time_errors)

    def so_far(outcome: Outcome) -> xr.Dataset:
        return _dataset(system, method, group, length, plan, outcome, measure.local(outcome))

    outcome, request = None, plan.request(group, length, len(flown.states))
    with reporting(progress) as show:
        try:
            if time_errors == "measured" and system.guards and method.records_contacts:
                outcome, errors = measure.measured(flown, method, request, threads, show)
            else:
                outcome = engine.run(flown, method.suited_to(group.size), request, threads, show)
                errors = measure.local(outcome)
            result = _dataset(system, method, group, length, plan, outcome, errors)
        except KeyboardInterrupt as stop:
            if outcome is not None:
                raise Interrupted(partial(so_far, outcome)) from None
            raise stop.then(so_far) if isinstance(stop, engine.RunInterrupted) else stop from None
    warn(result, length, system)
    return result


@dataclass(frozen=True)
class _Plan:
    """The samples and contacts that are kept."""

    schedule: Schedule
    first: int

    def request(self, group: Ensemble, length: Span, states: int) -> Request:
        more = ((0, 0), (0, states - group.start.shape[1]))
        return replace(
            length.request(np.pad(group.start, more), group.parameters, self.schedule, self.first),
            t_end=length.t_end,
        )


def _plan(
    system: System,
    group: Ensemble,
    length: Span,
    samples: int | None,
    keep: int | None,
    states: int,
) -> _Plan:
    per = _whole(
        samples, "samples", _per_span(group.size) if system.forced_at is None else PER_PERIOD
    )
    last = int(np.max(length.count + length.phase / length.period))
    periods_kept = _whole(keep, "keep", max(last, 1))
    if keep is not None and system.forced_at is None:
        raise ParameterError(
            lambda say: (
                f"{system.name} has no forcing period, so {say.key('keep')} has no "
                f"meaning. Start later, or take fewer {say.key('samples')}."
            )
        )
    first = max(int(np.min(length.count)) - periods_kept, 0) if keep is not None else 0
    longest = np.max((length.count + length.phase / length.period) * per)
    count = int(longest + 1e-9) + 1 - first * per
    _check_room(system, group.size, count, states)
    periods = np.arange(first, first - (-count // per))
    return _Plan(
        Schedule(
            np.repeat(periods, per)[:count], np.tile(np.arange(per) / per, len(periods))[:count]
        ),
        first,
    )


def _least_samples(system: System, trajectories: int, periods: Any, samples: Any, keep: Any) -> int:
    """Least number of samples of each trajectory, known before any array is made."""
    if system.forced_at is None:
        return _whole(samples, "samples", _per_span(trajectories)) + 1
    if periods is None:
        return 1
    kept = whole(periods, "periods")
    return min(kept, _whole(keep, "keep", kept)) * _whole(samples, "samples", PER_PERIOD) + 1


def _check_room(system: System, trajectories: int, samples: int, states: int | None = None) -> None:
    """Raise a ParameterError if samples of so many trajectories don't fit into memory."""
    check_room(
        samples
        * trajectories
        * (16.0 * ((states or len(system.states)) + len(system.outputs)) + 16.0),
        f"{trajectories} trajectories with {samples} samples each",
        lambda say: (
            f"Give {say.key('keep')} (last periods) or fewer {say.key('samples')}, or use "
            f"{say.verb('stroboscope')}."
        ),
    )


def _per_span(trajectories: int) -> int:
    """Samples of a motion without forcing: enough for a smooth curve, fewer for many
    trajectories.
    """
    return max(MOST_PER_SPAN // max(trajectories // 20, 1), LEAST_PER_SPAN)


def _whole(value: int | None, name: str, default: int) -> int:
    return default if value is None else whole(value, name)


def _dataset(
    system: System,
    method: Method,
    group: Ensemble,
    length: Span,
    plan: _Plan,
    outcome: Outcome,
    errors: np.ndarray,
) -> xr.Dataset:
    """The Dataset of a run."""
    reached = slice(outcome.reached())
    count, fraction = plan.schedule.count[reached], plan.schedule.fraction[reached]
    forced = system.forced_at is not None
    own_periods = forced and bool(np.ptp(length.period) > 0)
    scale = length.period[:, None] if own_periods else length.period[0]
    time = np.minimum(length.t_start + (count * scale + fraction * scale), length.t_end)
    subject = dataset_parts.trajectories(
        system,
        method,
        group,
        (length.period if own_periods else float(length.period[0])) if forced else None,
    )
    values = {
        "trajectory": np.arange(group.size),
        **({"period": count + fraction} if forced else {}),
        "time": time,
        "<state>": dataset_parts.motion_values(
            system, group, time, outcome.samples[:, reached], outcome.sample_mode[:, reached]
        ),
        "mode": outcome.sample_mode[:, reached],
        **dataset_parts.contacts(system, group, outcome, errors),
        **dataset_parts.endings(outcome),
        **dataset_parts.minima(outcome),
        "end_time": outcome.time,
        "end_<state>": dataset_parts.motion_values(
            system, group, outcome.time, outcome.state, outcome.mode
        ),
    }
    return build(
        schema.TRAJECTORY, subject, values, along={"time": "period"} if own_periods else {}
    )
