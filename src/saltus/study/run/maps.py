"""The basin maps of a study: planned into chunks, computed by threads, processes or a cluster, in
crash-safe stores.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from saltus.analysis.basins.basins import label_all
from saltus.analysis.basins.labels import Settling, settle
from saltus.analysis.basins.pipeline import CHUNK, BasinPlan, memory
from saltus.analysis.basins.serial import (
    cell_types,
    found_data,
    found_from,
    settling_arrays,
    settling_from,
)
from saltus.flow.threads import usable_processors
from saltus.results.store.store import Store
from saltus.study.answers.basins import BasinMap
from saltus.study.run.processes import run_on_processes
from saltus.study.run.running import Report, Resources

if TYPE_CHECKING:
    import xarray as xr

    from saltus.analysis.attractors.attractor_set import AttractorSet

#: Chunks of a map from which its time is estimated.
LARGE = 20
#: Cells whose labels are timed for the estimate.
TIMED_CELLS = 512
#: Folder of a study's stores, in its output folder.
STORES = "stores"


def open_store(job: BasinMap, folder: Path) -> Store:
    """Open the store of a map in a study's output folder, or make it. Raises StoreError if it
    belongs to something else.
    """
    (folder / STORES).mkdir(parents=True, exist_ok=True)
    return Store.create_or_resume(
        folder / STORES / job.stem,
        job.identity(),
        shape=job.plan.shape,
        chunk=CHUNK,
        arrays=cell_types(job.plan.system.states),
        note={"name": job.title},
    )


def compute(
    job: BasinMap,
    store: Store,
    resources_: Resources,
    report: Callable[[Report], None],
    say: Callable[[str], None],
) -> bool:
    """Compute the missing chunks of a map, or of a shard of it. Returns True if the whole map is
    done.

    Every chunk is committed when it is ready: stopped at any moment, by anything, the work goes on
    from there.
    """
    shard = resources_.shard
    with store.lock(shard):
        damaged = store.verify()
        if damaged:
            say(f"{job.title}: damaged chunks that are computed again: {len(damaged)}")
        found = _attractors(job, store, resources_)
        missing = store.missing(shard)
        if len(missing) >= LARGE:
            say(f"{job.title}: {estimate(job.plan, found, resources_)}")
        begin, count = time.perf_counter(), [0]

        def tell(last: bool = False) -> None:
            done, seconds = int(store.done().sum()), time.perf_counter() - begin
            report(Report(job.title, done, job.plan.chunks, seconds, count[0], last=last))

        if missing:

            def keep(index: int, part: Settling) -> None:
                store.commit(index, settling_arrays(part, job.plan.system.states))
                count[0] += 1

            with _runner(resources_) as run:
                run(job.plan, found, missing, keep, lambda _: tell())
        tell(last=True)
    return not store.missing()


def _attractors(job: BasinMap, store: Store, resources_: Resources) -> AttractorSet:
    """Attractors that all chunks are labelled with. The first process finds them, for all
    others.
    """
    if not store.has("attractors"):
        store.put("attractors", found_data(job.plan.scout(resources_.threads)), existing="keep")
    return found_from(store.get("attractors"), len(job.plan.system.states))


def _runner(resources_: Resources) -> AbstractContextManager[Callable[..., None]]:
    """``run(plan, found, missing, keep, show)`` by threads, by processes, or by a dask cluster."""
    if resources_.scheduler not in (None, "local"):
        from saltus.study.run.cluster import cluster_runner

        return cluster_runner(str(resources_.scheduler))
    if resources_.workers is not None or resources_.scheduler == "local":
        return nullcontext(partial(run_on_processes, resources_.workers))

    def run(
        plan: BasinPlan,
        found: AttractorSet,
        missing: list[int],
        keep: Callable[[int, Settling], None],
        show: Callable[[float], None],
    ) -> None:
        label_all(plan, found, missing, keep, resources_.threads, show)

    return nullcontext(run)


def finish(job: BasinMap, store: Store, threads: int | None = None) -> xr.Dataset:
    """The Dataset of a finished map."""
    found = found_from(store.get("attractors"), len(job.plan.system.states))
    return job.plan.finish(settling_from(store.read_all(), job.plan.system.states), found, threads)


def estimate(plan: BasinPlan, found: AttractorSet, resources_: Resources) -> str:
    """Sentence on the time, memory and disk space that a map will take, estimated from a few
    hundred of its cells.
    """
    cells = plan.sample(TIMED_CELLS)
    map_ = plan.map(1)
    map_.launch(plan.starts(cells[:1]), 1).advance(1)  # compiles, if it must
    begin = time.perf_counter()
    settle(map_, plan.starts(cells), found, plan.periods)
    seconds = (
        (time.perf_counter() - begin)
        / len(cells)
        * plan.cells
        / (resources_.workers or resources_.threads or usable_processors())
    )
    size = len(plan.system.states)
    needed, disk = memory(plan.cells, size), plan.cells * (9.0 + 8.0 * size)
    return (
        f"{plan.cells} cells: about {seconds:.0f} s here, {needed / 1e9:.1f} GB of memory, "
        f"{disk / 1e6:.0f} MB on the disk"
    )
