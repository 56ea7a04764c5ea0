"""The request to the engine, and its outcome."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from saltus.flow.contact_table import ContactTable
from saltus.flow.until import Until


@dataclass(frozen=True)
class Schedule:
    """Times of samples: at ``(count + fraction)`` periods after the start, ascending.

    Attributes
    ----------
    count : int64[M]
    fraction : float64[M], in [0, 1)
    """

    count: np.ndarray
    fraction: np.ndarray

    @classmethod
    def none(cls) -> Schedule:
        """A schedule without samples."""
        return cls(np.zeros(0, np.int64), np.zeros(0))

    @classmethod
    def at(cls, elapsed: np.ndarray, period: float) -> Schedule:
        """A schedule of times since the start [s], ascending; none is later than its own time by
        rounding, so a sample at the end is taken.
        """
        count = np.floor(elapsed / period)
        count -= count * period > elapsed
        rest = elapsed - count * period
        fraction = rest / period
        fraction = np.where(fraction * period > rest, np.nextafter(fraction, 0.0), fraction)
        return cls(count.astype(np.int64), fraction)

    @classmethod
    def even(cls, periods: int, per_period: int, first: int = 0, beyond: int = 0) -> Schedule:
        """``per_period`` equidistant samples in each of ``periods`` from ``first`` on, and
        ``beyond`` more after them.
        """
        index = first * per_period + np.arange(periods * per_period + beyond)
        return cls(index // per_period, (index % per_period) / per_period)


@dataclass(frozen=True, kw_only=True)
class Request:
    """The trajectories to compute: n trajectories, D states, P parameters.

    Attributes
    ----------
    start : float64[n, D]
        States at the start.
    parameters : float64[n or 1, P]
        Values in the order of ``system.values``; one row for all, or one each.
    period : float64[n]
        Forcing period [s]; for an unforced system the span.
    origin : float
        Time at the start [s].
    end_count : int
        Whole periods to run,
    end_phase : float64[n]
        and the time after them [s].
    schedule : Schedule
        When samples are taken.
    times : float64[M], optional
        Times of the samples since the start [s], ascending, the same for all trajectories, in place
        of the schedule.
    until : Until, optional
        Condition at which trajectories end, with the status of it.
    record_from : int or None
        First period since the start whose contacts are recorded; None records none.
    t_end : float
        End that the user gave [s]: sums of periods that exceed it by rounding are cut off.
    checks : int
        Number of trajectories at the end that check the others. The method's companion moves them,
        with the same kernels, and takes no samples of them.
    """

    start: np.ndarray
    parameters: np.ndarray
    period: np.ndarray
    end_count: np.ndarray
    end_phase: np.ndarray
    origin: float = 0.0
    schedule: Schedule = field(default_factory=Schedule.none)
    times: np.ndarray | None = None
    until: Until | None = None
    record_from: int | None = None
    t_end: float = np.inf
    checks: int = 0

    @property
    def sample_count(self) -> int:
        """Number of samples of each trajectory."""
        return len(self.schedule.count) if self.times is None else len(self.times)

    def unsampled(self, **more: Any) -> Request:
        """The request without samples; ``more`` are other changes."""
        return replace(self, schedule=Schedule.none(), times=None, **more)

    @classmethod
    def periods(
        cls,
        start: np.ndarray,
        parameters: np.ndarray,
        period: float | np.ndarray,
        count: int | np.ndarray,
        **more: Any,
    ) -> Request:
        """Whole periods from time zero, one period and count for all or one each; ``more`` as
        above.
        """
        n = len(start)
        return cls(
            start=start,
            parameters=parameters,
            period=np.full(n, period, float),
            end_count=np.full(n, count, np.int64),
            end_phase=np.zeros(n),
            **more,
        )


@dataclass
class Outcome:
    """The outcome of a request; arrays have the trajectory first. Contacts are sorted by
    trajectory, then time.
    """

    state: np.ndarray
    time: np.ndarray
    status: np.ndarray
    mode: np.ndarray
    counters: np.ndarray
    minima: np.ndarray
    samples: np.ndarray
    sample_mode: np.ndarray
    contacts: ContactTable
    complete: bool = True

    def reached(self) -> int:
        """Number of samples; of an interrupted run, those that some trajectory has reached."""
        if self.complete:
            count: int = self.samples.shape[1]
            return count
        return int(np.flatnonzero((self.sample_mode >= 0).any(axis=0)).max(initial=0)) + 1

    def of(self, first: int, last: int) -> Outcome:
        """The outcome of some of the trajectories, as if they had been computed alone."""
        begins = self.contacts.begins(last - first, first)
        each = {name: getattr(self, name)[first:last] for name in _EACH}
        return replace(
            self, **each, contacts=self.contacts.rows(slice(begins[0], begins[-1])).moved(-first)
        )

    @classmethod
    def joined(cls, parts: Sequence[Outcome]) -> Outcome:
        """The outcomes of trajectories one behind the other, as one."""
        each = {name: np.concatenate([getattr(one, name) for one in parts]) for name in _EACH}
        begins = np.cumsum([0, *(len(one.status) for one in parts)]).tolist()
        tables = [one.contacts.moved(begin) for one, begin in zip(parts, begins, strict=False)]
        complete = all(one.complete for one in parts)
        return cls(**each, contacts=ContactTable.joined(tables), complete=complete)

    def arrays(self) -> dict[str, np.ndarray]:
        """Its arrays by name, as :meth:`of_arrays` takes them."""
        integers, floats = self.contacts.arrays
        each = {name: getattr(self, name) for name in _EACH}
        return each | {"contact_integers": integers, "contact_floats": floats}

    @classmethod
    def of_arrays(cls, arrays: Mapping[str, np.ndarray]) -> Outcome:
        """The outcome of a run that came to its end, from :meth:`arrays`' result."""
        table = ContactTable(arrays["contact_integers"], arrays["contact_floats"])
        return cls(**{name: arrays[name] for name in _EACH}, contacts=table, complete=True)


#: Arrays of an outcome that have a row for each trajectory.
_EACH = ("state", "time", "status", "mode", "counters", "minima", "samples", "sample_mode")
