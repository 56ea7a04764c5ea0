"""Ladders of grazes: a branch that gains one contact after the other at values of the parameter
that approach a limit, at which the orbit chatters.

The times between the contacts of a chatter are nearly a geometric sequence, so its grazes are one
too. The limit is extrapolated: A. C. Aitken, Proc. R. Soc. Edinburgh 46 (1926) 289-305.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

#: Rungs by which a ladder is known: three ratios of steps, and so three estimates of the limit.
RUNGS = 5
#: Shift of the limit by the last two steps, in parts of the way that is left to it.
STEADY = 0.05


def accumulation(contacts: Sequence[int], values: Sequence[float]) -> float:
    """The value at which the rungs of a ladder accumulate; NaN if they are none.

    Parameters
    ----------
    contacts : sequence of int
        Contacts of a branch before each of its grazes.
    values : sequence of float
        The parameter there.
    """
    if len(values) < RUNGS:
        return np.nan
    place, gained = np.array(values[-RUNGS:]), np.diff(contacts[-RUNGS:])
    step = np.diff(place)
    if gained[0] <= 0 or (gained != gained[0]).any() or not step.all():
        return np.nan
    ratio = step[1:] / step[:-1]
    if not ((ratio > 0) & (ratio < 1)).all():
        return np.nan
    limits = place[2:] + step[1:] * ratio / (1.0 - ratio)
    steady = np.abs(np.diff(limits)) < STEADY * np.abs(limits[1:] - place[3:])
    return float(limits[-1]) if steady.all() else np.nan
