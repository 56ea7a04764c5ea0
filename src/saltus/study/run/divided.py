"""Questions of a study that divide into chunks, computed by threads, processes or a cluster, in
crash-safe stores.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.flow.threads import on_threads, usable_processors
from saltus.interrupt import Interrupted
from saltus.results.provenance import to_json
from saltus.results.store.division import Division
from saltus.results.store.store import Store
from saltus.study.answers.basins import BasinMap
from saltus.study.run.processes import run_on_processes
from saltus.study.run.running import Report, Resources
from saltus.whole_files import sha256

if TYPE_CHECKING:
    import xarray as xr

    from saltus.study.answers.question import Question

#: Chunks of a question from which its time is estimated.
LARGE = 20
#: Folder of a study's stores, in its output folder.
STORES = "stores"


def division_of(question: Question) -> Division:
    """The chunks of a question that has some."""
    division = question.division
    assert isinstance(division, Division)
    return division


def place_of(question: Question, folder: Path) -> Path:
    """Folder of the store of a question. A map that changed is refused; of other questions, which
    are computed again then, each version has a store of its own.
    """
    name = question.stem
    if not isinstance(question, BasinMap):
        name += "-" + sha256(to_json(dict(question.identity() or {})).encode())[:10]
    return folder / STORES / name


def open_store(question: Question, folder: Path) -> Store:
    """Open the store of a question in a study's output folder, or make it. Raises StoreError if it
    belongs to something else.
    """
    division, place = division_of(question), place_of(question, folder)
    place.parent.mkdir(parents=True, exist_ok=True)
    return Store.create_or_resume(
        place,
        question.identity() or {},
        shape=division.shape,
        chunk=division.cells,
        arrays=division.arrays,
        note={"name": question.title},
    )


def compute(
    question: Question,
    store: Store,
    resources_: Resources,
    report: Callable[[Report], None],
    say: Callable[[str], None],
) -> bool:
    """Compute the missing chunks of a question, or of a shard of it. Returns True if all chunks are
    done.

    Every chunk is committed when it is ready: stopped at any moment, by anything, the work goes on
    from there.
    """
    shard, division, total = resources_.shard, division_of(question), store.chunks.count
    with store.lock(shard):
        damaged = store.verify()
        if damaged:
            say(f"{question.title}: damaged chunks that are computed again: {len(damaged)}")
        if division.kept and not store.has(division.kept):
            store.put(division.kept, division.share(resources_.threads), existing="keep")
        shared = _shared(division, store)
        missing = store.missing(shard)
        if len(missing) >= LARGE:
            told = division.estimate(
                shared, resources_.workers or resources_.threads or usable_processors()
            )
            if told:
                say(f"{question.title}: {told}")
        begin, count = time.perf_counter(), [0]

        def tell(last: bool = False) -> None:
            done, seconds = int(store.done().sum()), time.perf_counter() - begin
            report(Report(question.title, done, total, seconds, count[0], last=last))

        if missing:

            def keep(index: int, part: Mapping[str, np.ndarray]) -> None:
                store.commit(index, part)
                count[0] += 1

            with _runner(resources_) as run:
                run(division, shared, missing, keep, lambda _: tell())
        tell(last=True)
    return not store.missing()


def _shared(division: Division, store: Store) -> Any:
    """Data that all chunks share. The first process computes it, for all others."""
    return division.shared_from(store.get(division.kept)) if division.kept else None


def _runner(resources_: Resources) -> AbstractContextManager[Callable[..., None]]:
    """``run(division, shared, missing, keep, show)`` by threads, by processes, or by a dask
    cluster.
    """
    if resources_.scheduler not in (None, "local"):
        from saltus.study.run.cluster import cluster_runner

        return cluster_runner(str(resources_.scheduler))
    if resources_.workers is not None or resources_.scheduler == "local":
        return nullcontext(partial(run_on_processes, resources_.workers))
    return nullcontext(partial(run_on_threads, resources_.threads))


def run_on_threads(
    threads: int | None,
    division: Division,
    shared: Any,
    missing: list[int],
    keep: Callable[[int, Mapping[str, np.ndarray]], None],
    show: Callable[[float], None],
) -> None:
    """Compute chunks on threads of this process; the arguments are those of
    :func:`run_on_processes`.
    """
    division.prepare()
    on_threads(lambda index: division.chunk(index, shared), missing, keep, threads, show)


def finish(
    question: Question,
    store: Store,
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> xr.Dataset:
    """The Dataset of a question whose chunks are done."""
    division = division_of(question)
    return division.finish(store, _shared(division, store), threads, progress)


def answer_in_chunks(
    question: Question,
    store: Store,
    resources_: Resources,
    report: Callable[[Report], None],
    say: Callable[[str], None],
    progress: Callable[[float], None],
) -> xr.Dataset | None:
    """The Dataset of a question; None if other shards have yet to work on it.

    Raises
    ------
    Interrupted
        On Ctrl-C, with the Dataset of the chunks that are done.
    """
    try:
        if not compute(question, store, resources_, report, say):
            return None
    except KeyboardInterrupt:
        raise _stopped(question, store, resources_.threads) from None
    return finish(question, store, resources_.threads, progress)


def _stopped(question: Question, store: Store, threads: int | None) -> Interrupted:
    """The interruption that holds what the chunks that are done say."""
    if not store.done().any():
        return Interrupted()
    try:
        finish(question, store, threads)
    except Interrupted as stopped:
        return stopped
    return Interrupted()
