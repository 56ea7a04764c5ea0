"""Match motions that never repeat at neighbouring values of a parameter: they are one if they lie
in the same place. No branch of them can be followed.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment

from saltus.analysis.attractors.grid_responses import GridResponses

#: Most consecutive values at which a motion that never repeats may be missing.
MISSED = 3
#: Largest displacement of such a motion from one value to the next, in units of its own range.
MOVED = 0.35
#: A distance beyond that of any two responses.
_NEVER = 1e6


def matched(found: GridResponses, on: np.ndarray, places: int, known: int) -> np.ndarray:
    """Branch of every response of a grid with one axis, int64[m].

    Parameters
    ----------
    found : GridResponses
        The responses.
    on : int64[m]
        The branches of those that lie on one that was followed, -1 of the others.
    places, known : int
        Values of the parameter; branches that were followed, from which number on the others are
        counted in the order in which they begin.
    """
    branch, heads = on.copy(), list[int]()  # the last response of each branch so far
    for value in range(places):
        others = np.flatnonzero((found.place == value) & (on < 0))
        near = [i for i, last in enumerate(heads) if value - found.place[last] <= MISSED]
        for i, response in _matches(found, [heads[i] for i in near], others):
            branch[response] = known + near[i]
        for response in others.tolist():
            if branch[response] < 0:
                branch[response] = known + len(heads)
                heads.append(response)
            heads[int(branch[response]) - known] = response
    return branch


def _matches(
    found: GridResponses, before: list[int], responses: np.ndarray
) -> list[tuple[int, int]]:
    """Pairs (index into before, response) of motions that are one, each used once, the nearest
    first.
    """
    cost = np.array([[_distance(found, a, int(b)) for b in responses] for a in before]).reshape(
        len(before), len(responses)
    )
    rows, columns = linear_sum_assignment(np.minimum(cost, _NEVER))
    pairs = zip(rows, columns, strict=True)
    return [(int(i), int(responses[j])) for i, j in pairs if cost[i, j] < MOVED]


def _distance(found: GridResponses, a: int, b: int) -> float:
    """Distance of two motions at different values, in units of their range; inf if they differ in
    kind.
    """
    if found.kind[a] != found.kind[b] or found.period[a] != found.period[b]:
        return np.inf
    scale = np.maximum(found.motions.scale[found.row[a]], found.motions.scale[found.row[b]])
    p, q = found.points(a), found.points(b)
    return float(
        max(
            np.abs((p.mean(axis=0) - q.mean(axis=0)) / scale).max(),
            np.abs((p.std(axis=0) - q.std(axis=0)) / scale).max(),
        )
    )
