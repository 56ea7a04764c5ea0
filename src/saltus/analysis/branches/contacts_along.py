"""Contacts of a sequence as functions of the state and the time: the gap, its rate, the state
behind the contact, and their derivatives.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from saltus.analysis.branches.contact_sequences import SequenceContact
from saltus.language import expression as ex
from saltus.language.derivatives import gradient, time_derivative
from saltus.language.evaluate import evaluate
from saltus.language.expression import Expr
from saltus.system import System
from saltus.system.leg import frozen


@dataclass(frozen=True)
class At:
    """The contacts of r orbits; times are in the unit of the parametric system.

    Attributes
    ----------
    gap : float64[r, m]
        Of the guard of each contact.
    normal, gap_by_time : float64[r, m, E], float64[r, m]
        Its derivatives with respect to the states and the time.
    rate : float64[r, m, D]
        Of the states before the contact.
    after : float64[r, m, D]
        The states behind it.
    by_state, by_time : float64[r, m, D, E], float64[r, m, D]
        Their derivatives.
    """

    gap: np.ndarray
    normal: np.ndarray
    gap_by_time: np.ndarray
    rate: np.ndarray
    after: np.ndarray
    by_state: np.ndarray
    by_time: np.ndarray


class Jumps:
    """The contacts of a sequence in a system.

    Parameters
    ----------
    system : System
        E states, of which the first ``size`` move.
    contacts : sequence of Contact
        None: an orbit without contacts, of which the first point is the only place.
    size : int
        D.
    """

    def __init__(
        self, system: System, contacts: Sequence[SequenceContact], size: int, mode: int = 0
    ):
        self._system, self._size = system, size
        places: dict[SequenceContact | None, list[int]] = {}
        for i, contact in enumerate(contacts or (None,)):
            places.setdefault(contact, []).append(i)
        self._places = [
            (_entries(system, contact, mode, size), alike) for contact, alike in places.items()
        ]

    def at(self, time: np.ndarray, states: np.ndarray) -> At:
        """Evaluate the contacts at times float64[r, m] in states float64[r, m, E]."""
        (r, m, width), size = states.shape, self._size
        columns = np.empty((1 + width + 1 + size * (width + 3), r, m))
        for entries, alike in self._places:
            named = dict(zip(self._system.states, states[:, alike].T, strict=True))
            values = evaluate(entries, t=time[:, alike].T, states=named, values=self._system.values)
            mine = np.empty((len(columns), len(alike), r))
            for row, value in zip(mine, values, strict=True):
                row[:] = value
            columns[:, :, alike] = mine.swapaxes(1, 2)
        last = np.moveaxis(columns, 0, -1)
        gap, normal, by_time, rate, after, by_state, after_by_time = np.split(
            last, np.cumsum([1, width, 1, size, size, size * width]), axis=2
        )
        return At(
            gap[..., 0],
            normal,
            by_time[..., 0],
            rate,
            after,
            by_state.reshape(r, m, size, width),
            after_by_time,
        )


@lru_cache(maxsize=128)
def _entries(
    system: System, contact: SequenceContact | None, mode: int, size: int
) -> tuple[Expr, ...]:
    """Expressions for the entries of :class:`At` at a contact; without one, in a mode."""
    gap, after, before = ex.constant(0.0), tuple(map(ex.state, system.states[:size])), mode
    if contact is not None:
        guard, before = system.guards[contact.guard], contact.before
        gap, law = guard.gap, guard.law
        if law is not None and law.reset and contact.direction == -law.side:
            after = law.reset[:size]
    gap, *left = frozen(system, (gap, *after), before)
    return (
        gap,
        *gradient(gap, system.states),
        time_derivative(gap),
        *frozen(system, system.field[:size], before),
        *left,
        *(slope for one in left for slope in gradient(one, system.states)),
        *map(time_derivative, left),
    )
