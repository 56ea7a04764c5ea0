"""The first view of a study, or of its results: its system, values, axes, and what is computed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.attractors.aperiodic import SampledMotion
from saltus.analysis.attractors.attractor_set import AttractorSet
from saltus.analysis.basins.labels import Settling
from saltus.analysis.basins.pipeline import basin_plan
from saltus.analysis.closed.capture import Neighbourhoods
from saltus.analysis.closed.motions import ClosedMotion
from saltus.errors import SaltusError
from saltus.explore.desk import Desk
from saltus.explore.map import KeptMap
from saltus.explore.opening import Opening, first_quantity, opening_of
from saltus.explore.questions import MOST_PERIODS
from saltus.kernels import status as st
from saltus.results import load
from saltus.results.dataset import schema
from saltus.study.ask import questions_of
from saltus.study.read import read
from saltus.study.run.copies import copy_of, inputs_of
from saltus.study.setting.inputs import Inputs
from saltus.study.setting.setting import Setting, setting_of
from saltus.study.tables.study import Study
from saltus.system import System
from saltus.units import to_si

#: Starts of a map whose attractors come from a finished map: as many as can be.
_EVERY = 2**30


def opening_of_study(path: Path, own: System | None = None) -> Opening:
    """The opening of a study file: nothing is computed that wasn't asked for.

    Parameters
    ----------
    path : Path
        The TOML file.
    own : System, optional
        The system, if the study names none.

    Raises
    ------
    StudyError, UnitError, ParameterError
        If it isn't a study, or doesn't fit its system.
    """
    study, _ = read(path)
    return _opening(study, setting_of(study, own, Inputs(path.parent)))


def desk_of_results(folder: Path, own: System | None = None, threads: int | None = None) -> Desk:
    """The desk of a finished study: its maps and branches are there at once.

    Raises
    ------
    StudyError, UnitError, ParameterError, ResultFileError
        If the folder isn't the output of a study, or a result in it is damaged.
    """
    study, text = read(copy_of(folder))
    inputs = inputs_of(folder, text)
    stems = [stem for one in questions_of(study, own, inputs) for stem in one.stems]
    files = {stem: folder / f"{stem}.nc" for stem in stems}
    results = {stem: load(file) for stem, file in files.items() if file.is_file()}
    opening = _opening(study, setting_of(study, own, inputs), results)
    desk = Desk(opening, threads)
    for ds in results.values():
        _give(desk, ds)
    return desk


def _opening(
    study: Study, setting: Setting, results: Mapping[str, xr.Dataset] | None = None
) -> Opening:
    system = setting.base
    asked: dict[str, Any] = dict(study.questions())
    known: dict[str, Any] = {"results": results or {}, "responses": _responses(asked, system)}
    known["system_table"] = study.system.model_dump(exclude_unset=True)
    view: dict[str, Any] = {}
    if (map_ := asked.get("basins")) is not None:
        axes = {name: _ends(system, name, axis) for name, axis in map_.axes.items()}
        known["axes"] = {name: (low, high) for name, (low, high, _) in axes.items()}
        known["size"] = tuple(count for _, _, count in axes.values())
        known["at"] = {
            name: to_si(value, system.units[name], name) for name, value in map_.at.items()
        }
        view["map"] = {"periods": map_.periods}
    if (motion := asked.get("simulate")) is not None:
        known["start"] = _start(system, motion.start)
        if isinstance(motion.periods, int):
            view["motion"] = {"periods": motion.periods}
    found = opening_of(system, setting.method(None, "method"), view=view, **known)
    if motion is None or motion.t_end is None or isinstance(motion.t_end, list):
        return found
    turns = math.ceil(to_si(motion.t_end, "s", "t_end") / found.turn * (1 - 1e-9))
    return replace(found, view={**view, "motion": {"periods": min(max(turns, 1), MOST_PERIODS)}})


def _ends(system: System, name: str, axis: Any) -> tuple[float, float, int]:
    """First and last start of an axis of a map [SI], and their number."""
    given = axis.values or [axis.first, axis.last]
    low, high = (to_si(one, _unit(system, name), name) for one in (given[0], given[-1]))
    return low, high, len(given) if axis.values else axis.count


def _unit(system: System, name: str) -> str:
    outputs = dict(zip(system.outputs.names, system.outputs.units, strict=True))
    return str(system.units.get(name, "") if name in system.states else outputs.get(name, ""))


def _start(system: System, start: Any) -> dict[str, float] | None:
    """The first start of a study's motion [SI]; None if it gives none."""
    if not isinstance(start, Mapping):
        return None
    first = {name: one[0] if isinstance(one, list) else one for name, one in start.items()}
    with suppress(SaltusError, TypeError):  # a range of starts, or what only a batch can be
        return {name: to_si(one, _unit(system, name), name) for name, one in first.items()}
    return None


def _responses(asked: Mapping[str, Any], system: System) -> dict[str, Any] | None:
    """The parameter and the range of the first responses that a study asks for."""
    first = first_quantity(system)
    for name, low, high in _ranges(asked):
        ends = [to_si(one, system.units[name], name) for one in (low, high)]
        return {"parameter": name, "range": ends, "quantity": first}
    return None


def _ranges(asked: Mapping[str, Any]) -> Iterator[tuple[str, Any, Any]]:
    if (branches := asked.get("branches")) is not None:
        for name, ends in branches.vary.items():
            yield (name, *(tuple(ends) if isinstance(ends, list | tuple) else _of(ends)))
    if (responses := asked.get("frequency_response")) is not None:
        yield ("frequency", *_of(responses.frequency))
    if (diagram := asked.get("bifurcation_diagram")) is not None:
        for name, values in diagram.vary.items():
            yield (name, *_of(values))


def _of(values: Any) -> tuple[Any, Any]:
    given = getattr(values, "values", None)
    return (given[0], given[-1]) if given else (values.first, values.last)


# -- results ---------------------------------------------------------------------------------------
def _give(desk: Desk, ds: xr.Dataset) -> None:
    """Give a desk what a result knows."""
    kind = schema.kind_of(ds)
    if ds.attrs.get("fingerprint") != desk.opening.system.fingerprint():
        return
    if kind == schema.BASINS:
        _give_map(desk, ds)
    elif kind == schema.BRANCHES:
        desk.keep_responses(ds)


def _give_map(desk: Desk, ds: xr.Dataset) -> None:
    opening, system = desk.opening, desk.opening.system
    axes = {str(name): ds[name].values for name in ds["basin"].dims}
    grid = {name: (one[0], one[-1], len(one)) for name, one in axes.items()}
    plan = basin_plan(system, grid, opening.at, opening.method, int(ds.attrs["periods"]), None)
    legend = desk.legend_at(plan)
    names = [schema.attractor_name(name) for name in system.states]
    points = np.stack([ds[name].values for name in names], axis=2)
    found = AttractorSet(Neighbourhoods.none(len(system.states)))
    for i, kind in enumerate(ds["attractor_type"].values.tolist()):
        own = points[i][np.isfinite(points[i]).all(axis=1)]
        if kind in ("periodic", "equilibrium"):
            both = (
                ds["attractor_multiplier_real"].values[i]
                + 1j * (ds["attractor_multiplier_imag"].values[i])
            )
            found.add(legend.map, ClosedMotion(own, both, 0.0), plan.scale)
        else:
            exponent = float(ds["attractor_exponent"][i]) * float(legend.map.period[0])
            found.sampled.append(SampledMotion(kind, exponent, 0.0, own, plan.scale))
    legend.grow(found)
    legend.scouts = _EVERY
    codes = {name: code for code, (name, _) in st.STATUS.items()}
    status = ds["status"].values.ravel()
    if status.dtype.kind == "U":
        status = np.vectorize(codes.get)(status)
    cells = plan.cells
    result = Settling(
        np.nan_to_num(ds["basin"].values, nan=-4).astype(np.int64).ravel(),
        ds["periods_to_settle"].values.astype(np.int64).ravel(),
        status.astype(np.int64),
        ds["grazes_unresolved"].values.astype(np.int64).ravel(),
        np.full((cells, len(system.states)), np.nan),
    )
    desk.maps.put(KeptMap(plan, result, found, ds))
