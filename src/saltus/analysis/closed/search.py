"""One search for closed motions, stable and unstable: Newton's method from many guesses, and again
with the motions that are known deflated.

1. Newton's method is started from every guess.
2. What it found is sorted out: a motion that is known counts for it, another one is added.
3. The known motions are taken out of the equations, and Newton's method is started from some of the
   guesses and from beside the known motions, where a fold leaves the second of a pair. Again, until
   nothing more is found.

How many motions were missed is estimated from those that a single start led to: Good, Biometrika 40
(1953) 237-264.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Generic, Self, TypeVar

import numpy as np

from saltus.analysis.closed.motions import ClosedMotion
from saltus.analysis.closed.shooting import Shooting, close
from saltus.analysis.solve.deflation import Known
from saltus.flow.maps import Travel
from saltus.flow.progress import stage
from saltus.kernels import status as st

#: Iterates before Newton's method begins, in rotation: 0 finds motions that repel, more iterates
#: reach the chaotic set.
AGES = (0, 4, 8, 12)
#: Guesses that a search with known motions deflated begins with.
DEFLATED_STARTS = 64
#: Steps of such a search: most guesses lead nowhere.
DEFLATED_STEPS = 40
#: Guesses that Newton's method takes together, times the square of the number of states; and the
#: fewest.
TOGETHER, FEWEST = 16_384, 8
#: Distances from known motions at which it begins too, in units of their range.
BESIDE = np.repeat([0.01, 0.1, 0.3], 6)


@dataclass
class Search:
    """Outcome of a search.

    Attributes
    ----------
    period : int
        n of the orbits of period n that were looked for; 0 of limit cycles.
    starts, converged : int
        Starts, and those of them that led to a closed motion.
    found_once : int
        Motions that one start alone led to.
    deflated : int
        Motions that no start led to before the others were deflated.
    exhausted : bool
        Whether the last search with all known motions deflated found nothing.
    given_up : int
        Starts that were dropped: their motion took more steps or contacts than the method allows.
    """

    period: int
    starts: int
    converged: int = 0
    found_once: int = 0
    deflated: int = 0
    exhausted: bool = False
    given_up: int = 0

    @property
    def unseen(self) -> float:
        """Estimated share of the starts whose motion isn't known; NaN if none led to one."""
        return self.found_once / self.converged if self.converged else np.nan


M = TypeVar("M", bound=ClosedMotion)


class Family(ABC, Generic[M]):
    """Closed motions of one kind that were found, each once.

    Attributes
    ----------
    motions : list of ClosedMotion
        They.
    found : list of int
        Starts that led to each.
    searches : list of Search
        What was done.
    """

    #: Searches with the known motions deflated at most.
    rounds: int

    def __init__(self) -> None:
        self.motions: list[M] = []
        self.found: list[int] = []
        self.searches: list[Search] = []

    @abstractmethod
    def motion(self, closed: Shooting) -> M | None:
        """The motion that Newton's method found; None if it doesn't close."""

    @abstractmethod
    def same(self, motion: M, closed: Shooting) -> np.ndarray:
        """True where a row that Newton's method closed is this motion, bool[k]."""

    @abstractmethod
    def known(self, n: int) -> Known:
        """Zeros that deflation takes out of the equations of n points."""

    @abstractmethod
    def beside(self, n: int, random: np.random.Generator) -> list[Shooting]:
        """Guesses of n points beside the known motions."""

    @abstractmethod
    def place(self, motion: M) -> tuple[float, ...]:
        """By what motions are ordered: it doesn't depend on discovery."""

    def take(self, closed: Shooting) -> np.ndarray:
        """Add what Newton's method found and isn't known yet; the number of each, int64[k], -1 of
        one that doesn't close.
        """
        number = np.full(len(closed), -1)

        def note(motion: M, i: int) -> None:
            rows = np.flatnonzero(number == -1)
            number[rows[self.same(motion, closed.rows(rows))]] = i

        for i, motion in enumerate(self.motions):
            note(motion, i)
        for row in range(len(closed)):
            if number[row] != -1:
                continue
            one = self.motion(closed.rows(np.array([row])))
            number[row] = -2
            if one is not None:
                number[row] = len(self.motions)
                note(one, len(self.motions))
                self.motions.append(one)
                self.found.append(0)
        return np.asarray(np.maximum(number, -1))

    def hunt(self, search: Search, guesses: Iterable[tuple[Shooting, np.ndarray]]) -> Shooting:
        """Search from guesses, of which each part says what starts they come from, int64[k]; all
        guesses.
        """
        self.searches.append(search)
        tried, led = list[Shooting](), list[np.ndarray]()
        for guess, start in guesses:
            index, closed = close(guess)
            number = self.take(closed)
            tried.append(guess)
            led.append(np.stack([start[index], number])[:, number >= 0])
        pairs = np.unique(np.concatenate(led, axis=1), axis=1)
        count = np.bincount(pairs[1], minlength=len(self.motions))
        self.found = (np.array(self.found, np.int64) + count).tolist()
        search.converged = len(np.unique(pairs[0]))
        search.found_once = int(np.count_nonzero(count == 1))
        return Shooting.joined(tried)

    def deflate(
        self,
        search: Search,
        guesses: Shooting,
        progress: Callable[[float], None] | None = None,
    ) -> None:
        """Search on with the known motions deflated, from some guesses and from beside the known
        motions, until nothing more is found.
        """
        n, random = guesses.points.shape[1], np.random.default_rng(0)
        every = max(1, len(guesses) // DEFLATED_STARTS)
        some = guesses.rows(np.arange(0, len(guesses), every))
        for turn in range(self.rounds):
            before, known = len(self.motions), self.known(n)
            starts = Shooting.joined([some, *self.beside(n, random)])
            show = stage(progress, turn / self.rounds, (turn + 1) / self.rounds)
            for part in parts_of(starts, show):
                self.take(close(starts.rows(part), known, DEFLATED_STEPS)[1])
            search.deflated += len(self.motions) - before
            if len(self.motions) == before:
                search.exhausted = True
                return

    def ordered(self, wanted: Callable[[M], bool] = lambda _: True) -> Self:
        """The family with the wanted motions only, in an order that doesn't depend on discovery."""
        pairs = zip(self.motions, self.found, strict=False)  # Ctrl-C may come between the two
        order = sorted((pair for pair in pairs if wanted(pair[0])), key=lambda p: self.place(p[0]))
        self.motions, self.found = [one for one, _ in order], [count for _, count in order]
        return self


def parts_of(
    guesses: Shooting, progress: Callable[[float], None] | None = None
) -> Iterator[np.ndarray]:
    """Rows of guesses that Newton's method takes together, int64[..]: few of many states, so that
    the bar moves and Ctrl-C hands out what was found before. Tells the share that was asked for.
    """
    size = max(FEWEST, TOGETHER // guesses.points.shape[2] ** 2)
    total = len(guesses)
    for first in range(0, max(total, 1), size):  # of none one part, which is empty
        if progress:
            progress(first / max(total, 1))
        yield np.arange(first, min(first + size, total))


def used_up(flight: Travel) -> np.ndarray:
    """Trajectories that needed more steps or contacts than they were allowed, bool[k]."""
    return np.isin(flight.status, (st.BUDGET_STEPS, st.BUDGET_EVENTS))
