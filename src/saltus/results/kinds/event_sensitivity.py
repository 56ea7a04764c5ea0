"""Result of ``event_sensitivity``: the place of a bifurcation and its derivatives."""

from __future__ import annotations

import numpy as np
import xarray as xr

from saltus.results.dataset.schema import ResultKind
from saltus.results.dataset.variable import SQRT_COEFFICIENT, Variable
from saltus.results.table import TextTable, number, table, words
from saltus.results.wording import plain, unit_of

#: Variables of the result of ``event_sensitivity``. ``<varied>``: the unit of the parameter that
#: was varied; ``<slope>``: that over the unit in ``to_units``.
VARIABLES = {
    "to": Variable(("to",), "", "what the derivatives are with respect to", "str", coord=True),
    "to_units": Variable(("to",), "", "unit of it", "str", coord=True),
    "to_value": Variable(("to",), "<to>", "its value"),
    "event_value": Variable((), "<varied>", "value of the varied parameter at the bifurcation"),
    "event_derivative": Variable(("to",), "<slope>", "derivative of this value"),
    "sqrt_coefficient": Variable((), "<root gap>", SQRT_COEFFICIENT),
}


def account(ds: xr.Dataset) -> list[str]:
    """The place, what it depends on, and what a rigid stop does to the orbit beyond a graze."""
    place, unit = float(ds["event_value"]), unit_of(ds["event_value"])
    kind = plain(ds.attrs["bifurcation"])
    shares = 0.01 * ds["event_derivative"].values * ds["to_value"].values / place
    parts = ", ".join(
        f"{100 * share:+.3g} % for 1 % of {one}"
        for one, share in zip(ds["to"].values, shares, strict=True)
        if np.isfinite(share)
    )
    lines = [f"place    {kind} at {ds.attrs['parameter']} = {place:.8g} {unit}".rstrip()]
    lines += [f"depends  {parts}"] if parts else []
    if abs(float(ds["sqrt_coefficient"])) > 0:
        lines.append(
            "beyond   the orbit's own slope is infinite on the side with contact, as one over the "
            "root of the distance"
        )
    return lines


def rows(title: str, ds: xr.Dataset) -> list[TextTable]:
    """A row for each parameter."""
    columns = [
        words("with respect to", ds["to"].values),
        number("value [SI]", ds["to_value"].values, ".8g"),
        number("derivative [SI]", ds["event_derivative"].values, ".8g"),
    ]
    return [table(title, columns, account(ds)[:1])]


KIND = ResultKind(
    "sl.event_sensitivity", VARIABLES, ("event_value", "event_derivative"), account, rows
)
