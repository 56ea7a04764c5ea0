"""A stretch of motion after a transient, from which sections, impact statistics and energy balances
are computed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis import dataset_parts
from saltus.analysis.inputs.spans import Span, span
from saltus.analysis.inputs.starts import Ensemble, ensemble
from saltus.errors import ParameterError, shown
from saltus.flow import engine
from saltus.flow.counts import whole
from saltus.flow.methods import Method
from saltus.flow.progress import reporting
from saltus.flow.request import Outcome, Request, Schedule
from saltus.results import build
from saltus.system import System
from saltus.units import to_si


@dataclass(frozen=True)
class Stretch:
    """The trajectories of a run, and the part of it after the transient.

    Attributes
    ----------
    system : System
        Equations and values.
    group : Ensemble
        Trajectories.
    length : Span
        From the start to the end, transient included.
    skipped : int
        Whole forcing periods of the transient; of an unforced system 0.
    begin : float64[n]
        Time at which the transient ends [s].
    """

    system: System
    group: Ensemble
    length: Span
    skipped: int
    begin: np.ndarray

    @property
    def duration(self) -> np.ndarray:
        """Length of the stretch, float64[n] [s]."""
        duration: np.ndarray = (
            self.length.t_start
            + self.length.count * self.length.period
            + self.length.phase
            - self.begin
        )
        return duration

    @property
    def forcing_period(self) -> float | np.ndarray | None:
        """Forcing period, one for all trajectories or one each [s]; None for an unforced system."""
        if self.system.forced_at is None:
            return None
        return (
            self.length.period if np.ptp(self.length.period) > 0 else float(self.length.period[0])
        )

    def request(self, system: System, schedule: Schedule, record: bool) -> Request:
        """The request for this system, or for one with more states, which start at zero."""
        more = len(system.states) - self.group.start.shape[1]
        start = np.pad(self.group.start, ((0, 0), (0, more)))
        return self.length.request(
            start, self.group.parameters, schedule, self.skipped if record else None
        )


def stretch(
    system: System, start: Any, values: Any, periods: Any, t_end: Any, t_start: Any, transient: Any
) -> Stretch:
    """The stretch of a user's arguments.

    Raises
    ------
    ParameterError, UnitError
        As :func:`saltus.simulate`; or if the transient isn't a number of periods (a time, if
        unforced), or outlasts the run.
    """
    group = ensemble(system, start, values)
    if system.forced_at is None:
        length = span(system, group, periods, t_end, t_start)
        skip = to_si(transient, "s", "transient")
        begin = np.full(group.size, length.t_start + skip)
        if not 0 <= skip < float(length.period[0]):
            raise ParameterError(
                f"transient = {shown(transient)} must be a time >= 0 s that ends "
                f"before t_end = {shown(t_end)}."
            )
        return Stretch(system, group, length, 0, begin)
    skipped = whole(transient, "transient", 0)
    length = span(
        system,
        group,
        None if periods is None else whole(periods, "periods") + skipped,
        t_end,
        t_start,
    )
    begin = length.t_start + skipped * length.period
    if np.any(skipped >= length.count + length.phase / length.period):
        raise ParameterError(
            f"transient = {skipped} periods outlast the run up to t_end = "
            f"{shown(t_end)}. Give a later t_end."
        )
    return Stretch(system, group, length, skipped, begin)


def computed(
    system: System,
    method: Method,
    request: Request,
    dataset: Callable[[Outcome], xr.Dataset],
    threads: int | None,
    progress: bool | Callable[[float], None] | None,
) -> xr.Dataset:
    """The Dataset of a request; on Ctrl-C the Dataset so far is in the ``partial`` of the
    exception.
    """
    with reporting(progress) as show:
        try:
            return dataset(engine.run(system, method, request, threads, show))
        except engine.RunInterrupted as stop:
            raise stop.then(dataset) from None


def dataset(
    kind: str,
    seen: Stretch,
    system: System,
    method: Method,
    outcome: Outcome,
    values: Mapping[str, Any],
    each: Mapping[str, Any],
    attrs: Mapping[str, Any] | None = None,
    **options: Any,
) -> xr.Dataset:
    """The Dataset of a stretch: of the system itself, without added guards and states.

    ``values`` are tables, ``each`` what belongs to each trajectory; how it ended stands between
    them. ``attrs`` are settings beside the provenance, ``options`` as for
    :func:`saltus.results.build`.
    """
    own = dataset_parts.trajectories(seen.system, method, seen.group, seen.forcing_period)
    guards = None if own.guards is None else own.guards.first(len(system.guards))
    subject = replace(
        own,
        states=system.states,
        guards=guards,
        gap_unit=dataset_parts.gap_unit(system),
        attrs={**own.attrs, **(attrs or {})},
    )
    counters = ("steps", "rejected_steps", "mode_violations", "grazes_unresolved")
    ending = {**dataset_parts.endings(outcome, counters), "end_time": outcome.time}
    ends = {
        "end_<state>": dataset_parts.motion_values(
            system, seen.group, outcome.time, outcome.state, outcome.mode
        )
    }
    return build(
        kind,
        subject,
        {"trajectory": np.arange(seen.group.size), **values, **ending, **each, **ends},
        **options,
    )


def extended(seen: Stretch, system: System) -> Stretch:
    """The same stretch of a system with more guards or states."""
    return replace(seen, system=system)
