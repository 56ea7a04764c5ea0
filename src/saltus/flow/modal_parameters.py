"""Derivatives of the contact states of a modal flow with respect to parameters, as tables.

In a contact state the motion is ``z = s + V e^(Lambda h) y``, with s its steady answer. With
respect to a parameter p its derivative w obeys ``w' = A w + A_p z + ...``; the derivative s_p of
the steady answer is one solution of it, so that ``w - s_p`` is moved as a column of the tangent is,
but for what A_p makes of the modes. Each drive Re(r e^(i theta)) of s gives s_p two parts: that of
its amplitude, Re(r_p e^(i theta)), and that of its phase, theta_p Re(i r e^(i theta)), which grows
with the time where p is a frequency. A state whose derivative has no such form has NaN there.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Collection, Sequence

import numpy as np

from saltus.codegen.module import MODAL_LANES as LANES
from saltus.contact.guards import is_hold
from saltus.flow.modal_blocks import MOST_LOSS, MOST_SPREAD
from saltus.flow.modal_modes import StateModes, answers_of, both_ways, weights_of
from saltus.flow.modal_rows import Links, Rows
from saltus.flow.modal_values import ValueSet
from saltus.kernels.modal import layout
from saltus.language import expression as ex
from saltus.system.linear import LinearPiece, LinearSystem

#: Contact states whose differentiated equations are kept: those of some periods at least, and as
#: many as fit into so many bytes, but no more than a chaotic motion comes to.
KEPT, KEPT_BYTES, MOST_KEPT = 64, 2**25, 512
#: Sets of values through which the derivatives of a contact state are made with those of others,
#: without a motion that asks for them: a chaotic motion at the same values leaves hundreds of
#: states, of which an orbit needs a few.
REMEMBERED = 64


@functools.lru_cache(maxsize=256)
def varies_by(linear: LinearSystem, name: str) -> bool:
    """True if the derivative with respect to a parameter has a closed form: its boundaries keep
    their slopes, its laws of contact don't change, no drive is a record and no friction sticks.
    """
    if linear.courses or linear.sticking:
        return False
    guards = linear.system.guards
    laws = [
        one
        for guard in guards
        if guard.law is not None and not is_hold(guard)
        for one in (
            *(guard.gap, guard.law.constraint, guard.law.restitution),
            *(*guard.law.settled, *guard.law.reset),
        )
        if one is not None
    ]
    known = linear.of(tuple(laws))
    if known is None or any(node is ex.parameter(name) for node in ex.walk(*known)):
        return False
    gaps = linear.by(name).own_gaps
    return not any(
        ex.depends_on(gap, ("state", "select"))
        for guard, gap in zip(guards, gaps, strict=True)
        if not is_hold(guard)
    )


class ParameterTables:
    """The derivatives of the tables of a system with respect to some parameters.

    Parameters
    ----------
    linear : LinearSystem
        The system.
    names : tuple of str
        The parameters.
    groups, state_groups : int
        Groups of LANES modes, and of states.
    sets, made, links : sequence, sequence, Links
        Its sets of parameter values; equations and modes of its contact states; what links these.
        All grow.

    Attributes
    ----------
    rows, shifts : Rows
        What the kernel reads.
    links : Links
        Links between the contact states that have derivatives, with the first row of these.
    """

    def __init__(
        self,
        linear: LinearSystem,
        names: tuple[str, ...],
        groups: int,
        state_groups: int,
        sets: Sequence[ValueSet],
        made: Sequence[tuple[object, StateModes]],
        links: Links,
    ) -> None:
        self._groups, self._state_groups, self._sets, self._made = groups, state_groups, sets, made
        self._linear = [linear.by(name) for name in names]
        drives, guards = len(linear.drives), len(linear.system.guards)
        #: Numbers of each set of values, for each parameter.
        self._width = 2 * drives + guards * (1 + 2 * drives)
        self.rows, self.shifts = Rows(), Rows(max(len(names) * self._width, 1))
        #: Derivatives of the equations, by the parameters and the values that they depend on.
        self._pieces: dict[tuple[float, ...], Callable[[int], LinearPiece]] = {}
        kept = int(np.clip(KEPT_BYTES // (8 * (LANES * state_groups) ** 2), KEPT, MOST_KEPT))
        self._piece = functools.lru_cache(maxsize=kept)(self._piece_of)
        self._every, self.links = links, Links(links.table.shape[1])
        #: Contact states that were asked for, each with the number of sets since then; the last
        #: set.
        self._asked: dict[int, int] = {}
        self._last = -1

    def ask(self, which: int, mode: int) -> None:
        """Note that a motion has come to a contact state of a set."""
        if which != self._last:
            self._asked = {one: age + 1 for one, age in self._asked.items() if age < REMEMBERED}
            self._last = which
        self._asked[mode] = 0

    def has(self, number: int) -> bool:
        """True if the derivatives of a contact state have been made."""
        return bool(number < self.links.used and self.links.table[number, layout.SLOPES] >= 0)

    def wanted(self, known: Collection[int]) -> list[int]:
        """The contact states, of ``known`` ones, that motions came to in the last sets."""
        return [one for one in self._asked if one in known]

    def need(self, numbers: Sequence[int], which: int, modes: Sequence[int]) -> None:
        """Make the derivatives of contact states of one set of values, and of this set."""
        while self.shifts.used <= which:
            self.shifts.add(self._shifts_of(self._sets[self.shifts.used]))
        if self.links.used < len(self._made):
            new = len(self._made) - self.links.used
            self.links.add(np.full((new, self.links.table.shape[1]), -1))
        left = self.links.table[numbers, layout.SLOPES] < 0
        if left.any():
            some, sides = np.array(numbers)[left], np.array(modes)[left].tolist()
            states = [self._made[at][1] for at in some.tolist()]
            every = range(len(self._linear))
            parts = [self._slopes_of(j, self._sets[which], states, sides) for j in every]
            firsts = [self._put([one[k] for one in parts]) for k in range(len(states))]
            self._link(some, np.array(firsts))

    def _put(self, parts: list[tuple[np.ndarray, np.ndarray]]) -> int:
        """Write the derivatives of a contact state; the first row."""
        answers, mixing = zip(*parts, strict=True)
        behind = np.cumsum([sum(map(len, answers)), *map(len, mixing)])
        for one, more, place in zip(answers, mixing, behind, strict=False):
            one[0, 0] = place if len(more) else 0
        return self.rows.add(np.concatenate([*answers, *mixing]))

    def _link(self, numbers: np.ndarray, firsts: np.ndarray) -> None:
        """Link contact states whose derivatives begin at some rows to others that have some."""
        links, every = self.links, self._every.table
        rows = every[numbers]
        rows[:, layout.SLOPES] = links.table[numbers, layout.SLOPES] = firsts
        behind = rows[:, layout.BEHIND :]
        known = (behind >= 0) & (links.table[behind, layout.SLOPES] >= 0)
        behind[~known] = -1
        links.put(numbers, rows)
        mine, guards = np.nonzero(known)
        others = behind[known]
        links.table[others, layout.BEHIND + guards] = numbers[mine]
        links.table[others, layout.SMOOTH] = every[others, layout.SMOOTH]
        links.change(others)

    def _shifts_of(self, given: ValueSet) -> np.ndarray:
        """Of each parameter: what it does to the rate and the phase of each drive; of each guard
        what it does to the constant and the drives in its gap, and these drives themselves.
        """
        found = list[np.ndarray]()
        for linear in self._linear:
            rates, phases = linear.rates(given.values)
            gaps = linear.gaps(given.values)
            rows = np.column_stack([gaps.constant, gaps.driven, given.gaps.driven])
            found += [rates, phases, rows.ravel()]
        return np.concatenate(found)

    def _slopes_of(
        self, parameter: int, given: ValueSet, modes: list[StateModes], sides: list[int]
    ) -> list[tuple[np.ndarray, np.ndarray]]:
        """Of each of some contact states the derivative of the steady answer behind a row of its
        own, and what mixes the modes: rows of the table.
        """
        linear = self._linear[parameter]
        slow, _ = linear.rates(given.values)
        key = parameter, *(given.values[name] for name in linear.parameters)
        if key not in self._pieces:
            self._pieces[key] = linear.every_piece(given.values)
        pieces = [self._piece(key, mode) for mode in sides]
        answers = slopes_of(pieces, given.rates, slow, modes)
        count, states, terms = answers.shape
        rows = np.zeros((count, 2 * terms, LANES * self._state_groups))  # the first has a row alone
        rows[:, 1, :states] = answers[:, :, 0].real
        rows[:, 2::2, :states] = answers[:, :, 1:].real.transpose(0, 2, 1)
        rows[:, 3::2, :states] = answers[:, :, 1:].imag.transpose(0, 2, 1)
        behind = rows.reshape(count, -1, LANES)[:, self._state_groups - 1 :]
        none = np.zeros((0, LANES))
        mixing = [
            none
            if one.block is not None or not piece.matrix.any()
            else mixing_of(piece.matrix, one, self._groups)
            for piece, one in zip(pieces, modes, strict=True)
        ]
        return list(zip(behind, mixing, strict=True))

    def _piece_of(self, key: tuple[float, ...], mode: int) -> LinearPiece:
        """Derivatives of the equations of a contact state."""
        return self._pieces[key](mode)


def slopes_of(
    pieces: list[LinearPiece], rates: np.ndarray, slow: np.ndarray, modes: list[StateModes]
) -> np.ndarray:
    """Derivatives of the amplitudes of steady answers: complex128[k, N, 1 + D].

    Parameters
    ----------
    pieces : list of LinearPiece
        Derivatives of the equations of k contact states.
    rates, slow : float64[D]
        Rates of the drives [rad/s], and the derivatives of these.
    modes : list of StateModes
        Their modes and their steady answers.

    Returns
    -------
    complex128[k, N, 1 + D]
        For the constant and for each drive. NaN where it has no closed form: modes go together in a
        block, or are so slow that a constant force moves them without end.
    """
    every, changes = np.append(0.0, rates), np.append(0.0, slow)
    answers = np.array([one.answers for one in modes])
    loads = np.empty(answers.shape, complex)
    loads.real = [np.column_stack([piece.constant, piece.driven]) for piece in pieces]
    loads.real += changes * answers.imag
    loads.imag = -changes * answers.real
    for k, piece in enumerate(pieces):
        if piece.matrix.any():
            loads[k] += piece.matrix @ answers[k]
    loads = np.concatenate([loads, loads.conj()], axis=2)
    parts = np.concatenate([one.inverse @ load for one, load in zip(modes, loads, strict=True)])
    counts = [len(one.values) for one in modes]
    values, signed = np.concatenate([one.values for one in modes]), both_ways(every)
    sizes = np.abs(values)[:, None]
    most = [max(np.abs(one.values).max(initial=0.0), np.abs(every).max()) for one in modes]
    lost = MOST_LOSS * np.abs(1j * signed - values[:, None]) <= np.maximum(np.abs(signed), sizes)
    lost[:, 0] |= MOST_SPREAD * sizes[:, 0] <= np.repeat(most, counts)
    unknown = (lost & (parts != 0)).any(axis=1)
    weights = weights_of(values, parts, signed)
    for k, (one, end) in enumerate(zip(modes, np.cumsum(counts), strict=True)):
        mine = slice(end - counts[k], end)
        if one.block is not None or unknown[mine].any():
            answers[k] = np.nan
        else:
            answers[k] = answers_of(one.vectors, weights[mine])
    return answers


def mixing_of(matrix: np.ndarray, modes: StateModes, groups: int) -> np.ndarray:
    """Change of the modes of a contact state by a change of its matrix, as rows of LANES modes.

    The derivative of e^(A h) is V (G * D) L, with G = L A_p V and the divided differences D_jk of
    e^(lambda h) (Higham, Functions of Matrices (2008), theorem 3.9). For each kept mode k: by
    groups of modes j the real and the imaginary part of G_jk, then those for its complex partner.
    """
    count, paired = len(modes.values), modes.values.imag > 0
    mixed = np.zeros((2, LANES * groups, LANES * groups), complex)
    left = modes.inverse @ matrix
    mixed[0, :count, :count] = left @ modes.vectors
    mixed[1, :count, :count] = left @ (modes.vectors.conj() * paired)
    parts = np.stack([mixed[0].real, mixed[0].imag, mixed[1].real, mixed[1].imag])
    # [part, j, k] -> [k, group, part, lane]
    return parts.reshape(4, groups, LANES, -1).transpose(3, 1, 0, 2).reshape(-1, LANES)
