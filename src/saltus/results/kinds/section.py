"""Result of ``poincare``: crossings of a surface."""

from __future__ import annotations

import numpy as np
import xarray as xr

from saltus.results.dataset.schema import ResultKind, told_of
from saltus.results.dataset.variable import ENDINGS, GUARDS, SHARED, Variable
from saltus.results.table import (
    Column,
    TextTable,
    left_out,
    number,
    of_trajectory,
    quantity,
    table,
    words,
)
from saltus.results.wording import failed, unit_of

_CROSSING = ("crossing",)

#: Variables of the result of ``poincare``. Crossings are one table for all trajectories.
VARIABLES = {
    "<state>": Variable(_CROSSING, "<state>", "<state> at the crossing"),
    "crossing_time": Variable(_CROSSING, "s", "time of the crossing"),
    "crossing_time_error": Variable(
        _CROSSING, "s", "error of that time by the step that holds the crossing"
    ),
    "crossing_period": Variable(
        _CROSSING, "1", "whole forcing periods from the start to the crossing", "i8"
    ),
    "crossing_phase": Variable(_CROSSING, "1", "phase of the forcing at the crossing, t/T mod 1"),
    "crossing_direction": Variable(
        _CROSSING, "1", "+1 where the surface's function rises, -1 where it falls", "i1"
    ),
    "crossing_rate": Variable(
        _CROSSING, "<surface rate>", "rate of the surface's function at the crossing"
    ),
    "crossing_kind": Variable(_CROSSING, "", "kind of crossing", "str"),
    "crossing_trajectory": Variable(
        _CROSSING, "1", "trajectory that the crossing belongs to", "i8"
    ),
    "crossings": Variable(("trajectory",), "1", "crossings that were kept", "i8"),
    "tangencies": Variable(("trajectory",), "1", "touches of the surface without a crossing", "i8"),
    "contacts": Variable(("trajectory",), "1", "contacts of the system itself meanwhile", "i8"),
    **ENDINGS,
    **GUARDS,
    **SHARED,
}


def account(ds: xr.Dataset) -> list[str]:
    """Lines on the surface, and on its crossings."""
    directions = {0: "both ways", 1: "upwards", -1: "downwards"}[int(ds.attrs["direction"])]
    return [f"surface  {ds.attrs['surface']}, {directions}", f"found    {_totals(ds)}"]


def rows(title: str, ds: xr.Dataset) -> list[TextTable]:
    """A row for each crossing, sorted by trajectory and time."""
    up = ds["crossing_direction"].values.tolist()
    columns = of_trajectory(ds, "crossing_trajectory")
    columns.append(number("time", ds["crossing_time"].values, ".10g", "s"))
    if "crossing_phase" in ds and np.isfinite(ds["crossing_phase"].values).any():
        columns.append(number("phase of the forcing", ds["crossing_phase"].values, ".8f"))
    columns += [quantity(name, ds[name].values, unit_of(ds[name]), 8) for name in told_of(ds)]
    columns += [
        Column("direction", lambda i: "up" if up[i] > 0 else "down", {"direction": up}),
        words("kind", ds["crossing_kind"].values.astype(str)),
    ]
    notes = [f"Surface {ds.attrs['surface']}: {_totals(ds)}."]
    notes += left_out(ds.sizes["crossing"], "crossings")
    return [table(title, columns, [*notes, *failed(ds)])]


def _totals(ds: xr.Dataset) -> str:
    """``58 crossings, 0 tangencies, 109 contacts``."""
    return ", ".join(
        f"{int(ds[name].sum())} {name}" for name in ("crossings", "tangencies", "contacts")
    )


KIND = ResultKind("sl.poincare", VARIABLES, ("<state>", "crossing_time", "status"), account, rows)
