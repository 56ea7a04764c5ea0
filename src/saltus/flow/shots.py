"""Shots: the same short run repeated from other starts, thousands of times in Newton's method. Its
arrays and the arguments of its kernel are made once.
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
from saltus.flow.request import Request
from saltus.flow.stops import on_allowed_sides
from saltus.kernels import status as st
from saltus.system import System

#: Arrays that a run changes, besides the states.
_LEFT = ("count", "phase", "mode", "fresh", "carry", "counters", "minima", "cursor", *marks(0))


class Shots:
    """k trajectories of one system over ``periods`` whole periods at most, on one thread; only
    their ends are kept.

    Parameters
    ----------
    system : System
        The equations.
    method : Method
        The method of integration: one whose steps adapt.
    parameters : float64[1 or k, P]
        Values in the order of ``system.values``.
    period : float64[k]
        Forcing period [s].
    periods : int
        The longest of the runs; sets the default step budget.
    """

    def __init__(
        self,
        system: System,
        method: Method,
        parameters: np.ndarray,
        period: np.ndarray,
        periods: int,
    ):
        k, states = len(period), len(system.states)
        check_steps(system, method, period)
        method = method.serving(system.origin)
        module = method.kernels(system.origin)
        request = Request.periods(np.zeros((k, states)), parameters, period, periods)
        _, arrays = allocate(request, system, module)
        arrays |= shared_arrays(k, parameters, request.schedule, tables_of(system.origin))
        arrays["options"] = options_of(method, periods, k)
        arrays["rec_i"], arrays["rec_f"] = ContactTable.empty(0, states).arrays
        self._system, self._request, self._arrays = system, request, arrays
        self._begun = [(arrays[name], arrays[name].copy()) for name in _LEFT]
        self._due = method.due(periods)
        self._finite = bool(np.isfinite(parameters).all())
        self._move = module.bound(
            *(arrays[name] for name in ARGUMENTS), slice_of(states), *module.workspace()
        )

    @property
    def counters(self) -> np.ndarray:
        """The counters of the last run, int64[k, ..]: see kernels/status.py."""
        return self._arrays["counters"]

    def run(self, start: np.ndarray, count: np.ndarray | int) -> tuple[np.ndarray, np.ndarray]:
        """States float64[k, D] after ``count`` periods from others, and the status of each,
        int64[k].
        """
        arrays, request = self._arrays, self._request
        for array, first in self._begun:
            array[...] = first
        arrays["end_count"][...] = count
        arrays["state"][...], beyond = on_allowed_sides(
            self._system, start, request.parameters, request.origin, request.period
        )
        good = np.isfinite(start).all(axis=1) & ~beyond
        if not self._finite:
            good &= np.isfinite(request.parameters).all(axis=1)
        arrays["status"][...] = np.where(good, st.RUNNING, st.INVALID)
        move_to_end(self._move, arrays, self._due)
        return arrays["state"].copy(), arrays["status"].copy()
