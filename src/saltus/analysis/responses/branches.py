"""Branches: the same response followed from one value of a parameter to the next, and what happens
to it on the way.

Two responses belong to one branch if each is what the other becomes when it is followed to its
value (continuation.py), and if no response is met on the way: by identity, never by amplitude,
which crossing branches share. No start need lead to it at the values between. Motions that never
repeat can't be followed; neighbours belong together if they lie in the same place.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment

from saltus.analysis.responses.bifurcations import Event, middle, why_they_end
from saltus.analysis.responses.continuation import LINK
from saltus.analysis.responses.followed import Followed
from saltus.analysis.responses.grid import Grid
from saltus.analysis.responses.responses import GridResponses
from saltus.results import AttractorTable
from saltus.results.dataset.kinds import CLOSED

#: Values over which a motion that never repeats may be missing.
MISSED = 3
#: What is farther apart than any two responses.
_NEVER = 1e6


def follow(found: GridResponses, followed: Followed, places: int) -> np.ndarray:
    """Branch of every response of a grid with one axis of values, int64[m]; numbered in the order
    in which they begin.
    """
    before = _before(found, followed)
    branch = np.full(len(found), -1, np.int64)
    heads: list[int] = []  # response that a branch ends with so far
    for place in range(places):
        here = np.flatnonzero(found.place == place)
        for response in here[before[here] >= 0]:
            branch[response] = branch[before[response]]
        strange = here[~np.isin(found.kind[here], CLOSED)]
        alike = [
            i
            for i, last in enumerate(heads)
            if found.kind[last] not in CLOSED and place - found.place[last] <= MISSED
        ]
        for i, response in _matches(found, [heads[i] for i in alike], strange):
            branch[response] = alike[i]
        for response in here:
            if branch[response] < 0:
                branch[response] = len(heads)
                heads.append(int(response))
            heads[branch[response]] = int(response)
    return branch


def _before(found: GridResponses, followed: Followed) -> np.ndarray:
    """The response that each was at a value before, int64[m], -1 where it was none: each of the two
    becomes the other.
    """
    result, rows = np.full(len(found), -1, np.int64), np.flatnonzero(np.isin(found.kind, CLOSED))
    met = followed.met[followed.index(rows, +1)]
    rows, met = rows[met >= 0], met[met >= 0]
    both = followed.met[followed.index(met, -1)] == rows
    result[met[both]] = rows[both]
    return result


def _matches(found: GridResponses, before: list[int], here: np.ndarray) -> list[tuple[int, int]]:
    """Pairs (index into before, response) of motions that never repeat and are one, each used once,
    the nearest first.
    """
    cost = np.array([[_distance(found, a, int(b)) for b in here] for a in before]).reshape(
        len(before), len(here)
    )
    rows, columns = linear_sum_assignment(np.minimum(cost, _NEVER))
    return [(int(i), int(here[j])) for i, j in zip(rows, columns, strict=True) if cost[i, j] < LINK]


def _distance(found: GridResponses, a: int, b: int) -> float:
    """How far two motions at different values that never repeat lie apart, in units of their range;
    inf if they differ in kind.
    """
    if found.kind[a] != found.kind[b]:
        return np.inf
    scale = np.maximum(found.motions.scale[found.row[a]], found.motions.scale[found.row[b]])
    p, q = found.points(a), found.points(b)
    return float(
        max(
            np.abs((p.mean(axis=0) - q.mean(axis=0)) / scale).max(),
            np.abs((p.std(axis=0) - q.std(axis=0)) / scale).max(),
        )
    )


def events(
    found: GridResponses,
    table: AttractorTable,
    branch: np.ndarray,
    followed: Followed,
    grid: Grid,
    exact: bool,
) -> list[Event]:
    """What happens to the branches of :func:`follow`, in the order of the values; ``exact``:
    whether the method's errors are rounding.
    """
    (values,) = grid.axes.values()
    result = []
    groups = [np.flatnonzero(branch == number) for number in range(branch.max(initial=-1) + 1)]
    for number, members in enumerate(groups):
        result += _grazes(found, table, members, values, number)
    for way, side in ((+1, -1), (-1, 0)):
        ends = np.array([members[side] for members in groups], np.int64)
        result += why_they_end(found, followed, values, ends, way, exact)
    # a limit cycle begins where an equilibrium begins to oscillate: reported once
    step = float(np.diff(values).max(initial=0.0))
    born = [event.value for event in result if event.kind == "hopf"]
    result = [
        event
        for event in result
        if event.kind != "end" or not any(abs(event.value - value) <= step for value in born)
    ]
    return sorted(result, key=lambda event: (event.value, event.branch, event.kind))


def _grazes(
    found: GridResponses,
    table: AttractorTable,
    members: np.ndarray,
    values: np.ndarray,
    number: int,
) -> list[Event]:
    """Where the number of contacts changes along a periodic branch."""
    if found.kind[members[0]] not in CLOSED:
        return []
    contacts, place = np.asarray(table.contacts)[members], found.place[members]
    jumps = np.flatnonzero(np.abs(np.diff(contacts)) > 0.5)
    return [Event(middle(values, place[i], place[i + 1]), "graze", number) for i in jumps]
