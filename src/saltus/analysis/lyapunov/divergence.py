"""Growth of volumes by a flow: the divergence of its field, integrated along the motion, and the
contributions of contacts.

By Liouville's rule the logarithm of the determinant of the tangent is the integral of the trace of
the Jacobian. At a contact where the force jumps the determinant is multiplied by that of the
saltation matrix, (n'f_after + g_t) / (n'f_before + g_t): the rate of the gap after the contact over
the rate before. Where the state jumps the matrix itself is made, from the state on both sides;
where a contact begins to be held volumes vanish. Nothing here uses the tangent flow, so that the
sum of Lyapunov exponents can be held against it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from saltus.analysis.dataset_parts import before_jumps
from saltus.flow.contact_table import ContactTable
from saltus.flow.maps import Stroboscope
from saltus.flow.request import Outcome
from saltus.kernels import status as st
from saltus.language.derivatives import gradient, time_derivative
from saltus.language.evaluate import evaluate
from saltus.language.expression import Expr, add, depends_on, walk
from saltus.system import System
from saltus.system.quantity import remembering, with_states

#: Name of the state added for an integral, which no user can write.
_INTEGRAL = "integral of the divergence"


class Divergence:
    """The divergence of a system's field, integrated over blocks.

    The trace of the Jacobian of most vibrating systems holds parameters only, or is constant in
    each mode: then it is summed by hand, the times in the modes being known from the contacts. Any
    other is integrated as one more state.
    """

    def __init__(self, system: System):
        self._system = system
        self._trace = _sum([row[i] for i, row in enumerate(system.jacobian)])
        self._moves = depends_on(self._trace, ("state", "time"))
        self._by_mode = any(node.op == "select" for node in walk(self._trace))
        self._remembering = remembering(system)
        self._extended = remembering(with_states(system, {_INTEGRAL: self._trace}))

    def of_blocks(self, map_: Stroboscope, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Growth of volumes over one block from float64[k, D], each with its row of the map: the
        logarithm, float64[k], and the number of directions lost where contacts are held, int64[k].
        """
        constant = not self._moves and not self._by_mode
        if constant and not self._system.guards:
            return self._constant(map_), np.zeros(len(start), np.int64)
        integrated = self._moves or (self._by_mode and not map_.method.records_contacts)
        system = self._extended if integrated else self._remembering
        more = len(system.states) - start.shape[1]
        outcome = map_.of_system(system).run(np.pad(start, ((0, 0), (0, more))), 1, record=0)
        total = (
            outcome.state[:, start.shape[1]].copy()
            if integrated
            else self._constant(map_)
            if constant
            else self._dwelling(map_, outcome)
        )
        np.add.at(total, outcome.contacts.trajectory, self._jumps(map_, outcome))
        good = np.isin(outcome.status, (st.OK, st.GRAZE_UNRESOLVED))
        lost = np.maximum(self._lost(outcome), np.isneginf(total))
        total[lost > 0] = -np.inf  # what is held all the time keeps no volume either
        return np.where(good, total, np.nan), lost

    def _lost(self, outcome: Outcome) -> np.ndarray:
        """The most constraints that are held at once, int64[k]: two for a contact at rest (place
        and velocity), one for a surface.
        """
        contacts, most = outcome.contacts, self._held(outcome.mode)
        begins = contacts.kind == st.HOLD
        np.maximum.at(most, contacts.trajectory[begins], self._held(contacts.mode_after)[begins])
        lost: np.ndarray = np.minimum(most, len(self._system.states))
        return lost

    def _held(self, mode: np.ndarray) -> np.ndarray:
        """Constraints of the contacts that are held in modes int64[n], int64[n]."""
        held = np.zeros(len(mode), np.int64)
        for guard, bit in zip(self._system.guards, self._bits(mode), strict=True):
            if guard.law is not None and guard.law.kind == "hold":
                owner = self._system.guards[guard.law.partner].law
                held += np.where(bit, 2 if owner is not None and owner.kind == "impact" else 1, 0)
        return held

    def _constant(self, map_: Stroboscope) -> np.ndarray:
        """A trace of parameters only."""
        integral: np.ndarray = (
            np.broadcast_to(evaluate([self._trace], values=map_.values)[0], len(map_)) * map_.period
        )
        return integral

    def _dwelling(self, map_: Stroboscope, outcome: Outcome) -> np.ndarray:
        """A trace that is constant in each mode: its values times the times in the modes."""
        row, times = outcome.contacts.trajectory, outcome.contacts.time
        first = np.diff(row, prepend=-1) != 0
        begun = np.where(first, 0.0, np.roll(times, 1))
        total = np.zeros(len(map_))
        np.add.at(
            total, row, (times - begun) * self._in_mode(map_, row, outcome.contacts.mode_before)
        )
        last = np.zeros(len(map_))
        last[row] = times  # sorted by time: the last one is kept
        integral: np.ndarray = total + (map_.period - last) * self._in_mode(
            map_, np.arange(len(map_)), outcome.mode
        )
        return integral

    def _in_mode(self, map_: Stroboscope, row: np.ndarray, mode: np.ndarray) -> np.ndarray:
        values = {name: column[row] for name, column in map_.values.items()}
        return np.broadcast_to(
            evaluate([self._trace], values=values, bits=self._bits(mode))[0], len(row)
        )

    def _bits(self, mode: np.ndarray) -> list[np.ndarray]:
        return [(mode >> i) & 1 == 1 for i in range(len(self._system.guards))]

    def _jumps(self, map_: Stroboscope, outcome: Outcome) -> np.ndarray:
        """Logarithm of the determinant of the saltation matrix at each contact; -inf where a
        contact begins to be held.
        """
        system, contacts = self._system, outcome.contacts
        carried, behind = _carried(contacts)
        arguments = self._here(map_, contacts)
        before, after = self._bits(contacts.mode_before), self._bits(contacts.mode_after)
        fields = [evaluate(system.field, bits=bits, **arguments) for bits in (before, after)]
        logarithm = np.where(contacts.kind == st.HOLD, -np.inf, 0.0)
        for g, guard in enumerate(system.guards):
            *normal, drift = evaluate(
                [*gradient(guard.gap, system.states), time_derivative(guard.gap)],
                bits=before,
                **arguments,
            )
            rates = [
                sum((n * f for n, f in zip(normal, field, strict=True)), start=drift)
                for field in fields
            ]
            mine = (contacts.guard == g) & (contacts.kind == st.CROSSING) & ~carried
            with np.errstate(all="ignore"):
                logarithm = np.where(mine, np.log(np.abs(rates[1] / rates[0])), logarithm)
            if guard.law is not None and guard.law.reset:
                rows = np.flatnonzero((contacts.guard == g) & (contacts.kind == st.IMPACT))
                logarithm[rows] = self._reset(map_, contacts.rows(rows), g, behind[rows])
        return logarithm

    def _reset(
        self, map_: Stroboscope, contacts: ContactTable, g: int, behind: np.ndarray
    ) -> np.ndarray:
        """Logarithm of the determinant of S = J + (f_after - J f_before - J_t) n'/(n'f_before +
        g_t) at impacts or jumps of one guard, J the derivative of the state after by that before.
        """
        system, guard = self._system, self._system.guards[g]
        assert guard.law is not None
        size, k = len(system.states), len(contacts)
        was = self._here(map_, contacts, before=True) | {"bits": self._bits(contacts.mode_before)}
        now = self._here(map_, contacts) | {"bits": self._bits(behind)}

        def columns(expressions: Sequence[Expr], **where: Any) -> np.ndarray:
            return np.stack(
                [np.broadcast_to(one, k) for one in evaluate(expressions, **where)], axis=-1
            )

        reset = guard.law.reset
        slopes = [entry for one in reset for entry in gradient(one, system.states)]
        jacobian = columns(slopes, **was).reshape(k, size, size)
        drift = columns([time_derivative(one) for one in reset], **was)
        normal = columns([*gradient(guard.gap, system.states), time_derivative(guard.gap)], **was)
        first, last = columns(system.field, **was), columns(system.field, **now)
        leap = last - np.einsum("kij,kj->ki", jacobian, first) - drift
        closing = np.einsum("kj,kj->k", normal[:, :size], first) + normal[:, size]
        with np.errstate(all="ignore"):
            along = normal[:, None, :size] / closing[:, None, None]
            return np.asarray(np.linalg.slogdet(jacobian + leap[:, :, None] * along)[1])

    def _here(
        self, map_: Stroboscope, contacts: ContactTable, before: bool = False
    ) -> dict[str, Any]:
        """Arguments of :func:`evaluate` at contacts, with the states after or before them."""
        columns = before_jumps(self._system, contacts) if before else contacts.state
        return {
            "t": contacts.time,
            "states": dict(zip(self._system.states, columns.T, strict=False)),
            "values": {name: column[contacts.trajectory] for name, column in map_.values.items()},
        }


def _carried(contacts: ContactTable) -> tuple[np.ndarray, np.ndarray]:
    """True for contacts that are boundaries over which an impact has carried the state, bool[n],
    and the mode after each contact with its carried ones, int64[n].
    """
    same = (np.diff(contacts.trajectory, prepend=-1) == 0) & (
        np.diff(contacts.time, prepend=np.nan) == 0
    )
    carried = same & (contacts.kind == st.CROSSING) & (contacts.velocity == 0.0)
    begins = np.flatnonzero(~carried)
    last = np.append(begins[1:], len(contacts))[: len(begins)] - 1
    return carried, np.repeat(contacts.mode_after[last], np.diff(np.append(begins, len(contacts))))


def _sum(terms: list[Expr]) -> Expr:
    total = terms[0]
    for term in terms[1:]:
        total = add(total, term)
    return total
