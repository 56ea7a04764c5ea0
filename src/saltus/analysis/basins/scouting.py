"""A first search for attractors, from few starts that stand for all of a map or a box, within a
budget.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from saltus.analysis.attractors.aperiodic import SURVEY_ITERATES
from saltus.analysis.attractors.attractor_set import AttractorSet
from saltus.analysis.attractors.find_attractors import find_attractors
from saltus.analysis.closed.capture import Neighbourhoods
from saltus.flow.maps import Map
from saltus.flow.progress import stage

#: Most starts; a basin of half a per cent is hit with 99.4 %.
SCOUTS = 1024
#: Fewest: their mean cost says how many more follow.
FEWEST = 16
#: Iterates of a first look at systems of more than four states.
GLANCE = 256
#: Work of all of them: iterates times the cube of the number of states. What an iterate costs grows
#: with the modes and with the contacts that they make; the neighbourhood of an orbit, with its
#: derivatives. No map of four states comes so far.
WORK = 2**29


def affordable(iterates: float, states: int, most: int = SCOUTS) -> int:
    """Number of starts, each followed for so many iterates, that the budget is enough for."""
    return int(np.clip(WORK / (max(iterates, 1.0) * states**3), FEWEST, most))


def glanced(
    map_: Map, start: np.ndarray, scale: np.ndarray, most: int, known: AttractorSet | None = None
) -> AttractorSet:
    """Known attractors, and those that some of the starts float64[k, D] are seen to lead to early:
    of systems of more than four states only what repeats, and what shows within
    :data:`GLANCE` iterates of :data:`FEWEST` starts.
    """
    if not dear(most, start.shape[1]):
        *_, found = scouted(map_, start, scale, most, known=known)
        return found
    first = start[:FEWEST]
    return find_attractors(map_, first, scale, min(GLANCE, most), known, surveyed=False)[0]


def dear(most: int, states: int) -> bool:
    """True where the budget isn't enough for a whole sample of starts, each followed so long: from
    five states on, or for many iterates.
    """
    return affordable(most + SURVEY_ITERATES, states) < SCOUTS


def scouted(
    map_: Map,
    start: np.ndarray,
    scale: np.ndarray,
    most: int,
    progress: Callable[[float], None] | None = None,
    known: AttractorSet | None = None,
) -> Iterator[AttractorSet]:
    """The attractors that some of the starts float64[k, D] lead to, more and more of them: those of
    the first ones, then of as many as their cost allows. Followed for ``most`` iterates each, the
    later ones until they keep to an attractor that the first have shown. ``known`` ones are among
    them.
    """
    count, states = start.shape
    whole = affordable(most + SURVEY_ITERATES, states, count) >= count
    first = count if whole else min(FEWEST, count)
    found = known or AttractorSet(Neighbourhoods.none(states))
    yield found
    half = stage(progress, 0.0, 1.0 if whole else 0.5)
    found, _, settled = find_attractors(map_, start[:first], scale, most, found, half)
    yield found
    cost = np.where(settled < 0, most + SURVEY_ITERATES, settled).mean()
    more = affordable(float(cost), states, count)
    if more > first:
        rest = start[first:more]
        half = stage(progress, 0.5, 1.0)
        yield find_attractors(map_, rest, scale, most, found, half, kept=True)[0]
