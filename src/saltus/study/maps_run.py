"""Run the basin maps of a study: compute or resume each, then its Dataset, table and pictures."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from saltus.errors import StudyError
from saltus.results.files import replacing
from saltus.study.maps import AGREEMENT, ATTRACTORS, STORES, MapJob, Report, Resources, compute, finish, jobs_of, open_store
from saltus.study.maps_table import agreement_table, attractor_table
from saltus.study.spec import Study
from saltus.study.table import TextTable

if TYPE_CHECKING:
    import xarray as xr

    from saltus.results.store import StoreStatus
    from saltus.system import System

#: Name of the copy of the study in its output folder: what `resume` reads.
COPY = "study.toml"
#: Trajectories of attractors drawn in a gallery, and the periods of one that never repeats.
GALLERY, PERIODS = 8, 24


@dataclass
class MapOutcome:
    """What a study of maps gave: tables to print, files written, maps that other shards have still to compute."""

    tables: list[TextTable] = field(default_factory=list)
    files: list[Path] = field(default_factory=list)
    waiting: list[str] = field(default_factory=list)


def run_maps(
    study: Study,
    text: str,
    folder: Path,
    own: System | None,
    resources: Resources,
    report: Callable[[Report], None],
    say: Callable[[str], None],
    pictures: bool = True,
) -> MapOutcome:
    """Compute every map of a study, or what is missing of it, and write what came out.

    Parameters
    ----------
    study : Study
        With [basins].
    text : str
        The file as it stands; a copy goes to the folder.
    folder : Path
        Output: the stores, and for each map ``NAME.nc``, ``NAME.csv`` and pictures.
    own : System, optional
        The system, if it isn't one of saltus's models.
    resources : Resources
        What to compute with.
    report, say : callable
        Called with the progress of a map; with a sentence.
    pictures : bool
        Whether to draw.

    Raises
    ------
    StoreError
        If a store in the folder was made from something else: names what differs.
    """
    jobs = jobs_of(study, own)
    if resources.scheduler not in (None, "local"):
        from saltus.study.cluster import check_scheduler

        check_scheduler(str(resources.scheduler))
    stores = {job.name: open_store(job, folder) for job in jobs}
    with replacing(folder / COPY) as (part,):
        part.write_text(text, encoding="utf-8")
    outcome, maps = MapOutcome(), {}
    for job in jobs:
        if not compute(job, stores[job.name], resources, report, say):
            outcome.waiting.append(job.name)
            continue
        ds = finish(job, stores[job.name], resources.threads).assign_attrs(study=text, title=job.name)
        maps[job.name] = ds
        _write_map(job, ds, folder, outcome, pictures)
    for job in jobs:
        if job.compare is not None and {job.name, job.compare} <= maps.keys():
            _write_agreement(job, maps[job.name], maps[job.compare], folder, outcome, pictures)
    return outcome


def _write_map(job: MapJob, ds: xr.Dataset, folder: Path, outcome: MapOutcome, pictures: bool) -> None:
    from saltus.results import save

    table = attractor_table(job.name, ds)
    outcome.tables.append(table)
    outcome.files += [save(ds, folder / f"{job.slug}.nc"), table.write_csv(folder / f"{job.slug}.csv")]
    if pictures:
        from saltus import plot

        with plot.style():
            axes = plot.basins(ds)
            axes.set_title(job.name, loc="left")
            outcome.files.append(_picture(axes.figure, folder / f"{job.slug}.png"))
            if ds.sizes["attractor"] > 0 and ds.attrs["method"] == "Taylor":
                figure = plot.gallery(ds, _motions(job, ds), attractors=list(range(min(ds.sizes["attractor"], GALLERY))))
                outcome.files.append(_picture(figure, folder / f"{job.slug}{ATTRACTORS}.png"))


def _write_agreement(job: MapJob, ds: xr.Dataset, other: xr.Dataset, folder: Path, outcome: MapOutcome, pictures: bool) -> None:
    from saltus.analysis import compare
    from saltus.results import save

    both = compare(other, ds).assign_attrs(name_a=str(job.compare), name_b=job.name)
    table = agreement_table(both)
    name = f"{job.slug}{AGREEMENT}"
    outcome.tables.append(table)
    outcome.files += [save(both, folder / f"{name}.nc"), table.write_csv(folder / f"{name}.csv")]
    if pictures:
        from saltus import plot

        with plot.style():
            outcome.files.append(_picture(plot.agreement(both)[0].figure, folder / f"{name}.png"))


def _motions(job: MapJob, ds: xr.Dataset) -> xr.Dataset:
    """A motion on each attractor, long enough for its picture."""
    from saltus.analysis import simulate

    system = job.plan.system
    start = {name: ds[f"attractor_{name}"].values[:, 0] for name in system.states}
    longest = max(int(ds["attractor_period"].max()), PERIODS)
    if system.forced_at is None:
        return simulate(system, start, t_end=longest * (job.plan.every or 1.0), progress=False)
    return simulate(system, start, periods=longest, time_errors="local", progress=False)


def _picture(figure: object, file: Path) -> Path:
    import matplotlib.pyplot as plt

    with replacing(file) as (part,):
        figure.savefig(part, dpi=150, format=file.suffix[1:])  # type: ignore[attr-defined]
    plt.close("all")
    return file


def statuses(folder: Path) -> list[StoreStatus]:
    """How far the stores of a study's output folder are, or a store itself. Raises StudyError if there are none."""
    from saltus.results.store import Store

    found = [folder] if (folder / "store.json").exists() else sorted(path.parent for path in (folder / STORES).glob("*/store.json"))
    if not found:
        raise StudyError(f"{folder} holds no store. Give the output folder of a study of basins, such as saltus-runs/fig6b.")
    return [Store.open(path).status() for path in found]


def status_table(found: list[StoreStatus]) -> TextTable:
    """A row for each store."""
    rows = tuple(
        (
            str(one.note.get("name", one.path.name)),
            f"{one.done} of {one.total}", f"{100 * one.done / max(one.total, 1):.0f} %", str(one.damaged),
            f"{one.bytes / 1e6:.1f}", one.last_written.strftime("%Y-%m-%d %H:%M:%S UTC") if one.last_written else "never",
            ", ".join(one.writers) or "-",
        )
        for one in found
    )  # fmt: skip
    columns = ("map", "chunks", "done", "damaged", "MB", "last written", "at work")
    return TextTable("Maps", columns, rows)


def copy_of(folder: Path) -> Path:
    """The study in an output folder. Raises StudyError if there is none."""
    if not (folder / COPY).is_file():
        raise StudyError(f"{folder} holds no {COPY}: it isn't the output folder of a study. Run the study again with --out {folder}.")
    return folder / COPY
