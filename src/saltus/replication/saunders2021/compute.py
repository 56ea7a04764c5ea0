"""What the jobs compute: functions from settings and other jobs' Datasets to a Dataset.

Each job runs on one thread; several run at a time.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.analysis.basins.attractors import attractors
from saltus.analysis.basins.basins import label_all
from saltus.analysis.basins.labels import Settling
from saltus.analysis.dataset_parts import gap_unit, provenance
from saltus.analysis.lyapunov.lyapunov import lyapunov
from saltus.analysis.motion.simulate import simulate
from saltus.analysis.motion.stroboscope import stroboscope
from saltus.analysis.orbits.capture import Neighbourhoods
from saltus.analysis.orbits.found import Found
from saltus.analysis.orbits.orbits import Orbit, find_orbits, same
from saltus.analysis.orbits.portrait import portraits
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import Method
from saltus.replication.job import Show
from saltus.results import attractors_dataset
from saltus.study.run.maps import jobs_of
from saltus.study.setting import quantities
from saltus.study.setting.setting import method_of, system_of
from saltus.study.tables.parts import METHODS
from saltus.study.tables.spec import Study

if TYPE_CHECKING:
    import xarray as xr

    from saltus.system import System

Settings = Mapping[str, Any]
Inputs = Mapping[str, "xr.Dataset"]

#: Share of the progress that the search for attractors takes.
SCOUTING = 0.3
#: Distance [in ranges of the axes] within which two orbits are one.
SAME = 1e-5


def study_of(settings: Settings) -> Study:
    """The study in a job's settings."""
    return Study.model_validate({"study": {"name": "job"}, **settings["study"]})


def method_in(settings: Settings) -> Method:
    """The method in a job's settings."""
    table = settings["method"]
    method: Method = method_of(METHODS[table["name"]].model_validate(table))
    return method


def _system(settings: Settings, study: Study) -> System:
    system = system_of(study.system)
    return system.with_values(**quantities.parameters(system, settings.get("values", {})))


# -- motions -------------------------------------------------------------------------------------------------------------------
def simulated(settings: Settings, inputs: Inputs, show: Show) -> xr.Dataset:  # noqa: ARG001  (all jobs are called alike)
    """The motions of [simulate] by the method of the settings."""
    study = study_of(settings)
    table, system = study.simulate, _system(settings, study)
    assert table is not None
    t_end = None if table.t_end is None else quantities.number(table.t_end, "s", "simulate", "t_end")
    return simulate(
        system, quantities.start_or_rest(system, table.start, "simulate"), table.periods, t_end, method=method_in(settings), samples=table.samples,
        keep=table.keep, values=quantities.varied(system, table.values), time_errors="local", threads=1, progress=show,
    )  # fmt: skip


def beside(settings: Settings, inputs: Inputs, show: Show) -> xr.Dataset:  # noqa: ARG001
    """The stroboscopes of starts spread evenly over some distance to either side of each start of [simulate]."""
    study = study_of(settings)
    table, system = study.simulate, _system(settings, study)
    assert table is not None
    start = {name: np.atleast_1d(value) for name, value in quantities.start_or_rest(system, table.start, "simulate").items()}
    offsets = settings["distance"] * np.linspace(-1.0, 1.0, settings["count"])
    first, second = system.states
    x = (start[first][:, None] + offsets).ravel()
    v = np.repeat(np.broadcast_to(start[second], start[first].shape), len(offsets))
    return stroboscope(
        system, {first: x, second: v}, table.periods or 1, settings["keep"], method=method_in(settings), threads=1, progress=show
    )


def on_attractors(settings: Settings, inputs: Inputs, show: Show) -> xr.Dataset:
    """A motion on each attractor of a map, by the map's own method: trajectory i starts on attractor i."""
    (found,) = inputs.values()
    study = study_of(settings)
    system = _system(settings, study)
    start = {name: found[f"attractor_{name}"].values[:, 0] for name in system.states}
    return simulate(
        system, start, settings["periods"], method=method_in(settings), keep=settings["keep"], time_errors="local", threads=1, progress=show
    )


def exponents_on_attractors(settings: Settings, inputs: Inputs, show: Show) -> xr.Dataset:
    """Lyapunov exponents on each attractor of a map, by the map's own way of integrating: trajectory i starts on attractor i."""
    (found,) = inputs.values()
    system = _system(settings, study_of(settings))
    start = {name: found[f"attractor_{name}"].values[:, 0] for name in system.states}
    return lyapunov(
        system, start, method=settings["by"], flow=method_in(settings), periods=settings["periods"], transient=settings["transient"],
        threads=1, progress=show,
    )  # fmt: skip


# -- attractors ----------------------------------------------------------------------------------------------------------------
def settled_from(settings: Settings, inputs: Inputs, show: Show) -> xr.Dataset:  # noqa: ARG001
    """The attractors that the starts of [simulate] lead to."""
    study = study_of(settings)
    system = _system(settings, study)
    assert study.simulate is not None
    start = quantities.start_or_rest(system, study.simulate.start, "simulate")
    return attractors(system, start, method=method_in(settings), threads=1, progress=show)


def settled_from_motion(settings: Settings, inputs: Inputs, show: Show) -> xr.Dataset:
    """The attractors at other values that the states along the last period of another job's first trajectory lead to."""
    (run,) = inputs.values()
    study = study_of(settings)
    system = _system(settings, study)
    one = run.isel(trajectory=0) if "trajectory" in run.dims else run
    dim = one[system.states[0]].dims[0]
    last = one.isel({dim: slice(-201, -1)})
    start = {name: last[name].values for name in system.states}
    return attractors(system, start, method=method_in(settings), threads=1, progress=show)


def settled_from_rare(settings: Settings, inputs: Inputs, show: Show) -> xr.Dataset:
    """The attractors that the cells of a map's rarest basins, and the cells around them, lead to by some method."""
    (map_,) = inputs.values()
    study = study_of(settings)
    system = _system(settings, study)
    rare = np.flatnonzero(map_["attractor_fraction"].values < settings["rarer_than"])
    cells = np.isin(map_["basin"].values, rare)
    near = np.zeros_like(cells)
    for i, j in np.argwhere(cells):
        near[max(i - 1, 0) : i + 2, max(j - 1, 0) : j + 2] = True
    rows, columns = np.nonzero(near) if near.any() else (np.array([0]), np.array([0]))
    first, second = map_["basin"].dims
    start = {str(first): map_[first].values[rows], str(second): map_[second].values[columns]}
    return attractors(system, start, method=method_in(settings), threads=1, progress=show)


def halved(settings: Settings, inputs: Inputs, show: Show) -> xr.Dataset:  # noqa: ARG001
    """Each attractor of even period with the orbit of half its period that lies within it: what it doubled from."""
    (found,) = inputs.values()
    study = study_of(settings)
    system = _system(settings, study)
    map_ = Stroboscope(system, method_in(settings), threads=1)
    points = np.stack([found[f"attractor_{name}"].values for name in system.states], axis=-1)
    scale = np.nanmax(points, axis=(0, 1)) - np.nanmin(points, axis=(0, 1))
    near: list[tuple[np.ndarray, int]] = []
    for i, n in enumerate(found["attractor_period"].values.tolist()):
        if n >= 2 and n % 2 == 0:
            near += [(points[i, 0], n), (0.5 * (points[i, 0] + points[i, n // 2]), n // 2)]
    start, n = np.array([one for one, _ in near]).reshape(-1, len(scale)), np.array([n for _, n in near], np.int64)
    closed = find_orbits(map_, start, n, np.broadcast_to(scale, start.shape), np.full(len(n), map_.noise))
    orbits: list[Orbit] = []
    for orbit in closed.rows(closed.period > 0):
        if not any(same(orbit, one, scale, SAME) and orbit.period == one.period for one in orbits):
            orbits.append(orbit)
    table = portraits(map_, Found(Neighbourhoods.none(len(system.states)), orbits))
    return attractors_dataset(
        states=system.states, units=system.units, attractors=table, gap_unit=gap_unit(system),
        attrs=provenance(system, map_.method, system.values),
    )  # fmt: skip


# -- basins --------------------------------------------------------------------------------------------------------------------
def mapped(settings: Settings, inputs: Inputs, show: Show) -> xr.Dataset:  # noqa: ARG001
    """The basin map of the settings, a study with one map."""
    (job,) = jobs_of(study_of(settings))
    plan = replace(job.plan, scouts=settings["scouts"])
    found = plan.scout(1, lambda share: show(SCOUTING * share))
    result = Settling.empty(plan.cells, len(plan.system.states))
    label_all(
        plan, found, range(plan.chunks), lambda i, part: result.put(plan.cells_of(i), part), 1,
        lambda share: show(SCOUTING + (1.0 - SCOUTING) * share),
    )  # fmt: skip
    return plan.finish(result, found, 1)
