"""Chunks on a dask cluster, which a scheduler's address stands for. Needs the extra ``cluster``.

A dask scheduler runs any code: whoever can reach it can run anything as the user who started it.
See docs/studies.md.
"""

from __future__ import annotations

import asyncio
import logging
import re
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from saltus.errors import StudyError

if TYPE_CHECKING:
    from saltus.analysis.attractors.attractor_set import AttractorSet
    from saltus.analysis.basins.labels import Settling
    from saltus.analysis.basins.pipeline import BasinPlan

#: Chunks handed out at a time, for each worker: enough to keep it busy, few enough that a large map
#: doesn't fill the scheduler.
CHUNKS_PER_WORKER = 4
#: Times that a chunk is given to another worker when its own dies.
MAX_RETRIES = 5
_SILENT = (
    "the scheduler {} doesn't answer ({}). Start one with `dask scheduler`, or leave "
    "--scheduler out."
)


@contextmanager
def cluster_runner(scheduler: str) -> Iterator[Callable[..., None]]:
    """Yields ``run(plan, found, missing, keep, show)`` on a cluster.

    Parameters
    ----------
    scheduler : str
        Address such as ``tcp://host:8786``.

    Raises
    ------
    StudyError
        If dask isn't installed, or the scheduler doesn't answer.
    """
    try:
        from distributed import Client
    except ImportError:
        raise StudyError(
            'a cluster needs dask. Install "saltus[cluster]", or leave --scheduler out.'
        ) from None
    # late heartbeats and lost workers are handled here, or raise errors
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    try:
        client = Client(scheduler, timeout=10)
    except (OSError, ValueError) as error:
        raise StudyError(_SILENT.format(scheduler, error)) from error
    with client:
        yield lambda *job: _run(client, *job)


def check_scheduler(address: str) -> None:
    """Raise StudyError if nobody listens there: asked before long work, and answered at once."""
    place = re.fullmatch(r"(?:\w+://)?(\[.*\]|[^:/]+):(\d+)/?", address)
    if place is None:
        raise StudyError(_SILENT.format(address, "that is no address such as tcp://127.0.0.1:8786"))
    try:
        socket.create_connection((place[1].strip("[]"), int(place[2])), timeout=5.0).close()
    except OSError as error:
        raise StudyError(_SILENT.format(address, error.strerror or error)) from error


def _run(
    client: Any,
    plan: BasinPlan,
    found: AttractorSet,
    missing: list[int],
    keep: Callable[[int, Settling], None],
    show: Callable[[float], None],
) -> None:
    """Hand out chunks, keep what comes back, hand out more; a chunk whose worker dies goes to
    another one.
    """
    from distributed import as_completed

    try:
        client.wait_for_workers(1, timeout=30)
    except TimeoutError as error:
        raise StudyError(
            "the scheduler has no workers. Start some with `dask worker ADDRESS`, or "
            "leave --scheduler out."
        ) from error
    shared = client.scatter((plan, found), broadcast=True)
    waiting, tries = iter(missing), dict.fromkeys(missing, 0)
    width = max(
        CHUNKS_PER_WORKER * max(len(client.scheduler_info()["workers"]), 1), CHUNKS_PER_WORKER
    )
    indices = {
        _submit(client, shared, index): index
        for _, index in zip(range(width), waiting, strict=False)
    }
    running, done = as_completed(list(indices)), 0
    for future in running:
        index = indices.pop(future)
        try:
            part = future.result()
        # every worker with the plan has died: send it to their successors
        except (Exception, asyncio.CancelledError) as error:
            tries[index] += 1
            if tries[index] > MAX_RETRIES:
                raise StudyError(
                    f"chunk {index} failed on {MAX_RETRIES} workers, the last time with {error!r}."
                ) from error
            client.wait_for_workers(1, timeout=60)
            shared = client.scatter((plan, found), broadcast=True)
            again = _submit(client, shared, index)
            indices[again] = index
            running.add(again)
            continue
        keep(index, part)
        done += 1
        show(done / len(missing))
        following = next(waiting, None)
        if following is not None:
            added = _submit(client, shared, following)
            indices[added] = following
            running.add(added)


def _submit(client: Any, shared: Any, index: int) -> Any:
    return client.submit(_chunk, shared, index, retries=MAX_RETRIES, pure=False)


def _chunk(shared: tuple[BasinPlan, AttractorSet], index: int) -> Settling:
    plan, found = shared
    return plan.chunk(index, found)
