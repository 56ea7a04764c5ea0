"""Chunks on a dask cluster: processes of this machine, or whatever a scheduler's address stands for. Needs the extra ``cluster``."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from saltus.errors import StudyError

if TYPE_CHECKING:
    from saltus.analysis.plan import BasinPlan
    from saltus.analysis.recurrence import Found
    from saltus.analysis.settling import Settling

#: Chunks handed out at a time, for each worker: enough to keep it busy, few enough that a large map doesn't fill the scheduler.
AHEAD = 4
#: Times that a chunk is given to another worker when its own dies.
RETRIES = 5


@contextmanager
def cluster_runner(workers: int | None, scheduler: str | None) -> Iterator[Callable[..., None]]:
    """Yields ``run(plan, found, missing, keep, show)`` on a cluster; one of this machine listens on the loopback only.

    Parameters
    ----------
    workers : int, optional
        Processes of a cluster on this machine; by default one for each core.
    scheduler : str, optional
        Address such as ``tcp://host:8786``; ``"local"`` or None for a cluster on this machine.

    Raises
    ------
    StudyError
        If dask isn't installed, or the scheduler doesn't answer.
    """
    try:
        from distributed import Client, LocalCluster
    except ImportError:
        raise StudyError('a cluster needs dask. Install "saltus[cluster]", or leave --workers and --scheduler out.') from None
    if scheduler in (None, "local"):
        local = LocalCluster(n_workers=workers, threads_per_worker=1, host="127.0.0.1", dashboard_address=None)
        with local as cluster, Client(cluster) as client:
            yield lambda *job: _run(client, *job)
        return
    try:
        client = Client(scheduler, timeout=10)
    except (OSError, ValueError) as error:
        told = f"the scheduler {scheduler} doesn't answer ({error}). Start one with `dask scheduler`, or leave --scheduler out."
        raise StudyError(told) from error
    with client:
        yield lambda *job: _run(client, *job)


def _run(client: Any, plan: BasinPlan, found: Found, missing: list[int], keep: Callable, show: Callable[[float], None]) -> None:
    """Hand out chunks, keep what comes back, hand out more; a chunk whose worker dies goes to another one."""
    from distributed import as_completed

    shared = client.scatter((plan, found), broadcast=True)
    waiting = iter(missing)
    width = max(AHEAD * max(len(client.scheduler_info()["workers"]), 1), AHEAD)
    first = [index for _, index in zip(range(width), waiting, strict=False)]
    running = as_completed((_submit(client, shared, index) for index in first), with_results=True)
    for done, (_, (index, part)) in enumerate(running, start=1):
        keep(index, part)
        show(done / len(missing))
        following = next(waiting, None)
        if following is not None:
            running.add(_submit(client, shared, following))


def _submit(client: Any, shared: Any, index: int) -> Any:
    return client.submit(_chunk, shared, index, retries=RETRIES, pure=False)


def _chunk(shared: tuple[BasinPlan, Found], index: int) -> tuple[int, Settling]:
    plan, found = shared
    return index, plan.chunk(index, found)
