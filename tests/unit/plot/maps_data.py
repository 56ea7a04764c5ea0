"""Small maps of basins as the solver would return them."""

from __future__ import annotations

import numpy as np
import xarray as xr

CODES = {
    "flag_values": np.array([-4, -3, -2, -1], dtype="i2"),
    "flag_meanings": "not_computed failed unconverged escaped",
}


def attractors(x, v, period, contacts, kind=None, fraction=None, kind_attr="attractors", **more):
    """The attractor_* part: ``x`` and ``v`` hold the stroboscopic points of each attractor."""
    m, longest = len(period), max([len(one) for one in x], default=0)
    points = np.full((2, m, longest), np.nan)
    for i, both in enumerate(zip(x, v, strict=True)):
        points[:, i, : len(both[0])] = both
    periodic = np.asarray(period) > 0
    kind = ["periodic" if one else "chaotic" for one in periodic] if kind is None else kind
    size = np.where(periodic, 0.53, np.nan)
    peak = np.array([max(np.abs(one)) for one in x], dtype=float)
    data = {
        "attractor_type": ("attractor", np.array(kind, dtype=np.str_)),
        "attractor_period": ("attractor", np.array(period, dtype=np.int64)),
        "attractor_contacts": ("attractor", np.array(contacts, dtype=float)),
        "attractor_peak": ("attractor", peak, {"units": "m"}),
        "attractor_multiplier_real": (
            ("attractor", "multiplier"),
            np.stack([0 * size, 0 * size], -1),
        ),
        "attractor_multiplier_imag": (("attractor", "multiplier"), np.stack([size, -size], -1)),
        "attractor_exponent": ("attractor", np.where(periodic, -5.0, 12.34), {"units": "1/s"}),
        "attractor_exponent_error": ("attractor", np.full(m, 0.3), {"units": "1/s"}),
        "attractor_x": (("attractor", "phase"), points[0], {"units": "m"}),
        "attractor_v": (("attractor", "phase"), points[1], {"units": "m/s"}),
        "attractor_fraction": (
            "attractor",
            np.full(m, 1 / max(m, 1)) if fraction is None else np.array(fraction),
        ),
    }
    return xr.Dataset(data | more, {"attractor": np.arange(m)}, {"saltus_result": kind_attr})


def basins_map(basin, periods_to_settle=None, x=None, v=None, known=None):
    """The whole Dataset of a map; ``known`` is its attractor part."""
    basin = np.asarray(basin)
    m = int(max(basin.max(), -1)) + 1
    x = np.linspace(-5e-3, 5e-3, basin.shape[0]) if x is None else np.asarray(x)
    v = np.linspace(-0.5, 0.5, basin.shape[1]) if v is None else np.asarray(v)
    if known is None:
        at = np.linspace(-4e-3, 4e-3, max(m, 1))[:m]
        known = attractors(
            [[one] * (i + 1) for i, one in enumerate(at)],
            [np.linspace(-0.1, 0.1, i + 1) for i in range(m)],
            period=range(1, m + 1),
            contacts=[2 * (i + 1) for i in range(m)],
            fraction=[(basin == i).mean() for i in range(m)],
        )
    settle = np.where(basin >= 0, 10, -1) if periods_to_settle is None else periods_to_settle
    data = {"basin": (("x", "v"), basin.astype("i2") if basin.dtype.kind != "f" else basin, CODES),
            "periods_to_settle": (("x", "v"), np.asarray(settle).astype("i4")),
            "status": (("x", "v"), np.zeros(basin.shape, dtype="i1"))}  # fmt: skip
    axes = {"x": ("x", x, {"units": "m"}), "v": ("v", v, {"units": "m/s"})}
    return known.assign(data).assign_coords(axes).assign_attrs(saltus_result="basins")


def agreement_map(a, b):
    """Where two maps agree."""
    a, b = np.asarray(a), np.asarray(b)
    agree = np.where((a < 0) | (b < 0), -1, a == b).astype("i1")
    dims = ("x", "v")
    axes = {
        "x": ("x", np.linspace(-5e-3, 5e-3, a.shape[0]), {"units": "m"}),
        "v": ("v", np.linspace(-0.5, 0.5, a.shape[1]), {"units": "m/s"}),
    }
    ids = np.arange(max(int(a.max()), int(b.max()), -1) + 1)
    match = {
        "a": np.where(np.isin(ids, a), ids, -1),
        "b": np.where(np.isin(ids, b), ids, -1),
        "period": ids + 1,
        "type": ["periodic"] * ids.size,
    }
    pairs = {
        f"match_{name}": ("pair", np.asarray(column, dtype="U" if name == "type" else int))
        for name, column in match.items()
    }
    cells = {"agreement": (dims, agree), "basin_a": (dims, a), "basin_b": (dims, b)}
    return xr.Dataset(cells | pairs, axes | {"pair": ids}, {"saltus_result": "agreement"})
