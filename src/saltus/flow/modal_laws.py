"""The laws of a system's contacts, as the kernel of the modal flow reads them."""

from __future__ import annotations

import numpy as np

from saltus.contact.guards import is_hold
from saltus.kernels.modal import layout
from saltus.kernels.status import HOLD_LAW, LAW_KINDS, NO_LAW
from saltus.system.linear import LinearSystem
from saltus.system.linear_friction import is_idle, limit_side


def laws_of(linear: LinearSystem) -> np.ndarray:
    """The law of each gap as the kernel reads it, see layout.KIND: int64[gaps, LAW_COLUMNS]."""
    guards, sticking = linear.system.guards, linear.sticking
    table = np.full((len(linear.own_gaps), layout.LAW_COLUMNS), -1, np.int64)
    table[:, layout.KIND], table[:, layout.LIMITS] = NO_LAW, 0
    for g, guard in enumerate(guards):
        if guard.state is not None:
            table[g, layout.LEVEL] = linear.system.states.index(guard.state)
        table[g, layout.LIMITS] = limit_side(guard)
        if is_idle(guards, guard):
            table[g, layout.KIND] = HOLD_LAW
        elif guard.law is not None and limit_side(guard) == 0:
            holds = g if is_hold(guard) else guard.law.partner
            kind, partner = LAW_KINDS[guard.law.kind], guard.law.partner
            table[g, [layout.KIND, layout.PARTNER, layout.HOLDER]] = kind, partner, holds
    for one in sticking:
        table[one.second, [layout.KIND, layout.PARTNER]] = HOLD_LAW, one.guard
        table[[one.guard, one.hold, one.second], layout.HOLDER] = one.hold
        table[[one.guard, one.hold, one.second], layout.SECOND] = one.second
    return table
