"""The exact flow of systems that are linear between their contacts."""

from __future__ import annotations

import functools
import math
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.codegen.module import Flow, modal_module
from saltus.errors import ParameterError
from saltus.flow.counts import whole
from saltus.flow.method import Method, explain_unknown_options, step_budget
from saltus.flow.modal_parameters import varies_by
from saltus.flow.modal_rubbing import Rubbing
from saltus.flow.modal_tables import Tables
from saltus.flow.modal_values import ValueSet
from saltus.flow.taylor import Taylor
from saltus.kernels import status as st
from saltus.kernels.batch import Batch
from saltus.kernels.isolation import DEEPEST, MOST_TOUCHES
from saltus.kernels.modal import layout
from saltus.system import System
from saltus.system.linear import LinearPiece
from saltus.system.linear_laws import Constrained
from saltus.system.linearity import linear_pieces
from saltus.system.quantity import remembered
from saltus.system.tangent import tangent_states

#: Share of a period, or of an unforced span, that is tried as the first step.
FIRST_STEP = 1.0 / 64
#: Times that a slice of the modal flow has the steps of a slice of other flows, at most: its steps
#: grow with the states, not with their square. A slice of eighty states takes some forty
#: milliseconds: at its end a thread may wait five for another one that runs Python.
MOST_AT_ONCE = 600
#: Statuses of a run that came to its end.
ENDED = st.OK, st.RESTING, st.GRAZE_UNRESOLVED
#: Terms of a gap's series by which the way from a boundary is told.
WAYS = 12


def bernstein_table(lanes: int) -> np.ndarray:
    """Bernstein coefficients on [0, 1] of the polynomials of which one of the first terms at 0,
    then at 1, is one, and the others zero; the differences of two that follow one another; the
    powers of x in these polynomials; what each coefficient adds to those of the left half, and of
    the right one; numbers: float64[rows, lanes], see `bernstein` in kernels/modal/layout.py.
    """
    order, half = layout.ORDER, layout.HALF
    terms, table = range(order + 1), np.zeros((order + 1, order + 1))
    for k in range(half):
        table[k, :half] = [math.comb(i, k) / math.comb(order, k) for i in range(half)]
        table[half + k, half:] = (-1) ** k * table[k, half - 1 :: -1]
    steps = np.diff(table, axis=1)
    steps = np.append(steps, steps[:, -1:], axis=1)
    powers = [
        [(-1) ** (k - i) * math.comb(order, k) * math.comb(k, i) for k in terms] for i in terms
    ]
    left = [[math.comb(i, k) / 2.0**i for i in terms] for k in terms]
    halves = [left, np.array(left)[::-1, ::-1]]
    places = np.arange(order + 1.0)
    shares = [1.0 / math.factorial(k) for k in terms]
    numbers = [[*places, *(order / (places + 1.0)), *shares, *(0.0 for _ in terms)]]
    tables = [table, steps, table @ np.array(powers, float), *halves]
    return np.concatenate([*map(np.ravel, tables), *numbers]).reshape(-1, lanes)


class ModalFlow:
    """The flow of one system, as the engine calls it.

    Parameters
    ----------
    tables : Tables
        Its contact states.
    columns : int
        Columns of the derivative that follows the states, row by row: of the state with respect to
        the state at the start, or along some directions.
    names : tuple of str, optional
        Parameters with respect to which it is carried too: these are the last columns.
    """

    def __init__(self, tables: Tables, columns: int = 0, names: tuple[str, ...] = ()) -> None:
        self.tables, self._kernel = tables, modal_module()
        self._lanes, self._memory = self.tables.modes.table.shape[1], threading.local()
        size, _, _, _, guards, _, rows, *_ = tables.sizes.tolist()
        self._states, self._sizes = size, tables.sizes.copy()
        self._names, self._tangents = names, columns > 0
        self._sizes[layout.TANGENTS] = columns
        self.CARRY = layout.AMPLITUDES + rows * self._lanes + columns
        self.CARRY += size + guards if self._tangents else 0
        self.CARRY += 2 * tables.groups * self._lanes if names else 0
        self.STEP_RECORDS = 2 * guards + MOST_TOUCHES

    def workspace(self) -> tuple[np.ndarray, ...]:
        """None that the engine must keep."""
        return ()

    def bound(self, *values: Any) -> Callable[[], int]:
        """See :class:`saltus.codegen.module.Flow`."""
        return functools.partial(self.propagate, *values)

    def propagate(self, *values: Any) -> int:
        """Move the trajectories of a batch, until contact states that haven't been made must be."""
        batch = Batch(*values[:-1])
        budget = values[-1] * min(max(batch.state.shape[1] ** 2 // 25, 1), MOST_AT_ONCE)
        with self.tables.lock:
            self._begin(batch)
            self._look_up(batch)
            tables = self._sizes, *self.tables.arrays(self._names)
        running = batch.status == st.RUNNING
        answer: int = self._kernel.propagate(*batch, budget, *tables, *self._work())
        ended = np.flatnonzero(running & np.isin(batch.status, ENDED))
        sets = batch.carry[ended, layout.SET].astype(int)
        for which in np.unique(sets).tolist() if len(self.tables.partners) else ():
            self._keep_sides(batch, ended[sets == which])
        return answer

    def _keep_sides(self, batch: Batch, who: np.ndarray) -> None:
        """Move ends that rounding put on the other side of a boundary, by rounding, to their side:
        a run that begins there meets what this one hasn't met, and not again what it has. Contacts
        at rest are put onto their constraints. All have one set of parameter values, whose number
        another thread may have dropped meanwhile.
        """
        tables, state = self.tables, batch.state[who, : self._states]
        values = batch.param[who[0] if batch.stride else 0]
        with tables.lock:
            given = tables.sets[tables.set_of(values)]
        time = _times(batch, who)
        drives = self._drives(given, time)
        mode, fresh, carry = batch.mode[who, None], batch.fresh[who, None], batch.carry[who]
        guards = np.arange(len(tables.partners))
        twice = carry[:, [layout.TWICE]].astype(int) >> guards & 1 == 1
        stays = (carry[:, [layout.RIDES]].astype(int) >> guards & 1 == 1) | twice
        held = (mode >> np.maximum(tables.partners, 0)) & 1 == 1
        held &= (tables.partners >= 0) & ~tables.holds
        rests = held | (twice & (tables.allowed != 0))
        holds = rests[:, tables.partners >= 0] @ (1 << tables.partners[tables.partners >= 0])
        for some, bits in {(int(a), int(b)) for a, b in zip(mode[:, 0], holds, strict=True) if b}:
            rows = np.flatnonzero((mode[:, 0] == some) & (holds == bits))
            with tables.lock:
                free, shown = tables.rests(tables.set_of(values), some, bits)
            for g in [-1, *np.flatnonzero(rests[rows[0]] & (tables.allowed != 0)).tolist()]:
                self._rest(given, free, shown, g, held[rows, g], state, rows, time[rows])
        batch.state[who, : self._states] = state
        gap, noise = self._values(given.gaps, given, state, drives)
        for i, g in (beyond := np.argwhere(gap * tables.limits > 0).tolist()):  # a memory isn't
            row = given.gaps.matrix[g]
            j = int(np.argmax(np.abs(row)))
            batch.state[who[i], j] = state[i, j] = state[i, j] - gap[i, g] / row[j]
        if beyond:
            gap, noise = self._values(given.gaps, given, state, drives)
        free = (tables.plain | (tables.allowed != 0)) & ~(stays | held)
        side, met = np.where((mode >> guards) & 1, 1.0, -1.0), (fresh >> guards) & (gap == 0.0) != 0
        least = np.where(tables.rubs, 2 * noise, noise / 4)  # what slides isn't taken to stick
        asked = (free & ~met) | (tables.rubs & ~held)
        near = asked & (np.abs(gap) <= 2 * noise) & (side * gap < least)
        near &= tables.rubs | (np.abs(gap) <= noise)
        wrong = asked & ~near & (tables.plain | tables.rubs) & (side * gap < 0.0)
        for i in np.flatnonzero(wrong.any(axis=1)).tolist():  # the clock's rounding may do that
            rates = self._rates(given, int(mode[i, 0]), state[i], time[i])
            near[i] |= wrong[i] & (np.abs(gap[i]) <= 2 * layout.CLOCK * np.abs(time[i] * rates))
        for i, g in np.argwhere(near).tolist():
            if gap[i, g] == 0.0 and tables.plain[g]:  # on it, and back to its side: a touch
                up, *_ = self._ways(given, int(mode[i, 0]), guards == g, state[i], time[i])
                if (up >> g) & 1 == (side[i, g] > 0.0):
                    continue
            row = given.gaps.matrix[g]
            j = int(np.argmax(np.abs(row)))
            batch.state[who[i], j] += (side[i, g] * least[i, g] - gap[i, g]) / row[j]

    def _rest(
        self,
        given: ValueSet,
        free: Constrained,
        shown: LinearPiece,
        g: int,
        held: np.ndarray,
        states: np.ndarray,
        rows: np.ndarray,
        time: np.ndarray,
    ) -> None:
        """Put the states in some rows onto the constraints of contacts at rest. What presses a stop
        g that is held becomes more than rounding, what presses one that isn't nothing: that is how
        a start reads them.
        """  # fmt: skip
        drives = self._drives(given, time)
        states[rows] = free.put(states[rows], drives)
        h = self.tables.partners[g] if g >= 0 else 0
        ways = shown.matrix[h] @ free.spread
        if g < 0 or not ways.any():
            return
        value, noise = (of[:, h] for of in self._values(shown, given, states[rows], drives))
        speeds = self._speeds(given, time) @ np.abs(shown.driven[h])
        noise = noise + layout.CLOCK * np.abs(time) * speeds
        wanted = np.where(held, np.maximum(value, 2 * noise), np.minimum(value, 0.0))
        for i in np.flatnonzero((np.abs(value) <= 2 * noise) & (wanted != value)).tolist():
            j = int(np.argmax(np.abs(ways * states[rows[i], free.kept])))
            states[rows[i], free.kept[j]] += (wanted[i] - value[i]) / ways[j] if ways[j] else 0.0
        states[rows] = free.put(states[rows], drives)

    def _look_up(self, batch: Batch) -> None:
        """Find the contact states that trajectories have come to: as many as the tables have room
        for. The others wait until these trajectories have ended.
        """
        running, tables = batch.status == st.RUNNING, self.tables
        dropped = running & (batch.carry[:, layout.TABLES] != tables.generation)
        batch.carry[dropped, layout.AT] = -1.0
        lost = running & (batch.carry[:, layout.AT] < 0)
        if (lost == running).all() and tables.full:
            tables.clear()
        for i in np.flatnonzero(lost).tolist():
            if tables.full:
                return
            which = tables.set_of(batch.param[i if batch.stride else 0])
            if not tables.equations.are_finite(tables.sets[which], int(batch.mode[i])):
                batch.status[i] = st.NONFINITE
                continue
            at = tables.state_of(which, int(batch.mode[i]))
            if self._names:
                tables.need(which, self._names, int(batch.mode[i]))
            batch.carry[i, [layout.AT, layout.SET, layout.TABLES]] = at, which, tables.generation

    def _work(self) -> tuple[np.ndarray, ...]:
        """Work arrays of this thread, in the order in which the kernel takes them."""
        if not hasattr(self._memory, "arrays"):
            (
                size, groups, states, rows, guards, drives, amplitudes, courses, *_,
            ) = self._sizes.tolist()  # fmt: skip
            terms, lanes, empty = layout.ORDER + 1, self._lanes, np.zeros
            columns = int(self._sizes[layout.TANGENTS]) or 1
            self._memory.arrays = (
                empty((amplitudes, lanes)), empty((amplitudes, lanes)), empty((groups, lanes)),
                empty((terms + 4 + layout.HALF, lanes)),
                empty((max(rows, 1), terms + layout.HALF)), empty((max(rows, 1), 4)), empty(terms),
                empty((DEEPEST + 2, terms)), empty((DEEPEST + 2, 2)), empty(terms), empty(2),
                empty((MOST_TOUCHES, 2)), empty((states, lanes)), empty((states, lanes)),
                empty((max(drives, 1), 6)), empty((max(guards, 1), layout.FACTORS + 1)),
                empty(((terms + 2) * self.tables.block_groups, lanes)),
                empty((max(courses, 1), layout.VALUE + self.tables.linear.terms)),
                empty((2 * groups, lanes)),
                empty((amplitudes + (2 * states + 4 * groups) * lanes, lanes)),
                empty((size, columns)),
                empty((3, size)), bernstein_table(lanes),
                empty((max(rows, 1), layout.FIFTH + 1)),
                empty((layout.WAVES * (groups + 1) * max(rows, 1), lanes)),
                empty((max(rows, 1), 11)), empty(5),
                empty((layout.QUEUE * (4 * groups + states), lanes)), np.zeros(1, np.int64),
                empty((4 * groups, lanes)),
            )  # fmt: skip
        arrays: tuple[np.ndarray, ...] = self._memory.arrays
        return arrays

    # -- starts ------------------------------------------------------------------------------------
    def _begin(self, batch: Any) -> None:
        """Find the sides of trajectories that haven't begun."""
        new = np.flatnonzero((batch.mode < 0) & (batch.status == st.RUNNING))
        if not len(new):
            return
        rows = batch.param[new] if batch.stride else batch.param[:1]
        sets = np.array([self.tables.set_of(row) for row in rows], np.int64)
        sets = np.broadcast_to(sets, len(new))
        for which in np.unique(sets).tolist():
            self._begin_set(batch, new[sets == which], which)

    def _begin_set(self, batch: Any, who: np.ndarray, which: int) -> None:
        """The same for trajectories with one set of parameter values."""
        given, state = self.tables.sets[which], batch.state[who, : self._states]
        time = _times(batch, who)
        earliest = max((course.earliest for course in given.courses), default=-np.inf)
        if (time < earliest).any():
            raise ParameterError(
                f"a motion begins at {time.min():g} s, and sl.Modal knows a drive of "
                f"{self.tables.linear.system.name} from {earliest:g} s on: ask for "
                f"method=sl.Taylor(), or begin later."
            )
        drives = self._drives(given, time)
        gap, noise = self._values(given.gaps, given, state, drives)
        zero = np.abs(gap) <= noise
        bits, allowed, plain = 1 << np.arange(gap.shape[1]), self.tables.allowed, self.tables.plain
        beyond = ((gap * self.tables.limits > 0) & ~zero).any(axis=1)
        batch.status[who[beyond]] = st.INVALID
        if given.pushes:
            batch.status[who] = st.INVALID_FRICTION
        rubs = zero & self.tables.rubs
        zero &= plain | (allowed != 0) | rubs
        within = (allowed > 0) | (self.tables.limits < 0)
        up = np.where(zero, within, gap > 0) & ~self.tables.holds
        mode = up @ bits if gap.shape[1] else np.zeros(len(who), np.int64)
        fresh = zero @ bits if gap.shape[1] else mode
        zero &= plain
        for i in np.flatnonzero(rubs.any(axis=1)).tolist():
            begin = Rubbing(self.tables, which, state[i], drives[i])
            mode[i] = begin.mode(int(mode[i]), rubs[i])
            if not begin.is_unique(int(mode[i]), rubs[i]):
                batch.status[who[i]] = st.NONUNIQUE
            held = begin.held(int(mode[i]))
            fresh[i] &= ~sum(1 << one.guard for one in held)
            if held and self._tangents:
                rows = batch.state[who[i], self._states :].reshape(self._states, -1)
                rows[:] = begin.projection(int(mode[i]), held) @ rows
        twice, thrice = self._at_rest(given, state, drives, fresh), np.zeros(len(who), np.int64)
        apart = ((gap * allowed > 0) & state.any(axis=1)[:, None]) @ bits if len(bits) else fresh
        fresh &= ~(apart & ~twice)
        for i in np.flatnonzero(zero.any(axis=1)).tolist():
            up, slow, slower, moves = self._ways(given, int(mode[i]), zero[i], state[i], time[i])
            # with a rate a gap in rounding isn't zero either, if it is that of a motion
            moves &= int((gap[i] != 0.0) @ bits) if state[i].any() else 0
            up = (up & ~moves) | (moves & int((gap[i] > 0.0) @ bits))
            mode[i] = (mode[i] & ~(zero[i] @ bits)) | up
            twice[i], thrice[i] = twice[i] | slow, slower
            fresh[i] &= ~moves
            zero[i] &= (moves & bits) == 0
        batch.mode[who], batch.fresh[who] = mode, fresh
        carry = np.zeros((len(who), layout.AMPLITUDES))
        carry[:, layout.AT], carry[:, layout.ENTERS], carry[:, layout.STARTS] = -1.0, 1.0, 1.0
        carry[:, layout.NEXT_STEP] = FIRST_STEP * batch.period[who]
        carry[:, layout.TWICE], carry[:, layout.THRICE] = twice, thrice
        carry[:, layout.LANDED_AT] = time
        carry[:, layout.RIDES] = zero @ bits if gap.shape[1] else 0.0
        batch.carry[who, : layout.AMPLITUDES] = carry

    @staticmethod
    def _drives(given: ValueSet, time: np.ndarray) -> np.ndarray:
        """The drives at some times, float64[times, drives]."""
        waves = np.cos(given.rates * time[:, None] + given.lags)
        return np.column_stack([waves, *(course.at(time)[0] for course in given.courses)])

    @staticmethod
    def _speeds(given: ValueSet, time: np.ndarray) -> np.ndarray:
        """Bounds of the rates of the drives, float64[times, drives]."""
        waves = np.broadcast_to(np.abs(given.rates), (len(time), len(given.rates)))
        return np.column_stack([waves, *(np.abs(course.at(time)[1]) for course in given.courses)])

    @staticmethod
    def _values(
        of: LinearPiece, given: ValueSet, states: np.ndarray, drives: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Linear functions of states and drives, and their rounding: that of a cosine is
        absolute.
        """
        values = states @ of.matrix.T + of.constant + drives @ of.driven.T
        most = np.abs(drives)
        most[:, : len(given.rates)] = 1.0
        size = np.abs(states) @ np.abs(of.matrix.T) + np.abs(of.constant)
        size += most @ np.abs(of.driven.T)
        return values, layout.ROUNDED * size

    def _at_rest(
        self, given: ValueSet, states: np.ndarray, drives: np.ndarray, fresh: np.ndarray
    ) -> np.ndarray:
        """Bits of the stops among those in `fresh` that neither close nor open."""
        closing, noise = self._values(given.impacts.closing, given, states, drives)
        slow = np.abs(closing) <= noise
        bits = 1 << np.arange(slow.shape[1])
        stops = (self.tables.allowed != 0) & ((fresh[:, None] & bits) != 0)
        found: np.ndarray = (slow & stops) @ bits if slow.shape[1] else fresh
        return found

    def _ways(
        self, given: ValueSet, mode: int, zero: np.ndarray, state: np.ndarray, time: float
    ) -> tuple[int, int, int, int]:
        """Bits of the guards at zero whose gaps open upwards, by the first derivative that isn't
        rounding; of those whose rate is zero, of those whose second derivative is too, and of those
        whose rate isn't.
        """
        piece = self.tables.equations.piece_of(given, mode)
        values, sizes = self._drives_at(given, time)
        rate, size, steady = state, np.abs(state), piece.constant
        open_, bits = set(np.flatnonzero(zero).tolist()), [0] * 4
        for order in range(1, WAYS + 1):
            rate = piece.matrix @ rate + piece.driven @ values[order - 1] + steady
            size = (
                np.abs(piece.matrix) @ size
                + np.abs(piece.driven) @ sizes[order - 1]
                + np.abs(steady)
            )
            steady, drive = 0.0 * steady, given.gaps.driven @ values[order]
            for g in sorted(open_):
                value = float(given.gaps.matrix[g] @ rate + drive[g])
                least = layout.ROUNDED * float(
                    np.abs(given.gaps.matrix[g]) @ size + np.abs(drive[g])
                )
                if abs(value) > order * least:
                    open_.discard(g)
                    for k, holds in enumerate((value > 0, order > 1, order > 2, order < 2)):
                        bits[k] |= int(holds) << g
        return bits[0], bits[1], bits[2], bits[3]

    def _rates(self, given: ValueSet, mode: int, state: np.ndarray, time: float) -> np.ndarray:
        """Rates of all gaps at a time, float64[guards]."""
        piece = self.tables.equations.piece_of(given, mode)
        values, _ = self._drives_at(given, time)
        rate = piece.matrix @ state + piece.driven @ values[0] + piece.constant
        return np.array(given.gaps.matrix @ rate + given.gaps.driven @ values[1])

    @staticmethod
    def _drives_at(given: ValueSet, time: float) -> tuple[np.ndarray, np.ndarray]:
        """The drives and their derivatives at a time, and what their sizes are at most:
        float64[1 + WAYS, drives].
        """
        orders = np.arange(WAYS + 1)[:, None]
        waves = np.exp(1j * (given.rates * time + given.lags)) * (1j * given.rates) ** orders
        courses = np.zeros((WAYS + 1, len(given.courses)))
        for p, course in enumerate(given.courses):
            known = course.at(np.array(time))[: WAYS + 1]
            courses[: len(known), p] = known
        return np.hstack([waves.real, courses]), np.hstack([np.abs(waves), np.abs(courses)])


def _times(batch: Batch, who: np.ndarray) -> np.ndarray:
    """Absolute times of some trajectories [s]."""
    times: np.ndarray = batch.origin[who] + batch.count[who] * batch.period[who] + batch.phase[who]
    return times


@functools.lru_cache(maxsize=64)
def modal_flow(system: System) -> ModalFlow:
    """The modal flow of a system. Raises ParameterError, with the reason, if it has none."""
    if system.tangent_of is not None:
        tables = modal_flow(system.tangent_of.origin).tables
        columns = len(system.states) // len(system.tangent_of.states) - 1
        return ModalFlow(tables, columns, system.tangent_by)
    linear = linear_pieces(system)
    if isinstance(linear, str):
        raise ParameterError(f"sl.Modal doesn't serve {system.name}: {linear}.")
    return ModalFlow(Tables(linear))


@explain_unknown_options
@dataclass(frozen=True)
class Modal(Method):
    """The exact flow in each contact state of a system that is linear between its contacts: modes
    go their own ways, and no step is as short as the fastest of them would ask.

    Drives are harmonic, or any function of time alone that ends in a polynomial or in what repeats:
    records, square waves, pulses, swept sines. Modes that don't go their own ways - critical
    damping, rigid bodies, resonance - go together. The modes of one system take 1 GB at most.

    A gap is followed by the modes that matter and bounded by the others, so that no contact is
    missed; the instant of a contact is a zero of all modes, to rounding. At a rigid stop
    (:func:`saltus.impact`) impacts, rest and release follow the rules of :class:`saltus.Taylor`. So
    do dry friction whose force in motion is linear in the states, and memories
    (:func:`saltus.slider`), which begin within their limits. Systems that it doesn't serve -
    nonlinear forces, friction of or along rigid stops, jumps - are moved by
    :class:`saltus.Taylor`.

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
        base = system.tangent_of
        with_equations = base is not None and len(system.field) == len(system.states)
        if with_equations or isinstance(linear_pieces((base or system).origin), str):
            return Taylor(max_steps=self.max_steps, max_events=self.max_events)
        return self

    def kernels(self, system: System) -> Flow:
        """The modal flow."""
        return modal_flow(system)

    def tangents(
        self, system: System, names: tuple[str, ...] = (), directions: int | None = None
    ) -> System | None:
        """The states alone: the modes of a contact state move the derivative too."""
        if self.serving(system.origin) is not self or remembered(system):
            return super().tangents(system, names, directions)
        linear = linear_pieces(system.origin)
        if isinstance(linear, str) or not all(varies_by(linear, name) for name in names):
            return None
        return tangent_states(system, names, directions)

    def numbers(self, periods: float) -> np.ndarray:
        """Step budget, event budget."""
        return np.array([step_budget(self.max_steps, periods), float(self.max_events)])

    @property
    def records_tangents(self) -> bool:
        """No: columns of the derivative wait until the motion leaves a contact state."""
        return False

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
