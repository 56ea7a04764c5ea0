"""Strong chaos of structures, told before a motion has been followed for as long as one that is on
its way to an orbit.

A motion that settles must be waited for. One whose deviations grow over hundreds of periods needn't
be, once what was free in it has died away: then the exponent along its last periods says the same
as it would later. Whether chaos ends, no watch of a fixed length tells.
"""

from __future__ import annotations

import math

import numpy as np

from saltus.analysis.attractors.aperiodic import FIRST_LOOK, first_look
from saltus.analysis.attractors.growth import BLOCK, MOST_STATES
from saltus.analysis.attractors.recurrence import recurrence
from saltus.analysis.closed.field_zeros import autonomous
from saltus.analysis.solve.tolerances import NEAR, ROUND
from saltus.flow.maps import Stroboscope
from saltus.flow.modal_motions import slowest_decays

#: Share of the iterates that a motion may be followed for after which it is looked at: 512 of 2000.
EARLY = 0.25
#: Iterates that are looked at, and kept.
SEEN = FIRST_LOOK * BLOCK + 1
#: To this share of themselves free motions have decayed before these: numbers of chaos don't know
#: more.
DIED = 1e-3


def looked_at(map_: Stroboscope, most: int, kept: int = SEEN) -> np.ndarray:
    """Iterates, in whole rounds, after which motions that are followed for ``most`` may be told to
    be chaotic, int64[k] for the rows of a map: at most ``most``, which it is of systems of few
    states, and of those that aren't linear between contacts. The last ``kept`` of them come when
    free motions have died.
    """
    late = np.full(len(map_), most)
    if len(map_.states) <= MOST_STATES or autonomous(map_.system):
        return late
    decays = slowest_decays(map_)
    if decays is None:
        return late
    with np.errstate(divide="ignore"):
        died = np.where(decays > 0, -math.log(DIED) / decays, np.inf)
    least = np.maximum(died + kept, EARLY * most)
    rounds = ROUND * np.ceil(np.minimum(least, most) / ROUND)
    ages: np.ndarray = np.minimum(rounds, most).astype(np.int64)
    return ages


def told_early(
    map_: Stroboscope, past: np.ndarray, scale: np.ndarray
) -> list[tuple[str, float, float] | None]:
    """(kind, exponent, its standard error) of motions that are strongly chaotic along their last
    iterates float64[k, SEEN, D], row i by row i of the map, with ranges float64[k, D]; None of
    others.
    """
    found: list[tuple[str, float, float] | None] = [None] * len(past)
    apart = recurrence(past[:, -ROUND:], scale)[1]
    finite = np.isfinite(past).all(axis=(1, 2))
    rows = np.flatnonzero(finite & (apart >= np.maximum(NEAR, map_.noise_of(scale))))
    if len(rows):
        for row, kind in zip(
            rows.tolist(), first_look(map_.rows(rows), past[rows], scale[rows]), strict=True
        ):
            found[row] = kind
    return found
