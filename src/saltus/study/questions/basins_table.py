"""What basin maps have to say, as tables: a row for each attractor, a row for each pair of attractors of two maps."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from saltus.results.schema import axes_of, kind_text
from saltus.study.table import TextTable
from saltus.units import from_si

if TYPE_CHECKING:
    import xarray as xr


def attractor_table(title: str, ds: xr.Dataset) -> TextTable:
    """A row for each attractor of a map: type, contacts, size, stability, margin, share."""
    rows = []
    for i in ds["attractor"].values.tolist():
        one = ds.isel(attractor=i)
        kind, n = str(one["attractor_type"].item()), int(one["attractor_period"])
        size = math.hypot(float(one["attractor_multiplier_real"][0]), float(one["attractor_multiplier_imag"][0]))
        unit, gap = one["attractor_peak"].attrs.get("units", ""), one["attractor_margin"].attrs.get("units", "")
        rows.append((
            str(i), kind_text(kind, n), _or_dash(float(one["attractor_contacts"]), "g"),
            from_si(float(one["attractor_peak"]), unit, 4), from_si(float(one["attractor_rms"]), unit, 4),
            _or_dash(size, ".4f"),
            f"{float(one['attractor_exponent']):.4g} ± {float(one['attractor_exponent_error']):.1g}",
            from_si(float(one["attractor_margin"]), gap, 3),
            f"{100 * float(one['attractor_fraction']):.2f} ± "
            f"{50 * float(one['attractor_fraction_high'] - one['attractor_fraction_low']):.2g} %",
        ))  # fmt: skip
    first = str(ds.attrs["states"]).split()[0]
    columns = ("", "type", "contacts", f"peak |{first}|", f"rms {first}", "|multiplier|", "exponent [1/s]", "to a graze", "share of starts")
    return TextTable(title, columns, tuple(rows), _notes(ds))


def _or_dash(value: float, form: str) -> str:
    return format(value, form) if math.isfinite(value) else "-"


def _notes(ds: xr.Dataset) -> tuple[str, ...]:
    """What the numbers are worth."""
    attrs, cells = ds.attrs, int(np.prod([ds.sizes[name] for name in axes_of(ds)]))
    notes = [f"{cells} starts; a basin of less than {100 * attrs['smallest_basin_seen']:.2g} % may have been missed."]
    if attrs["flip_checked"]:
        notes.append(
            f"{attrs['flip_checked']} starts recomputed more exactly: {100 * attrs['flip_rate']:.2g} % lead elsewhere "
            f"({100 * attrs['flip_rate_low']:.2g} to {100 * attrs['flip_rate_high']:.2g} %)."
        )
    if math.isfinite(attrs["uncertainty_exponent"]):
        notes.append(
            f"Basin entropy {attrs['basin_entropy']:.4f}, at boundaries {attrs['boundary_basin_entropy']:.4f}; uncertainty exponent "
            f"{attrs['uncertainty_exponent']:.3f} ± {attrs['uncertainty_exponent_error']:.2g} (1: a smooth boundary)."
        )
    if attrs["unresolved_cells"]:
        notes.append(f"{attrs['unresolved_cells']} starts met a graze shallower than the local error: either outcome is possible.")
    if attrs["unsettled_cells"]:
        notes.append(f"{attrs['unsettled_cells']} starts lead to no known attractor within the periods allowed.")
    return tuple(notes)


def agreement_table(ds: xr.Dataset) -> TextTable:
    """A row for each pair of attractors of two maps, and the share of the starts on which the maps agree."""
    rows = []
    for i in range(ds.sizes["pair"]):
        one = {name: ds[f"match_{name}"].values[i] for name in ("a", "b", "type", "period", "fraction_a", "fraction_b", "orbit_distance")}
        kind = kind_text(str(one["type"]), int(one["period"]))
        shares = [f"{100 * float(one[f'fraction_{side}']):.2f} %" if int(one[side]) >= 0 else "-" for side in "ab"]
        distance = float(one["orbit_distance"])
        rows.append((kind, *(str(one[side]) if int(one[side]) >= 0 else "-" for side in "ab"), *shares,
                     _or_dash(distance, ".1e")))  # fmt: skip
    a, b = (str(ds.attrs.get(f"name_{side}", side)) for side in "ab")
    values = ds["agreement"].values
    settled = values >= 0
    share = f"{100 * float((values[settled] == 1).mean()):.2f} %" if settled.any() else "none"
    columns = ("type", "a", "b", "share in a", "share in b", "distance of orbits")
    note = f"The maps agree on {share} of the {int(settled.sum())} starts that settle in both."
    return TextTable(f"a: {a} / b: {b}", columns, tuple(rows), (note,))
