"""What all pictures of basins share: the right Dataset, the starts as cells, codes and colours,
attractors in words.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from saltus.errors import ParameterError, shown
from saltus.plot.palette import hues
from saltus.plot.style import Scale, display_scale
from saltus.results.dataset.kinds import Kind
from saltus.results.dataset.schema import kind_text
from saltus.units import from_si


@dataclass(frozen=True)
class Unsettled:
    """A code for starts that lead to no attractor: its name in a legend and its colour."""

    label: str
    color: str


#: Without hue, so that no shade is taken for them: near-black where nothing settled, grey where a
#: start left, pale where nothing is known.
UNSETTLED: dict[int, Unsettled] = {
    Kind.ESCAPED: Unsettled("escaped", "#BDBDBD"),
    Kind.UNCONVERGED: Unsettled("not settled", "#1E1E1E"),
    Kind.FAILED: Unsettled("failed", "#3C3C3C"),
    Kind.NOT_COMPUTED: Unsettled("not computed", "#E9E9E9"),
}


# -- the Dataset -----------------------------------------------------------------------------------
def ranked(ds: xr.Dataset, order: Sequence[int] | None) -> list[int]:
    """Ids of the attractors in the order of their colours: those of ``order``, then the others.

    Raises
    ------
    ParameterError
        If ``order`` names an attractor twice, or one that there isn't.
    """
    known = ds["attractor"].values.tolist()
    try:
        first = [] if order is None else [int(one) for one in np.atleast_1d(order).tolist()]
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(
            f"order must hold numbers of attractors, not {shown(order)}."
        ) from None
    strange = [one for one in first if one not in known]
    if strange or len(set(first)) < len(first):
        what = f"there is no attractor {strange[0]}" if strange else "an attractor occurs twice"
        raise ParameterError(
            f"order={first}, but {what}. Known: {', '.join(map(str, known)) or 'none'}."
        )
    return first + [one for one in known if one not in first]


def colors_of(ds: xr.Dataset, order: Sequence[int] | None) -> dict[int, np.ndarray]:
    """The hue of each attractor, by id, in the order of the legend."""
    ids = ranked(ds, order)
    return dict(zip(ids, hues(len(ids)), strict=True))


# -- words -----------------------------------------------------------------------------------------
def describe(one: xr.Dataset) -> str:
    """An attractor in a few words: ``24T, 60 contacts``; ``chaotic, 2.4 contacts per T``; ``limit
    cycle, 0.3 s, 4 contacts``.

    Of a noisy one how far it scatters too: ``noisy 24T, scatter 4.3 µm, 60 contacts``.
    """
    period, contacts = int(one["attractor_period"]), float(one["attractor_contacts"])
    name = kind_text(str(one["attractor_type"].item()), period)
    if "attractor_scatter" in one and math.isfinite(float(one["attractor_scatter"])):
        scatter = one["attractor_scatter"]
        name += f", scatter {from_si(float(scatter), scatter.attrs.get('units', ''), 2)}"
    if not math.isfinite(contacts):
        return name
    if period > 0:
        return f"{name}, {contacts:.4g} contact{'' if contacts == 1 else 's'}"
    kind = str(one["attractor_type"].item())
    if kind == "equilibrium":
        return name
    if "attractor_cycle" not in one:
        return f"{name}, {contacts:.3g} contacts per T"
    if kind != "limit_cycle":
        return name
    return (
        f"{name}, {from_si(float(one['attractor_cycle']), 's', 3)}, {contacts:.4g} "
        f"contact{'' if contacts == 1 else 's'}"
    )


def method_text(ds: xr.Dataset, suffix: str = "") -> str:
    """How a map was computed, such as ``ode45, rtol 0.0001, atol 1e-07``; empty for the exact
    method. ``suffix``: ``_a`` of two maps.
    """
    name = str(ds.attrs.get(f"method{suffix}", "Taylor"))
    if name == "Taylor":
        return ""
    try:
        options = dict(json.loads(ds.attrs.get(f"method_options{suffix}", "{}")))
    except (ValueError, TypeError):  # of another program
        options = {}
    tolerances = [
        f"{key} {float(options[key]):g}" for key in ("rtol", "atol", "step") if key in options
    ]
    ways = {"ignore": "contacts not located", "locate": ""}
    way = str(options.get("events", "locate"))
    spoken = name.lower() if name.startswith("ODE") else name
    return ", ".join(filter(None, [spoken, *tolerances, ways.get(way, f"contacts by {way}")]))


def share_text(fraction: float) -> str:
    """A share in per cent; one that rounds to nothing, or to all, says that it isn't."""
    if 0 < fraction < 0.0005:
        return "< 0.1 %"
    if 0.9995 <= fraction < 1:
        return "> 99.9 %"
    return f"{100 * fraction:.1f} %" if 0 < fraction < 1 else f"{100 * fraction:g} %"


def peak_text(one: xr.Dataset) -> str:
    """The largest first state of an attractor, such as ``peak 0.91 mm``; of an equilibrium where it
    lies, such as ``x = -0.91 mm``.
    """
    state = str(one.attrs.get("states", "")).split(" ")[0]
    unit = one["attractor_peak"].attrs.get("units", "")
    if str(one["attractor_type"].item()) == "equilibrium" and f"attractor_{state}" in one:
        place = float(np.ravel(one[f"attractor_{state}"].values)[0])
        return f"{state} = {display_scale(unit, abs(place)).text(float(f'{place:.3g}'))}"
    peak = float(one["attractor_peak"])
    return f"peak {display_scale(unit, abs(peak)).text(float(f'{peak:.3g}'))}"


# -- the starts ------------------------------------------------------------------------------------
def plane(ds: xr.Dataset, variable: str) -> tuple[str, str]:
    """Names of the two states on the axes of a map."""
    dims = ds[variable].dims
    if len(dims) != 2 or any(dim not in ds.coords for dim in dims):
        raise ParameterError(
            f"{variable} has the dims {dims}; a map needs two states with their starts as "
            f"coordinates. "
            f"Of more states choose a section first, such as "
            f"ds.isel({dims[-1] if dims else 'x'}=0)."
        )
    if 0 in ds[variable].shape:
        raise ParameterError(f"this map holds no starts (its shape is {ds[variable].shape}).")
    return str(dims[0]), str(dims[1])


def scale_of(ds: xr.Dataset, state: str) -> Scale:
    """Display unit of one axis of the map."""
    starts = np.asarray(ds[state].values, dtype=float)
    return display_scale(ds[state].attrs.get("units", ""), float(np.abs(starts).max()))


def edges(starts: np.ndarray) -> np.ndarray:
    """Edges of the cells around the starts, shape (start + 1,): half-way between neighbours, the
    outer cells symmetric.
    """
    starts = np.asarray(starts, dtype=float)
    if starts.size == 1:
        half = 0.5 * abs(starts[0]) or 0.5
        return np.array([starts[0] - half, starts[0] + half])
    between = 0.5 * (starts[1:] + starts[:-1])
    return np.concatenate([[2 * starts[0] - between[0]], between, [2 * starts[-1] - between[-1]]])


def draw_cells(
    ax: Axes, ds: xr.Dataset, pair: tuple[str, str], scales: tuple[Scale, Scale], colors: np.ndarray
) -> None:
    """Colour every cell, uint8, shape (A, B, 3), and name the axes.

    No colours are mixed, however small the cells: a mixture of two hues would be taken for a third
    attractor.
    """
    x, y = (edges(ds[name].values * scale.factor) for name, scale in zip(pair, scales, strict=True))
    image = np.ascontiguousarray(colors.swapaxes(0, 1))
    if all(
        np.allclose(np.diff(axis), (axis[-1] - axis[0]) / (axis.size - 1), rtol=1e-6, atol=0.0)
        for axis in (x, y)
    ):
        extent = (x[0], x[-1], y[0], y[-1])
        ax.imshow(
            image,
            origin="lower",
            extent=extent,
            interpolation="nearest",
            aspect="auto",
            zorder=0,
            rasterized=True,
        )
    else:
        ax.pcolormesh(x, y, image, zorder=0, rasterized=True)
    ax.set_xlim(x.min(), x.max())
    ax.set_ylim(y.min(), y.max())
    ax.set_xlabel(scales[0].label(pair[0]))
    ax.set_ylabel(scales[1].label(pair[1]))


def as_bytes(rgb: np.ndarray) -> np.ndarray:
    """sRGB in 0 to 1 as whole numbers, as images are stored."""
    return np.round(255 * np.asarray(rgb)).astype(np.uint8)
