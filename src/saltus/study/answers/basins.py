"""[basins]: which attractor each start of a grid leads to; one map, or several and where they agree."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from saltus.study.answers.question import Question
from saltus.study.run.kept import save_picture
from saltus.study.run.running import Outcome, Running
from saltus.study.tables.basins import Basins

if TYPE_CHECKING:
    import xarray as xr

    from saltus.results.store.store import Store
    from saltus.study.run.maps import MapJob
    from saltus.study.setting.setting import Setting

#: Trajectories of attractors drawn in a gallery, and the periods of one that never repeats.
GALLERY, PERIODS = 8, 24
#: Ends of the names of files that belong to a map.
ATTRACTORS, AGREEMENT = "-attractors", "-agreement"


# -- the question --------------------------------------------------------------------------------------------------------------
def questions(table: Basins, setting: Setting) -> list[Question]:
    """The question that the table asks: all its maps.

    Raises
    ------
    StudyError, UnitError, ParameterError
        If a map doesn't fit the system.
    """
    from saltus.study.run.maps import jobs_of_setting

    return [Maps(setting.study.study.name, jobs_of_setting(table, setting))]


class Maps(Question):
    """The maps of a study, each in a store of its own that survives anything."""

    shared = True

    def __init__(self, title: str, jobs: list[MapJob]) -> None:
        self.title, self.jobs = title, jobs
        self.stems = tuple(f"{job.slug}{end}" for job in jobs for end in ("", ATTRACTORS, *([AGREEMENT] if job.compare else [])))
        self._stores: dict[str, Store] = {}

    def prepare(self, folder: Path) -> None:
        """Open or make the stores. Raises StoreError if one was made from something else: names what differs."""
        from saltus.study.run.maps import open_store

        self._stores = {job.name: open_store(job, folder) for job in self.jobs}

    def answer(self, at: Running) -> Outcome:
        """Compute or resume each map, then its Dataset, table and pictures; then where maps agree."""
        from saltus.study.run.maps import compute, finish

        outcome, maps = Outcome(), {}
        for job in self.jobs:
            store = self._stores[job.name]
            if not compute(job, store, at.resources, at.report, at.say):
                outcome.waiting.append(job.name)
                continue
            ds = finish(job, store, at.resources.threads).assign_attrs(study=at.text, title=job.name)
            maps[job.name] = ds
            self._write_map(job, ds, at.folder, outcome, at.pictures)
        for job in self.jobs:
            if job.compare is not None and {job.name, job.compare} <= maps.keys():
                self._write_agreement(job, maps[job.name], maps[job.compare], at.folder, outcome, at.pictures)
        return outcome

    def _write_map(self, job: MapJob, ds: xr.Dataset, folder: Path, outcome: Outcome, pictures: bool) -> None:
        from saltus.results import save
        from saltus.study.answers.basins_table import attractor_table

        table = attractor_table(job.name, ds)
        outcome.tables.append(table)
        outcome.files += [save(ds, folder / f"{job.slug}.nc"), self.write_table(table, folder / f"{job.slug}.csv")]
        if pictures:
            from saltus import plot

            with plot.style():
                axes = plot.basins(ds)
                axes.set_title(": ".join(filter(None, (job.name, axes.get_title("left")))), loc="left")
                outcome.files.append(save_picture(axes.figure, folder / f"{job.slug}.png"))
                if ds.sizes["attractor"] > 0 and ds.attrs["method"] == "Taylor":
                    figure = plot.gallery(ds, _motions(job, ds), attractors=list(range(min(ds.sizes["attractor"], GALLERY))))
                    outcome.files.append(save_picture(figure, folder / f"{job.slug}{ATTRACTORS}.png"))

    def _write_agreement(self, job: MapJob, ds: xr.Dataset, other: xr.Dataset, folder: Path, outcome: Outcome, pictures: bool) -> None:
        from saltus.analysis.basins.compare import compare
        from saltus.results import save
        from saltus.study.answers.basins_table import agreement_table

        both = compare(other, ds).assign_attrs(name_a=str(job.compare), name_b=job.name)
        table = agreement_table(both)
        name = f"{job.slug}{AGREEMENT}"
        outcome.tables.append(table)
        outcome.files += [save(both, folder / f"{name}.nc"), self.write_table(table, folder / f"{name}.csv")]
        if pictures:
            from saltus import plot

            with plot.style():
                outcome.files.append(save_picture(plot.agreement(both)[0].figure, folder / f"{name}.png"))


def _motions(job: MapJob, ds: xr.Dataset) -> xr.Dataset:
    """A motion on each attractor, long enough for its picture."""
    from saltus.analysis.motion.simulate import simulate

    system = job.plan.system
    start = {name: ds[f"attractor_{name}"].values[:, 0] for name in system.states}
    longest = max(int(ds["attractor_period"].max()), PERIODS)
    if system.forced_at is None:
        return simulate(system, start, t_end=longest * (job.plan.every or 1.0), progress=False)
    return simulate(system, start, periods=longest, time_errors="local", progress=False)
