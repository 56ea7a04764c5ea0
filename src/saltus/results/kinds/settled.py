"""Result of ``settled``: the responses that runs end in."""

from __future__ import annotations

import numpy as np
import xarray as xr

from saltus.results.dataset.schema import ResultKind, period_text, told_of
from saltus.results.dataset.variable import TRAJECTORY_NUMBER, Variable
from saltus.results.kinds.spectrum import RESPONSE_PERIOD
from saltus.results.table import TextTable, left_out, number, of_trajectory, quantity, table, words
from saltus.results.wording import unit_of

#: Variables of the result of ``settled``. The last three are those of a run with samples between
#: whole periods.
VARIABLES = {
    "mismatch": Variable(
        ("trajectory",), "1", "relative difference of states one response period apart"
    ),
    "response_period": RESPONSE_PERIOD,
    "contacts_per_response": Variable(
        ("trajectory",), "1", "contacts in one period of the response"
    ),
    "<state>_peak": Variable(("trajectory",), "<state>", "largest |<state>|"),
    "<state>_rms": Variable(("trajectory",), "<state>", "root mean square of <state>"),
    **TRAJECTORY_NUMBER,
}


def account(ds: xr.Dataset) -> list[str]:
    """Line on the trajectories that repeat, counted by their period."""
    found, counts = np.unique(ds["response_period"].values, return_counts=True)
    each = [f"{count} {word}" for count, word in zip(counts, _words(ds, found), strict=True)]
    return [f"found    {', '.join(each)}"]


def responses(ds: xr.Dataset) -> list[str]:
    """``T``, ``3T`` or ``not periodic within 48T`` for each trajectory."""
    return _words(ds, np.atleast_1d(ds["response_period"].values))


def _words(ds: xr.Dataset, periods: np.ndarray) -> list[str]:
    none = f"not periodic within {ds.attrs['longest_period']}T"
    return [period_text(int(n), none) for n in periods]


def rows(title: str, ds: xr.Dataset) -> list[TextTable]:
    """A row for each trajectory: its response, how well it repeats, its contacts and size."""
    batch = ds if "trajectory" in ds.dims else ds.expand_dims("trajectory")
    columns = of_trajectory(ds)
    columns += [
        words("response", responses(ds)),
        number("mismatch", batch["mismatch"].values, ".1e"),
        number("contacts", batch["contacts_per_response"].values, "g"),
    ]
    columns += [
        quantity(
            heading.format(name), batch[f"{name}_{size}"].values, unit_of(batch[f"{name}_{size}"])
        )
        for name in told_of(ds)
        for size, heading in (("peak", "peak |{}|"), ("rms", "rms {}"))
        if f"{name}_{size}" in batch
    ]
    return [table(title, columns, left_out(batch.sizes["trajectory"], "trajectories"))]


KIND = ResultKind("sl.settled", VARIABLES, ("response_period", "mismatch"), account, rows)
