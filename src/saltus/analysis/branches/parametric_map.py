"""The stroboscope of a parametric system by a flow of the system itself, whose parameters are
numbers: derivatives with respect to them are columns that the flow carries, or differences.
"""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np

from saltus.analysis.closed.field_zeros import field_of
from saltus.flow.contact_table import ContactTable
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import Method
from saltus.flow.modal_motions import modal_rates
from saltus.flow.request import Outcome, Schedule
from saltus.kernels import status as st
from saltus.system import System
from saltus.system.parametric import Parametric

#: Step of the differences, relative to a parameter. A shift by which stiff contacts last much
#: longer is too long: errors of the derivatives of a beam with two stops were 1e-9 to 5e-9.
STEP = 5e-5


def parametric_map(
    system: System, with_parameters: Parametric, method: Method, threads: int | None = None
) -> Stroboscope:
    """The map of a parametric system over one forcing period, or over one unit of its time, by the
    flow that the method has for the system.
    """
    own, extended = (method.serving(one.origin) for one in (system, with_parameters.system))
    if own != extended:
        return ParametricStroboscope(system, with_parameters, method, threads)
    every = 1.0 if with_parameters.timed else None
    return Stroboscope(with_parameters.system, method, every=every, threads=threads)


class ParametricStroboscope(Stroboscope):
    """See :func:`parametric_map`. States are those of the system, then its period if the time is
    counted in periods, then the other parameters.

    Attributes
    ----------
    base : System
        The system itself.
    timed : bool
        Whether the time is counted in periods.
    names : tuple of str
        The parameters.
    """

    def __init__(
        self, base: System, parametric: Parametric, method: Method, threads: int | None
    ) -> None:
        every = 1.0 if parametric.timed else None
        super().__init__(parametric.system, method, every=every, threads=threads)
        self.base, self.timed, self.names = base, parametric.timed, parametric.names

    # -- the flow of the system --------------------------------------------------------------------
    def _below(self, start: np.ndarray) -> Stroboscope:
        """The map of the system at the parameters of states float64[k, E]."""
        own = start[:, len(self.base.states) :].T
        known = dict(zip(self.system.values, self.parameters.T, strict=True))
        if self.timed:
            period, own = own[0], own[1:]
            if self.base.forced_at is not None:
                known[self.base.forced_at] = self._turns / period
        known |= dict(zip(self._others, own, strict=True))
        rows = np.stack(
            [np.broadcast_to(known[name], len(start)) for name in self.base.values], axis=1
        )
        every = period if self.base.forced_at is None else None
        return Stroboscope(self.base, self.method, rows, every, self.threads)

    @property
    def _turns(self) -> float:
        """The forcing frequency times the period."""
        assert self.base.forced_at is not None
        period = self.base.period({self.base.forced_at: 1.0})
        assert isinstance(period, float)
        return period

    @functools.cached_property
    def _others(self) -> list[str]:
        """The parameters but the forcing frequency."""
        return [name for name in self.names if name != self.base.forced_at]

    def run(
        self,
        start: np.ndarray,
        periods: np.ndarray | int,
        schedule: Schedule | None = None,
        record: int | None = None,
    ) -> Outcome:
        """See :meth:`Stroboscope.run`."""
        below, size = self._below(start), len(self.base.states)
        outcome, own = below.run(start[:, :size], periods, schedule, record), start[:, size:]
        unit = below.period if self.timed else np.ones(len(start))
        samples = np.repeat(own[:, None], outcome.samples.shape[1], axis=1)
        contacts, who = outcome.contacts, outcome.contacts.trajectory
        floats = np.insert(contacts.floats, [st.RECORD_FLOATS + size] * own.shape[1], own[who], 1)
        for column, power in (
            (st.REC_PHASE, -1), (st.REC_TIME_ERROR, -1), (-1, -1), (st.REC_VELOCITY, 1),
        ):  # fmt: skip
            floats[:, column] *= unit[who] ** power
        return replace(
            outcome,
            state=np.append(outcome.state, own, axis=1),
            time=outcome.time / unit,
            samples=np.append(outcome.samples, samples, axis=2),
            contacts=ContactTable(contacts.integers, floats),
        )

    def ends(self, start: np.ndarray, count: np.ndarray | int) -> tuple[np.ndarray, np.ndarray]:
        """See :meth:`Stroboscope.ends`."""
        size = len(self.base.states)
        state, status = self._below(start).ends(start[:, :size], count)
        return np.append(state, start[:, size:], axis=1), status

    # -- derivatives -------------------------------------------------------------------------------
    def tangent(
        self, start: np.ndarray, count: np.ndarray | int, directions: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """See :class:`Map`."""
        below, (k, width), size = self._below(start), start.shape, len(self.base.states)
        first = start[:, :size]
        state, by_state, by_parameter = self._derivatives(below, first, count)
        matrix = np.broadcast_to(np.eye(width), (k, width, width)).copy()
        matrix[:, :size, :size] = by_state
        for j, name in enumerate(self._others, size + self.timed):
            matrix[:, :size, j] = by_parameter[name]
        if self.timed:  # the end moves, and the forcing is slower
            rates = modal_rates(below, state)
            if rates is None:
                rates = field_of(self.base, state, below.values)
            late = rates * np.reshape(count, (-1, 1))
            forced = self.base.forced_at
            if forced is not None:
                late -= by_parameter[forced] * (below.values[forced] / below.period)[:, None]
            matrix[:, :size, size] = late
        ends = np.append(state, start[:, size:], axis=1)
        return ends, matrix if directions is None else matrix @ directions

    def _derivatives(
        self, below: Stroboscope, start: np.ndarray, count: np.ndarray | int
    ) -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]:
        """Ends float64[k, D], their derivatives with respect to the starts float64[k, D, D], and
        with respect to each parameter, float64[k, D] each; the time to the end is kept.
        """
        size, forced = len(self.base.states), self.base.forced_at
        wanted = {*self._others, *((forced,) if self.timed and forced is not None else ())}
        names = tuple(name for name in self.base.values if name in wanted)
        carried = below.tangent_by(start, count, names)
        if carried is None:
            state, matrix = below.tangent(start, count)
            found = np.full((len(start), size, len(names)), np.nan)
        else:
            (state, matrix), found = carried, carried[1][..., size:]
        lost = np.isfinite(state).all(axis=1) & ~np.isfinite(found).all(axis=(1, 2))
        if lost.any():
            rows, counts = below.rows(lost), np.broadcast_to(count, len(start))[lost]
            for j, name in enumerate(names):
                found[lost, :, j] = self._by_shifts(rows, start[lost], counts, name)
        by_parameter = {name: found[..., j] for j, name in enumerate(names)}
        return state, matrix[..., :size], by_parameter

    @staticmethod
    def _by_shifts(
        below: Stroboscope, start: np.ndarray, count: np.ndarray | int, name: str
    ) -> np.ndarray:
        """The derivative of the ends with respect to a parameter, float64[k, D], by central
        differences of fourth order (Abramowitz and Stegun, 25.3.6); the time to the end is kept.
        """
        k, at = len(start), list(below.system.values).index(name)
        each = np.repeat(np.arange(k), 4)
        size = np.where(below.values[name] == 0.0, 1.0, np.abs(below.values[name]))
        rows = below.parameters[each]
        rows[:, at] += np.tile([-2.0, -1.0, 1.0, 2.0], k) * STEP * size[each]
        ends, status = below.with_parameters(rows, each).ends(
            start[each], np.broadcast_to(count, k)[each]
        )
        ends[(status != st.OK) & (status != st.GRAZE_UNRESOLVED)] = np.nan
        weights = np.array([1.0, -8.0, 8.0, -1.0]) / 12.0
        slopes: np.ndarray = np.einsum("s,ksd->kd", weights, ends.reshape(k, 4, -1))
        return slopes / (STEP * size[:, None])
