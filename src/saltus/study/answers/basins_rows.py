"""What basin maps have to say, as tables: a row for each attractor, a row for each pair of
attractors of two maps.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from saltus.results.dataset.kinds import WITHOUT, Kind, sentences
from saltus.results.dataset.schema import axes_of
from saltus.results.summary import own_errors
from saltus.results.wording import kind_texts, unit_of
from saltus.study.table import Column, TextTable, number, quantity, table, with_error, words

if TYPE_CHECKING:
    import xarray as xr


def attractor_table(title: str, ds: xr.Dataset) -> TextTable:
    """A row for each attractor of a map: type, contacts, size, stability, margin, share."""
    found = {
        name.removeprefix("attractor_"): ds[name]
        for name in map(str, ds.data_vars)
        if name.startswith("attractor_")
    }
    units = {name: unit_of(one) for name, one in found.items()}
    kinds = kind_texts(ds, "attractor_")
    sizes = (
        np.hypot(found["multiplier_real"].values[:, 0], found["multiplier_imag"].values[:, 0])
        if kinds
        else np.empty(0)
    )
    share, low, high = (found[f"fraction{end}"].values.tolist() for end in ("", "_low", "_high"))
    first = str(ds.attrs["states"]).split()[0]
    columns = [
        words("", ds["attractor"].values, "attractor"),
        words("type", kinds),
        number("contacts", found["contacts"].values.astype(float), "g"),
        quantity(f"peak |{first}|", found["peak"].values, units["peak"]),
        quantity(f"rms {first}", found["rms"].values, units["rms"]),
        *([quantity(f"scatter {first}", found["scatter"].values, units["scatter"],
            2)] if "scatter" in found else []),
        number("|multiplier|", np.where(np.isfinite(sizes), sizes, np.nan), ".4f"),
        with_error("exponent", found["exponent"].values, found["exponent_error"].values,
            unit="1/s"),
        quantity("to a graze", found["margin"].values, units["margin"], 3),
        Column("share of starts", lambda i: f"{100 * share[i]:.2f} ± "
                                            f"{50 * (high[i] - low[i]):.2g} %",
               {"share of starts": share, "share from": low, "share to": high}),
    ]  # fmt: skip
    return table(title, columns, _notes(ds), range(len(kinds)))


def _notes(ds: xr.Dataset) -> tuple[str, ...]:
    """What the numbers are worth."""
    attrs, cells = ds.attrs, int(np.prod([ds.sizes[name] for name in axes_of(ds)]))
    notes = [
        f"{cells} starts; a basin of less than {100 * attrs['smallest_basin_seen']:.2g} % may "
        f"have been missed."
    ]
    if attrs["flip_checked"]:
        notes.append(
            f"{attrs['flip_checked']} starts recomputed more exactly: "
            f"{100 * attrs['flip_rate']:.2g} % lead elsewhere "
            f"({100 * attrs['flip_rate_low']:.2g} to {100 * attrs['flip_rate_high']:.2g} %)."
        )
    if math.isfinite(attrs["uncertainty_exponent"]):
        notes.append(
            f"Basin entropy {attrs['basin_entropy']:.4f}, at boundaries "
            f"{attrs['boundary_basin_entropy']:.4f}; uncertainty exponent "
            f"{attrs['uncertainty_exponent']:.3f} ± {attrs['uncertainty_exponent_error']:.2g} (1: "
            f"a smooth boundary)."
        )
    if attrs["unresolved_cells"]:
        notes.append(
            f"{attrs['unresolved_cells']} starts met a graze shallower than the local "
            f"error: either outcome is possible."
        )
    unconverged, words = WITHOUT[Kind.UNCONVERGED], own_errors(attrs)
    notes += [
        f"{note} {words}".rstrip() if unconverged in note else note
        for note in sentences(ds["basin"].values)
    ]
    if "attractor_scatter" in ds:
        notes.append(
            "Noisy: errors of the method keep the motion from closing. It stays near an exact "
            "orbit, whose numbers are in the row; "
            "scatter is its root mean square distance from there."
        )
    return tuple(notes)


def agreement_table(ds: xr.Dataset) -> TextTable:
    """A row for each pair of attractors of two maps, and the share of the starts on which the maps
    agree.
    """
    match = {
        name: ds[f"match_{name}"].values.tolist()
        for name in ("a", "b", "fraction_a", "fraction_b", "orbit_distance")
    }
    columns = [
        words("type", kind_texts(ds, "match_")),
    ]
    columns += [number(side, [n if n >= 0 else None for n in match[side]]) for side in "ab"]
    columns += [_share(f"share in {side}", match[f"fraction_{side}"], match[side]) for side in "ab"]
    columns.append(
        number(
            "distance of orbits",
            [d if math.isfinite(d) else None for d in match["orbit_distance"]],
            ".1e",
        )
    )
    a, b = (str(ds.attrs.get(f"name_{side}", side)) for side in "ab")
    values = ds["agreement"].values
    settled = values >= 0
    share = f"{100 * float((values[settled] == 1).mean()):.2f} %" if settled.any() else "none"
    note = f"The maps agree on {share} of the {int(settled.sum())} starts that settle in both."
    return table(f"a: {a} / b: {b}", columns, (note,), range(ds.sizes["pair"]))


def _share(heading: str, shares: list[float], numbers: list[int]) -> Column:
    """Shares of the starts of those that are in a map."""
    found = [share if n >= 0 else math.nan for share, n in zip(shares, numbers, strict=True)]
    return Column(
        heading, lambda i: "-" if numbers[i] < 0 else f"{100 * found[i]:.2f} %", {heading: found}
    )
