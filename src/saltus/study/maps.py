"""The basin maps of a study: planned into chunks, computed by threads or on a cluster, kept in stores that survive anything."""

from __future__ import annotations

import hashlib
import re
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

from saltus.analysis.basins import label_all
from saltus.analysis.plan import CHUNK, BasinPlan, basin_plan
from saltus.analysis.serial import cell_types, found_data, found_from, settling_arrays, settling_from
from saltus.analysis.settling import Settling, settle
from saltus.errors import StudyError
from saltus.flow.threads import usable_processors
from saltus.results.provenance import to_json, version
from saltus.results.store import Store
from saltus.study import quantities
from saltus.study.run import method_of, system_of
from saltus.study.spec import Basins, Map, Study

if TYPE_CHECKING:
    import xarray as xr

    from saltus.analysis.recurrence import Found
    from saltus.system import System

#: Chunks from which on a map is worth an estimate.
LARGE = 20
#: Cells whose labels are timed for the estimate.
TIMED = 512
#: Ends of the names of files that belong to a map.
ATTRACTORS, AGREEMENT = "-attractors", "-agreement"
#: Folder of a study's stores, in its output folder.
STORES = "stores"


@dataclass(frozen=True)
class Resources:
    """What to compute with.

    Attributes
    ----------
    threads : int or None
        Threads of this process; all usable cores by default.
    workers : int or None
        Processes of a dask cluster on this machine.
    scheduler : str or None
        Address of a dask scheduler, or ``"local"``.
    shard : (k, n) or None
        Only the chunks i with i % n == k: one of n jobs that share the store and nothing else.
    """

    threads: int | None = None
    workers: int | None = None
    scheduler: str | None = None
    shard: tuple[int, int] | None = None

    @property
    def cluster(self) -> bool:
        """Whether dask does the work."""
        return self.workers is not None or self.scheduler is not None


def shard_of(text: str) -> tuple[int, int]:
    """(k, n) from "k/n". Raises StudyError if that isn't what stands there."""
    match = re.fullmatch(r"(\d+)/(\d+)", text.strip())
    if not match or not int(match[1]) < int(match[2]):
        raise StudyError(f"--shard {text}: write K/N with K from 0 to N - 1, such as 0/4.")
    return int(match[1]), int(match[2])


@dataclass(frozen=True)
class Report:
    """How far a map is; read off the store, so that the work of other machines counts too."""

    name: str
    done: int
    total: int
    seconds: float
    computed: int
    last: bool = False

    @property
    def seconds_left(self) -> float | None:
        """Time left at the rate so far [s]; None before the first chunk."""
        return self.seconds / self.computed * (self.total - self.done) if self.computed else None


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
        return {
            "equations": plan.system.fingerprint(), "values": to_json(dict(plan.system.values)), "method": plan.method.name,
            "method options": to_json(plan.method.options()), "axes": to_json(axes), "at": to_json(dict(plan.fixed)),
            "periods": str(plan.periods), "every": str(plan.every), "saltus": version("saltus"), "code": code_hash(),
        }  # fmt: skip


@cache
def code_hash() -> str:
    """SHA-256 of all code that a label depends on."""
    digest = hashlib.sha256()
    for package in ("system", "kernels", "codegen", "flow", "analysis"):
        for file in sorted(resources.files(f"saltus.{package}").iterdir(), key=lambda item: item.name):
            if file.name.endswith(".py"):
                digest.update(file.name.encode() + file.read_bytes())
    return digest.hexdigest()


def jobs_of(study: Study, own: System | None = None) -> list[MapJob]:
    """The maps of a study, each with its plan.

    Raises
    ------
    StudyError, UnitError, ParameterError
        If the study doesn't fit its system.
    """
    table = study.basins
    assert table is not None
    base = system_of(study.system, own)
    jobs = []
    for one in table.map or [Map(name=study.study.name)]:
        system = base.with_values(**quantities.parameters(base, one.values, "basins.map.values"))
        slug = _slug(one.name) if table.map else "basins"
        jobs.append(MapJob(one.name, slug, _plan(table, system, method_of(one.method or study.method)), one.compare))
    slugs = [job.slug + end for job in jobs for end in ("", ATTRACTORS, *([AGREEMENT] if job.compare else []))]
    if len(set(slugs)) < len(slugs):
        raise StudyError(f"[[basins.map]] names give the same file names, among {', '.join(slugs)}. Let them differ in letters or digits.")
    return jobs


def _slug(name: str) -> str:
    """A name as a file name."""
    return re.sub(r"[^a-z0-9.]+", "-", name.lower()).strip("-.") or "map"


def _plan(table: Basins, system: System, method: Any) -> BasinPlan:
    first = quantities.states(system, {name: axis.first for name, axis in table.axes.items()}, "basins.axes")
    last = quantities.states(system, {name: axis.last for name, axis in table.axes.items()}, "basins.axes")
    axes = {name: (first[name], last[name], axis.count) for name, axis in table.axes.items()}
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
    """``run(plan, found, missing, keep, show)`` by threads, or by a dask cluster."""
    if resources_.cluster:
        from saltus.study.cluster import cluster_runner

        return cluster_runner(resources_.workers, resources_.scheduler)

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
    memory, disk = 2.5e8 + plan.cells * (120.0 + 24.0 * size), plan.cells * (9.0 + 8.0 * size)
    return f"{plan.cells} cells: about {seconds:.0f} s here, {memory / 1e9:.1f} GB of memory, {disk / 1e6:.0f} MB on the disk"
