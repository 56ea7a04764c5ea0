"""Ends of trajectories at a condition: the kernels stop at every event, and go on unless there the
condition holds.

A kernel stops a trajectory whose budget of events is used up, with everything that it needs to go
on to the same bits. So a budget of one more event than there have been hands it over at each of
them, and nothing behind the condition is computed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from saltus.kernels import status as st
from saltus.language.evaluate import evaluate
from saltus.language.expression import Expr

#: Status of a trajectory that ended at its condition. No kernel knows it.
UNTIL = 20
#: Name and meaning of every status, this one among them.
STATUS = {**st.STATUS, UNTIL: ("until", "the condition at which it was to end became true")}


@dataclass(frozen=True)
class Until:
    """A condition at which trajectories end.

    Attributes
    ----------
    sides : Expr
        1 where it holds, 0 where it doesn't, in terms of sides of guards.
    opposite : bool[n]
        Trajectories for which it is the opposite that ends them.
    at_start : bool[n]
        Trajectories for which it holds at the start.
    """

    sides: Expr
    opposite: np.ndarray
    at_start: np.ndarray

    def of(self, rows: np.ndarray | slice) -> Until:
        """The condition of some trajectories; behind the last one they begin anew, as copies that
        measure errors do.
        """
        n = len(self.opposite)
        places = np.arange(rows.start, rows.stop) if isinstance(rows, slice) else rows
        return replace(self, opposite=self.opposite[places % n], at_start=self.at_start[places % n])

    def begin(self, arrays: dict[str, np.ndarray]) -> None:
        """End the trajectories for which it holds at the start."""
        arrays["status"][self.at_start & (arrays["status"] == st.RUNNING)] = UNTIL

    def go_on(self, arrays: dict[str, np.ndarray], budget: int, most: float) -> bool:
        """End the stopped trajectories for which it holds, and let the others go on; True if there
        are any.

        Parameters
        ----------
        arrays : dict of str to ndarray
            The arrays of a kernel's batch.
        budget : int
            Column of its options that holds the budget of events.
        most : float
            The method's own budget.
        """
        status, events = arrays["status"], arrays["counters"][:, st.EVENTS]
        allowed = arrays["options"][:, budget]
        ended = np.isin(status, (st.OK, st.GRAZE_UNRESOLVED, st.BUDGET_EVENTS))
        stopped = np.flatnonzero(ended & ~self.at_start & (arrays["mode"] >= 0))
        if not len(stopped):
            return False
        met = stopped[self._holds(arrays["mode"][stopped]) ^ self.opposite[stopped]]
        status[met] = UNTIL
        on = np.flatnonzero((status == st.BUDGET_EVENTS) & (events > allowed) & (events < most))
        allowed[on] = events[on] + 0.5
        status[on] = st.RUNNING
        return len(on) > 0

    def _holds(self, mode: np.ndarray) -> np.ndarray:
        sides = {
            guard: (mode >> guard) & 1 == 1
            for guard in range(self.sides.bits.bit_length())
            if self.sides.bits >> guard & 1
        }
        (found,) = evaluate([self.sides], bits=sides)
        return np.broadcast_to(found == 1.0, len(mode))
