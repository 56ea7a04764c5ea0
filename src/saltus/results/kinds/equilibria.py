"""Result of ``equilibria``: the equilibria of a system without forcing."""

from __future__ import annotations

import numpy as np
import xarray as xr

from saltus.errors import counted
from saltus.results.dataset.schema import ResultKind, equilibrium_name, states_of
from saltus.results.dataset.variable import Variable
from saltus.results.table import TextTable, number, quantity, table, words
from saltus.results.wording import sized, unit_of

_EACH = ("equilibrium",)
_EIGENVALUE = ("equilibrium", "eigenvalue")
#: Digits of a state of an equilibrium.
DIGITS = 10

#: Variables of the result of ``equilibria``.
VARIABLES = {
    "equilibrium": Variable(_EACH, "1", "equilibrium", "i8", coord=True),
    "equilibrium_type": Variable(_EACH, "", "node, focus, saddle, ... by its eigenvalues", "str"),
    "equilibrium_place": Variable(
        _EACH, "", "in a region, on a boundary, or held by contacts", "str"
    ),
    "equilibrium_stable": Variable(
        _EACH, "1", "whether it attracts", "i1", flags={0: "no", 1: "yes"}
    ),
    "equilibrium_contacts": Variable(
        _EACH, "", "guards whose contacts are held, or whose gap is zero", "str"
    ),
    "equilibrium_mode": Variable(_EACH, "1", "mode, bit i is guard i", "i8"),
    "equilibrium_margin": Variable(_EACH, "<margin>", "distance to the nearest other boundary"),
    "equilibrium_dimension": Variable(_EACH, "1", "dimension of a continuum, 0 if isolated", "i8"),
    "equilibrium_eigenvalue_real": Variable(
        _EIGENVALUE, "1/s", "eigenvalue of the Jacobian, real part"
    ),
    "equilibrium_eigenvalue_imag": Variable(
        _EIGENVALUE, "1/s", "eigenvalue of the Jacobian, imaginary part"
    ),
    "equilibrium_<state>": Variable(_EACH, "<state>", "<state> at rest"),
    "equilibrium_<state>_from": Variable(
        _EACH, "<state>", "<state> at the beginning of an interval of equilibria"
    ),
    "equilibrium_<state>_to": Variable(
        _EACH, "<state>", "<state> at the end of an interval of equilibria"
    ),
}


def account(ds: xr.Dataset) -> list[str]:
    """A line on each equilibrium."""
    count = ds.sizes["equilibrium"]
    lines = [f"found    {counted(count, 'equilibrium')}"]
    return lines + [f"  {i}: {_one(ds.isel(equilibrium=i))}" for i in range(count)]


def _one(equilibrium: xr.Dataset) -> str:
    """Type, state and contacts of an equilibrium."""
    at = ", ".join(
        f"{name} = {sized(equilibrium[equilibrium_name(name)])}" for name in states_of(equilibrium)
    )
    kind = _kind(equilibrium["equilibrium_type"].item())
    stable = "stable" if equilibrium["equilibrium_stable"] else "unstable"
    word = kind if kind in ("center", "degenerate", "undecided") else f"{stable} {kind}"
    contacts = equilibrium["equilibrium_contacts"].item()
    on = "held at" if equilibrium["equilibrium_place"].item() == "pseudo" else "on the boundary"
    return f"{word} at {at}{contacts and f', {on} {contacts}'}"


def _kind(kind: str) -> str:
    """A type in the field's word: ``saddle-focus``."""
    return kind.replace("_", "-")


def rows(title: str, ds: xr.Dataset) -> list[TextTable]:
    """A row for each equilibrium."""
    states = {name: ds[equilibrium_name(name)] for name in states_of(ds)}
    growth = ds["equilibrium_eigenvalue_real"].values
    largest = np.fmax.reduce(growth, axis=1, initial=-np.inf)
    columns = [
        words("type", [_kind(kind) for kind in ds["equilibrium_type"].values]),
        words("stable", ["yes" if one else "no" for one in ds["equilibrium_stable"].values]),
        words("place", ds["equilibrium_place"].values),
        words("contacts", ds["equilibrium_contacts"].values),
        *(quantity(name, one.values, unit_of(one), DIGITS) for name, one in states.items()),
        number("largest growth", np.where(np.isinf(largest), np.nan, largest), ".6g", "1/s"),
    ]
    return [table(title, columns)]


KIND = ResultKind(
    "sl.equilibria", VARIABLES, ("equilibrium_type", "equilibrium_place"), account, rows
)
