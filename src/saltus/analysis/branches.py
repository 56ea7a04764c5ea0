"""Branches: the same response followed from one value of a parameter to the next, and what happens to it on the way.

Two responses at neighbouring values belong to one branch if Newton's method, started on the one, arrives at the other (natural parameter
continuation); so do those some values apart, if no start led to what it finds in between. Where Newton's method arrives nowhere near, they
do if their orbits are near each other, point by point at the best phase shift: by identity, never by amplitude, which crossing branches
share.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment

from saltus.analysis.bifurcations import LINK, Event, closed_again, middle, orbit_distance, why_they_end
from saltus.analysis.grid import Grid
from saltus.analysis.recurrence import SAME
from saltus.analysis.responses import Found
from saltus.analysis.steady import CLOSED
from saltus.flow.methods import Method
from saltus.results import AttractorTable

#: Farthest that an orbit moves between two values, in units of its own range, if Newton's method went with it; else LINK.
FARTHEST = 1.0
#: Values over which a branch may be missing: followed by Newton's method, or not.
FOLLOWED, MISSED = 16, 3
#: What is farther apart than any two responses.
_NEVER = 1e6


def follow(found: Found, grid: Grid, method: Method, threads: int | None = None) -> np.ndarray:
    """Branch of every response of a grid with one axis, int64[m]; numbered in the order in which they begin."""
    onward, moved = _continued(found, grid, method, threads)
    branch = np.full(len(found), -1, np.int64)
    heads: list[tuple[int, int]] = []  # response that a branch ends with so far, and its place
    for place in range(grid.places):
        here = np.flatnonzero(found.place == place)
        tails = [
            i for i, (last, at) in enumerate(heads) if place - at <= MISSED or (onward[last] >= 0 and found.place[onward[last]] == place)
        ]
        for tail, response in _matches(found, [heads[i][0] for i in tails], here, onward, moved):
            branch[response] = tails[tail]
            heads[tails[tail]] = (int(response), place)
        for response in here[branch[here] < 0]:
            branch[response] = len(heads)
            heads.append((int(response), place))
    return branch


def _continued(found: Found, grid: Grid, method: Method, threads: int | None) -> tuple[np.ndarray, np.ndarray]:
    """Where Newton's method arrives from each response.

    Returns
    -------
    onward : int64[m]
        The response at the next value to which some start led, or one of the values after it; -1 where there is none.
    moved : float64[m]
        How far the orbit moves to the next value, in units of its range; inf where none that attracts is found.
    """
    onward, moved = np.full(len(found), -1, np.int64), np.full(len(found), np.inf)
    rows = np.flatnonzero(np.isin(found.kind, CLOSED))
    family = grid.family(method, threads)
    start, scale = found.start()[rows], found.steady.scale[found.row[rows]]
    for ahead in range(1, FOLLOWED + 1 if family.exact else 1):
        inside = found.place[rows] + ahead < grid.places
        rows, start, scale = rows[inside], start[inside], scale[inside]
        if not len(rows):
            break
        place = found.place[rows] + ahead
        arrived = closed_again(found, rows, family.rows(place), start, scale)
        going = arrived.stable & (arrived.period == found.period[rows])
        for i in np.flatnonzero(going):
            orbit = arrived.points[i, : arrived.period[i]]
            if ahead == 1:
                moved[rows[i]] = orbit_distance(found.points(int(rows[i])), orbit, scale[i])
            for other in np.flatnonzero((found.place == place[i]) & (found.period == arrived.period[i])):
                if arrived.distance(found.points(int(other))[:1], scale[[i]], np.array([i]))[0] < SAME:
                    onward[rows[i]], going[i] = other, False
        rows, start, scale = rows[going], arrived.points[going, 0], scale[going]
    return onward, moved


def _matches(found: Found, before: list[int], here: np.ndarray, onward: np.ndarray, moved: np.ndarray) -> list[tuple[int, int]]:
    """Pairs (index into before, response) of responses that are one, each used once, the nearest first."""
    cost = np.array([[_distance(found, a, int(b)) for b in here] for a in before]).reshape(len(before), len(here))
    led = onward[np.array(before, np.int64)][:, None] == here[None]
    steps = found.place[here][None] - found.place[np.array(before, np.int64)][:, None]
    beyond = cost > steps * moved[np.array(before, np.int64)][:, None]  # Newton's method knows a nearer one: this is another response
    cost = np.where(led, np.where(cost < FARTHEST, cost * LINK / FARTHEST, cost), np.where(beyond, np.inf, cost))
    rows, columns = linear_sum_assignment(np.minimum(cost, _NEVER))
    return [(int(i), int(here[j])) for i, j in zip(rows, columns, strict=True) if cost[i, j] < LINK]


def _distance(found: Found, a: int, b: int) -> float:
    """Distance of two responses at different values, in units of the motion's range; inf if they differ in kind or period."""
    if found.kind[a] != found.kind[b] or found.period[a] != found.period[b]:
        return np.inf
    scale = np.maximum(found.steady.scale[found.row[a]], found.steady.scale[found.row[b]])
    p, q = found.points(a), found.points(b)
    if found.kind[a] not in CLOSED:  # a strange set: where it lies and how wide
        return float(max(np.abs((p.mean(axis=0) - q.mean(axis=0)) / scale).max(), np.abs((p.std(axis=0) - q.std(axis=0)) / scale).max()))
    return orbit_distance(p, q, scale)


def events(found: Found, table: AttractorTable, branch: np.ndarray, grid: Grid, method: Method, threads: int | None = None) -> list[Event]:
    """What happens to the branches of :func:`follow`, in the order of the values."""
    (values,) = grid.axes.values()
    result = []
    groups = [np.flatnonzero(branch == number) for number in range(branch.max(initial=-1) + 1)]
    for number, members in enumerate(groups):
        result += _grazes(found, table, members, values, number)
    for way, side in ((+1, -1), (-1, 0)):
        ends = np.array([members[side] for members in groups], np.int64)
        over = np.flatnonzero(~_goes_on(found, grid, method, ends, way, threads))
        result += why_they_end(found, grid, method, ends[over], over, way, threads)
    step = float(np.diff(values).max(initial=0.0))  # a limit cycle begins where an equilibrium begins to oscillate: told once
    born = [event.value for event in result if event.kind == "hopf"]
    result = [event for event in result if event.kind != "end" or not any(abs(event.value - value) <= step for value in born)]
    return sorted(result, key=lambda event: (event.value, event.branch, event.kind))


def _goes_on(found: Found, grid: Grid, method: Method, ends: np.ndarray, way: int, threads: int | None) -> np.ndarray:
    """Which responses Newton's method finds at the next value (way 1) or the one before (-1) too, bool[k]: just no start leads there."""
    result, place = np.zeros(len(ends), bool), found.place[ends] + way
    family = grid.family(method, threads)
    inside = np.flatnonzero(np.isin(found.kind[ends], CLOSED) & (place >= 0) & (place < grid.places))
    if not family.exact or not len(inside):
        return result
    rows = ends[inside]
    scale = found.steady.scale[found.row[rows]]
    arrived = closed_again(found, rows, family.rows(place[inside]), found.start()[rows], scale)
    for i in np.flatnonzero(arrived.stable & (arrived.period == found.period[rows])):
        orbit = arrived.points[i, : arrived.period[i]]
        result[inside[i]] = orbit_distance(found.points(int(rows[i])), orbit, scale[i]) < LINK
    return result


def _grazes(found: Found, table: AttractorTable, members: np.ndarray, values: np.ndarray, number: int) -> list[Event]:
    """Where the number of contacts changes along a periodic branch."""
    if found.kind[members[0]] not in CLOSED:
        return []
    contacts, place = np.asarray(table.contacts)[members], found.place[members]
    jumps = np.flatnonzero(np.abs(np.diff(contacts)) > 0.5)
    return [Event(middle(values, place[i], place[i + 1]), "graze", number) for i in jumps]
