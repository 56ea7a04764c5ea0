"""Chunks on a dask cluster, given by its scheduler's address. Needs the extra ``cluster``.

A dask scheduler runs any code: whoever can reach it can run anything as the user who started it.
See docs/studies.md.
"""

from __future__ import annotations

import logging
import re
import socket
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError, wait
from contextlib import contextmanager
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from saltus.errors import StudyError
from saltus.flow.threads import on_threads
from saltus.interrupt import check_stop

if TYPE_CHECKING:
    import numpy as np
    from distributed import Client

    from saltus.results.store.division import Division

#: Chunks handed out at a time, for each worker: enough to keep it busy, few enough that a large map
#: doesn't fill the scheduler.
CHUNKS_PER_WORKER = 4
#: Workers that a chunk is given to, one after the other, when they die or it fails there.
MAX_TRIES = 6
#: Time between two questions whether to stop, while a chunk is computed [s].
PATIENCE = 0.5
_SILENT = (
    "the scheduler {} doesn't answer ({}). Start one with `dask scheduler`, or leave "
    "--scheduler out."
)


@contextmanager
def cluster_runner(scheduler: str) -> Iterator[Callable[..., None]]:
    """Yields ``run(division, shared, missing, keep, show)`` on a cluster.

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
    # Silence dask on late heartbeats and lost workers: both are handled here, or raise errors.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    try:
        client = Client(scheduler, timeout=10)
    except (OSError, ValueError) as error:
        raise StudyError(_SILENT.format(scheduler, error)) from error
    with client:
        yield lambda *job: _run(client, *job)


def check_scheduler(address: str) -> None:
    """Raise StudyError if nobody listens at the scheduler's address. Call this before long work."""
    place = re.fullmatch(r"(?:\w+://)?(\[.*\]|[^:/]+):(\d+)/?", address)
    if place is None:
        raise StudyError(_SILENT.format(address, "that is no address such as tcp://127.0.0.1:8786"))
    try:
        socket.create_connection((place[1].strip("[]"), int(place[2])), timeout=5.0).close()
    except OSError as error:
        raise StudyError(_SILENT.format(address, error.strerror or error)) from error


def open_to_all(address: str) -> str:
    """A line that warns of a scheduler that asks for no secret; empty for one that does, and
    without dask, which is told later.
    """
    if address.startswith("tls://") or find_spec("distributed") is None:
        return ""
    return (
        f"--scheduler {address} asks for no secret: whoever can reach it can run code as you. "
        "Where others can, start it with TLS and write tls://HOST:PORT (docs/cluster.md)."
    )


def _run(
    client: Client,
    division: Division,
    shared: Any,
    missing: Sequence[int],
    keep: Callable[[int, Mapping[str, np.ndarray]], None],
    show: Callable[[float], None],
) -> None:
    """Compute chunks; one thread waits for each chunk that is handed out."""

    def watch(share: float) -> None:
        _find_workers(client, 60.0)
        show(share)

    _find_workers(client, 30.0)
    width = CHUNKS_PER_WORKER * len(client.scheduler_info()["workers"])
    on_threads(lambda index: _chunk(client, division, shared, index), missing, keep, width, watch)


def _chunk(client: Client, division: Division, shared: Any, index: int) -> Mapping[str, np.ndarray]:
    """Compute one chunk on the cluster. The division goes with each chunk: it is small, and a
    worker that dies loses what it keeps.

    Raises
    ------
    StudyError
        If it fails again and again.
    """
    problem: Exception | None = None
    for _ in range(MAX_TRIES):
        future = client.get_executor(pure=False).submit(division.chunk, index, shared)
        while not wait([future], PATIENCE).done:
            check_stop()
        try:
            chunk: Mapping[str, np.ndarray] = future.result()
        except (Exception, CancelledError) as error:  # its workers have died, one after the other
            problem = error
            continue
        return chunk
    raise StudyError(
        f"chunk {index} failed on {MAX_TRIES} workers, the last time with {problem!r}."
    ) from problem


def _find_workers(client: Client, seconds: float) -> None:
    """Wait until the scheduler has a worker. Raises StudyError if none comes."""
    try:
        client.wait_for_workers(1, timeout=seconds)
    except TimeoutError as error:
        raise StudyError(
            "the scheduler has no workers. Start some with `dask worker ADDRESS`, or "
            "leave --scheduler out."
        ) from error
