"""What Lyapunov exponents have to say, as a table: a row for each motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from saltus.results.dataset.schema import kind_text
from saltus.results.wording import unit_of
from saltus.study.table import TextTable, interval, left_out, number, table, varied, words

if TYPE_CHECKING:
    import xarray as xr

#: Exponents that get a column of their own.
COLUMNS = 4
#: Sum of the exponents, and the mean divergence that it must equal.
_SUMS = {"sum": "exponent_sum", "mean divergence": "mean_divergence"}


def exponent_table(title: str, ds: xr.Dataset) -> TextTable:
    """A row for each trajectory: kind of motion, exponents, interval of the largest, their sum,
    mean divergence.
    """
    unit = unit_of(ds["lyapunov_exponent"])
    count, shown = ds.sizes["trajectory"], min(ds.sizes["exponent"], COLUMNS)
    periods = ds["response_period"].values.tolist() if "response_period" in ds else [0] * count
    kinds = [
        kind_text(str(kind), int(n)) for kind, n in zip(ds["kind"].values, periods, strict=True)
    ]
    columns = [
        words("", range(count), "trajectory"),
        *varied(ds, ds["trajectory"].values),
        words("motion", kinds),
    ]
    columns += [
        number(f"exponent {k + 1}", ds["lyapunov_exponent"].values[:, k], ".6g", unit)
        for k in range(shown)
    ]
    low, high = (ds[name].values[:, 0] for name in ("lyapunov_low", "lyapunov_high"))
    columns.append(interval("95 % interval of the largest", low, high, "{:.6g}".format, unit))
    if ds.sizes["exponent"] > 1 and "mean_divergence" in ds:
        columns += [number(label, ds[name].values, ".6g", unit) for label, name in _SUMS.items()]
    near = ds["near_graze"].values if "near_graze" in ds else np.zeros(count, dtype=np.int64)
    columns.append(words("", ["near a graze" if one else "" for one in near], "near a graze"))
    return table(title, columns, _notes(ds))


def _notes(ds: xr.Dataset) -> tuple[str, ...]:
    notes = left_out(ds.sizes["trajectory"], "motions")
    if "near_graze" in ds and np.any(ds["near_graze"].values == 1):
        notes.append(
            "Near a graze finite deviations don't grow as infinitesimal ones do: the "
            "exponents say little there."
        )
    if "mean_divergence" in ds and ds.sizes["exponent"] > 1:
        notes.append(
            "The sum of the exponents and the mean divergence, found without the tangent, "
            "must agree."
        )
    return tuple(notes)
