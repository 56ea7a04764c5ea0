"""Result of ``structure_modes``: the modes of a structure from its matrices."""

from __future__ import annotations

import xarray as xr

from saltus.results.dataset.schema import ResultKind
from saltus.results.dataset.variable import Variable
from saltus.results.table import TextTable, quantity, table, words

#: Variables of the result of ``structure_modes``.
VARIABLES = {
    "frequency": Variable(("mode",), "Hz", "natural frequency"),
    "shape": Variable(("degree", "mode"), "kg^-0.5", "mode shape of unit modal mass"),
    "flexibility": Variable(("place",), "m/N", "static flexibility"),
    "residual_flexibility": Variable(("place",), "m/N", "static flexibility of the modes left out"),
    "flexibility_share": Variable(
        ("place",), "1", "share of the static flexibility that the modes carry"
    ),
    "mode": Variable(("mode",), "1", "mode", "i8", coord=True),
    "degree": Variable(("degree",), "", "degree of freedom", "str", coord=True),
    "place": Variable(("place",), "", "where the flexibility is asked for", "str", coord=True),
}


def account(ds: xr.Dataset) -> list[str]:
    """Lines on the modes: their number, their frequencies, and the compliance left out."""
    frequency = ds["frequency"].values
    return [
        f"found    {len(frequency)} modes of {ds.sizes['degree']} degrees of freedom",
        f"extent   {frequency[0]:.4g} to {frequency[-1]:.4g} Hz",
        *(f"  {one}" for one in _shares(ds)),
    ]


def rows(title: str, ds: xr.Dataset) -> list[TextTable]:
    """A row for each mode."""
    columns = [
        words("mode", ds["mode"].values),
        quantity("frequency", ds["frequency"].values, "Hz", 6),
    ]
    return [table(title, columns, [f"{one}." for one in _shares(ds)])]


def _shares(ds: xr.Dataset) -> list[str]:
    """The share of the static flexibility at each place."""
    return [
        f"{place}: {share:.2%} of the static flexibility"
        for place, share in zip(
            ds["place"].values.tolist(), ds["flexibility_share"].values.tolist(), strict=True
        )
    ]


KIND = ResultKind("sl.structure_modes", VARIABLES, ("shape", "flexibility"), account, rows)
