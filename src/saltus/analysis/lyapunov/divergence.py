"""How fast a flow makes volumes grow: the divergence of its field, integrated along the motion, and
what contacts add.

By Liouville's rule the logarithm of the determinant of the tangent is the integral of the trace of
the Jacobian. At a contact where the force jumps the determinant is multiplied by that of the
saltation matrix, (n'f_after + g_t) / (n'f_before + g_t): the rate of the gap after the contact over
the rate before. Nothing here uses the tangent flow, so that the sum of Lyapunov exponents can be
held against it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from saltus.flow.engine import Outcome
from saltus.flow.maps import Stroboscope
from saltus.kernels import status as st
from saltus.system.derivatives import gradient, time_derivative
from saltus.system.evaluate import evaluate
from saltus.system.expression import Expr, add, depends_on, walk
from saltus.system.system import System

#: Name of the state that holds the integral, where one is needed; no user can write it.
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
        units = {**system.units, _INTEGRAL: ""}
        self._extended = replace(
            system,
            states=(*system.states, _INTEGRAL),
            field=(*system.field, self._trace),
            units=units,
        )

    def of_blocks(self, map_: Stroboscope, start: np.ndarray) -> np.ndarray:
        """Logarithm of the growth of volumes over one block from float64[k, D], each with its row
        of the map, float64[k].
        """
        constant = not self._moves and not self._by_mode
        if constant and not self._system.guards:
            return self._constant(map_)
        integrated = self._moves or (self._by_mode and not map_.method.records_contacts)
        if integrated:
            start = np.concatenate([start, np.zeros((len(start), 1))], axis=1)
        outcome = map_.of_system(self._extended if integrated else self._system).run(
            start, 1, record=0
        )
        total = (
            outcome.state[:, -1].copy()
            if integrated
            else self._constant(map_)
            if constant
            else self._dwelling(map_, outcome)
        )
        np.add.at(total, outcome.contacts.trajectory, self._jumps(map_, outcome))
        return np.where(np.isin(outcome.status, (st.OK, st.GRAZE_UNRESOLVED)), total, np.nan)

    def _constant(self, map_: Stroboscope) -> np.ndarray:
        """A trace of parameters only."""
        return (
            np.broadcast_to(evaluate([self._trace], values=map_.values)[0], len(map_)) * map_.period
        )

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
        last[row] = times  # sorted by time: the last one stays
        return total + (map_.period - last) * self._in_mode(
            map_, np.arange(len(map_)), outcome.mode
        )

    def _in_mode(self, map_: Stroboscope, row: np.ndarray, mode: np.ndarray) -> np.ndarray:
        values = {name: column[row] for name, column in map_.values.items()}
        return np.broadcast_to(
            evaluate([self._trace], values=values, bits=self._bits(mode))[0], len(row)
        )

    def _bits(self, mode: np.ndarray) -> list[np.ndarray]:
        return [(mode >> i) & 1 == 1 for i in range(len(self._system.guards))]

    def _jumps(self, map_: Stroboscope, outcome: Outcome) -> np.ndarray:
        """Logarithm of the determinant of the saltation matrix at each contact."""
        system, contacts = self._system, outcome.contacts
        here: dict[str, Any] = {
            "t": contacts.time,
            # an integral may follow them
            "states": dict(zip(system.states, contacts.state.T, strict=False)),
            "values": {name: column[contacts.trajectory] for name, column in map_.values.items()},
        }
        before, after = self._bits(contacts.mode_before), self._bits(contacts.mode_after)
        fields = [evaluate(system.field, bits=bits, **here) for bits in (before, after)]
        logarithm = np.zeros(len(contacts))
        for g, guard in enumerate(system.guards):
            *normal, drift = evaluate(
                [*gradient(guard.gap, system.states), time_derivative(guard.gap)],
                bits=before,
                **here,
            )
            rates = [
                sum((n * f for n, f in zip(normal, field, strict=True)), start=drift)
                for field in fields
            ]
            mine = (contacts.guard == g) & (contacts.kind == st.CROSSING)
            with np.errstate(all="ignore"):
                logarithm = np.where(mine, np.log(np.abs(rates[1] / rates[0])), logarithm)
        return logarithm


def _sum(terms: list[Expr]) -> Expr:
    total = terms[0]
    for term in terms[1:]:
        total = add(total, term)
    return total
