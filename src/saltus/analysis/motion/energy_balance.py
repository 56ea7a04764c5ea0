"""`energy_balance`: energy stored, supplied and dissipated in a motion."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

import numpy as np
import xarray as xr

from saltus.analysis.inputs.given import Starts, Values
from saltus.analysis.inputs.starts import check_system
from saltus.analysis.inputs.verb import verb
from saltus.analysis.motion.window import Stretch, computed, dataset, stretch
from saltus.analysis.outcome_messages import warn
from saltus.errors import ParameterError
from saltus.flow.counts import whole
from saltus.flow.methods import Method, check_method
from saltus.flow.request import Outcome, Schedule
from saltus.flow.room import check_room
from saltus.language.evaluate import evaluate
from saltus.language.expression import Expr
from saltus.results.dataset import schema
from saltus.system import System
from saltus.system.quantity import with_integrals, with_losses
from saltus.system.read_off import Quantity, quantity

#: Default number of intervals of an unforced system's span.
INTERVALS = 100
#: Names of the states that hold the integrals, by content, and of the sum of the losses at impacts;
#: chosen so that no system has them.
_NAMES = {
    "supplied": "work_supplied_",
    "dissipated": "energy_dissipated_",
    "friction": "work_friction_",
}
_IMPACTS = "energy_impacts_"


@verb
def energy_balance(
    system: System,
    start: Starts | None = None,
    *,
    energy: Quantity,
    supplied: Quantity,
    dissipated: Quantity,
    friction: Quantity | None = None,
    periods: int | None = None,
    t_end: float | str | None = None,
    t_start: float | str = 0.0,
    transient: int | float | str = 0,
    intervals: int | None = None,
    method: Method | None = None,
    values: Mapping[str, Values] | None = None,
    threads: int | None = None,
    progress: bool | Callable[[float], None] | None = None,
) -> xr.Dataset:
    """Energy stored, supplied and dissipated, forcing period by forcing period; the residual must
    be zero.

    The powers are integrated along the motion as states of their own, so with the flow's precision:
    with :class:`saltus.Taylor` the residual is rounding. A residual that is larger says that a term
    is missing in one of the functions, or that the equations aren't those of the system that one
    has in mind.

    What impacts and jumps of the state take (``sl.impact``, ``sl.jump``) is counted as they happen:
    the energy before each less that behind it, those of a chatter and the coming to rest among
    them.

    Parameters
    ----------
    system, start, t_start, method, values, threads, progress
        As for :func:`saltus.simulate`. ``ODE45`` controls the errors of the integrals too, so
        its steps may differ from those without.
    energy : callable
        Stored energy [J], a function of (t, states, parameters); its arguments are found by name.
        Comparisons in it that are contacts of the system read the same sides.
    supplied, dissipated : callable
        Power that flows in, and power that is lost [W], likewise.
    friction : callable, optional
        Power that friction takes [W], likewise, as a part of its own: leave it out of
        ``dissipated``. :func:`saltus.friction` and :func:`saltus.sign` of a contact that sticks are
        the force that holds it.
    periods : int
        Whole forcing periods after the transient.
    t_end : float or str
        Time at the end [s], in place of periods; of a forced system at a whole period.
    transient : int, or float or str
        Whole forcing periods before; of an unforced system a time [s].
    intervals : int
        Equal intervals into which the run of an unforced system is cut (default 100); those that
        end in the transient are left out.

    Returns
    -------
    Dataset
        Dims ``period`` (at the end of each interval; of an unforced system ``time``), and
        ``trajectory`` for many. ``energy`` at the end of the interval; ``change``, ``supplied``,
        ``dissipated`` in it, with ``friction=`` ``friction``, of a system with impacts or jumps
        ``impacts``; and ``residual`` = supplied - dissipated - friction - impacts - change [J];
        ``imbalance``: the largest residual relative to the largest of these; ``status``, counters.

    Raises
    ------
    ParameterError, UnitError
        If an argument can't be used.
    TraceError
        If one of the functions can't be traced.
    Interrupted
        On Ctrl-C; its ``partial`` is the Dataset so far.

    Examples
    --------
    Published models bring the three functions along.

    >>> import saltus as sl
    >>> rig = sl.models.delangre("b", force="4 N", frequency="15 Hz")
    >>> balance = sl.energy_balance(rig, periods=20, transient=200, **sl.models.energy("delangre"))
    >>> bool(balance["imbalance"].max() < 1e-10)
    True
    """
    check_system(system)
    method = check_method(method, system)
    stored, guards = quantity(system, energy, "the energy")
    powers = {"supplied": supplied, "dissipated": dissipated, "friction": friction}
    parts = {name: power for name, power in powers.items() if power is not None}
    whole_system = with_integrals(
        replace(system, guards=guards),
        {_NAMES[name]: power for name, power in parts.items()},
        {_NAMES[name]: "J" for name in parts},
    )
    names = list(parts)
    if any(guard.law and guard.law.kind in ("impact", "jump") for guard in system.guards):
        whole_system = with_losses(whole_system, stored, _IMPACTS, "J")
        names.append("impacts")
    seen = stretch(system, start, values, periods, t_end, t_start, transient)
    schedule = _schedule(seen, intervals)

    answer = partial(_dataset, system, method, seen, whole_system, stored, schedule, names)
    result = computed(
        whole_system,
        method,
        seen.request(whole_system, schedule, record=False),
        answer,
        threads,
        progress,
    )
    warn(result)
    return result


def _schedule(seen: Stretch, intervals: int | None) -> Schedule:
    """The ends of all intervals, the beginning of the first one in front."""
    if seen.system.forced_at is None:
        count = INTERVALS if intervals is None else whole(intervals, "intervals")
        _check_room(seen, count)
        index = np.arange(count + 1)
        share = float((seen.begin[0] - seen.length.t_start) / seen.length.period[0])
        index = index[index / count >= share - 1e-12]
        return Schedule(index // count, (index % count) / count)
    if intervals is not None:
        raise ParameterError(
            lambda say: (
                f"{seen.system.name} is forced: its balance is drawn each forcing period. "
                f"Leave {say.key('intervals')} out."
            )
        )
    last = int(np.min(seen.length.count))
    if np.any(seen.length.phase > 0) or np.any(seen.length.count != last):
        raise ParameterError(
            lambda say: (
                "an energy balance of a forced system is drawn over whole forcing "
                f"periods. Give {say.key('periods')} in place of {say.key('t_end')}."
            )
        )
    _check_room(seen, last - seen.skipped)
    index = np.arange(seen.skipped, last + 1)
    return Schedule(index, np.zeros(len(index)))


def _check_room(seen: Stretch, intervals: int) -> None:
    """Raise a ParameterError if the balance of these intervals doesn't fit into memory."""
    numbers = seen.group.size * (2 * len(seen.system.states) + 8) + 2
    check_room(
        8.0 * numbers * intervals,
        f"{seen.group.size} trajectories with {intervals} intervals each",
        "Draw the balance of fewer.",
    )


def _dataset(
    system: System,
    method: Method,
    seen: Stretch,
    extended: System,
    stored: Expr,
    schedule: Schedule,
    names: list[str],
    outcome: Outcome,
) -> xr.Dataset:
    """The energies of each interval, by name."""
    samples = outcome.samples
    columns = {name: np.array(column)[:, None] for name, column in seen.group.varied.items()}
    shared = dict(zip(seen.system.values, seen.group.parameters[0], strict=True))
    time = seen.length.t_start + (schedule.count + schedule.fraction) * seen.length.period[:, None]
    bits = [(outcome.sample_mode >> i) & 1 == 1 for i in range(len(extended.guards))]
    states = {name: samples[:, :, i] for i, name in enumerate(system.states)}
    (energy,) = evaluate([stored], t=time, states=states, values={**shared, **columns}, bits=bits)
    energy = np.broadcast_to(energy, samples.shape[:2])
    integrals = np.diff(samples[:, :, len(system.states) :], axis=1)
    turned = {name: integrals[:, :, i] for i, name in enumerate(names)}
    change = np.diff(energy, axis=1)
    residual = 2.0 * turned["supplied"] - sum(turned.values()) - change
    parts = {"energy": energy[:, 1:], "change": change, **turned, "residual": residual}
    forced = system.forced_at is not None
    intervals = {"period": schedule.count[1:]} if forced else {"time": time[0, 1:]}
    each = {**parts, "imbalance": _imbalance(parts)}
    return dataset(
        schema.ENERGY,
        seen,
        system,
        method,
        outcome,
        intervals,
        each,
        along={} if forced else {"period": "time"},
    )


def _imbalance(parts: Mapping[str, np.ndarray]) -> np.ndarray:
    """Largest residual of each trajectory relative to the largest of the other parts; NaN if it
    didn't reach the end.
    """
    largest = {name: np.abs(part).max(axis=1, initial=0.0) for name, part in parts.items()}
    scale = np.max([size for name, size in largest.items() if name != "residual"], axis=0)
    imbalance: np.ndarray = largest["residual"] / np.where(scale > 0, scale, 1.0)
    return imbalance
