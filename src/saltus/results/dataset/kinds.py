"""Kinds of motion, and reasons why a start leads to none: one code and one word for each, used
everywhere.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum

import numpy as np


class Kind(IntEnum):
    """Kind of motion; codes below zero are reasons why a start leads to none."""

    PERIODIC = 0
    QUASI_PERIODIC = 1
    CHAOTIC = 2
    EQUILIBRIUM = 3
    LIMIT_CYCLE = 4
    #: An orbit that errors of the method keep from closing.
    NOISY_PERIODIC = 5
    #: Motion that hasn't repeated, and whose exponent is undecided after the time spent on it.
    NOT_REPEATING = 6
    #: Orbit of more than LONGEST periods: it was seen to repeat, but isn't closed.
    LONG_PERIODIC = 7
    ESCAPED = -1
    UNCONVERGED = -2
    FAILED = -3
    NOT_COMPUTED = -4

    @property
    def word(self) -> str:
        """Word for the kind in Datasets."""
        return self.name.lower()


#: Longest period at which a motion is known to repeat [forcing periods]; no argument raises it.
LONGEST = 64
#: The same of a forced motion among responses.
LATEST = 512
#: Sentences on motions without a type, in every result, and on such responses.
LONGER = (
    f"An orbit is recognised up to {LONGEST} periods, which no argument raises: a longer one has "
    "no type. sl.stroboscope and sl.poincare show its points."
)
LONGER_RESPONSE = LONGER.replace("An", "A forced", 1).replace(str(LONGEST), str(LATEST), 1)
#: Kinds that Newton's method closes.
CLOSED = (Kind.PERIODIC, Kind.EQUILIBRIUM, Kind.LIMIT_CYCLE)
#: Fate of starts that lead to no attractor, as the end of a sentence.
WITHOUT: Mapping[Kind, str] = {
    Kind.ESCAPED: "escaped: their motion grew beyond all numbers",
    Kind.UNCONVERGED: "lead to no known attractor within the periods allowed",
    Kind.FAILED: "failed: they begin beyond a stop, or a law or a budget ended them (sl.simulate)",
    Kind.NOT_COMPUTED: "weren't computed: the run was stopped",
}
#: Check left out for motions without a type, and the argument that adds it: end of a sentence.
OPEN = (
    "haven't repeated, and their exponents don't say yet whether they are quasi-periodic or "
    "chaotic: numbers are those of 64 periods. A larger periods= spends more on it; sl.lyapunov "
    "tells all exponents of one."
)
#: Knowledge of orbits that are too long to be closed: end of a sentence.
LATE = (
    f"repeat, but only after more than {LONGEST} periods: they are known by their points, with an "
    "exponent, but no multipliers, and aren't followed."
)
#: The words for them by their codes.
WITHOUT_WORDS = {int(kind): kind.word for kind in WITHOUT}


def sentences(labels: np.ndarray) -> list[str]:
    """A sentence for each reason why starts lead to no attractor, with the number of these starts.
    ``labels``, int[...], are attractors or codes.
    """
    counts = {kind: int(np.count_nonzero(labels == kind)) for kind in WITHOUT}
    return [f"{count} starts {WITHOUT[kind]}." for kind, count in counts.items() if count]
