"""The contact states of a system that is linear between its contacts, as tables for the modal flow:
made when a motion first comes to them.
"""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import replace

import numpy as np

from saltus.codegen.module import MODAL_LANES as LANES
from saltus.flow.modal_eigen import slots_of
from saltus.flow.modal_equations import EquationsOfStates, StateEquations, numbers_of
from saltus.flow.modal_laws import laws_of
from saltus.flow.modal_modes import (
    Known,
    StateModes,
    answers_at,
    modes_of,
    spread_over,
)
from saltus.flow.modal_parameters import ParameterTables
from saltus.flow.modal_rows import Links, Rows
from saltus.flow.modal_state_rows import modes_rows, steady_rows
from saltus.flow.modal_values import ValueSet
from saltus.kernels.modal import layout
from saltus.kernels.status import HOLD_LAW, IMPACT_LAW, NO_LAW, SURFACE_LAW
from saltus.language.evaluate import evaluate
from saltus.language.expression import Expr, walk
from saltus.system.courses import Course, course_of
from saltus.system.linear import LinearPiece, LinearSystem
from saltus.system.linear_laws import Constrained, constrained, impacts_of, rows_of
from saltus.system.quantity import remembered

#: Memory of the tables of one system [bytes]. Beyond it all are dropped, as soon as no trajectory
#: that a call moves needs them; those still to be moved make theirs anew. A contact state of 128
#: modes takes 6 MB; a beam against ten stops came to 52 of them, again and again.
MOST_BYTES = 2**30
#: Memory of a set of parameter values besides its arrays [bytes].
SET_BYTES = 4096
#: Sets of values among which the nearest to a new one is looked for.
NEAR = 64
#: Sets through which a contact state is handed on, each from the one before, without a motion that
#: has asked for it.
HANDED = 32


class Tables:
    """Tables of the contact states of a system, by its parameter values.

    Parameters
    ----------
    linear : LinearSystem
        The system.

    Notes
    -----
    They take MOST_BYTES, 1 GB, at most, and what one more contact state needs.
    """

    def __init__(self, linear: LinearSystem) -> None:
        self.linear = linear
        self.lock = threading.Lock()
        self._laws = laws_of(linear)
        kinds, sides = self._laws[:, layout.KIND], np.zeros(len(self._laws), np.int64)
        for g, guard in enumerate(linear.system.guards):
            sides[g] = guard.law.side if guard.law else 0
        self.holds, self.plain = kinds == HOLD_LAW, kinds == NO_LAW
        self.strikes = kinds == IMPACT_LAW
        self.rubs, self.allowed = kinds == SURFACE_LAW, sides
        self.limits = self._laws[:, layout.LIMITS]
        self.partners = self._laws[:, layout.PARTNER].astype(int)
        self._remembers = np.array(remembered(linear.system), np.int64)
        self._impacts = impacts_of(linear, linear.system.values)
        self.generation = 0
        self.clear()
        n, gaps = len(linear.states), len(self._laws)
        self.row_of, self.sign_of = self._rows_of_gaps()
        rows = int(self.row_of.max(initial=-1)) + 1
        self.first_guard = [int(np.flatnonzero(self.row_of == r)[0]) for r in range(rows)]
        values = dict(linear.system.values)
        slots = len(slots_of(np.linalg.eigvals(numbers_of(linear.piece(values, 0).matrix)))) + rows
        self.groups, self.state_groups = -(-slots // LANES), -(-n // LANES)
        drives = len(linear.drives)
        courses = len(linear.courses)
        self.block_groups = -(-(n + 1 + 2 * drives + linear.terms * courses) // LANES)
        self.rows = 2 * self.groups + self.block_groups
        counts = n, self.groups, self.state_groups, rows, gaps, drives, self.rows, courses
        self.sizes = np.array([*counts, 0, len(self._remembers), linear.terms], np.int64)

    def clear(self) -> None:
        """Drop all sets and contact states: their numbers are of a new generation. Arrays that
        kernels hold stay as they are.
        """
        self.generation += 1
        self.modes, self.steady, self.pieces = Rows(), Rows(), Rows()
        self._courses: dict[tuple[Expr, bytes], tuple[Course, list[float]]] = {}
        self._sets: dict[bytes, int] = {}
        self.sets: list[ValueSet] = []
        self.equations = EquationsOfStates(self.linear, self.holds)
        self._parts: dict[tuple[int, int], Known] = {}
        self._known: dict[tuple[int, bytes], int] = {}
        self._states: dict[tuple[int, int], int] = {}
        self._rests: dict[tuple[int, int, int], tuple[Constrained, LinearPiece]] = {}
        #: Of each set its contact states, and how often each has been handed on to come to it.
        self._handed: list[dict[int, int]] = []
        #: The last sets of the same equations and gaps: they differ in the rates of drives.
        self._alike: dict[tuple[object, ...], deque[int]] = {}
        #: Equations and modes of each contact state.
        self.made: list[tuple[StateEquations, StateModes]] = []
        self._by: dict[tuple[str, ...], ParameterTables] = {}
        drives, gaps = max(len(self.linear.drives), 1), len(self._laws)
        self._offset, self._rate, self._lag = Rows(max(2 * gaps, 1)), Rows(drives), Rows(drives)
        self._links = Links(layout.BEHIND + gaps)
        self._course = Rows(max(5 * len(self.linear.courses), 1))
        states = len(self.linear.states)
        width = states + 1 + len(self.linear.drives) + len(self.linear.courses)
        self._acts, self._presses = Rows(2 * width + states + 1), Rows(width)
        self._held = 0

    @property
    def full(self) -> bool:
        """True if the tables hold MOST_BYTES or more."""
        tables = [self.modes, self.steady, self.pieces, self._acts, self._presses]
        tables += [one.rows for one in self._by.values()]
        held = self._held + self.equations.held
        return held + sum(one.table.nbytes for one in tables) >= MOST_BYTES

    def _rows_of_gaps(self) -> tuple[np.ndarray, np.ndarray]:
        """Row and sign of each gap: those that differ by a number only share one."""
        values = dict(self.linear.system.values)
        rng = np.random.default_rng(0)
        sets = [values, {name: one * rng.uniform(0.9, 1.1) for name, one in values.items()}]
        seen = [np.column_stack([g.matrix, g.driven]) for g in map(self.linear.gaps, sets)]
        rows: list[int] = []
        row_of, sign_of = np.zeros(len(seen[0]), np.int64), np.ones(len(seen[0]))
        for g in range(len(seen[0])):
            for row, first in enumerate(rows):
                for sign in (1.0, -1.0):
                    alike = not (self.holds[g] or self.holds[first])
                    if alike and all(np.array_equal(one[g], sign * one[first]) for one in seen):
                        row_of[g], sign_of[g] = row, sign
                        break
                else:
                    continue
                break
            else:
                row_of[g] = len(rows)
                rows.append(g)
        return row_of, sign_of

    # -- what the kernel reads ---------------------------------------------------------------------
    def by(self, names: tuple[str, ...]) -> ParameterTables:
        """The derivatives with respect to some parameters."""
        if names not in self._by:
            widths = self.groups, self.state_groups
            self._by[names] = ParameterTables(
                self.linear, names, *widths, self.sets, self.made, self._links
            )
        return self._by[names]

    def arrays(self, names: tuple[str, ...] = ()) -> tuple[np.ndarray, ...]:
        """The tables, in the order in which the kernel takes them after the sizes. With names of
        parameters a contact state that lacks the derivatives with respect to them isn't linked.
        """
        slopes = self.by(names)
        links = slopes.links.copy() if names else self._links.copy()
        return (
            self.row_of, self.sign_of, self._offset.table, self._rate.table, self._lag.table,
            self.modes.table, self.steady.table, links, self._course.table, self.pieces.table,
            self._laws, self._acts.table, self._presses.table, self._remembers,
            slopes.rows.table, slopes.shifts.table,
        )  # fmt: skip

    def set_of(self, row: np.ndarray) -> int:
        """Number of a set of parameter values."""
        key = row.tobytes()
        if key not in self._sets:
            values = dict(zip(self.linear.system.values, row.tolist(), strict=True))
            rates, lags = self.linear.rates(values)
            found = [self._course_of(node, values) for node in self.linear.courses]
            rows = np.array([row for _, row in found], float).ravel()
            courses, gaps = tuple(course for course, _ in found), self.linear.gaps(values)
            if self.holds.any():
                gaps = replace(gaps, constant=np.where(self.holds, 0.0, gaps.constant))
            for table, numbers in (
                (self._offset, np.append(gaps.constant, self._levels(gaps))),
                (self._rate, rates), (self._lag, lags),
                (self._course, rows),
            ):  # fmt: skip
                table.add(np.append(numbers, np.zeros(table.table.shape[1] - len(numbers))))
            impacts = self._impacts
            if not self.plain.all():
                impacts = impacts_of(self.linear, values)
                self._acts.add(
                    np.column_stack(
                        [
                            *(gaps.matrix, gaps.constant, gaps.driven, impacts.closing.matrix),
                            *(impacts.closing.constant, impacts.closing.driven),
                            *(impacts.push, impacts.restitution),
                        ]
                    )
                )
            pushes = any(level < 0 for level in evaluate(self.linear.levels, values=values))
            self.sets.append(ValueSet(values, gaps, rates, lags, courses, impacts, pushes))
            self._handed.append({})
            self._sets[key] = len(self.sets) - 1
            self._held += SET_BYTES + self.sets[-1].gaps.matrix.nbytes
        return self._sets[key]

    def _levels(self, gaps: LinearPiece) -> np.ndarray:
        """Levels of the boundaries that are those of a state, float64[gaps]; 0 of the others."""
        state, every = self._laws[:, layout.LEVEL], np.arange(len(self._laws))
        slope = np.where(state >= 0, gaps.matrix[every, state], 1.0)
        return np.where(state >= 0, -gaps.constant / slope, 0.0)

    def _course_of(self, node: Expr, values: dict[str, float]) -> tuple[Course, list[float]]:
        """A course and its row of numbers for the kernel: one for all values that it doesn't ask
        for.
        """
        asked = [one.payload for one in walk(node) if one.op == "param"]
        key = (node, np.array([values[name] for name in asked]).tobytes())
        if key not in self._courses:
            course = course_of(node, values, self.linear.terms)
            begins = np.concatenate([course.begins, np.zeros(-len(course.begins) % LANES)])
            first = self.pieces.add(np.concatenate([begins, course.terms.ravel()]))
            row = [first, len(course.begins), course.cycle, len(begins) // LANES, course.tail]
            self._courses[key] = course, row
            self._held += course.begins.nbytes + course.terms.nbytes
        return self._courses[key]

    def state_of(self, which: int, mode: int) -> int:
        """Number of a contact state, made if it isn't known; the first of a set with those that the
        nearest set has.
        """
        if not self._handed[which]:
            self._hand_on(which)
        if (which, mode) not in self._states:
            self._make(which, mode)
        self._handed[which][mode] = 0
        return self._states[which, mode]

    def need(self, which: int, names: tuple[str, ...], mode: int) -> None:
        """Make the derivatives of a contact state of a set with respect to some parameters, and of
        those others of the set that motions with such derivatives have come to in sets before.
        """
        slopes = self.by(names)
        slopes.ask(which, mode)
        if not slopes.has(self._states[which, mode]):
            modes = slopes.wanted(self._handed[which])
            slopes.need([self._states[which, one] for one in modes], which, modes)

    def _make(self, which: int, mode: int) -> None:
        given = self.sets[which]
        shown = self.shown(given, mode)
        stays = [g for g in np.flatnonzero(self.limits).tolist() if self.stays(given, mode, g)]
        free = constrained(self.linear.system, mode, given.gaps, given.impacts, stays)
        known = self.equations.of(given, mode, free)
        modes = self._state_modes(known, given, shown, free)
        number, guards = len(self.made), len(self.linear.system.guards)
        seen = free.levelled(shown) if len(free.kept) < len(free.spread) else shown
        row = np.full((1, layout.BEHIND + len(self._laws)), -1)
        (steady,) = self._steady_of(modes.answers[None], given, seen)
        row[0, : layout.BEHIND] = self._modes_of(known, modes, seen), steady, 0, -1
        for g in range(guards):
            behind = self._states.get((which, mode ^ 1 << g), -1)
            if behind >= 0 and self.plain[g]:
                smooth = self.equations.are_smooth(known, self.made[behind][0], given.gaps, g)
                row[0, layout.SMOOTH] |= int(smooth) << g
            row[0, layout.BEHIND + g] = behind
        self._link(row, number)
        if self.holds.any():
            # the closing accelerations of contacts that can be held: the gaps of their hold guards
            rows, partner = rows_of(shown), self._laws[:, layout.PARTNER].copy()
            partner[guards:] = np.arange(guards, len(partner))
            self._presses.add(np.where((partner >= 0)[:, None], rows[partner], 0.0))
        self.made.append((known, modes))
        self._states[which, mode] = number

    def rests(self, which: int, mode: int, holds: int) -> tuple[Constrained, LinearPiece]:
        """The states that the contacts with some hold guards (bits) allow while they are held, and
        the gaps of a contact state.
        """
        key, given = (which, mode, holds), self.sets[which]
        if key not in self._rests:
            free = constrained(self.linear.system, holds, given.gaps, given.impacts)
            self._rests[key] = free, self.shown(given, mode)
        return self._rests[key]

    def _link(self, rows: np.ndarray, first: int) -> None:
        """Link contact states that begin with number ``first`` and those behind their boundaries,
        by their rows of links int64[k, ..].
        """
        self._links.add(rows)
        mine, guards = np.nonzero(rows[:, layout.BEHIND :] >= 0)
        others = rows[mine, layout.BEHIND + guards]
        self._links.table[others, layout.BEHIND + guards] = first + mine
        smooth = rows[mine, layout.SMOOTH] & 1 << guards
        np.bitwise_or.at(self._links.table[:, layout.SMOOTH], others, smooth)
        self._links.change(others)

    def _hand_on(self, which: int) -> None:
        """Make the contact states of the nearest set of the same equations and gaps for a set: all
        that the rates of drives change is the steady answer. Those of which they change more, and
        those with laws or records, are made when they are asked for.
        """
        given = self.sets[which]
        if not self.plain.all() or given.courses:
            return
        key = id(given.gaps), *(given.values[name] for name in self.linear.parameters)
        alike = self._alike.setdefault(key, deque(maxlen=NEAR))
        if alike:
            apart = np.abs([self.sets[one].rates - given.rates for one in alike]).sum(axis=1)
            self._hand(alike[int(np.argmin(apart))], which)
        alike.append(which)

    def _hand(self, source: int, which: int) -> None:
        """Make the contact states of one set for another one."""
        given, rates = self.sets[which], np.append(0.0, self.sets[which].rates)
        modes, numbers, loads = list[int](), list[int](), list[np.ndarray]()
        for mode, times in self._handed[source].items():
            number = self._states[source, mode]
            known, made = self.made[number]
            parts = self._parts[id(known), id(given.gaps)]
            own, together = parts.get(max(known.largest, rates.max()), (rates, True))
            if not together and made.block is None and times < HANDED:
                modes.append(mode)
                numbers.append(number)
                loads.append(own)
        if not modes:
            return
        apart, answers = answers_at([self.made[at][0].eigen for at in numbers], loads, rates)
        answers, old = answers[apart], np.array(numbers)[apart]
        if not len(old):
            return
        first, rows = len(self.made), self._links.table[old]
        behind = rows[:, layout.BEHIND :]
        place = np.minimum(np.searchsorted(old, behind), len(old) - 1)
        kept = old[place] == behind
        behind[:] = np.where(kept, first + place, -1)
        rows[:, layout.SMOOTH] &= kept @ (1 << np.arange(kept.shape[1]))
        rows[:, layout.STEADY] = self._steady_of(answers, given, given.gaps)
        self._links.add(rows)
        for k, mode in enumerate(np.array(modes)[apart].tolist()):
            known, made = self.made[old[k]]
            self.made.append((known, replace(made, answers=answers[k])))
            self._states[which, mode] = first + k
            self._handed[which][mode] = self._handed[source][mode] + 1

    # -- one contact state -------------------------------------------------------------------------
    def shown(self, given: ValueSet, mode: int) -> LinearPiece:
        """The gaps in a contact state: those of hold guards depend on it."""
        return self.linear.gaps(given.values, mode) if self.holds.any() else given.gaps

    def _state_modes(
        self, known: StateEquations, given: ValueSet, shown: LinearPiece, free: Constrained
    ) -> StateModes:
        """The modes of a contact state, of those states that contacts at rest allow."""
        speeds = np.array([one.speeds for one in given.courses]).reshape(-1, self.linear.terms)
        held = len(free.kept) < len(free.spread)
        piece, gaps = (
            (free.reduced(known.piece), free.seen(shown)) if held else (known.piece, shown)
        )
        also = self._parts.setdefault((id(known), id(given.gaps)), {}) if not held else None
        modes = modes_of(
            piece, gaps, given.rates, speeds, LANES * self.groups, known.eigen, known.fastest, also
        )
        return spread_over(modes, free, len(given.rates)) if held else modes

    def stays(self, given: ValueSet, mode: int, g: int) -> bool:
        """True if a memory stays at its limit in a contact state, the boundary of a guard."""
        if (self.limits[g] > 0) != bool(mode >> g & 1):
            return False
        normal = given.gaps.matrix[g]
        rates = [
            normal @ rows_of(self.equations.piece_of(given, one)) for one in (mode, mode ^ 1 << g)
        ]
        return not rates[0].any() and bool(rates[1].any()) and not given.gaps.driven[g].any()

    def _modes_of(self, known: StateEquations, modes: StateModes, shown: LinearPiece) -> int:
        """First row of the table of some modes; those of equal equations share one, but for blocks,
        which hold drives.
        """
        key = id(known), shown.matrix.tobytes()
        if modes.block is not None:
            return self.modes.add(self._rows(known, modes, shown))
        if key not in self._known:
            self._known[key] = self.modes.add(self._rows(known, modes, shown))
        return self._known[key]

    def _rows(self, known: StateEquations, modes: StateModes, shown: LinearPiece) -> np.ndarray:
        gaps = shown.matrix[self.first_guard]
        return modes_rows(known.piece.matrix, modes, gaps, self.groups, self.state_groups)

    def _steady_of(self, answers: np.ndarray, given: ValueSet, shown: LinearPiece) -> np.ndarray:
        """First rows of the tables of the steady answers complex128[k, N, ..] of some contact
        states: to the constant, to cosine and sine of each harmonic drive, to each derivative of
        each course.
        """
        harmonic, first = 1 + len(given.rates), self.first_guard
        own = np.zeros((len(first), answers.shape[2]))
        own[:, 0] = (shown.constant - given.gaps.constant)[first]
        own[:, 1:harmonic] = shown.driven[first, : harmonic - 1]
        own[:, harmonic :: self.linear.terms] = shown.driven[first, harmonic - 1 :]
        gaps, parts = shown.matrix[first] @ answers + own, np.abs(answers.real)
        sizes = np.abs(shown.matrix[first]) @ (parts + np.abs(answers.imag)) + np.abs(own)
        rows = steady_rows(answers, gaps, sizes, harmonic, LANES * self.state_groups)
        each = rows.shape[1] // LANES
        firsts: np.ndarray = self.steady.add(rows) + each * np.arange(len(rows))
        return firsts
