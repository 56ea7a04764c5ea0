"""Flights: many trajectories moved some periods at a time; those that have arrived are dropped."""

from __future__ import annotations

import numpy as np

from saltus.flow.contact_table import ContactTable
from saltus.flow.engine import ARGUMENTS, allocate, check_steps, options_of, slice_of, tables_of
from saltus.flow.methods import Method
from saltus.flow.pace import marks, resume
from saltus.flow.request import Request
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
    """Trajectories of one system on one thread, all of the same age in forcing periods.

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
        self._module = method.kernels(system.origin)
        request = Request.periods(start, parameters, period, 0)
        _, self._arrays = allocate(request, system, self._module)
        self._arrays["param"] = np.ascontiguousarray(parameters, float)
        self._arrays["options"] = options_of(method, longest, count)
        self._data, self._due = tables_of(system.origin), method.due(longest)
        self.age = 0

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
        return np.isin(self.status, (st.RUNNING, st.OK, st.GRAZE_UNRESOLVED))

    def advance(self, periods: int) -> np.ndarray:
        """Move on by whole periods.

        Returns
        -------
        float64[k, periods, D]
            States at each of them; NaN from where a trajectory has ended on.
        """
        check_stop()
        arrays = self._arrays
        k, states = arrays["state"].shape
        arrays["status"][self.going] = st.RUNNING
        arrays["end_count"] = np.full(k, self.age + periods, np.int64)
        samples = np.full((k, periods, states), np.nan)
        call = dict(
            arrays, stride=np.int64(0 if len(arrays["param"]) == 1 else 1),
            cursor=np.zeros(k, np.int64), samples=samples,
            sample_count=np.arange(self.age + 1, self.age + periods + 1, dtype=np.int64),
            sample_fraction=np.zeros(periods),
            sample_mode=np.zeros((k, periods), np.int64), rec_first=np.zeros(k, np.int64),
            rec_used=np.zeros(1, np.int64), data=self._data,
        )  # fmt: skip
        call["rec_i"], call["rec_f"] = ContactTable.empty(0, states).arrays
        steps, workspace = slice_of(states), self._module.workspace()
        outcome, went_on = st.PAUSED, False
        while outcome == st.PAUSED or went_on:
            outcome = self._module.propagate(*(call[name] for name in ARGUMENTS), steps, *workspace)
            went_on = self._due is not None and resume(arrays, self._due)
            check_stop()
        self.age += periods
        return samples

    def keep(self, wanted: np.ndarray) -> None:
        """Keep only the wanted trajectories, bool[k]."""
        if len(self._arrays["param"]) > 1:
            self._arrays["param"] = np.ascontiguousarray(self._arrays["param"][wanted])
        for name in _FOLLOW:
            self._arrays[name] = np.ascontiguousarray(self._arrays[name][wanted])
