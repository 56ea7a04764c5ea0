"""The end of a run at a condition: :func:`saltus.simulate` with ``until=``."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from saltus.analysis.inputs.spans import Span
from saltus.analysis.inputs.starts import Ensemble
from saltus.analysis.motion.sample_times import NO_SAMPLES, SampleTimes, evenly, planned
from saltus.errors import ParameterError, SaltusWarning
from saltus.flow import engine
from saltus.flow.contact_table import ContactTable
from saltus.flow.methods import Method
from saltus.flow.request import Outcome, Request
from saltus.flow.until import Until
from saltus.kernels import status as st
from saltus.language.derivatives import gradient, time_derivative
from saltus.language.evaluate import evaluate
from saltus.language.expression import Expr, add, mul
from saltus.system import System
from saltus.system.condition import EndCondition, end_condition
from saltus.system.modes import mode_number, sides
from saltus.system.quantity import remembering

#: Derivatives of a gap that is zero at the start: the first that isn't zero tells its side.
DERIVATIVES = 4
#: Share of the progress for the run that finds the ends, before the one that is kept.
FINDING = 0.5
#: A sample within this time of the end is the end: rounding [times the end].
AT_THE_END = 4.0 * float(np.finfo(float).eps)


@dataclass(frozen=True)
class Ending:
    """A user's condition for the trajectories of a run.

    Attributes
    ----------
    condition : EndCondition
        With the system that has its guards.
    until : Until
        The same as the engine reads it.
    own_guards : int
        Guards of the user's system, before those of the condition.
    first_mode : int64[n]
        Sides of all guards at the start, as bits.
    """

    condition: EndCondition
    until: Until
    own_guards: int
    first_mode: np.ndarray

    def asked(self, request: Request) -> Request:
        """The request with the condition: a column more for each of its numbers with a unit. All
        contacts are recorded.
        """
        values = list(self.condition.system.values.values())[request.parameters.shape[1] :]
        levels = np.broadcast_to(values, (len(request.parameters), len(values)))
        return replace(
            request,
            parameters=np.concatenate([request.parameters, levels], axis=1),
            until=self.until,
            record_from=0,
        )

    def rows(self, which: slice) -> Ending:
        """The condition of some of the trajectories."""
        return replace(self, until=self.until.of(which), first_mode=self.first_mode[which])

    def times(
        self,
        method: Method,
        group: Ensemble,
        length: Span,
        threads: int | None,
        show: Callable[[float], None] | None,
    ) -> np.ndarray:
        """The times at which the trajectories end, float64[n] [s], from a run that keeps nothing
        else.

        Raises
        ------
        RunInterrupted
            On Ctrl-C, with the Outcome of that run so far.
        """
        flown = remembering(self.condition.system)
        request = self.asked(NO_SAMPLES.request(group, length, len(flown.states)))
        found = engine.run(
            flown,
            method.suited_to(group.size),
            request,
            threads,
            show and (lambda done: show(FINDING * done)),
        )
        return found.time

    @staticmethod
    def plan(
        system: System, group: Ensemble, length: Span, samples: Any, states: int, times: np.ndarray
    ) -> SampleTimes:
        """Samples up to the last of the times of :meth:`times`, of motions of some states."""
        elapsed = np.maximum(times - length.t_start, 0.0)
        if system.forced_at is None:
            return evenly(system, group, length.t_start, float(elapsed.max()), samples)
        count = np.floor(elapsed / length.period).astype(np.int64)
        phase = np.maximum(elapsed - count * length.period, 0.0)
        reached = replace(length, count=count, phase=phase)
        return planned(system, group, reached, samples, None, states)

    @staticmethod
    def afterwards(
        length: Span, times: np.ndarray, show: Callable[[float], None] | None
    ) -> Callable[[float], None] | None:
        """Progress of the run that is kept, behind the one of :meth:`times`, which ended at these
        times float64[n] [s]. A trajectory alone passes its last share there.
        """
        span = length.count * length.period + length.phase
        last = float((times - length.t_start)[0] / span[0]) if len(times) == 1 else 1.0
        last = max(last, np.finfo(float).tiny)
        return show and (lambda done: show(FINDING + (1.0 - FINDING) * min(done / last, 1.0)))

    def of_the_user(self, outcome: Outcome, errors: np.ndarray) -> tuple[Outcome, np.ndarray]:
        """The outcome, and the errors of its contact times, without the guards of the condition.
        Trajectories that end where they start, which no kernel moved, have the mode there.
        """
        table, own = outcome.contacts, (1 << self.own_guards) - 1
        added = table.guard >= self.own_guards
        crossed = table.trajectory[added & (table.kind == st.CROSSING)]
        counters = outcome.counters.copy()
        counters[:, st.EVENTS] -= np.bincount(crossed, minlength=len(counters))
        kept = ContactTable(table.integers[~added], table.floats[~added])
        kept.mode_before[:] &= own
        kept.mode_after[:] &= own
        mode = np.where(self.until.at_start, self.first_mode, outcome.mode)
        return replace(outcome, mode=mode, counters=counters, contacts=kept), errors[~added]

    def with_ends(
        self, outcome: Outcome, samples: np.ndarray, modes: np.ndarray, times: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Samples float64[n, M, D] at times float64[M] or float64[n, M] [s] and their modes
        int64[n, M], of the user's guards: those at the end of a trajectory are its end, however
        the time rounds.
        """
        end, samples, modes = outcome.time[:, None], samples.copy(), modes.copy()
        at_end = np.abs(times - end) <= AT_THE_END * np.abs(end)
        at_end = np.broadcast_to(at_end, modes.shape)
        rows = np.nonzero(at_end)[0]
        samples[at_end] = outcome.state[rows, : samples.shape[2]]
        modes[at_end] = np.where(outcome.mode < 0, self.first_mode, outcome.mode)[rows]
        return samples, np.where(modes < 0, modes, modes & ((1 << self.own_guards) - 1))

    def warn_of_starts(self) -> None:
        """Say which trajectories end where they start, at the line of the user's call."""
        count = int(self.until.at_start.sum())
        if count:
            warnings.warn(
                f"{count} of {len(self.until.at_start)} trajectories: {self.condition.text} holds "
                f"at the start (first: trajectory {int(np.argmax(self.until.at_start))}), so they "
                f"end there.",
                SaltusWarning,
                stacklevel=4,
            )


def ending(
    system: System, method: Method, group: Ensemble, length: Span, until: Any, keep: Any
) -> Ending:
    """A user's condition for some trajectories.

    Raises
    ------
    ParameterError, TraceError, UnitError
        If it can't be read, the method doesn't locate contacts, or ``keep`` is given.
    """
    if not method.records_contacts:
        raise ParameterError(
            f'until needs a method that locates contacts, and {method.name}(events="ignore") steps '
            f'over them. Use sl.Taylor() or sl.ODE45(..., events="locate").'
        )
    if keep is not None:
        raise ParameterError(
            lambda say: (
                f"{say.key('keep')} counts periods before an end that is known beforehand, and "
                f"{say.key('until')} finds it. Leave one of them out."
            )
        )
    condition = end_condition(system, until)
    bits = _first_sides(condition, group, length.t_start)
    (found,) = evaluate([condition.sides], bits=bits)
    holds = np.broadcast_to(found == 1.0, group.size)
    none = np.zeros(group.size, bool)
    return Ending(
        condition,
        Until(
            condition.sides,
            opposite=holds.copy() if condition.crossing else none,
            at_start=none if condition.crossing else holds.copy(),
        ),
        len(system.guards),
        np.broadcast_to(mode_number(bits), group.size),
    )


def _first_sides(condition: EndCondition, group: Ensemble, time: float) -> list[Any]:
    """Side of each guard at the start, bool or bool[n]; on a boundary of the condition the side
    that the motion enters.
    """
    system = condition.system
    levels = list(system.values.items())[group.parameters.shape[1] :]
    values = dict(zip(system.values, group.parameters.T, strict=False)) | dict(levels)
    states = dict(zip(system.states, group.start.T, strict=True))
    bits = sides(system, time, group.start.T, values)
    for guard in condition.guards:
        gap, side = system.guards[guard].gap, np.zeros(group.size)
        for _ in range(1 + DERIVATIVES):
            (found,) = evaluate([gap], t=time, states=states, values=values, bits=bits)
            side = np.where(side == 0.0, np.sign(found), side)
            if side.all():
                break
            gap = _rate(gap, system)
        bits[guard] = side > 0.0
    return bits


def _rate(expression: Expr, system: System) -> Expr:
    """Rate of an expression along the motion, in a frozen mode."""
    total = time_derivative(expression)
    for slope, rate in zip(gradient(expression, system.states), system.field, strict=True):
        total = add(total, mul(slope, rate))
    return total
