"""What Lyapunov exponents have to say, as a table: a row for each motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from saltus.results.schema import kind_text
from saltus.study.table import ROWS, TextTable

if TYPE_CHECKING:
    import xarray as xr

#: Exponents that get a column of their own.
COLUMNS = 4


def exponent_table(title: str, ds: xr.Dataset) -> TextTable:
    """A row for each trajectory: kind of motion, exponents, interval of the largest, their sum beside the mean divergence."""
    unit = ds["lyapunov_exponent"].attrs.get("units", "")
    shown, several = min(ds.sizes["exponent"], COLUMNS), ds.sizes["exponent"] > 1 and "mean_divergence" in ds
    rows = []
    for i in range(min(ds.sizes["trajectory"], ROWS)):
        one = ds.isel(trajectory=i)
        exponents = [f"{value:.6g}" for value in one["lyapunov_exponent"].values[:shown]]
        interval = f"{float(one['lyapunov_low'][0]):.6g} to {float(one['lyapunov_high'][0]):.6g}"
        sums = [f"{float(one[name]):.6g}" for name in ("exponent_sum", "mean_divergence")] if several else []
        near = {0: "", 1: "near a graze"}[int(one["near_graze"])] if "near_graze" in one else ""
        kind = kind_text(str(one["kind"].item()), int(one["response_period"]) if "response_period" in one else 0)
        rows.append((str(i), kind, *exponents, interval, *sums, near))
    columns = ("", "motion", *(f"exponent {k + 1} [{unit}]" for k in range(shown)), "95 % interval of the largest",
               *(("sum", "mean divergence") if several else ()), "")  # fmt: skip
    return TextTable(title, columns, tuple(rows), _notes(ds, len(rows)))


def _notes(ds: xr.Dataset, shown: int) -> tuple[str, ...]:
    notes = [f"{ds.sizes['trajectory'] - shown} more motions are in the file."] if ds.sizes["trajectory"] > shown else []
    if "near_graze" in ds and np.any(ds["near_graze"].values == 1):
        notes.append("Near a graze finite deviations don't grow as infinitesimal ones do: the exponents tell less there.")
    if "mean_divergence" in ds and ds.sizes["exponent"] > 1:
        notes.append("The sum of the exponents and the mean divergence, found without the tangent, must agree.")
    return tuple(notes)
