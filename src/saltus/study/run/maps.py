"""The basin maps of a study: planned into chunks, computed by threads, processes or a cluster, kept in stores that survive anything."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from saltus.analysis.basins.basins import label_all
from saltus.analysis.basins.labels import Settling, settle
from saltus.analysis.basins.pipeline import CHUNK, BasinPlan, basin_plan, memory
from saltus.analysis.basins.serial import cell_types, found_data, found_from, settling_arrays, settling_from
from saltus.flow.threads import usable_processors
from saltus.results.store.store import Store
from saltus.study.identity import identity
from saltus.study.run.processes import run_on_processes
from saltus.study.run.running import Report, Resources
from saltus.study.setting import quantities
from saltus.study.setting.inputs import Inputs
from saltus.study.setting.setting import Setting, setting_of
from saltus.study.tables.basins import Basins, Map
from saltus.study.tables.parts import slug
from saltus.study.tables.spec import Study

if TYPE_CHECKING:
    import xarray as xr

    from saltus.analysis.orbits.found import Found
    from saltus.system import System

#: Chunks from which on a map is worth an estimate.
LARGE = 20
#: Cells whose labels are timed for the estimate.
TIMED = 512
#: Folder of a study's stores, in its output folder.
STORES = "stores"


@dataclass(frozen=True)
class MapJob:
    """One map of a study: what it is called, here and in file names, its plan, and the values that a store of it must agree on."""

    name: str
    slug: str
    plan: BasinPlan
    compare: str | None

    def identity(self) -> dict[str, str]:
        """What must be the same to go on with a store."""
        plan = self.plan
        axes = {name: f"{float(values[0])!r} to {float(values[-1])!r} in {len(values)}" for name, values in plan.axes.items()}
        arguments = {"axes": axes, "at": dict(plan.fixed), "periods": plan.periods, "every": plan.every}
        return identity(plan.system, plan.method, arguments)


def jobs_of(study: Study, own: System | None = None) -> list[MapJob]:
    """The maps of a study with [basins], each with its plan.

    Raises
    ------
    StudyError, UnitError, ParameterError
        If the study doesn't fit its system.
    """
    assert study.basins is not None
    return jobs_of_setting(study.basins, setting_of(study, own, Inputs(Path())))


def jobs_of_setting(table: Basins, setting: Setting) -> list[MapJob]:
    """The same, of a system that is known."""
    jobs = []
    for one in table.map or [Map(name=setting.study.study.name)]:
        system = setting.system(one.values, "basins.map.values")
        stem = slug(one.name) if table.map else "basins"
        jobs.append(MapJob(one.name, stem, _plan(table, system, setting.method(one.method)), one.compare))
    return jobs


def _plan(table: Basins, system: System, method: Any) -> BasinPlan:
    axes = quantities.axes(system, table.axes, "basins.axes")
    at = quantities.states(system, table.at, "basins.at")
    every = None if table.every is None else quantities.number(table.every, "s", "basins", "every")
    return basin_plan(system, axes, at, method, table.periods, every)


def open_store(job: MapJob, folder: Path) -> Store:
    """The store of a map in a study's output folder, made if it isn't there yet. Raises StoreError if it belongs to something else."""
    (folder / STORES).mkdir(parents=True, exist_ok=True)
    return Store.create_or_resume(
        folder / STORES / job.slug, job.identity(), shape=job.plan.shape, chunk=CHUNK, arrays=cell_types(job.plan.system.states),
        note={"name": job.name},
    )  # fmt: skip


def compute(job: MapJob, store: Store, resources_: Resources, report: Callable[[Report], None], say: Callable[[str], None]) -> bool:
    """Compute what is missing of a map (of a shard of it); returns whether the whole map is done.

    Every chunk is committed when it is ready: stopped at any moment, by anything, the work goes on from there.
    """
    shard = resources_.shard
    with store.lock(shard):
        damaged = store.verify()
        if damaged:
            say(f"{job.name}: damaged chunks that are computed again: {len(damaged)}")
        found = _attractors(job, store, resources_)
        missing = store.missing(shard)
        if len(missing) >= LARGE:
            say(f"{job.name}: {estimate(job.plan, found, resources_)}")
        begin, count = time.perf_counter(), [0]
        if missing:

            def keep(index: int, part: Settling) -> None:
                store.commit(index, settling_arrays(part, job.plan.system.states))
                count[0] += 1

            def show(_share: float) -> None:
                report(Report(job.name, int(store.done().sum()), job.plan.chunks, time.perf_counter() - begin, count[0]))

            with _runner(resources_) as run:
                run(job.plan, found, missing, keep, show)
        report(Report(job.name, int(store.done().sum()), job.plan.chunks, time.perf_counter() - begin, count[0], last=True))
    return not store.missing()


def _attractors(job: MapJob, store: Store, resources_: Resources) -> Found:
    """The attractors that all chunks are labelled with: found once, by whoever comes first."""
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

    def run(plan: BasinPlan, found: Found, missing: list[int], keep: Callable, show: Callable) -> None:
        label_all(plan, found, missing, keep, resources_.threads, show)

    return nullcontext(run)


def finish(job: MapJob, store: Store, threads: int | None = None) -> xr.Dataset:
    """The Dataset of a finished map."""
    found = found_from(store.get("attractors"), len(job.plan.system.states))
    return job.plan.finish(settling_from(store.read_all(), job.plan.system.states), found, threads)


def estimate(plan: BasinPlan, found: Found, resources_: Resources) -> str:
    """A sentence on the time, memory and disk that a map will take, from a few hundred of its cells."""
    cells = plan.sample(TIMED)
    map_ = plan.map(1)
    map_.launch(plan.starts(cells[:1]), 1).advance(1)  # compiles, if it must
    begin = time.perf_counter()
    settle(map_, plan.starts(cells), found, plan.periods)
    seconds = (time.perf_counter() - begin) / len(cells) * plan.cells / (resources_.workers or resources_.threads or usable_processors())
    size = len(plan.system.states)
    needed, disk = memory(plan.cells, size), plan.cells * (9.0 + 8.0 * size)
    return f"{plan.cells} cells: about {seconds:.0f} s here, {needed / 1e9:.1f} GB of memory, {disk / 1e6:.0f} MB on the disk"
