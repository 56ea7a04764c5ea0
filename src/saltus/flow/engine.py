"""The engine: trajectories in chunks, chunks on threads, kernels in slices short enough for Ctrl-C;
records and samples come back.

Every trajectory is independent of all others, so chunks may be cut and threads may run as they
like: the result is the same to the bit.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache, partial
from itertools import pairwise

import numpy as np

from saltus.codegen.clocks import table_data
from saltus.codegen.module import Flow
from saltus.errors import SaltusWarning
from saltus.flow.contact_table import ContactTable
from saltus.flow.counts import whole as whole_number
from saltus.flow.growth import mark_growth
from saltus.flow.methods import Method
from saltus.flow.pace import marks, resume
from saltus.flow.request import Outcome, Request, Schedule
from saltus.flow.room import Contacts
from saltus.flow.stops import on_allowed_sides
from saltus.flow.threads import may_wait, on_threads, usable_processors
from saltus.interrupt import PartInterrupted, Stop, alive, check_stop
from saltus.kernels import status as st
from saltus.kernels.batch import Batch
from saltus.system import System

#: Trajectories in a chunk: enough to keep lanes full, few enough to balance threads and to show
#: progress.
CHUNK = 1024
#: Threads of one call.
MOST_THREADS = 4096
#: Steps of the lanes between two checks for Ctrl-C, for two states: about ten milliseconds.
SLICE = 50_000
#: Contacts that a chunk's table holds before it is emptied, besides room for those of one step.
RECORDS = 8192


class RunInterrupted(PartInterrupted):
    """Ctrl-C during a run of the engine: ``partial`` is the Outcome so far."""


@dataclass
class _Chunk:
    """A slice of the trajectories and the arrays of its kernel call (views of the outcome's arrays
    where possible).
    """

    first: int
    arrays: dict[str, np.ndarray]
    keeps_contacts: bool
    due: np.ndarray | None
    until: Callable[[], bool] | None
    contacts: list[ContactTable] = field(default_factory=list)


def run(
    system: System,
    method: Method,
    request: Request,
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Outcome:
    """Compute a request.

    Parameters
    ----------
    system : System
        The equations; its own parameter values aren't used.
    method : Method
        The method of integration.
    request : Request
        The trajectories to compute.
    threads : int, optional
        Threads to use; default all processors this process may run on. The result doesn't depend on
        it.
    progress : callable, optional
        Called with the share done, from this thread.

    Raises
    ------
    RunInterrupted
        On Ctrl-C, with the partial Outcome.
    """
    threads = threads if threads is None else whole_number(threads, "threads", 1, MOST_THREADS)
    method = method.serving(system.origin)
    module = method.kernels(system.origin)
    outcome, arrays = allocate(request, system, module)
    periods = request.end_count + request.end_phase / request.period
    data, due = tables_of(system.origin), method.due(periods)
    arrays["options"] = options_of(method, periods, len(periods), request.checks)
    most = float(arrays["options"][:, method.EVENT_BUDGET].max(initial=0.0))
    if request.until is not None:
        arrays["options"][:, method.EVENT_BUDGET] = 0.5
    check_steps(system, method, request.period)
    chunks = [
        _cut(request, arrays, rows, data, due, method.EVENT_BUDGET, most)
        for rows in _rows_of_chunks(request)
    ]
    workers = threads or usable_processors()
    stop, room = Stop(), Contacts(len(system.states))
    try:
        _run_chunks(chunks, module, stop, room, progress, workers)
    except KeyboardInterrupt:
        outcome.complete = False
        raise RunInterrupted(lambda: _finish(outcome, arrays, chunks, request.t_end)) from None
    if room.stopped:
        warnings.warn(
            f"the contacts of this call, {room.count} by now, filled half of the free memory: "
            f"trajectories still running stopped with "
            "status budget_events. Keep those of the last periods only (keep=), or run fewer "
            "starts or periods in one call.",
            SaltusWarning,
            stacklevel=4,
        )
    _finish(outcome, arrays, chunks, request.t_end)
    if method.fixed:
        companion = method.companion()
        try:
            mark_growth(outcome, request, lambda one: run(system, companion, one, threads))
        except KeyboardInterrupt:
            raise RunInterrupted(lambda: outcome) from None
    return outcome


def not_run(system: System, method: Method, request: Request) -> Outcome:
    """The outcome of a request none of whose trajectories was moved."""
    outcome, arrays = allocate(
        request, system, method.serving(system.origin).kernels(system.origin)
    )
    outcome.complete = False
    return _finish(outcome, arrays, [], request.t_end)


def check_steps(system: System, method: Method, period: np.ndarray) -> None:
    """Raise ParameterError if the steps of a method are too long for the forcing periods [s]."""
    if system.forced_at is not None and len(period):
        method.check_forcing(float(np.min(period)))


def options_of(
    method: Method, periods: float | np.ndarray, count: int, checks: int = 0
) -> np.ndarray:
    """The numbers of a method as its kernels read them, for ``count`` trajectories of so many
    periods each. The last ``checks`` of these measure errors.
    """
    lengths, which = np.unique(np.broadcast_to(periods, count), return_inverse=True)

    def numbers(one: Method) -> np.ndarray:
        rows = [one.numbers(length) for length in lengths.tolist()]
        return np.reshape(rows, (len(rows), len(one.numbers(1.0))))[which]

    options = numbers(method)
    if checks:
        options[-checks:] = numbers(method.companion())[-checks:]
    return options


@lru_cache(maxsize=256)
def tables_of(system: System) -> np.ndarray:
    """The tables of a system as its kernels read them: the same for all values."""
    return table_data(system)


# -- arrays ----------------------------------------------------------------------------------------
def allocate(
    request: Request, system: System, module: Flow
) -> tuple[Outcome, dict[str, np.ndarray]]:
    """Allocate the arrays that all chunks write to, and the outcome that shows them."""
    n, m, states = len(request.start), request.sample_count, len(system.states)
    sampled = n - request.checks
    finite = np.isfinite(request.start).all(axis=1) & np.isfinite(request.parameters).all(axis=1)
    start, beyond = on_allowed_sides(
        system, request.start, request.parameters, request.origin, request.period
    )
    finite &= ~beyond
    zeros, counts = np.zeros((2, n)), np.zeros((4, n), np.int64)
    counts[2, sampled:] = counts[3] = -1
    arrays = {
        "period": request.period,
        "origin": zeros[0] + request.origin,
        "state": start,
        "count": counts[0],
        "phase": zeros[1],
        "mode": counts[3],
        "fresh": counts[1],
        "carry": np.zeros((n, module.CARRY)),
        "status": np.where(finite, st.RUNNING, st.INVALID),
        "end_count": request.end_count,
        "end_phase": request.end_phase,
        "counters": np.zeros((n, len(st.COUNTERS)), np.int64),
        "minima": np.full((n, len(st.MINIMA)), np.inf),
        "cursor": counts[2],
        "samples": np.full((sampled, m, states), np.nan),
        "sample_mode": np.full((sampled, m), -1, np.int64),
        **marks(n),
    }
    outcome = Outcome(
        arrays["state"],
        arrays["phase"],
        arrays["status"],
        arrays["mode"],
        arrays["counters"],
        arrays["minima"],
        arrays["samples"],
        arrays["sample_mode"],
        ContactTable.empty(0, states),
    )
    return outcome, arrays


#: Order of the arguments of every `propagate`.
ARGUMENTS = Batch._fields


def _rows_of_chunks(request: Request) -> list[slice]:
    """The trajectories of each chunk; those whose samples have given times share one period."""
    cuts = {*range(0, len(request.start), CHUNK), len(request.start)}
    if request.times is not None:
        cuts |= set((1 + np.flatnonzero(np.diff(request.period))).tolist())
    return [slice(*ends) for ends in pairwise(sorted(cuts))]


def _cut(
    request: Request,
    all_arrays: dict[str, np.ndarray],
    rows: slice,
    data: np.ndarray,
    due: np.ndarray | None,
    budget: int,
    most: float,
) -> _Chunk:
    """The arrays of one chunk: views of the shared arrays, and tables of its own."""
    schedule = request.schedule
    if request.times is not None:
        schedule = Schedule.at(request.times, float(request.period[rows.start]))
    parameters = request.parameters if len(request.parameters) == 1 else request.parameters[rows]
    arrays = {name: array[rows] for name, array in all_arrays.items()} | shared_arrays(
        rows.stop - rows.start, parameters, schedule, data
    )
    arrays["rec_first"] += request.record_from or 0
    go_on = None
    if request.until is not None:
        until = request.until.of(rows)
        until.begin(arrays)
        go_on = partial(until.go_on, arrays, budget, most)
    keeps, mine = request.record_from is not None, None if due is None else due[rows]
    return _Chunk(rows.start, arrays, keeps, mine, go_on)


def shared_arrays(
    count: int, parameters: np.ndarray, schedule: Schedule, data: np.ndarray
) -> dict[str, np.ndarray]:
    """The arguments of a kernel that aren't written to: of ``count`` trajectories, contacts
    recorded from the first period on.
    """
    return {
        "param": np.ascontiguousarray(parameters, float),
        "stride": np.int64(0 if len(parameters) == 1 else 1),  # type: ignore[dict-item]
        "sample_count": schedule.count,
        "sample_fraction": schedule.fraction,
        "rec_first": np.zeros(count, np.int64),
        "rec_used": np.zeros(1, np.int64),
        "data": data,
    }


def move_to_end(move: Callable[[], int], arrays: dict[str, np.ndarray], due: float | None) -> None:
    """Call a kernel until its trajectories have ended. Ctrl-C is noticed between two calls."""
    outcome, went_on = st.PAUSED, False
    while outcome == st.PAUSED or went_on:
        outcome = move()
        went_on = due is not None and resume(arrays, due)
        check_stop()


def _open_tables(chunk: _Chunk, module: Flow) -> None:
    """Allocate a chunk's table of contacts when its turn comes: waiting chunks hold no memory."""
    size = RECORDS + module.STEP_RECORDS if chunk.keeps_contacts else 0
    chunk.arrays["rec_i"], chunk.arrays["rec_f"] = ContactTable.empty(
        size, chunk.arrays["state"].shape[1]
    ).arrays


def _empty_table(chunk: _Chunk, room: Contacts) -> None:
    """Move a chunk's contacts from its table to its list."""
    arrays, used = chunk.arrays, int(chunk.arrays["rec_used"][0])
    if used:
        chunk.contacts.append(
            ContactTable(arrays["rec_i"][:used], arrays["rec_f"][:used].copy()).moved(chunk.first)
        )
        room.take(used)
        arrays["rec_used"][0] = 0


def _finish(
    outcome: Outcome, arrays: dict[str, np.ndarray], chunks: list[_Chunk], t_end: float
) -> Outcome:
    """Fill in the end times, and sort the contacts of all chunks into one table. No contact is
    later than the end, not even by rounding.
    """
    outcome.time = np.minimum(
        arrays["origin"] + arrays["count"] * arrays["period"] + arrays["phase"], t_end
    )
    running, begun = arrays["status"] == st.RUNNING, arrays["counters"][:, st.STEPS] > 0
    arrays["status"][running] = np.where(begun[running], st.INTERRUPTED, st.NOT_COMPUTED)
    if parts := [part for chunk in chunks for part in chunk.contacts]:
        contacts = ContactTable.joined(parts)
        if (outcome.status == st.SLIDING).any():
            contacts = contacts.rows(~_returns_where_sliding_begins(contacts, outcome.status))
        np.minimum(contacts.time, outcome.time[contacts.trajectory], out=contacts.time)
        outcome.contacts = contacts
    return outcome


def _returns_where_sliding_begins(contacts: ContactTable, status: np.ndarray) -> np.ndarray:
    """True where the last contact of a sliding trajectory is the return, at the same instant, from
    the contact before it: bool[contacts].
    """
    who, guard, direction, time = (
        contacts.trajectory,
        contacts.guard,
        contacts.direction,
        contacts.time,
    )
    last = (status[who] == st.SLIDING) & (np.append(who[1:], -1) != who)
    back = (
        (who[1:] == who[:-1])
        & (guard[1:] == guard[:-1])
        & (direction[1:] == -direction[:-1])
        & (time[1:] == time[:-1])
    )
    returns: np.ndarray = last & np.append(False, back)
    return returns


# -- work ------------------------------------------------------------------------------------------
def slice_of(states: int) -> int:
    """Steps of the lanes between two checks for Ctrl-C: fewer for many states, whose steps take
    longer.
    """
    return max(SLICE * 4 // max(states, 2) ** 2, 1)


def _advance(
    chunk: _Chunk,
    module: Flow,
    workspace: tuple[np.ndarray, ...],
    stop: Stop,
    room: Contacts,
    show: Callable[[float], None] | None = None,
) -> None:
    """Move a chunk to its end in slices, and empty its table of contacts after each. Stop early if
    the memory for contacts is full.
    """
    arrays = chunk.arrays
    steps = slice_of(arrays["state"].shape[1])
    while not stop.is_set():
        outcome = module.propagate(*(arrays[name] for name in ARGUMENTS), steps, *workspace)
        _empty_table(chunk, room)
        went_on = chunk.due is not None and resume(arrays, chunk.due)
        if chunk.until is not None:
            went_on |= chunk.until()
        if show is not None:
            show(_share_done([chunk]))
        alive()
        if outcome == st.FINISHED and not went_on:
            return
        if room.full:
            arrays["status"][arrays["status"] == st.RUNNING] = st.BUDGET_EVENTS
            room.stopped = True
            return


def _share_done(chunks: list[_Chunk]) -> float:
    """Share of all periods that the trajectories have passed."""
    done = sum(_behind(chunk.arrays) for chunk in chunks)
    return done / max(sum(len(chunk.arrays["status"]) for chunk in chunks), 1)


def _behind(arrays: dict[str, np.ndarray]) -> float:
    span = arrays["end_count"] + arrays["end_phase"] / arrays["period"]
    at = (arrays["count"] + arrays["phase"] / arrays["period"]) / np.where(span > 0, span, 1.0)
    return float(np.sum(np.where(arrays["status"] == st.RUNNING, at, 1.0)))


def _run_chunks(
    chunks: list[_Chunk],
    module: Flow,
    stop: Stop,
    room: Contacts,
    progress: Callable[[float], None] | None,
    workers: int,
) -> None:
    """Run all chunks. Ctrl-C never interrupts a chunk midway: a table of contacts would be cut in
    two.

    A single chunk that is moved by this very thread reports its own progress: a thread only for
    that would take as long as a short run.
    """
    in_this_thread = len(chunks) == 1 and may_wait(stop)

    def work(chunk: _Chunk) -> None:
        _open_tables(chunk, module)
        _advance(
            chunk, module, module.workspace(), stop, room, progress if in_this_thread else None
        )

    show = None if progress is None or in_this_thread else lambda _: progress(_share_done(chunks))
    on_threads(work, chunks, lambda *_: None, workers, show, stop)
