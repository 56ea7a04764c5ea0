"""Result of ``energy_balance``: energy stored, supplied and taken."""

from __future__ import annotations

import numpy as np
import xarray as xr

from saltus.results.dataset.schema import ResultKind
from saltus.results.dataset.variable import ENDINGS, SHARED, Variable
from saltus.results.table import (
    TextTable,
    flat,
    left_out,
    number,
    of_trajectory,
    quantity,
    table,
)
from saltus.results.wording import failed

_INTERVAL = ("trajectory", "period")

#: Variables of the result of ``energy_balance``. For an unforced system their dim is ``time``, not
#: ``period``.
VARIABLES = {
    "period": Variable(
        ("period",),
        "1",
        "whole forcing periods from the start to the end of the interval",
        "i8",
        coord=True,
    ),
    "time": Variable(("time",), "s", "time at the end of the interval", coord=True),
    "energy": Variable(_INTERVAL, "J", "stored energy at the end of the interval"),
    "change": Variable(_INTERVAL, "J", "change of the stored energy in the interval"),
    "supplied": Variable(_INTERVAL, "J", "work supplied in the interval"),
    "dissipated": Variable(_INTERVAL, "J", "energy dissipated in the interval"),
    "friction": Variable(_INTERVAL, "J", "work taken by friction in the interval"),
    "impacts": Variable(_INTERVAL, "J", "energy taken by impacts and jumps in the interval"),
    "residual": Variable(_INTERVAL, "J", "supplied - dissipated - friction - impacts - change"),
    "imbalance": Variable(
        ("trajectory",),
        "1",
        "largest |residual| relative to the energy that is stored or turned over in an interval",
    ),
    **ENDINGS,
    **SHARED,
}


#: Parts of a balance, in the words of an account.
_PARTS = {
    "supplied": "supplied",
    "dissipated": "dissipated",
    "friction": "taken by friction",
    "impacts": "taken by impacts",
}


def account(ds: xr.Dataset) -> list[str]:
    """The mean of each part, and the imbalance."""
    means = [
        f"{float(ds[name].mean()):.6g} J {words}" for name, words in _PARTS.items() if name in ds
    ]
    return [
        f"extent   {ds['residual'].shape[-1]} intervals",
        f"found    {', '.join(means[:-1])} and {means[-1]} in each on average",
        f"balance  off by {_worst(ds)} of the energy turned over",
    ]


def rows(title: str, ds: xr.Dataset) -> list[TextTable]:
    """A row for each interval, of each trajectory."""
    like = ds["residual"]
    along = str(like.dims[-1])
    columns = of_trajectory(ds, like=like)
    columns.append(number(along, flat(ds[along], like), ".8g", "s" if along == "time" else ""))
    columns += [
        quantity("stored at the end" if name == "energy" else name, flat(ds[name], like), "J", 6)
        for name in (*_PARTS, "change", "energy", "residual")
        if name in ds
    ]
    notes = [
        f"residual = supplied - all that is taken - change of the stored energy; at most "
        f"{_worst(ds)} of the largest of them."
    ]
    notes += left_out(like.size, "intervals")
    return [table(title, columns, [*notes, *failed(ds)])]


def _worst(ds: xr.Dataset) -> str:
    """The largest imbalance of all trajectories."""
    return f"{float(np.nanmax(np.atleast_1d(ds['imbalance'].values), initial=0.0)):.1e}"


KIND = ResultKind("sl.energy_balance", VARIABLES, ("energy", "residual", "status"), account, rows)
