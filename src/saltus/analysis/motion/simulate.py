"""`simulate`: trajectories with every contact."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from saltus.analysis import dataset_parts
from saltus.analysis.inputs.verb import verb
from saltus.analysis.motion import time_errors as measure
from saltus.analysis.motion.motion_arrays import AskedMotion, MotionArrays, asked_motion
from saltus.analysis.outcome_messages import warn
from saltus.flow import engine
from saltus.flow.methods import Method
from saltus.flow.progress import reporting
from saltus.flow.request import Outcome
from saltus.interrupt import Interrupted
from saltus.results import build
from saltus.results.dataset import schema
from saltus.system import System
from saltus.system.quantity import jumping_states

if TYPE_CHECKING:
    from saltus.analysis.inputs.given import Starts, UntilTrue, Values


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
        it serves; :class:`saltus.ODE45` for MATLAB's. Its ``max_steps`` and ``max_events`` are
        the budget of a trajectory, which ends there with status ``budget_steps`` or
        ``budget_events``.
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
    asked = asked_motion(
        system,
        start,
        periods,
        t_end,
        t_start=t_start,
        method=method,
        samples=samples,
        at=at,
        until=until,
        keep=keep,
        values=values,
        time_errors=time_errors,
    )

    def so_far(outcome: Outcome) -> xr.Dataset:
        return simulation(asked, outcome, measure.local(outcome))

    outcome, end = None, asked.end
    with reporting(progress) as show:
        try:
            if end is not None and not asked.given:
                times = end.times(asked.method, asked.group, asked.length, threads, show)
                show = end.afterwards(asked.length, times, show)
                asked = asked.until(times)
            outcome, errors = asked.run(threads, show)
            result = simulation(asked, outcome, errors)
        except KeyboardInterrupt as stop:
            if outcome is not None:
                raise Interrupted(partial(so_far, outcome)) from None
            raise stop.then(so_far) if isinstance(stop, engine.RunInterrupted) else stop from None
    if end is not None:
        end.warn_of_starts()
    warn(result, asked.length, system)
    return result


def simulation(asked: AskedMotion, outcome: Outcome, errors: np.ndarray) -> xr.Dataset:
    """The Dataset of a run, with the errors of its contact times float64[c] [s]."""
    arrays = asked.arrays(outcome, errors)
    system, group, length, outcome = asked.system, asked.group, asked.length, arrays.outcome
    forced, own_periods = system.forced_at is not None, asked.own_periods
    attrs: dict[str, Any] = {"sample_times": "given"} if asked.given else {}
    if asked.end is not None:
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
        **({"period": arrays.period} if forced and arrays.period is not None else {}),
        "time": arrays.time,
        "<state>": arrays.values,
        "mode": arrays.mode,
        **_contacts(system, arrays),
        **dataset_parts.endings(outcome),
        **dataset_parts.minima(outcome),
        "end_time": outcome.time,
        "end_<state>": arrays.end_values,
    }
    return build(
        schema.TRAJECTORY,
        subject,
        values,
        along={"time": "period"} if own_periods and asked.plan.given is None else {},
    )


def _contacts(system: System, arrays: MotionArrays) -> dict[str, Any]:
    """The table of contacts; with the values before them where some jump."""
    table = arrays.contacts
    names = np.array([guard.name for guard in system.guards] or [""], dtype=np.str_)
    columns = ("direction", "velocity", "kind", "mode_before", "mode_after", "steps", "trajectory")
    values = {
        "contact_time": table.time,
        "contact_time_error": arrays.time_error,
        "contact_guard": names[table.guard],
        **{
            f"contact_{name}": table.kind_name if name == "kind" else getattr(table, name)
            for name in columns
        },
        "contact_<state>": arrays.contact_values,
    }
    if arrays.before is not None:
        known = (*system.states, *system.outputs.names)
        kept = known if jumping_states(system) else system.outputs.names
        values["contact_<state>_before"] = {
            name: column
            for name, column in zip(known, arrays.before.T, strict=True)
            if name in kept
        }
    return values
