"""Motions together with the derivatives of their states with respect to parameters and starts: one
flow carries both, across contacts by the saltation matrix.

Leine & Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems (2004), section 7.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from saltus.analysis.inputs.spans import Span
from saltus.analysis.inputs.starts import Ensemble
from saltus.analysis.motion.sample_times import NO_SAMPLES, SampleTimes, at_times
from saltus.errors import ParameterError
from saltus.flow import engine
from saltus.flow.methods import Method
from saltus.flow.request import Outcome, Request
from saltus.kernels import status as st
from saltus.system import System
from saltus.system.modes import field
from saltus.system.parametric import parametric

#: Kinds of contacts at which a motion begins to be held: behind them its rates aren't those of the
#: equations.
HELD = ("hold",)
#: Length of a run that only tells in which mode a motion begins [periods].
SHORT = 1e-6
#: Ends that a run may come to from outside.
CUT_OFF = (st.INTERRUPTED, st.BUDGET_EVENTS)


@dataclass(frozen=True)
class Places:
    """Places on motions: m of them, of systems of D states with C columns of derivatives.

    Attributes
    ----------
    time : float64[m]
        When [s].
    states : float64[m, D]
    slopes : float64[m, D, C]
        Their derivatives at this time.
    mode : int64[m]
        Sides of the guards.
    trajectory : int64[m]
        Whose they are.
    """

    time: np.ndarray
    states: np.ndarray
    slopes: np.ndarray
    mode: np.ndarray
    trajectory: np.ndarray


class CarriedDerivatives:
    """The flow of a system that carries the derivatives with respect to its start and to some
    parameters.

    Parameters
    ----------
    system : System
        Equations and values.
    method : Method
        The flow.
    names : sequence of str
        Parameters.

    Raises
    ------
    ParameterError
        If the method can't carry derivatives, or instants of a switch depend on a parameter.
    """

    def __init__(self, system: System, method: Method, names: tuple[str, ...]) -> None:
        self.system, self.names, size = system, names, len(system.states)
        own = method.tangents(system, names)
        self._own = own is not None
        self._method = method
        if own is not None:
            self.flown: System = own
            self.timed, self._order = False, [*range(size + len(names))]
            return
        with_parameters = parametric(system, names, unforced_timed=False)
        flown = method.tangents(with_parameters.system)
        if flown is None:
            raise ParameterError(
                f"the flow of {system.name} carries no derivatives: its equations are so steep "
                "somewhere that only differences give them. Take differences of two runs."
            )
        self.flown, self.timed = flown, with_parameters.timed
        self._inner = with_parameters.system
        carried = self._inner.states[size:]
        at = {name: size + carried.index(name) for name in names if name != system.forced_at}
        self._order = [*range(size), *(at.get(name, size) for name in names)]

    # -- the run -----------------------------------------------------------------------------------
    def request(self, group: Ensemble, length: Span, plan: SampleTimes) -> Request:
        """The request of a run of the flow that carries the derivatives."""
        base = plan.request(group, length, len(self.system.states))
        n, size = group.start.shape
        if self._own:
            columns = np.zeros((n, size, size + len(self.names)))
            columns[..., :size] = np.eye(size)
            return replace(base, start=np.hstack([group.start, columns.reshape(n, -1)]))
        known = {
            name: np.broadcast_to(column, n)
            for name, column in zip(self.system.values, group.parameters.T, strict=True)
        }
        carried = [
            length.period if self.timed and name not in known else known[name]
            for name in self._inner.states[size:]
        ]
        inner = np.column_stack([group.start, *carried])
        whole = inner.shape[1]
        eye = np.broadcast_to(np.eye(whole).ravel(), (n, whole * whole))
        changed = replace(
            base,
            start=np.hstack([inner, eye]),
            parameters=np.column_stack([known[name] for name in self.flown.values])
            if self.flown.values
            else np.zeros((n, 0)),
        )
        if not self.timed:
            return changed
        unit = length.period
        if np.ptp(unit) > 0 and (base.origin != 0.0 or base.times is not None):
            raise ParameterError(
                lambda say: (
                    "trajectories with forcing periods of their own have derivatives with respect "
                    "to the frequency only at equal parts of their periods, from t_start = 0 on. "
                    f"Give {say.key('samples')} in place of {say.key('at')}, or one frequency a "
                    "call."
                )
            )
        times, end = base.times, base.end_phase / unit
        if times is not None:
            times = times / float(unit[0])  # the end rounds in its own way: no sample lies beyond
            end = np.maximum(end, times.max(initial=0.0) - base.end_count)
        return replace(
            changed,
            period=np.ones(n),
            end_phase=end,
            origin=base.origin / float(unit[0]),
            times=times,
            t_end=base.t_end / float(unit[0]) if np.ptp(unit) == 0 else np.inf,
        )

    def lost(self, at: Places) -> bool:
        """True if derivatives are unknown where the motion isn't: modes that go together leave the
        modal flow without those with respect to parameters.
        """
        known = np.isfinite(at.states).all(axis=1)
        return self._own and bool(np.isnan(at.slopes[known]).any())

    # -- what it holds -----------------------------------------------------------------------------
    def samples(
        self, outcome: Outcome, group: Ensemble, length: Span, time: np.ndarray, kept: Any
    ) -> Places:
        """The samples ``kept`` of all trajectories, at times float64[n, M] [s]."""
        n, count = time.shape
        who = np.repeat(np.arange(n), count)
        rows = outcome.samples[:, kept].reshape(n * count, -1)
        mode = outcome.sample_mode[:, kept].ravel()
        return self._places(rows, mode, time.ravel(), who, group, length)

    def contacts(
        self, outcome: Outcome, group: Ensemble, length: Span, run: Callable[[Request], Outcome]
    ) -> tuple[Places, Places]:
        """Places just before the contacts, and behind them; before those that begin to be held too.

        Trajectories that meet contacts with a law come from a second ``run`` each, with samples
        beside their contacts; so do all of a flow without derivatives in its records.
        """
        table, whole = outcome.contacts, self.request(group, length, NO_SAMPLES)
        unit = length.period[table.trajectory] if self.timed else 1.0
        rows = np.stack([table.state, table.state])
        modes = np.stack([table.mode_after, table.mode_after])
        missing = not self._method.serving(self.flown.origin).records_tangents
        lawful = np.array([guard.law is not None for guard in self.system.guards] or [False])
        beside = 4.0 * np.spacing(np.maximum(np.abs(table.time), abs(whole.origin)))
        since = table.time + np.stack([-beside, beside]) - whole.origin
        since = np.clip(since, 0.0, outcome.time[table.trajectory] - whole.origin)
        for i in np.unique(table.trajectory[missing | lawful[table.guard]]):
            here = table.trajectory == i
            times, place = np.unique(since[:, here], return_inverse=True)
            found, place = run(_alone(whole, i, times)), place.reshape(2, -1)
            rows[:, here], modes[:, here] = found.samples[0, place], found.sample_mode[0, place]
        held = np.isin(table.kind_name, HELD)
        rows[1, held], modes[1, held] = rows[0, held], modes[0, held]
        who = table.trajectory
        early, touch = (
            self._places(*one, table.time * unit, who, group, length)
            for one in zip(rows, modes, strict=True)
        )
        return early, touch

    def ends(self, outcome: Outcome, group: Ensemble, length: Span) -> Places:
        """The ends of all trajectories."""
        unit = length.period if self.timed else 1.0
        who = np.arange(group.size)
        at = self._places(outcome.state, outcome.mode, outcome.time * unit, who, group, length)
        if self._own:  # those of a run that is cut off wait where they were moved last
            at.slopes[np.isin(outcome.status, CUT_OFF)] = np.nan
        return at

    def parameters(self, group: Ensemble, who: np.ndarray) -> dict[str, np.ndarray]:
        """Values of all parameters of trajectories int64[m], float64[m] each."""
        rows = np.broadcast_to(group.parameters, (group.size, group.parameters.shape[1]))
        return dict(zip(self.system.values, rows[who].T, strict=True))

    def rates(self, at: Places, group: Ensemble) -> np.ndarray:
        """Rates of the states, float64[m, D]; of the equations in the modes there."""
        bits = [(at.mode >> i) & 1 == 1 for i in range(len(self.system.guards))]
        values = self.parameters(group, at.trajectory)
        return field(self.system, at.time, at.states.T, values, bits).T

    def _places(
        self,
        rows: np.ndarray,
        mode: np.ndarray,
        time: np.ndarray,
        who: np.ndarray,
        group: Ensemble,
        length: Span,
    ) -> Places:
        """Places from states of the flow; the columns are the starts, then the parameters."""
        size = len(self.system.states)
        inner = size if self._own else len(self._inner.states)
        width = size + len(self.names) if self._own else inner
        matrix = rows[:, inner:].reshape(len(rows), inner, width)[:, :size]
        at = Places(time, rows[:, :size], matrix[..., self._order], mode, who)
        where = self.system.forced_at
        if not self.timed or where not in self.names:
            return at
        # the flow holds the phase, T the period: dx/dT at one time is that at one phase less the
        # way from there to that time; the start is at one time too
        period = length.period[who]
        begin = self._begin(group, length)[who]
        moved = matrix[..., size] - self.rates(at, group) * (time / period)[:, None]
        moved += (
            np.einsum("mij,mj->mi", matrix[..., :size], begin) * (length.t_start / period)[:, None]
        )
        column = size + self.names.index(where)
        frequency = self.parameters(group, who)[where]
        at.slopes[..., column] = moved * (-period / frequency)[:, None]
        return at

    def _begin(self, group: Ensemble, length: Span) -> np.ndarray:
        """Rates at the starts, float64[n, D], in the modes in which the motions begin."""
        if length.t_start == 0.0:
            return np.zeros(group.start.shape)
        short = replace(length, count=np.zeros_like(length.count), phase=SHORT * length.period)
        first = at_times(short, 0, np.array([length.t_start]))
        found = engine.run(self.flown, self._method, self.request(group, short, first))
        every, time = np.arange(group.size), np.full(group.size, length.t_start)
        nothing = np.zeros((group.size, 0, 0))
        return self.rates(Places(time, group.start, nothing, found.sample_mode[:, 0], every), group)


def _alone(whole: Request, i: int, times: np.ndarray) -> Request:
    """The request of one of its trajectories, with samples at times since the start [s]."""
    parameters = whole.parameters[[i]] if len(whole.parameters) > 1 else whole.parameters
    return replace(
        whole,
        start=whole.start[[i]],
        parameters=parameters,
        period=whole.period[[i]],
        end_count=whole.end_count[[i]],
        end_phase=whole.end_phase[[i]],
        times=times,
        record_from=None,
    )
