"""[basins]: which attractor each start of a grid leads to; one map, or several and where they agree."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import Field, model_validator

from saltus.fence import MOST_COUNT
from saltus.study.kept import save_picture
from saltus.study.questions.question import Question
from saltus.study.running import Outcome, Running
from saltus.study.spec_parts import PERIODS as FOLLOWED
from saltus.study.spec_parts import FileTitle, Method, Quantity, Range, Table

if TYPE_CHECKING:
    import xarray as xr

    from saltus.results.store import Store
    from saltus.study.maps import MapJob
    from saltus.study.setting import Setting

#: Trajectories of attractors drawn in a gallery, and the periods of one that never repeats.
GALLERY, PERIODS = 8, 24
#: Ends of the names of files that belong to a map.
ATTRACTORS, AGREEMENT = "-attractors", "-agreement"


class Axis(Range):
    """An axis of a basin map: starts from one value to another, ends included, or given one by one."""

    first: Quantity | None = Field(None, description="The first start.", examples=["-5 mm"])
    last: Quantity | None = Field(None, description="The last start.", examples=["5 mm"])
    count: int | None = Field(None, ge=2, le=MOST_COUNT, description="How many starts.", examples=[400])
    values: list[Quantity] | None = Field(None, min_length=2, description="The starts themselves, ascending.", examples=[["-1 mm", "1 mm"]])


class Map(Table):
    """[[basins.map]]: one of the maps of a study, with what sets it apart from the others."""

    name: FileTitle = Field(description="What it is called in tables, pictures and file names.", examples=["exact, 25.5 kN/m"])
    method: Method | None = Field(None, description="How to integrate; the study's [method] by default.", examples=[{"name": "Taylor"}])
    values: dict[str, Quantity] = Field(
        default_factory=dict, description="Values that differ from [system].", examples=[{"contact_stiffness": "25.5 kN/m"}]
    )
    compare: str | None = Field(None, description="The name of another map to set beside this one, cell by cell.", examples=["exact"])


class Basins(Table):
    """[basins]: which attractor each start of a grid leads to."""

    axes: dict[str, Axis] = Field(
        description="The two states that the map is drawn over.",
        examples=[{"x": {"first": "-5 mm", "last": "5 mm", "count": 400}, "v": {"first": "-1 m/s", "last": "1 m/s", "count": 400}}],
    )  # fmt: skip
    at: dict[str, Quantity] = Field(default_factory=dict, description="Starts of the other states; 0 by default.", examples=[{"y": "0 mm"}])
    periods: int = FOLLOWED
    every: Quantity | None = Field(None, description="Time between two looks, for a system without forcing.", examples=["1 s"])
    map: list[Map] = Field(default_factory=list, description="Several maps of one study.", examples=[[{"name": "exact"}]])

    @model_validator(mode="after")
    def _fits(self) -> Basins:
        if len(self.axes) != 2:
            raise ValueError(f"a map has two axes, such as axes.x and axes.v, not {len(self.axes)}")
        names = [one.name for one in self.map]
        if len(set(names)) < len(names):
            raise ValueError("two maps have the same name")
        for one in self.map:
            if one.compare is not None and (one.compare not in names or one.compare == one.name):
                raise ValueError(f"map {one.name!r} is compared with {one.compare!r}, which is no other map of this study")
        return self


# -- the question --------------------------------------------------------------------------------------------------------------
def questions(table: Basins, setting: Setting) -> list[Question]:
    """The question that the table asks: all its maps.

    Raises
    ------
    StudyError, UnitError, ParameterError
        If a map doesn't fit the system.
    """
    from saltus.study.maps import jobs_of_setting

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
        from saltus.study.maps import open_store

        self._stores = {job.name: open_store(job, folder) for job in self.jobs}

    def answer(self, at: Running) -> Outcome:
        """Compute or resume each map, then its Dataset, table and pictures; then where maps agree."""
        from saltus.study.maps import compute, finish

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
        from saltus.study.questions.basins_table import attractor_table

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
        from saltus.study.questions.basins_table import agreement_table

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
