"""Flights: many trajectories moved some periods at a time; those that have arrived are dropped,
and others may take their places.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.contact_table import ContactTable
from saltus.flow.engine import (
    ARGUMENTS,
    allocate,
    check_steps,
    move_to_end,
    options_of,
    shared_arrays,
    slice_of,
    tables_of,
)
from saltus.flow.methods import Method
from saltus.flow.pace import marks
from saltus.flow.request import Request, Schedule
from saltus.interrupt import check_stop
from saltus.kernels import status as st
from saltus.system import System

#: Arrays of a batch with a row for each trajectory, thinned out when trajectories leave.
_FOLLOW = (
    "period",
    "origin",
    "state",
    "count",
    "phase",
    "mode",
    "fresh",
    "carry",
    "status",
    "end_count",
    "end_phase",
    "counters",
    "minima",
    "options",
    *marks(0),
)


class Flight:
    """Trajectories of one system on one thread.

    Parameters
    ----------
    system : System
        The equations.
    method : Method
        The method of integration.
    start : float64[k, D]
        States at a whole period.
    parameters : float64[1 or k, P]
        Values in the order of ``system.values``.
    period : float64[k]
        Forcing period [s].
    longest : float
        Periods that will be asked for at most; sets the default step budget.
    """

    def __init__(
        self,
        system: System,
        method: Method,
        start: np.ndarray,
        parameters: np.ndarray,
        period: np.ndarray,
        longest: float,
    ):
        count = len(start)
        check_steps(system, method, period)
        method = method.serving(system.origin)
        self._module = method.kernels(system.origin)
        _, self._arrays = allocate(
            Request.periods(start, parameters, period, 0), system, self._module
        )
        self._arrays["options"] = options_of(method, longest, count)
        self._parameters = parameters
        self._data, self._due = tables_of(system.origin), method.due(longest)
        self.age = 0  # of those that were launched here [periods]

    def __len__(self) -> int:
        return len(self._arrays["status"])

    @property
    def state(self) -> np.ndarray:
        """States now, float64[k, D]."""
        return self._arrays["state"]

    @property
    def status(self) -> np.ndarray:
        """Status codes, int64[k]; OK for trajectories that can go on."""
        return self._arrays["status"]

    @property
    def unresolved(self) -> np.ndarray:
        """Grazes so far that were shallower than the local error, int64[k]."""
        return self._arrays["counters"][:, st.UNRESOLVED]

    @property
    def going(self) -> np.ndarray:
        """True where a trajectory can go on, bool[k]."""
        status = self.status
        going: np.ndarray = (
            (status == st.OK) | (status == st.RUNNING) | (status == st.GRAZE_UNRESOLVED)
        )
        return going

    def advance(self, periods: int, last: int | None = None) -> np.ndarray:
        """Move on by whole periods, those of age ``last`` no farther. The ages of two trajectories
        are equal, or ``periods`` apart at least.

        Returns
        -------
        float64[k, periods, D]
            States at each of them; NaN from where a trajectory has ended on.
        """
        check_stop()
        arrays = self._arrays
        k, states = arrays["state"].shape
        arrays["status"][self.going] = st.RUNNING
        # the samples of every age that occurs, one age after the other; each trajectory begins at
        # those of its own
        ages, own = np.unique(arrays["end_count"], return_inverse=True)
        count = (ages[:, None] + np.arange(1, periods + 1)).ravel()
        arrays["end_count"] = arrays["end_count"] + periods
        if last is not None:
            arrays["end_count"] = np.minimum(arrays["end_count"], last)
        samples = np.empty((k, len(ages), periods, states))
        samples[np.arange(k), own] = np.nan
        schedule = Schedule(count, np.zeros(len(count)))
        call = arrays | shared_arrays(k, self._parameters, schedule, self._data)
        call |= {
            "cursor": own * periods,
            "samples": samples.reshape(k, len(count), states),
            "sample_mode": np.empty((k, len(count)), np.int64),
        }
        call["rec_i"], call["rec_f"] = ContactTable.empty(0, states).arrays
        move = self._module.bound(
            *(call[name] for name in ARGUMENTS), slice_of(states), *self._module.workspace()
        )
        move_to_end(move, arrays, self._due)
        self.age += periods
        return samples[np.arange(k), own] if len(ages) != 1 else samples[:, 0]

    def add(self, other: Flight) -> None:
        """Take in the trajectories of another flight of the same map, behind these."""
        if len(self._parameters) > 1:
            self._parameters = np.concatenate([self._parameters, other._parameters])
        for name in _FOLLOW:
            self._arrays[name] = np.concatenate([self._arrays[name], other._arrays[name]])

    def keep(self, wanted: np.ndarray) -> None:
        """Keep only the wanted trajectories, bool[k]."""
        if len(self._parameters) > 1:
            self._parameters = self._parameters[wanted]
        for name in _FOLLOW:
            self._arrays[name] = np.ascontiguousarray(self._arrays[name][wanted])
