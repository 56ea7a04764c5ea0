"""Errors of contact times: of one step, or measured by running the same trajectories again, more
exactly and nudged by roundings.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np

from saltus.flow import engine
from saltus.flow.engine import Outcome, Request, RunInterrupted, Schedule
from saltus.flow.methods import Method
from saltus.system import expression as ex
from saltus.system.evaluate import evaluate
from saltus.system.system import System

#: Copies of a trajectory whose errors are rounding. Errors soon lie along the one direction that
#: grows fastest, so the ratio of a trajectory's error to its distance from a copy stays what chance
#: made it at the start: one copy can be near for ever, three rarely are.
COPIES = 3
#: The estimate is this many times the largest distance so far: where errors are rounding, and where
#: the companion is exact beside them.
SAFETY, SAFETY_OF_EXACT_COMPANION = 8.0, 4.0
#: Most trajectories that move in one call with their copies.
FEW = 16
#: Share of the work that is the run itself, where its copies come after it.
BY_ITSELF = 0.3
#: Seed of the signs of the nudges. They are the same for every trajectory, so that no result
#: depends on its neighbours.
SEED = 20


def local(outcome: Outcome) -> np.ndarray:
    """What one step's own error means for the time of its contact [s]."""
    return outcome.contacts.time_error


def measured(
    system: System,
    method: Method,
    request: Request,
    threads: int | None,
    show: Callable[[float], None] | None,
) -> tuple[Outcome, np.ndarray]:
    """Run a request, and the copies that tell its errors.

    Parameters
    ----------
    system, method, request, threads, show
        As for :func:`saltus.flow.engine.run`.

    Returns
    -------
    Outcome, float64[contact]
        What came out, and the estimated error of the time of every contact [s]; infinite from where
        on nothing is known.

    Raises
    ------
    RunInterrupted
        On Ctrl-C, with the Outcome so far.
    """
    n, silent = len(request.start), replace(request, schedule=Schedule.none())
    runs = _nudged(system, silent) if method.exact else [silent]
    if method.exact and n <= FEW:
        outcome, distance = _in_one_call(system, method, request, runs, threads, show)
    else:
        outcome, distance = _one_by_one(system, method, request, runs, threads, show)
    error = (SAFETY if method.exact else SAFETY_OF_EXACT_COMPANION) * distance
    return outcome, np.maximum(
        error, local(outcome) + 4.0 * np.spacing(np.abs(outcome.contacts.time))
    )


def _in_one_call(
    system: System,
    method: Method,
    request: Request,
    runs: list[Request],
    threads: int | None,
    show: Callable[[float], None] | None,
) -> tuple[Outcome, np.ndarray]:
    """Outcome and largest distances, trajectories and copies moved together: copies fill lanes that
    would stay empty.
    """
    n, total = len(request.start), (1 + len(runs)) * len(request.start)
    together = replace(_together([request, *runs]), checks=total - n)
    try:
        whole = engine.run(system, method.suited_to(total), together, threads, show)
    except RunInterrupted as stop:
        so_far = stop
        raise RunInterrupted(lambda: so_far.partial.of(0, n)) from None
    outcome, check = whole.of(0, n), whole.of(n, total)
    return outcome, np.max([_distances(outcome, check, i * n) for i in range(len(runs))], axis=0)


def _one_by_one(
    system: System,
    method: Method,
    request: Request,
    runs: list[Request],
    threads: int | None,
    show: Callable[[float], None] | None,
) -> tuple[Outcome, np.ndarray]:
    """The same, one run after the other: the contacts of one copy need room at a time."""

    def part(begin: float, share: float) -> Callable[[float], None] | None:
        return None if show is None else lambda done: show(begin + share * done)

    n = len(request.start)
    outcome = engine.run(system, method.suited_to(n), request, threads, part(0.0, BY_ITSELF))
    companion, share = method.companion().suited_to(n), (1.0 - BY_ITSELF) / len(runs)
    distance = np.zeros(len(outcome.contacts))
    try:
        for done, one in enumerate(runs):
            check = engine.run(
                system, companion, one, threads, part(BY_ITSELF + done * share, share)
            )
            distance = np.maximum(distance, _distances(outcome, check, 0))
    except KeyboardInterrupt:
        raise RunInterrupted(lambda: outcome) from None
    return outcome, distance


# -- nudges ----------------------------------------------------------------------------------------
def _nudged(system: System, request: Request) -> list[Request]:
    """The request with starts and values wrong by an ulp, differently in each copy. What moves a
    boundary, or time, stays.
    """
    fixed = _fixed(system.origin)
    resting = _on_a_boundary(system, request)[:, None]
    copies = []
    for copy in range(COPIES):
        nudge = 1.0 + _signs(copy, len(system.states) + len(system.values)) * np.finfo(float).eps
        by_state = np.where(resting, 1.0, nudge[: len(system.states)])
        by_value = np.where(fixed, 1.0, nudge[len(system.states) :])
        copies.append(
            replace(
                request, start=request.start * by_state, parameters=request.parameters * by_value
            )
        )
    return copies


@lru_cache(maxsize=64)
def _fixed(system: System) -> np.ndarray:
    """Parameters that move a boundary, or time: bool[P], the same for all values."""
    places = {
        leaf.payload for guard in system.guards for leaf in ex.walk(guard.gap) if leaf.op == "param"
    } | {system.forced_at}
    return np.array([name in places for name in system.values], bool)


@lru_cache(maxsize=64)
def _signs(copy: int, count: int) -> np.ndarray:
    """Up or down, for each state and value of a copy."""
    return np.random.default_rng([SEED, copy]).choice([-1.0, 1.0], count)


def _on_a_boundary(system: System, request: Request) -> np.ndarray:
    """Trajectories that start on a boundary, and would leave it by a nudge: bool[n]."""
    gaps = evaluate(
        [guard.gap for guard in system.guards],
        t=request.origin,
        states=dict(zip(system.states, request.start.T, strict=True)),
        values=dict(zip(system.values, request.parameters.T, strict=True)),
        bits=[False] * len(system.guards),
    )
    return np.any([np.broadcast_to(gap, len(request.start)) == 0.0 for gap in gaps], axis=0)


def _together(requests: list[Request]) -> Request:
    """Several requests of the same kind as one."""
    first = requests[0]
    if len(requests) == 1:
        return first
    return replace(
        first,
        start=np.concatenate([r.start for r in requests]),
        parameters=np.concatenate(
            [np.broadcast_to(r.parameters, (len(r.start), r.parameters.shape[1])) for r in requests]
        ),
        period=np.concatenate([r.period for r in requests]),
        end_count=np.concatenate([r.end_count for r in requests]),
        end_phase=np.concatenate([r.end_phase for r in requests]),
    )


# -- distances -------------------------------------------------------------------------------------
def _distances(outcome: Outcome, check: Outcome, offset: int) -> np.ndarray:
    """Largest distance so far of the contacts of a trajectory from those of its copy [s],
    ``offset`` rows later in ``check``.

    The k-th contact is compared with the k-th; from the first at which the two runs meet different
    guards on, it is infinite.
    """
    distance = np.full(len(outcome.contacts), np.inf)
    count = len(outcome.status)
    bounds_ours, bounds_theirs = (
        outcome.contacts.begins(count),
        check.contacts.begins(count, offset),
    )
    for i in range(count):
        a, b = slice(*bounds_ours[i : i + 2]), slice(*bounds_theirs[i : i + 2])
        times, same = _in_order(
            _events(outcome, a), _events(check, b), check.contacts.time[b].copy()
        )
        here = slice(a.start, a.start + same)
        distance[here] = np.maximum.accumulate(np.abs(outcome.contacts.time[here] - times[:same]))
    return distance


def _events(outcome: Outcome, rows: slice) -> np.ndarray:
    """Guard and direction of contacts, int64[k, 2]."""
    return np.stack([outcome.contacts.guard[rows], outcome.contacts.direction[rows]], axis=1)


def _in_order(ours: np.ndarray, theirs: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, int]:
    """Their times in the order of our contacts, and how many are the same; neighbours are swapped
    (contacts at one instant).
    """
    shared, first = min(len(ours), len(theirs)), 0
    while first < shared:
        differ = (ours[first:shared] != theirs[first:shared]).any(axis=1)
        if not differ.any():
            return times, shared
        k = first + int(np.argmax(differ))
        if k + 1 >= shared or (ours[k : k + 2] != theirs[k : k + 2][::-1]).any():
            return times, k
        times[k : k + 2], first = times[k : k + 2][::-1].copy(), k + 2
    return times, shared
