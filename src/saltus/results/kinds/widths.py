"""Result of ``regularisation_widths``: errors of smooth approximations by their width."""

from __future__ import annotations

import numpy as np
import xarray as xr

from saltus.results.dataset.schema import ResultKind
from saltus.results.dataset.variable import Variable
from saltus.results.table import TextTable, number, quantity, table
from saltus.results.wording import unit_of

#: Variables of the result of ``regularisation_widths``.
VARIABLES = {
    "width": Variable(("width",), "<gap>", "width of the blend", coord=True),
    "regularisation_error": Variable(("width",), "1", "error of a forcing period by the width"),
    "error": Variable(("width",), "1", "error of a forcing period by width and method"),
    "steps_per_period": Variable(
        ("width",), "1", "steps tried in one forcing period of the stand-in"
    ),
    "method_error": Variable((), "1", "error of a forcing period by the method"),
    "method_steps_per_period": Variable(
        (), "1", "steps tried in one forcing period of the system with contacts"
    ),
    "equal_width": Variable((), "<gap>", "width of equal errors"),
    "equal_steps_per_period": Variable(
        (), "1", "steps tried in one forcing period at the width of equal errors"
    ),
}


def account(ds: xr.Dataset) -> list[str]:
    """The error with contacts, and the width of the same error."""
    return [f"contacts error {_with_contacts(ds)}", f"equal    {_equal(ds)}"]


def rows(title: str, ds: xr.Dataset) -> list[TextTable]:
    """A row for each width."""
    columns = [
        quantity("width", ds["width"].values, unit_of(ds["width"])),
        number("error by the width", ds["regularisation_error"].values, ".2g"),
        number("error by width and method", ds["error"].values, ".2g"),
        number("steps in a period", ds["steps_per_period"].values, ".3g"),
    ]
    notes = (f"With contacts: error {_with_contacts(ds)}.", f"Equal errors: {_equal(ds)}.")
    return [table(title, columns, notes)]


def _with_contacts(ds: xr.Dataset) -> str:
    return (
        f"{float(ds['method_error']):.2g} of a period, "
        f"{float(ds['method_steps_per_period']):.3g} steps"
    )


def _equal(ds: xr.Dataset) -> str:
    width, unit = float(ds["equal_width"]), unit_of(ds["equal_width"])
    if np.isnan(width):
        return "at none of the widths"
    steps = float(ds["equal_steps_per_period"])
    return f"at a width of {width:.3g} {unit}".rstrip() + f", {steps:.3g} steps a period"


KIND = ResultKind(
    "sl.regularisation_widths",
    VARIABLES,
    ("regularisation_error", "error", "steps_per_period"),
    account,
    rows,
)
