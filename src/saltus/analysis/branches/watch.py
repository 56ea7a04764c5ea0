"""The watch on branches while they are followed: a budget of work, progress, and the points so far,
which Ctrl-C leaves.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from saltus.analysis.branches.branch import Branch

#: Points of a branch, before any is known.
USUAL = 100.0


@dataclass
class Watch:
    """The watch on the branches of a plan.

    Attributes
    ----------
    most : float
        Most work, in points times periods of their orbits times squares of their states: beyond it
        branches end with ``points``, and no other is begun.
    spent : float
        Work so far.
    left : int
        Orbits whose branches weren't begun.
    cut : dict of int to Branch
        Branches that aren't finished, as far as they are known, by the ids of those that are.
    """

    most: float = math.inf
    spent: float = 0.0
    left: int = 0
    cut: dict[int, Branch] = field(default_factory=dict)
    _progress: Callable[[float], None] | None = None
    _usual: float = USUAL
    _points: int = 0

    @property
    def over(self) -> bool:
        """True if no work is left."""
        return self.spent >= self.most

    def begin(self, progress: Callable[[float], None] | None) -> None:
        """Begin to follow branches; their progress as a part of the whole."""
        if self._points:
            self._usual = 0.5 * (self._usual + self._points)
        self._progress, self._points = progress, 0
        self.cut.clear()

    def point(self, work: float) -> bool:
        """Count a point that was reached; True if no work is left. How many a branch will have
        isn't known: its share goes towards 1 as if it had as many as those before.
        """
        self.spent += work
        self._points += 1
        if self._progress is not None:
            self._progress(1.0 - math.exp(-self._points / self._usual))
        return self.over
