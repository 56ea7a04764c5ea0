"""`sensitivity`: derivatives of a motion, or of a periodic orbit, with respect to parameters,
through its contacts.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis import dataset_parts
from saltus.analysis.derivatives.carried import HELD, CarriedDerivatives, Places
from saltus.analysis.derivatives.closed_orbits import (
    ClosedOrbits,
    check_orbits,
    closed_orbits,
    warn_of_orbits,
)
from saltus.analysis.derivatives.readings import Readings, slope_of
from saltus.analysis.inputs.given import Starts, Values
from saltus.analysis.inputs.orbits import given_orbits
from saltus.analysis.inputs.outputs import outputs_of
from saltus.analysis.inputs.spans import Span, span
from saltus.analysis.inputs.starts import Ensemble, check_system, ensemble
from saltus.analysis.inputs.verb import verb
from saltus.analysis.motion.sample_times import (
    SampleTimes,
    at_times,
    first_kept,
    last_of,
    planned,
    times_of,
)
from saltus.analysis.outcome_messages import warn
from saltus.errors import ParameterError, SaltusWarning, among, must_be, unknown
from saltus.flow import engine
from saltus.flow.contact_table import ContactTable
from saltus.flow.methods import Method, check_method
from saltus.flow.progress import reporting
from saltus.flow.request import Outcome, Request
from saltus.language.evaluate import evaluate
from saltus.language.expression import TIME, parameter, state
from saltus.results import build
from saltus.results.dataset import schema
from saltus.system import System
from saltus.system.outputs import with_more
from saltus.system.quantity import with_turning_surfaces
from saltus.system.read_off import Quantity

#: Change of a parameter, in itself, for which derivatives should hold at least.
SLIGHT = 1e-6
#: Counters that are kept.
COUNTED = ("steps", "rejected_steps", "mode_violations", "grazes_unresolved")
#: Kinds of contacts at which states jump.
JUMPS = ("impact",)
#: Rate of a gap at a contact, in the largest at its contacts, below which the contact's time isn't
#: that of a zero of the gap: the motion rests there, or goes along the boundary.
LEAVES = 1e-9


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
    stop too; a warning says so. Derivatives of multipliers are differences of fourth order of
    multipliers from the exact tangent map, along the orbit as it moves. NaN or large numbers are
    those of multipliers that coincide.

    Parameters
    ----------
    system, periods, t_end, t_start, samples, at, keep, values, method, threads, progress
        As for :func:`saltus.simulate`.
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
        ``contact_time`` and ``contact_time_derivative``, NaN where the time isn't that of a gap's
        zero (release, the end of a chatter) or the motion stays on the boundary; ``maximum``,
        ``maximum_time``, ``maximum_derivative``, ``minimum`` likewise, of what is kept;
        ``end_derivative``; ``status``. Units in ``output_units``, ``to_units``. Of periodic orbits
        also ``period``, ``period_derivative``, and over the dim ``multiplier``
        ``multiplier_real``, ``multiplier_imag``, ``multiplier_real_derivative`` and
        ``multiplier_imag_derivative`` (of a limit cycle without the trivial one). The times of a
        limit cycle count from its first point, which moves across the flow.

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
        group = ensemble(system, np.zeros(len(system.states)) if start is None else start, values)
    times = None if at is None else times_of(system, group.size, at)
    if times is not None and samples is not None:
        raise ParameterError(
            lambda say: f"give {say.key('at')} or {say.key('samples')}, and only one of them."
        )
    if times is not None and periods is None and t_end is None:
        t_end = last_of(times, t_start)
    length = around if orbits else span(system, group, periods, t_end, t_start)
    turning = _turning(system, method) if extremes else _Turning(system, {}, [])
    flow = CarriedDerivatives(turning.system, method, asked.parameters)
    with reporting(progress) as show:
        fly = partial(engine.run, flow.flown, method.suited_to(group.size))
        closed = None
        if orbits:
            closed = closed_orbits(flow, group, length, lambda one: fly(one, threads))
            group, length = closed.group, closed.length
        plan = (
            planned(system, group, length, samples, keep, 2 * len(flow.flown.states))
            if times is None
            else at_times(length, first_kept(system, length, keep), times)
        )
        run = _Run(
            system=system, flow=flow, group=group, method=method, length=length, plan=plan,
            turning=turning, asked=asked, closed=closed,
        )  # fmt: skip
        answer = partial(_dataset, run)
        try:
            result = answer(fly(flow.request(group, length, plan), threads, show))
        except engine.RunInterrupted as stop:
            raise stop.then(answer) from None
    warn(result, length, system)
    if closed is None:
        _warn_of_chaos(result)
    else:
        warn_of_orbits(system, result, closed)
    return result


def _warn_of_chaos(result: xr.Dataset) -> None:
    """Say so where a motion is so sensitive that its derivatives hold for no change at all."""
    size = np.abs(result["to_value"].values)[..., None, None, :]
    change = SLIGHT * np.abs(result["derivative"].values) * size
    values = result["value"].values
    span = np.nanmax(values, axis=-2, initial=-np.inf) - np.nanmin(values, axis=-2, initial=np.inf)
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
        stacklevel=2,
    )


# -- what is asked for -----------------------------------------------------------------------------
@dataclass(frozen=True)
class Columns:
    """The columns of derivatives that were asked for.

    Attributes
    ----------
    names : tuple of str
        As the user gave them: parameters, and starts as ``x(0)``.
    parameters : tuple of str
        The parameters among them.
    places : list of int
        Where each stands among the columns of the flow: starts, then parameters.
    """

    names: tuple[str, ...]
    parameters: tuple[str, ...]
    places: list[int]

    @classmethod
    def of(cls, system: System, to: Any) -> Columns:
        """The columns of a user's ``to``."""
        given = [to] if isinstance(to, str) else to
        if (
            not isinstance(given, Sequence)
            or not given
            or not all(isinstance(name, str) for name in given)
        ):
            raise must_be("to", 'parameters, such as ["gap"], or starts, such as "x(0)"', to)
        starts = [f"{name}(0)" for name in system.states]
        for name in given:
            if not among(name, (*system.values, *starts)):
                raise unknown(
                    f"{system.name} has no parameter or start", name, (*system.values, *starts)
                )
        if len(set(given)) != len(given):
            raise ParameterError("to names something twice. Name each parameter once.")
        parameters = tuple(name for name in given if name not in starts)
        columns = (*starts, *parameters)
        return cls(tuple(given), parameters, [columns.index(name) for name in given])

    def units(self, system: System) -> list[str]:
        """Unit of each."""
        return [system.units.get(name.removesuffix("(0)"), "") for name in self.names]

    def values(self, system: System, group: Ensemble) -> np.ndarray:
        """Value of each, float64[n, C]."""
        rows = np.broadcast_to(group.parameters, (group.size, group.parameters.shape[1]))
        known = dict(zip(system.values, rows.T, strict=True))
        known |= {f"{name}(0)": group.start[:, i] for i, name in enumerate(system.states)}
        return np.stack([known[name] for name in self.names], axis=1)


@dataclass(frozen=True)
class _Turning:
    """A system with surfaces on which outputs turn.

    Attributes
    ----------
    system : System
        The surfaces are guards of it behind those of the system.
    of : mapping of int to int
        The output of each of these guards.
    known : list of int
        The outputs that turn there only.
    """

    system: System
    of: Mapping[int, int]
    known: list[int]


def _turning(system: System, method: Method) -> _Turning:
    """The system with surfaces on which its outputs turn; of a structure by its modes not the
    modes. A surface for which another flow would have to stand in is left out.
    """
    served = method.serving(system.origin)
    names = (*system.states, *system.outputs.names)
    wanted = names[len(system.states) :] if system.outputs.first else names
    found, of, known = with_turning_surfaces(
        system, wanted, lambda more: method.serving(more.origin) == served
    )
    return _Turning(
        found,
        {guard: names.index(name) for guard, name in of.items()},
        [names.index(name) for name in known],
    )


# -- the answer ------------------------------------------------------------------------------------
@dataclass(frozen=True, kw_only=True)
class _Run(Readings):
    """A run of the flow that carries derivatives."""

    method: Method
    length: Span
    plan: SampleTimes
    turning: _Turning
    asked: Columns
    closed: ClosedOrbits | None

    def chosen(self, slopes: np.ndarray, who: np.ndarray) -> np.ndarray:
        """The derivatives that were asked for, float64[m, ..., to], of all columns float64[m, ...,
        C] at places of trajectories int64[m].
        """
        if self.closed is None:
            return slopes[..., self.asked.places]
        weights = self.closed.weights[who]
        return np.asarray(np.einsum("m...c,mct->m...t", slopes, weights))

    def again(self, request: Request) -> Outcome:
        """The outcome of another request of the flow."""
        return engine.run(self.flow.flown, self.method.suited_to(1), request, 1)

    def contact_times(self, at: Places, table: ContactTable) -> np.ndarray:
        """Derivatives of the times of contacts, float64[m, C]: the gap of each stays zero. NaN
        where it is zero beside the contact too.
        """
        moved = np.full((len(at.time), at.slopes.shape[2]), np.nan)
        rates, system = self.flow.rates(at, self.group), self.turning.system
        begins = np.isin(table.kind_name, HELD)
        met = np.arange(len(system.guards))  # where a contact begins to be held
        for number, one in enumerate(system.guards):
            if one.law is not None and one.law.kind == "hold":
                met[number] = one.law.partner
        guard = np.where(begins, met[table.guard], table.guard)
        for number in np.unique(guard):
            here = guard == number
            gap = system.guards[number].gap
            leaves = [*map(state, system.states), *map(parameter, self.flow.names), TIME]
            found = evaluate(
                [slope_of(gap, leaf) for leaf in leaves],
                t=at.time[here],
                states=dict(zip(system.states, at.states[here].T, strict=True)),
                values=self.flow.parameters(self.group, at.trajectory[here]),
                bits=[(at.mode[here] >> i) & 1 == 1 for i in range(len(system.guards))],
            )
            slopes = np.stack([np.broadcast_to(one, here.sum()) for one in found], axis=1)
            size = len(system.states)
            change = np.einsum("mi,mic->mc", slopes[:, :size], at.slopes[here])
            change[:, size:] += slopes[:, size:-1]
            rate = np.einsum("mi,mi->m", slopes[:, :size], rates[here]) + slopes[:, -1]
            leaves_it = np.abs(rate) > LEAVES * np.abs(rate).max()
            with np.errstate(divide="ignore", invalid="ignore"):
                moved[here] = np.where(leaves_it[:, None], -change / rate[:, None], np.nan)
        return moved


def _dataset(run: _Run, outcome: Outcome) -> xr.Dataset:
    """The Dataset of a run."""
    system, group, length, turning = run.system, run.group, run.length, run.turning
    asked = run.asked
    n, forced = group.size, system.forced_at is not None
    unit = length.period if run.flow.timed else np.ones(n)
    time, _ = run.plan.of_result(outcome, length, forced)
    kept = run.plan.reached(outcome)
    count = time.shape[-1]
    own = np.broadcast_to(time, (n, count))
    at = run.flow.samples(outcome, group, length, own, kept)
    outputs = outputs_of(system)
    value = run.values(at).reshape(n, count, -1)
    slope = run.chosen(run.slopes(at), at.trajectory).reshape(n, count, len(outputs), -1)
    table = outcome.contacts
    touch = run.flow.contacts(outcome, group, length, run.again)
    speed = table.velocity / unit[table.trajectory]
    moved = run.contact_times(touch, table)
    mine = np.flatnonzero(table.guard < len(system.guards))
    names = np.array([guard.name for guard in system.guards] or [""], dtype=np.str_)
    end = run.flow.ends(outcome, group, length)
    subject = dataset_parts.trajectories(
        system,
        run.method,
        group,
        (length.period if np.ptp(length.period) > 0 else float(length.period[0]))
        if forced
        else None,
    )
    return build(
        schema.SENSITIVITY,
        subject,
        {
            "trajectory": np.arange(n),
            "time": time,
            "to": list(asked.names),
            "to_units": asked.units(system),
            "to_value": asked.values(system, group),
            "output": list(outputs.names),
            "output_units": list(outputs.units),
            "value": value,
            "derivative": slope,
            "contact_time": touch.time[mine],
            "contact_time_derivative": run.chosen(moved, touch.trajectory)[mine],
            "contact_guard": names[table.guard[mine]],
            "contact_kind": table.kind_name[mine],
            "contact_velocity": speed[mine],
            "contact_trajectory": table.trajectory[mine],
            **(_extremes(run, outcome, touch, moved, at, end) if turning.known else {}),
            "end_derivative": run.chosen(run.slopes(end), end.trajectory),
            **(_of_orbits(run.closed, end) if run.closed is not None else {}),
            **dataset_parts.endings(outcome, COUNTED),
            "end_time": end.time,
            "end_<state>": run.values(end),
        },
        words={"<slope>": "", "<to>": ""},
    )


def _of_orbits(closed: ClosedOrbits, end: Places) -> dict[str, np.ndarray]:
    """The variables that only periodic orbits have."""
    own, slope = closed.multipliers, closed.multiplier_slope
    return {
        "period": end.time,
        "period_derivative": closed.period_slope,
        "multiplier_real": own.real,
        "multiplier_imag": own.imag,
        "multiplier_real_derivative": slope.real,
        "multiplier_imag_derivative": slope.imag,
    }


def _extremes(
    run: _Run, outcome: Outcome, touch: Places, moved: np.ndarray, samples: Places, end: Places
) -> dict[str, np.ndarray]:  # fmt: skip
    """The largest and smallest values of each output, when, and their derivatives: where it turns,
    at a contact, just before it, at the first sample that is kept or at the end.
    """
    n, ahead = run.group.size, outcome.contacts.mode_before
    guard = outcome.contacts.guard
    first = _rows(samples, np.searchsorted(samples.trajectory, np.arange(n)))
    turns = np.isin(guard, list(run.turning.of))
    still = np.where(turns[:, None], 0.0, moved)
    early = touch  # what an impact changes has one more value, just before it
    if np.isin(outcome.contacts.kind_name, JUMPS).any():
        kinds = (*HELD, *JUMPS)
        early = run.flow.contacts(outcome, run.group, run.length, run.again, kinds)
    parts = [(touch, still, None), (early, still, ahead), (first, None, None)]
    if run.closed is None:  # an orbit ends where it begins, whose own slope is known
        parts.append((end, None, None))
    value = np.concatenate([run.values(at, mode) for at, _, mode in parts])
    slope = np.concatenate([run.slopes(*part) for part in parts])
    time = np.concatenate([at.time for at, _, _ in parts])
    who = np.concatenate([at.trajectory for at, _, _ in parts])
    slope = run.chosen(slope, who)
    of = np.full(len(time), -1)
    of[: 2 * len(guard)] = np.tile([run.turning.of.get(int(one), -1) for one in guard], 2)
    width = value.shape[1]
    found = {
        f"{word}{part}": np.full((n, width, *more), np.nan)
        for word in ("maximum", "minimum")
        for part, more in (("", ()), ("_time", ()), ("_derivative", slope.shape[2:]))
    }
    for i in range(n):
        mine = np.flatnonzero(who == i)
        for k in run.turning.known:
            here = mine[(of[mine] == k) | (of[mine] < 0)]
            here = here[np.isfinite(value[here, k])]
            if not len(here):
                continue
            for word, choose in (("maximum", np.argmax), ("minimum", np.argmin)):
                place = here[choose(value[here, k])]
                found[word][i, k] = value[place, k]
                found[f"{word}_time"][i, k] = time[place]
                found[f"{word}_derivative"][i, k] = slope[place, k]
    return found


def _rows(at: Places, which: np.ndarray) -> Places:
    return Places(
        at.time[which], at.states[which], at.slopes[which], at.mode[which], at.trajectory[which]
    )
