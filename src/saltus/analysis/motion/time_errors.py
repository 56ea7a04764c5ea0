"""Errors of contact times: of one step, or measured by repeated runs of the same trajectories, more
exact and perturbed by roundings.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np

from saltus.flow import engine
from saltus.flow.engine import RunInterrupted
from saltus.flow.methods import Method
from saltus.flow.request import Outcome, Request
from saltus.kernels import status as st
from saltus.language import expression as ex
from saltus.language.evaluate import evaluate
from saltus.system import System

#: Copies of a trajectory whose errors are rounding. Errors soon lie along the direction that grows
#: fastest, so the ratio of a trajectory's error to its distance from a copy stays at its random
#: first value: one copy can be near for ever, three rarely are.
COPIES = 3
#: Factor of the estimate on the largest distance so far, if errors are rounding.
SAFETY = 8.0
#: The same factor, if the companion is exact in comparison.
SAFETY_OF_EXACT_COMPANION = 4.0
#: Most trajectories that move in one call with their copies.
FEW = 16
#: Share of the progress for the run itself, if its copies come after it.
BY_ITSELF = 0.3
#: Seed of the signs of the perturbations. They are the same for every trajectory, so that no result
#: depends on its neighbours.
SEED = 20
#: Columns that must agree in two contacts that are compared.
_EVENT = [st.REC_GUARD, st.REC_DIRECTION]


def local(outcome: Outcome) -> np.ndarray:
    """Error of each contact's time from the error of one step [s]."""
    errors: np.ndarray = outcome.contacts.time_error
    return errors


def measured(
    system: System,
    method: Method,
    request: Request,
    threads: int | None,
    show: Callable[[float], None] | None,
) -> tuple[Outcome, np.ndarray]:
    """Run a request, and the copies that measure its errors.

    Parameters
    ----------
    system, method, request, threads, show
        As for :func:`saltus.flow.engine.run`.

    Returns
    -------
    Outcome, float64[contact]
        The outcome, and the estimated error of the time of every contact [s]; infinite from where
        on nothing is known.

    Raises
    ------
    RunInterrupted
        On Ctrl-C, with the Outcome so far.
    """
    method = method.serving(system.origin)
    if method.exact and len(request.start) <= FEW:
        outcome, distance = _in_one_call(system, method, request, threads, show)
    else:
        outcome, distance = _one_by_one(system, method, request, threads, show)
    error = (SAFETY if method.exact else SAFETY_OF_EXACT_COMPANION) * distance
    return outcome, np.maximum(
        error, local(outcome) + 4.0 * np.spacing(np.abs(outcome.contacts.time))
    )


def _in_one_call(
    system: System,
    method: Method,
    request: Request,
    threads: int | None,
    show: Callable[[float], None] | None,
) -> tuple[Outcome, np.ndarray]:
    """Outcome and largest distances, with trajectories and copies moved together: copies fill lanes
    that would stay empty.
    """
    n, total = len(request.start), (1 + COPIES) * len(request.start)
    try:
        together = engine.run(
            system, method.suited_to(total), _with_copies(system, request), threads, show
        )
    except RunInterrupted as stop:
        so_far = stop
        raise RunInterrupted(lambda: so_far.partial.of(0, n)) from None
    outcome, check = together.of(0, n), together.of(n, total)
    return outcome, np.max([_distances(outcome, check, i * n) for i in range(COPIES)], axis=0)


def _one_by_one(
    system: System,
    method: Method,
    request: Request,
    threads: int | None,
    show: Callable[[float], None] | None,
) -> tuple[Outcome, np.ndarray]:
    """Outcome and largest distances, with one run after the other: only one copy's contacts need
    memory at a time.
    """

    def part(begin: float, share: float) -> Callable[[float], None] | None:
        return None if show is None else lambda done: show(begin + share * done)

    n, silent = len(request.start), request.unsampled()
    runs = [silent]
    if method.exact:
        runs = [
            replace(silent, start=start, parameters=parameters)
            for start, parameters in zip(*_nudged(system, request), strict=True)
        ]
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
def _nudged(system: System, request: Request) -> tuple[np.ndarray, np.ndarray]:
    """Starts float64[copy, n, D] and values float64[copy, n or 1, P] of the copies, perturbed by an
    ulp, differently in each. Values that move a boundary, or change the time, are kept.
    """
    of_states, of_values = _nudges(system.origin)
    resting = _on_a_boundary(system, request)
    starts = request.start * of_states
    starts[:, resting] = request.start[resting]
    return starts, request.parameters * of_values


@lru_cache(maxsize=256)
def _nudges(system: System) -> tuple[np.ndarray, np.ndarray]:
    """Factors of the states float64[copy, 1, D] and of the values float64[copy, 1, P]: the same for
    all values of the system.
    """
    states = len(system.states)
    signs = np.array([_signs(copy, states + len(system.values)) for copy in range(COPIES)])
    factors = 1.0 + signs[:, None] * np.finfo(float).eps
    return factors[..., :states], np.where(_fixed(system), 1.0, factors[..., states:])


def _fixed(system: System) -> np.ndarray:
    """True for parameters that move a boundary, or change the time: bool[P], the same for all
    values.
    """
    places = {
        leaf.payload for guard in system.guards for leaf in ex.walk(guard.gap) if leaf.op == "param"
    } | {system.forced_at}
    return np.array([name in places for name in system.values], bool)


def _signs(copy: int, count: int) -> np.ndarray:
    """Signs of the perturbations of each state and value of a copy."""
    return np.random.default_rng([SEED, copy]).choice([-1.0, 1.0], count)


def _on_a_boundary(system: System, request: Request) -> np.ndarray:
    """True for trajectories that start on a boundary, and would leave it by a perturbation:
    bool[n].
    """
    gaps = evaluate(
        [guard.gap for guard in system.guards],
        t=request.origin,
        states=dict(zip(system.states, request.start.T, strict=True)),
        values=dict(zip(system.values, request.parameters.T, strict=True)),
        bits=[False] * len(system.guards),
    )
    resting = np.zeros(len(request.start), bool)
    for gap in gaps:
        resting |= gap == 0.0
    return resting


def _with_copies(system: System, request: Request) -> Request:
    """The request with its trajectories, and after them their copies."""
    starts, parameters = _nudged(system, request)
    n, times = len(request.start), 1 + COPIES
    shape = (COPIES, n, parameters.shape[2])
    values = np.broadcast_to(request.parameters, shape[1:])
    return replace(
        request,
        start=np.concatenate([request.start, *starts]),
        parameters=np.concatenate([values, *np.broadcast_to(parameters, shape)]),
        period=np.tile(request.period, times),
        end_count=np.tile(request.end_count, times),
        end_phase=np.tile(request.end_phase, times),
        checks=COPIES * n,
    )


# -- distances -------------------------------------------------------------------------------------
def _distances(outcome: Outcome, check: Outcome, offset: int) -> np.ndarray:
    """Largest distance so far of the contacts of a trajectory from those of its copy [s],
    ``offset`` rows later in ``check``.

    The k-th contact is compared with the k-th; from the first different guards on the distance is
    infinite.
    """
    distance = np.full(len(outcome.contacts), np.inf)
    count = len(outcome.status)
    bounds_ours, bounds_theirs = (
        outcome.contacts.begins(count),
        check.contacts.begins(count, offset),
    )
    ours, theirs = (one.contacts.integers[:, _EVENT] for one in (outcome, check))
    for i in range(count):
        a, b = slice(*bounds_ours[i : i + 2]), slice(*bounds_theirs[i : i + 2])
        times, same = _in_order(ours[a], theirs[b], check.contacts.time[b].copy())
        here = slice(a.start, a.start + same)
        distance[here] = np.maximum.accumulate(np.abs(outcome.contacts.time[here] - times[:same]))
    return distance


def _in_order(ours: np.ndarray, theirs: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, int]:
    """Times of their contacts in the order of ours, and the number of equal ones; neighbours may be
    swapped (contacts at one instant).
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
