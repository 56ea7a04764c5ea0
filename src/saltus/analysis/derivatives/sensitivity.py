"""`sensitivity`: derivatives of a motion, or of a periodic orbit, with respect to parameters,
through its contacts.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.derivatives.carried import CarriedDerivatives
from saltus.analysis.derivatives.closed_orbits import (
    check_orbits,
    closed_orbits,
    warn_of_orbits,
)
from saltus.analysis.derivatives.columns import Columns, Turning, turning_surfaces
from saltus.analysis.derivatives.sensitivity_table import (
    SensitivityRun,
    sensitivity_dataset,
    sensitivity_rows,
)
from saltus.analysis.inputs.given import Starts, Values
from saltus.analysis.inputs.orbits import given_orbits
from saltus.analysis.inputs.spans import span
from saltus.analysis.inputs.starts import check_system, ensemble
from saltus.analysis.inputs.verb import verb
from saltus.analysis.motion.sample_times import (
    at_times,
    first_kept,
    last_of,
    planned,
    times_of,
)
from saltus.analysis.outcome_messages import warn
from saltus.errors import ParameterError, SaltusWarning
from saltus.flow import engine
from saltus.flow.methods import Method, check_method
from saltus.flow.progress import reporting
from saltus.flow.request import Outcome
from saltus.flow.taylor import Taylor
from saltus.system import System
from saltus.system.outputs import with_more
from saltus.system.read_off import Quantity

#: Change of a parameter, in itself, for which derivatives should hold at least.
SLIGHT = 1e-6


@verb
def sensitivity(
    system: System,
    start: xr.Dataset | Starts | None = None,
    periods: int | None = None,
    t_end: float | str | None = None,
    *,
    to: str | Sequence[str],
    outputs: Mapping[str, Quantity] | None = None,
    extremes: bool = True,
    t_start: float | str = 0.0,
    samples: int | None = None,
    at: Values | None = None,
    keep: int | None = None,
    values: Mapping[str, Values] | None = None,
    method: Method | None = None,
    threads: int | None = None,
    progress: bool | Callable[[float], None] | None = None,
) -> xr.Dataset:
    """Derivatives of a motion, its contact times and its largest values with respect to parameters;
    of a periodic orbit those of its multipliers too.

    The flow carries the derivatives along, across contacts by the saltation matrix: they are exact
    but for rounding, as differences of two runs aren't. They hold for changes so small that the
    contacts stay the same ones in the same order. Where a contact is grazed (a small
    ``contact_velocity``) that range is small; at the graze of a rigid stop the slope on the side
    with contact is infinite. In a chaotic motion the range shrinks with the time: a warning says
    from when on it is below a millionth.

    A periodic orbit, stable or not, moves as a whole: dx/dp = (1 - dP/dx)^-1 dP/dp of the map P
    over its period. At a fold these are infinite, on the side with contact of a graze of a rigid
    stop too; a warning says so. One of a family, with a multiplier of 1, has none: they are NaN.
    Derivatives of multipliers are differences of fourth order of multipliers from the exact tangent
    map, along the orbit as it moves. NaN or large numbers are those of multipliers that coincide.

    Parameters
    ----------
    system, periods, t_end, t_start, samples, at, keep, values, threads, progress
        As for :func:`saltus.simulate`.
    method : Method
        As for :func:`saltus.simulate`. Where modes go together, as rigid bodies and resonances of
        :class:`saltus.Modal`, its derivatives with respect to parameters are those of
        :class:`saltus.Taylor`.
    start : Dataset, or starts
        Starts as for :func:`saltus.simulate`; or what :func:`saltus.periodic_orbits`,
        :func:`saltus.attractors`, :func:`saltus.frequency_response` or :func:`saltus.branches`
        returned: periodic orbits of one period, such as ``orbits.sel(orbit=0)``, with their values
        of the parameters. They are followed over one period from t = 0 on. Limit cycles one at a
        time.
    to : str or sequence of str
        Parameters, and states at the start as ``"x(0)"``: what the derivatives are with respect to.
    outputs : mapping of str to callable, or to (callable, unit)
        More outputs by name, functions of (t, states, parameters).
        States and named outputs of the system are taken without being asked for.
    extremes : bool
        Largest and smallest values with their derivatives. Each costs a surface that the flow
        looks for. Of a structure by its modes: of its outputs alone. NaN for what turns at times of
        its own, such as a drive, and in the modal flow for what a damped contact switches.

    Returns
    -------
    Dataset
        Dims ``time``, ``output``, ``to``, ``contact``, and ``trajectory`` for many starts or
        values. ``value`` and ``derivative`` (at fixed times) of states and outputs;
        ``contact_time`` and ``contact_time_derivative``: what an impact, a jump or another contact
        causes at its own instant moves with it, what a jump of a drive causes keeps its phase. NaN
        at the end of a chatter, and where the motion stays on the boundary; ``maximum``,
        ``maximum_time``, ``maximum_derivative``, ``minimum`` likewise, of what is kept;
        ``end_derivative``, at the time of the end as it is; ``status``. Units in ``output_units``,
        ``to_units``. Of periodic orbits also ``period``, ``period_derivative``,
        and over the dim ``multiplier`` ``multiplier_real``, ``multiplier_imag``,
        ``multiplier_real_derivative`` and ``multiplier_imag_derivative`` (of a limit cycle without
        the trivial one). The times of a limit cycle count from its first point, which moves across
        the flow.

    Raises
    ------
    ParameterError, UnitError
        If an argument can't be used.
    TraceError
        If a function can't be traced.
    Interrupted
        On Ctrl-C; its ``partial`` is the Dataset so far.

    References
    ----------
    Leine & Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems (2004), section 7;
    Galan, Feehery & Barton, Appl. Numer. Math. 31 (1999) 17-47 (sensitivities of hybrid systems).

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("b", force="4 N", frequency="15 Hz")
    >>> found = sl.sensitivity(rig, ("1 mm", 0), periods=5, to=["upper_gap", "force"])
    >>> dict(found.maximum_derivative.sizes)
    {'output': 2, 'to': 2}
    """
    with reporting(progress) as show:
        for by in (method, Taylor()):  # the second one where modes go together
            run = sensitivity_run(
                system, start, periods, t_end, to=to, outputs=outputs, extremes=extremes,
                t_start=t_start, samples=samples, at=at, keep=keep, values=values, method=by,
                threads=threads,
            )  # fmt: skip

            def answer(outcome: Outcome, run: SensitivityRun = run) -> xr.Dataset:
                return sensitivity_dataset(run, sensitivity_rows(run, outcome))

            try:
                outcome = run.fly(run.request, threads, show)
            except engine.RunInterrupted as stop:
                raise stop.then(answer) from None
            if not run.flow.lost(run.flow.ends(outcome, run.group, run.length)):
                break
        result = answer(outcome)
    warn(result, run.length, system)
    if run.closed is None:
        warn_of_limits(system, result)
    else:
        warn_of_orbits(system, result, run.closed)
    return result


def sensitivity_run(
    system: System, start: Any, periods: Any, t_end: Any, *, to: Any, outputs: Any, extremes: bool,
    t_start: Any, samples: Any, keep: Any, values: Any, method: Method | None, at: Any = None,
    threads: int | None = None,
) -> SensitivityRun:  # fmt: skip
    """The run that the arguments of :func:`sensitivity` ask for. Orbits are closed first.

    Raises
    ------
    ParameterError, UnitError, TraceError
        If an argument can't be used.
    """
    check_system(system)
    method = check_method(method, system)
    asked = Columns.of(system, to)
    if outputs is not None:
        system = replace(system, outputs=with_more(system, outputs))
    orbits = isinstance(start, xr.Dataset)
    if isinstance(start, xr.Dataset):
        check_orbits(asked.names, asked.parameters, periods, t_end, t_start, values)
        group, around = given_orbits(system, start)
    else:
        group = ensemble(system, start, values)
    times = None if at is None else times_of(system, group.size, at)
    if times is not None and samples is not None:
        raise ParameterError(
            lambda say: f"give {say.key('at')} or {say.key('samples')}, and only one of them."
        )
    if times is not None and periods is None and t_end is None:
        t_end = last_of(times, t_start)
    length = around if orbits else span(system, group, periods, t_end, t_start)
    turning = turning_surfaces(system, method) if extremes else Turning(system, {}, [])
    flow, closed = CarriedDerivatives(turning.system, method, asked.parameters), None
    if orbits:
        suited = method.suited_to(group.size)
        fly = partial(engine.run, flow.flown, suited)
        closed = closed_orbits(flow, group, length, lambda one: fly(one, threads))
        group, length = closed.group, closed.length
    plan = (
        planned(system, group, length, samples, keep, 2 * len(flow.flown.states))
        if times is None
        else at_times(length, first_kept(system, length, keep), times)
    )
    return SensitivityRun(
        system=system, flow=flow, group=group, method=method, length=length, plan=plan,
        turning=turning, asked=asked, closed=closed,
    )  # fmt: skip


def warn_of_limits(system: System, result: xr.Dataset) -> None:
    """Say so where derivatives of a motion hold for no change at all, or for none on one side."""
    rigid = any(one.law is not None and one.law.kind == "impact" for one in system.guards)
    if rigid and (result["status"].values == "graze_unresolved").any():
        warnings.warn(
            SaltusWarning(
                "a contact is grazed to rounding (status graze_unresolved). At the graze of a "
                "rigid stop the slope is infinite on the side with contact: derivatives from there "
                "on, and those of a largest value there, are of neither side. Compare with runs at "
                "values a little above and below."
            ),
            stacklevel=2,
        )
    _warn_of_chaos(result)


def _warn_of_chaos(result: xr.Dataset) -> None:
    """Say so where a change of a parameter by :data:`SLIGHT` of itself moves an output by more than
    its range: between its extremes where they are known, else of its samples.
    """
    size = np.abs(result["to_value"].values)[..., None, None, :]
    change = SLIGHT * np.abs(result["derivative"].values) * size
    values = result["value"].values
    if "maximum" in result:
        span = result["maximum"].values - result["minimum"].values
    else:
        span = np.nanmax(values, axis=-2, initial=-np.inf)
        span = span - np.nanmin(values, axis=-2, initial=np.inf)
    beyond = change > np.where(span > 0, span, np.inf)[..., None, :, None]
    if not beyond.any():
        return
    times = np.broadcast_to(result["time"].values, values.shape[:-1])[beyond.any(axis=(-2, -1))]
    warnings.warn(
        SaltusWarning(
            f"the derivatives grow beyond use: from t = {times.min():.6g} s on, a change of a "
            f"parameter by {SLIGHT:g} of itself would change an output by more than its range. "
            "Run for a shorter time, or take averages of many motions."
        ),
        stacklevel=3,
    )
