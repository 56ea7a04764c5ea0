"""Result of ``compare``: the agreement of two maps."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from saltus.results.dataset.schema import ResultKind, axes_of
from saltus.results.dataset.variable import Variable
from saltus.results.kinds.basins import AXES
from saltus.results.table import Column, TextTable, number, table, words
from saltus.results.wording import kind_texts, meanings, span

#: Meaning of the values of ``agreement``.
AGREEING = {-1: "not_settled", 0: "differ", 1: "agree"}
#: Variables of the result of ``compare``.
VARIABLES = {
    **AXES,
    "agreement": Variable(("...",), "1", "whether the two maps agree", "i1", flags=AGREEING),
    "basin_a": Variable(("...",), "1", "attractor in the first map", "i2"),
    "basin_b": Variable(
        ("...",), "1", "attractor in the second map, in the numbers of the first", "i2"
    ),
    "pair": Variable(
        ("pair",),
        "1",
        "attractor: those of the first map, then those that only the second has",
        "i8",
        coord=True,
    ),
    "match_a": Variable(("pair",), "1", "number in the first map, -1 if it isn't there", "i8"),
    "match_b": Variable(("pair",), "1", "number in the second map, -1 if it isn't there", "i8"),
    "match_type": Variable(("pair",), "", "kind of motion", "str"),
    "match_period": Variable(
        ("pair",), "1", "period in forcing periods, 0 if it doesn't repeat", "i8"
    ),
    "match_fraction_a": Variable(("pair",), "1", "share of the starts in the first map"),
    "match_fraction_b": Variable(("pair",), "1", "share of the starts in the second map"),
    "match_agreeing_cells": Variable(("pair",), "1", "starts that lead to it in both maps", "i8"),
    "match_orbit_distance": Variable(
        ("pair",), "1", "distance of the two orbits in units of the axis ranges"
    ),
}


def account(ds: xr.Dataset) -> list[str]:
    """Lines on the maps and on their agreement."""
    values, words = ds["agreement"].values, meanings(ds["agreement"])
    counts = [f"{int((values == code).sum())} {words[code]}" for code in sorted(words)[::-1]]
    a, b = ds["match_a"].values, ds["match_b"].values
    alone = f"{int((b < 0).sum())} only in the first map, {int((a < 0).sum())} only in the second"
    return [
        span(ds, axes_of(ds), "starts"),
        f"maps     {ds.attrs.get('method_a', 'unknown')} and {ds.attrs.get('method_b', 'unknown')}",
        f"agree    {ds.attrs.get('agreement', np.nan):.2%} of the settled starts "
        f"({', '.join(counts)})",
        f"matched  {int(((a >= 0) & (b >= 0)).sum())} attractors, {alone}",
    ]


def rows(title: str, ds: xr.Dataset) -> list[TextTable]:
    """A row for each pair of attractors, and the share of the starts on which the maps agree."""
    numbers = {side: ds[f"match_{side}"].values.tolist() for side in "ab"}
    shares = {side: ds[f"match_fraction_{side}"].values.tolist() for side in "ab"}
    distance = [d if math.isfinite(d) else None for d in ds["match_orbit_distance"].values.tolist()]
    columns = [
        words("type", kind_texts(ds, "match_")),
        *(number(side, [n if n >= 0 else None for n in numbers[side]]) for side in "ab"),
        *(_share(f"share in {side}", shares[side], numbers[side]) for side in "ab"),
        number("distance of orbits", distance, ".1e"),
    ]
    values = ds["agreement"].values
    settled = values >= 0
    share = f"{100 * float((values[settled] == 1).mean()):.2f} %" if settled.any() else "none"
    note = f"The maps agree on {share} of the {int(settled.sum())} starts that settle in both."
    return [table(title, columns, (note,), range(ds.sizes["pair"]))]


def _share(heading: str, shares: list[float], numbers: list[int]) -> Column:
    """Shares of the starts, for attractors that are in a map."""
    found = [share if n >= 0 else math.nan for share, n in zip(shares, numbers, strict=True)]
    return Column(
        heading, lambda i: "-" if numbers[i] < 0 else f"{100 * found[i]:.2f} %", {heading: found}
    )


KIND = ResultKind("sl.compare", VARIABLES, ("agreement", "match_a"), account, rows)
