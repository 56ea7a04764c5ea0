"""The exact flow of systems that are linear between their contacts."""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.codegen.module import Flow, modal_module
from saltus.errors import ParameterError
from saltus.flow.counts import whole
from saltus.flow.method import Method, explain_unknown_options, step_budget
from saltus.flow.modal_tables import Tables, ValueSet
from saltus.flow.taylor import Taylor
from saltus.kernels import modal_layout as layout
from saltus.kernels import status as st
from saltus.kernels.batch import Batch
from saltus.kernels.isolation import DEEPEST, MOST_TOUCHES
from saltus.system import System
from saltus.system.linear import LinearSystem, linear_pieces

#: Share of a period, or of an unforced span, that is tried as the first step.
FIRST_STEP = 1.0 / 64
#: Terms of a gap's series by which the way from a boundary is told.
WAYS = 6


class ModalFlow:
    """The flow of one system, as the engine calls it.

    Parameters
    ----------
    linear : LinearSystem
        The system.
    """

    def __init__(self, linear: LinearSystem) -> None:
        self.tables, self._kernel = Tables(linear), modal_module()
        self._lanes, self._memory = self.tables.modes.table.shape[1], threading.local()
        self.CARRY = layout.AMPLITUDES + 2 * self.tables.groups * self._lanes
        self.STEP_RECORDS = 2 * len(linear.system.guards) + MOST_TOUCHES

    def workspace(self) -> tuple[np.ndarray, ...]:
        """None that the engine must keep."""
        return ()

    def bound(self, *values: Any) -> Callable[[], int]:
        """See :class:`saltus.codegen.module.Flow`."""
        return functools.partial(self.propagate, *values)

    def propagate(self, *values: Any) -> int:
        """Move the trajectories of a batch; contact states that they come to are made meanwhile."""
        batch = Batch(*values[:-1])
        budget = values[-1] * max(batch.state.shape[1] // 4, 1)
        self._begin(batch)
        while True:
            with self.tables.lock:
                tables = self.tables.arrays()
            answer: int = self._kernel.propagate(*batch, budget, *tables, *self._work())
            lost = (batch.status == st.RUNNING) & (batch.carry[:, layout.AT] < 0)
            if answer == st.FINISHED or not lost.any():
                return answer
            with self.tables.lock:
                for i in np.flatnonzero(lost).tolist():
                    which = int(batch.carry[i, layout.SET])
                    batch.carry[i, layout.AT] = self.tables.state_of(which, int(batch.mode[i]))

    def _work(self) -> tuple[np.ndarray, ...]:
        """Work arrays of this thread, in the order in which the kernel takes them."""
        if not hasattr(self._memory, "arrays"):
            _, groups, states, rows, guards, drives = self.tables.sizes.tolist()
            terms, lanes = layout.ORDER + 1, self._lanes
            empty = np.zeros
            self._memory.arrays = (
                empty((2 * groups, lanes)), empty((2 * groups, lanes)), empty((groups, lanes)),
                empty((terms + 3, lanes)),
                empty((max(rows, 1), terms)), empty((max(rows, 1), 3)), empty(terms),
                empty((DEEPEST + 2, terms)), empty((DEEPEST + 2, 2)), empty(terms), empty(2),
                empty((MOST_TOUCHES, 2)), empty((states, lanes)), empty((states, lanes)),
                empty((max(drives, 1), 3)), empty((max(guards, 1), 4)),
                empty((3, len(self.tables.linear.system.states))),
            )  # fmt: skip
        arrays: tuple[np.ndarray, ...] = self._memory.arrays
        return arrays

    # -- starts ------------------------------------------------------------------------------------
    def _begin(self, batch: Any) -> None:
        """Find the contact states of trajectories that haven't begun."""
        new = np.flatnonzero((batch.mode < 0) & (batch.status == st.RUNNING))
        if not len(new):
            return
        with self.tables.lock:
            rows = batch.param[new] if batch.stride else batch.param[:1]
            sets = np.array([self.tables.set_of(row) for row in rows], np.int64)
            sets = np.broadcast_to(sets, len(new))
            for which in np.unique(sets).tolist():
                self._begin_set(batch, new[sets == which], which)

    def _begin_set(self, batch: Any, who: np.ndarray, which: int) -> None:
        """The same for trajectories with one set of parameter values."""
        given = self.tables.sets[which]
        time = batch.origin[who] + batch.count[who] * batch.period[who] + batch.phase[who]
        drives = np.cos(given.rates * time[:, None] + given.lags)
        parts = [
            batch.state[who] @ given.gaps.matrix.T,
            np.broadcast_to(given.gaps.constant, (len(who), len(given.gaps.constant))),
            drives @ given.gaps.driven.T,
        ]
        gap = parts[0] + parts[1] + parts[2]
        size = np.abs(batch.state[who]) @ np.abs(given.gaps.matrix.T)
        zero = np.abs(gap) <= layout.ROUNDED * (size + np.abs(parts[1]) + np.abs(parts[2]))
        bits, allowed, plain = 1 << np.arange(gap.shape[1]), self.tables.allowed, self.tables.plain
        zero &= plain | (allowed != 0)
        up = np.where(zero, allowed > 0, gap > 0) & ~self.tables.holds
        mode = up @ bits if gap.shape[1] else np.zeros(len(who), np.int64)
        fresh = zero @ bits if gap.shape[1] else mode
        zero &= plain
        for i in np.flatnonzero(zero.any(axis=1)).tolist():
            mode[i] |= self._ways(which, int(mode[i]), zero[i], batch.state[who[i]], time[i])
        batch.mode[who], batch.fresh[who] = mode, fresh
        carry = np.zeros((len(who), layout.AMPLITUDES))
        carry[:, layout.AT] = [self.tables.state_of(which, int(one)) for one in mode]
        carry[:, layout.ENTERS], carry[:, layout.SET], carry[:, layout.STARTS] = 1.0, which, 1.0
        carry[:, layout.NEXT_STEP] = FIRST_STEP * batch.period[who]
        carry[:, layout.TWICE] = self._at_rest(given, batch.state[who], drives, fresh)
        carry[:, layout.LANDED_AT] = time
        carry[:, layout.RIDES] = zero @ bits if gap.shape[1] else 0.0
        batch.carry[who, : layout.AMPLITUDES] = carry

    def _at_rest(
        self, given: ValueSet, states: np.ndarray, drives: np.ndarray, fresh: np.ndarray
    ) -> np.ndarray:
        """Bits of the stops among those in `fresh` that neither close nor open."""
        closing = given.impacts.closing
        parts = states @ closing.matrix.T, drives @ closing.driven.T
        size = np.abs(states) @ np.abs(closing.matrix.T) + np.abs(parts[1])
        slow = np.abs(parts[0] + parts[1] + closing.constant) <= layout.ROUNDED * (
            size + np.abs(closing.constant)
        )
        bits = 1 << np.arange(slow.shape[1])
        stops = (self.tables.allowed != 0) & ((fresh[:, None] & bits) != 0)
        found: np.ndarray = (slow & stops) @ bits if slow.shape[1] else fresh
        return found

    def _ways(self, which: int, mode: int, zero: np.ndarray, state: np.ndarray, time: float) -> int:
        """Bits of the guards at zero whose gaps open upwards: by the first derivative that isn't
        rounding.
        """
        given = self.tables.sets[which]
        piece = self.tables.linear.piece(given.values, mode)
        wave, bits = np.exp(1j * (given.rates * time + given.lags)), 0
        rate, size, steady = state, np.abs(state), piece.constant
        open_ = set(np.flatnonzero(zero).tolist())
        for order in range(1, WAYS + 1):
            forced = (piece.driven @ wave).real
            rate = piece.matrix @ rate + forced + steady
            size = (
                np.abs(piece.matrix) @ size + np.abs(piece.driven) @ np.abs(wave) + np.abs(steady)
            )
            steady, wave = 0.0 * steady, wave * (1j * given.rates)
            drive = (given.gaps.driven @ wave).real
            for g in sorted(open_):
                value = float(given.gaps.matrix[g] @ rate + drive[g])
                least = layout.ROUNDED * float(
                    np.abs(given.gaps.matrix[g]) @ size + np.abs(drive[g])
                )
                if abs(value) > order * least:
                    open_.discard(g)
                    bits |= (1 << g) if value > 0 else 0
        return bits


@functools.lru_cache(maxsize=64)
def modal_flow(system: System) -> ModalFlow:
    """The modal flow of a system. Raises ParameterError, with the reason, if it has none."""
    linear = linear_pieces(system)
    if isinstance(linear, str):
        raise ParameterError(f"sl.Modal doesn't serve {system.name}: {linear}.")
    return ModalFlow(linear)


@functools.lru_cache(maxsize=64)
def _has_modes(system: System) -> bool:
    """False if a contact of a system has a law, and modes don't carry its motion before it: bodies
    without springs.
    """
    flow = modal_flow(system)
    if flow.tables.plain.all():
        return True
    try:
        flow.tables.state_of(flow.tables.set_of(np.array([*system.values.values()], float)), 0)
    except ParameterError:
        return False
    return True


@explain_unknown_options
@dataclass(frozen=True)
class Modal(Method):
    """The exact flow in each contact state of a system that is linear between its contacts: modes
    go their own ways, and no step is as short as the fastest of them would ask.

    A gap is followed by the modes that matter and bounded by the others, so that no contact is
    missed; the instant of a contact is a zero of all modes, to rounding. At a rigid stop
    (:func:`saltus.impact`) impacts, rest and release follow the rules of :class:`saltus.Taylor`.
    Systems that it doesn't serve - nonlinear forces, friction, jumps, drives that aren't harmonic -
    are moved by :class:`saltus.Taylor`.

    Parameters
    ----------
    max_steps, max_events : int, optional
        Budgets of one trajectory; beyond them it stops with status ``budget_steps`` or
        ``budget_events``. Default: a million steps and 10 000 more for each period; 10 million
        contacts.
    """

    max_steps: int | None = None
    max_events: int = 10_000_000

    def __post_init__(self) -> None:
        if self.max_steps is not None:
            whole(self.max_steps, "max_steps")
        whole(self.max_events, "max_events")

    def serving(self, system: System) -> Method:
        """Taylor's method for a system that has no modal flow."""
        if isinstance(linear_pieces(system), str) or not _has_modes(system):
            return Taylor(max_steps=self.max_steps, max_events=self.max_events)
        return self

    def kernels(self, system: System) -> Flow:
        """The modal flow."""
        return modal_flow(system)

    def numbers(self, periods: float) -> np.ndarray:
        """Step budget, event budget."""
        return np.array([step_budget(self.max_steps, periods), float(self.max_events)])

    @property
    def noise(self) -> float:
        """Rounding over some periods."""
        return 1e-12

    @property
    def exact(self) -> bool:
        """Yes."""
        return True

    def companion(self) -> Modal:
        """Itself: it has no truncation."""
        return self
