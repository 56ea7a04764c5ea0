"""The periodic orbits that a result holds, as what another question begins with."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.inputs.spans import Span, span
from saltus.analysis.inputs.starts import Ensemble
from saltus.errors import ParameterError, shown
from saltus.results.dataset import schema
from saltus.system import System

#: Names of what a Dataset knows of its orbits: points, period, limit cycles' time.
PREFIX = {
    schema.RESPONSES: "response", schema.ATTRACTORS: "attractor", schema.BASINS: "attractor",
    schema.ORBITS: "orbit",
}  # fmt: skip
#: Names of the variables that hold their points.
NAMES = {
    "response": schema.response_name,
    "attractor": schema.attractor_name,
    "orbit": schema.orbit_name,
    "point": schema.point_name,
}


def check_equations(system: System, found: xr.Dataset) -> None:
    """Raise a ParameterError if a Dataset is of other equations."""
    if found.attrs.get("fingerprint") != system.fingerprint():
        raise ParameterError(
            f"start= holds orbits of {found.attrs.get('system')}, whose equations are others than "
            f"those of {system.name}."
        )


def given_orbits(system: System, found: xr.Dataset) -> tuple[Ensemble, Span]:
    """The first points of the orbits of a Dataset with their values, and a period of each; of
    forced orbits all last as many forcing periods.

    Raises
    ------
    ParameterError
        If the Dataset is of another system or kind, holds no orbit, orbits of several periods, or
        more than one limit cycle.
    """
    prefix = {**PREFIX, schema.BRANCHES: "point"}.get(schema.kind_of(found))
    if prefix is None:
        raise ParameterError(
            "start= takes orbits that sl.periodic_orbits, sl.attractors, sl.frequency_response, "
            f"sl.bifurcation_diagram or sl.branches found, or starts, not {shown(found)[:60]}."
        )
    check_equations(system, found)
    batch = prefix in found.dims
    names = [NAMES[prefix](name) for name in (*system.states, *system.values)]
    lasting = [f"{prefix}_cycle", f"{prefix}_period"]
    mine = found[[name for name in (*names, *lasting) if name in found]].reset_coords()
    mine = mine if batch else mine.drop_vars(prefix, errors="ignore").expand_dims(prefix)
    mine = mine.transpose(prefix, ...)
    points = np.stack([mine[name].values for name in names[: len(system.states)]], axis=2)
    counts, time = _lasting(system, mine, prefix, points)
    if not len(counts) or (counts < 1).any():
        raise ParameterError(
            "start= holds motions that don't repeat: only periodic orbits have derivatives. Choose "
            f"some that do: found.sel({prefix}=0)."
        )
    if np.ptp(counts) > 0 or (system.forced_at is None and len(counts) > 1):
        raise ParameterError(
            "start= holds orbits of several periods. Choose one, or some of one period: "
            f"found.sel({prefix}=0)."
        )
    known = {**system.values, **json.loads(found.attrs.get("parameters", "{}"))}
    columns = {
        name: mine[own].values if own in mine else np.full(len(counts), np.nan)
        for name, own in zip(system.values, names[len(system.states) :], strict=True)
    }
    columns = {
        name: np.where(np.isfinite(column), column, known[name]) for name, column in columns.items()
    }
    group = Ensemble.of(points[:, 0], columns, batch)
    if system.forced_at is None:
        return group, Span.of_cycles(time)
    return group, span(system, group, int(counts[0]), None, 0.0)


def _lasting(
    system: System, mine: Any, prefix: str, points: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Forcing periods after which each repeats, of a limit cycle 1, 0 where it doesn't repeat; and
    the time [s] of limit cycles.
    """
    finite = np.isfinite(points).all(axis=2).sum(axis=1)
    if system.forced_at is None:
        name = f"{prefix}_cycle" if f"{prefix}_cycle" in mine else f"{prefix}_period"
        time = np.asarray(mine[name].values, float)
        return np.where((time > 0) & (finite > 0), 1, 0), time
    if prefix == "point":
        return finite, np.full(len(finite), np.nan)
    periods = mine[f"{prefix}_period"].values
    return np.where(finite >= periods, periods, 0), np.full(len(finite), np.nan)
