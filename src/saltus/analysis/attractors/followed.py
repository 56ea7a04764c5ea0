"""Attractors at new parameter values from those at old ones nearby: what is most often asked under
a slider takes milliseconds, not a search.
"""

from __future__ import annotations

import numpy as np

from saltus.analysis.attractors.aperiodic import SampledMotion
from saltus.analysis.attractors.attractor_set import AttractorSet
from saltus.analysis.attractors.limit_cycles import cycle_of, limit_cycles
from saltus.analysis.closed.capture import Neighbourhoods
from saltus.analysis.closed.field_zeros import autonomous
from saltus.analysis.closed.motions import ClosedMotion, same
from saltus.analysis.closed.orbits import find_orbits
from saltus.analysis.solve.tolerances import ROUND, SAME
from saltus.flow.maps import Stroboscope
from saltus.results.dataset.kinds import Kind


def followed(
    map_: Stroboscope, old: AttractorSet, scale: np.ndarray
) -> tuple[AttractorSet, np.ndarray]:
    """The periodic orbits and limit cycles among some attractors, closed again at other values.

    Newton's method begins at each orbit; a limit cycle is looked for where a motion from the old
    one has come to. What attracts no more, or isn't there, is left out, and so is what never
    repeats: a search from starts finds these, and the attractors that are new
    (:meth:`saltus.analysis.basins.pipeline.BasinPlan.scout`, with ``known``).

    Parameters
    ----------
    map_ : Stroboscope
        At the new values.
    old : AttractorSet
        At the old ones.
    scale : float64[D]
        Range of each state.

    Returns
    -------
    found : AttractorSet
        In the order of their ids; none for a method whose errors are more than rounding.
    came_from : int64[k]
        The id that each had among the old ones.
    """
    found = AttractorSet(Neighbourhoods.none(len(scale)))
    if not map_.exact:
        return found, np.zeros(0, np.int64)
    owners: dict[int, int] = {}
    start = np.array([one.points[0] for one in old.orbits]).reshape(-1, len(scale))
    period = np.array([one.period for one in old.orbits], np.int64)
    ranges = np.broadcast_to(scale, start.shape)
    orbits = find_orbits(map_, start, period, ranges, np.full(len(start), map_.noise))
    for i in np.flatnonzero(orbits.stable).tolist():
        orbit = orbits[i]
        if not any(same(orbit, one, scale, SAME) for one in found.orbits):
            owners[id(orbit)] = i
            found.add(map_, orbit, scale, old.near.of(np.array([i])))
    if autonomous(map_.system):
        for i, one in enumerate(old.sampled, len(old.orbits)):
            if one.kind == Kind.LIMIT_CYCLE.word:
                state = map_.launch(one.points[:1], ROUND).advance(ROUND)[:, -1]
                for cycle in limit_cycles(map_, state, ROUND * float(map_.period[0]), scale):
                    found.add_sampled(cycle)
                    owners |= {id(kept): i for kept in found.sampled if id(kept) not in owners}
    found = found.ordered(scale)
    return found, np.array([owners[id(one)] for one in found.every], np.int64)


def cycle_on(map_: Stroboscope, one: SampledMotion) -> ClosedMotion:
    """A limit cycle that is known by its points, closed by Newton's method."""
    return cycle_of(map_, one)[0]
