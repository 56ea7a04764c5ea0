"""From trajectories of a map to its attractors: let them settle, close what recurs, and find out
what never does.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from saltus.analysis.attractors.arrivals import Arrivals
from saltus.analysis.attractors.attractor_set import AttractorSet
from saltus.analysis.attractors.growth import BUDGET
from saltus.analysis.attractors.unsettled import longest_survey, survey_unsettled
from saltus.analysis.closed.capture import Neighbourhoods
from saltus.analysis.closed.motions import ClosedMotion
from saltus.analysis.solve.tolerances import ROUND
from saltus.flow.maps import Map
from saltus.interrupt import PartInterrupted
from saltus.results.dataset.kinds import Kind


def find_attractors(
    map_: Map,
    start: np.ndarray,
    scale: np.ndarray,
    most: int,
    known: AttractorSet | None = None,
    progress: Callable[[float], None] | None = None,
    kept: bool = False,
    surveyed: bool = True,
) -> tuple[AttractorSet, np.ndarray, np.ndarray]:
    """The attractors that trajectories from given starts settle to.

    Each is followed for ``most`` iterates, and for
    :data:`~saltus.analysis.attractors.aperiodic.SURVEY_ITERATES` more if it hasn't settled; some of
    these again, for as long as :func:`~saltus.analysis.attractors.unsettled.watched` says. Newton's
    method may cost :data:`~saltus.analysis.attractors.growth.BUDGET` times what they were followed
    for.

    Parameters
    ----------
    map_ : Map
        The map.
    start : float64[k, D]
        Starts.
    scale : float64[D]
        Range of each state.
    most : int
        Iterates after which a trajectory that hasn't settled is surveyed for chaos.
    known : AttractorSet, optional
        Attractors that are known already.
    progress : callable, optional
        Called with the share done.
    kept : bool
        Whether a trajectory that keeps to a known attractor that never repeats has arrived, as in a
        map's cells. Else it is followed as one that hasn't settled.
    surveyed : bool
        Whether trajectories that haven't settled are surveyed; else nothing is said of them.

    Returns
    -------
    found : AttractorSet
        Known and new attractors, in the order of their ids.
    label : int64[k]
        The attractor of each start; -1 where none was established.
    settled : int64[k]
        Iterates after which it was captured; -1 if it wasn't.

    Raises
    ------
    PartInterrupted
        On Ctrl-C. Its ``partial`` is what was found; the label of starts that haven't settled by
        then is ``Kind.NOT_COMPUTED``.
    """
    found = known or AttractorSet(Neighbourhoods.none(start.shape[1]))
    found = AttractorSet(found.near, list(found.orbits), list(found.sampled), list(found.unstable))
    arrivals = Arrivals(
        map_, scale, lambda state: _exactly(map_, state, scale, most), found,
        [None] * len(start), np.full(len(start), -1, np.int64),
    )  # fmt: skip

    def known_now(unsettled: int) -> tuple[AttractorSet, np.ndarray, np.ndarray]:
        result = found.ordered(scale)
        label = [unsettled if one is None else result.index(one) for one in arrivals.owner]
        return result, np.array(label, np.int64), arrivals.settled

    try:
        _settle(arrivals, start, most, progress, kept, surveyed)
    except KeyboardInterrupt:
        raise PartInterrupted(lambda: known_now(Kind.NOT_COMPUTED)) from None
    return known_now(-1)


def _settle(
    arrivals: Arrivals, start: np.ndarray, most: int, progress: Callable[[float], None] | None,
    kept: bool, surveyed: bool,
) -> None:  # fmt: skip
    """Follow trajectories until each has settled, or was surveyed; note their owners."""
    travel, going = arrivals.map_.launch(start, most), np.arange(len(start))
    total, purse = most + longest_survey(start.shape[1]), np.zeros(1)

    def tell(age: int) -> None:
        if progress:
            progress(max(1.0 - len(going) / len(start), min(age / total, 1.0)))

    turns, noisy = arrivals.turns, Kind.NOISY_PERIODIC.word
    never = (Kind.CHAOTIC.word, Kind.QUASI_PERIODIC.word)
    while len(going) and travel.age < most:
        points = travel.advance(ROUND)
        purse += BUDGET * ROUND * len(going)
        begun, age = travel.age - ROUND, travel.age
        here = np.flatnonzero(~arrivals.captured(points, going, begun))
        for kind in (noisy, *(never if kept else ())):
            here = here[~arrivals.keeping(kind, points[here], going[here], age)]
        while len(here) and arrivals.add_orbits(points[here], purse):
            here = here[~arrivals.keeping(noisy, points[here], going[here], age)]
            here = here[~arrivals.captured(points[here], going[here], begun)]
        if turns and len(here):
            here = here[~arrivals.on_cycles(points[here], going[here], travel, here)]
        if len(here):
            here = here[~arrivals.on_families(points[here], going[here], age)]
        stay = np.zeros(len(going), bool)
        stay[here] = travel.going[here]
        travel.keep(stay)
        going = going[stay]
        tell(travel.age)
    if len(going) and surveyed:
        survey_unsettled(arrivals, travel, going, tell)


def _exactly(
    map_: Map, state: np.ndarray, scale: np.ndarray, most: int
) -> list[ClosedMotion | None]:
    """The orbits to which the exact map settles from float64[k, D]."""
    assert map_.exact_map is not None
    exact, label, _ = find_attractors(map_.exact_map, state, scale, most)
    return [exact.orbits[i] if 0 <= i < len(exact.orbits) else None for i in label]
