"""Convert the length of a run that a user gives, periods or times, to that of each trajectory."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from saltus.analysis.inputs.starts import Ensemble
from saltus.errors import ParameterError, must_be, shown
from saltus.flow.counts import whole
from saltus.flow.request import Request, Schedule
from saltus.system import System
from saltus.units import to_si


@dataclass(frozen=True)
class Span:
    """The length of a run: a period for each trajectory, whole periods and the time after them, all
    since t_start.

    For an unforced system the whole span is one period. ``t_end`` is the time that was asked for
    [s], infinite if periods were.
    """

    t_start: float
    period: np.ndarray
    count: np.ndarray
    phase: np.ndarray
    t_end: float = math.inf

    @classmethod
    def of_cycles(cls, time: np.ndarray) -> Span:
        """A period of limit cycles, float64[n] [s]."""
        return cls(0.0, time, np.ones(len(time), np.int64), np.zeros(len(time)))

    def rows(self, which: slice) -> Span:
        """The length of some of the trajectories."""
        each = {name: getattr(self, name)[which] for name in ("period", "count", "phase")}
        return replace(self, **each)

    def request(
        self, start: np.ndarray, parameters: np.ndarray, schedule: Schedule, record_from: int | None
    ) -> Request:
        """A request of this length, with samples at a schedule; contacts are kept from period
        ``record_from`` on, or none.
        """
        return Request(
            start=start,
            parameters=parameters,
            period=self.period,
            end_count=self.count,
            end_phase=self.phase,
            origin=self.t_start,
            schedule=schedule,
            record_from=record_from,
        )


def span(system: System, group: Ensemble, periods: Any, t_end: Any, t_start: Any) -> Span:
    """The span of all trajectories.

    Raises
    ------
    ParameterError
        If neither or both of ``periods`` and ``t_end`` are given, or the end isn't after the start.
    """
    begin = _time(t_start, "t_start")
    n = group.size
    if periods is None and t_end is None and system.forced_at is None:
        raise ParameterError(
            lambda say: (
                f"{system.name} has no forcing period: give {say.key('t_end')}, such as "
                f"{say.key(t_end='10 s')}."
            )
        )
    if (periods is None) == (t_end is None):
        raise ParameterError(
            lambda say: (
                f"give {say.key('periods')} (whole forcing periods) or {say.key('t_end')} "
                "(seconds), and only one of them."
            )
        )
    if periods is not None:
        if system.forced_at is None:
            raise ParameterError(
                lambda say: (
                    f"{system.name} has no forcing period. Give {say.key('t_end')} in "
                    f"place of {say.key('periods')}."
                )
            )
        periods = whole(periods, "periods")
        return Span(begin, _periods(system, group), np.full(n, int(periods), np.int64), np.zeros(n))
    end = _time(t_end, "t_end")
    length = end - begin
    if not length > 0:
        raise ParameterError(f"t_end = {shown(t_end)} must be after t_start = {shown(t_start)}.")
    if system.forced_at is None:
        return Span(begin, np.full(n, length), np.ones(n, np.int64), np.zeros(n), end)
    period = _periods(system, group)
    count = np.floor(length / period).astype(np.int64)
    return Span(begin, period, count, np.maximum(length - count * period, 0.0), end)


def _time(value: Any, name: str) -> float:
    seconds = to_si(value, "s", name)
    if not math.isfinite(seconds):
        raise must_be(name, "a finite time", value)
    return seconds


def _periods(system: System, group: Ensemble) -> np.ndarray:
    values = dict(zip(system.values, group.parameters[0], strict=True))
    return np.broadcast_to(system.period({**values, **group.varied}), group.size).astype(float)
