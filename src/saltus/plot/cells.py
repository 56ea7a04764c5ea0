"""Maps: a plane of coloured cells, for basins, kinds of motion and agreement; codes and colours;
attractors in words.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb

from saltus.errors import ParameterError, shown
from saltus.plot.palette import hues, shades
from saltus.plot.response_points import is_log, parameter_scale
from saltus.plot.style import Scale, display_scale
from saltus.plot.unsettled import UNSETTLED
from saltus.results.dataset.kinds import Kind
from saltus.results.dataset.schema import kind_text
from saltus.units import from_si

#: Shades of a hue; the middle one is the hue itself.
LEVELS = 65


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
        first = [] if order is None else [int(number) for number in np.atleast_1d(order).tolist()]
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(
            f"order must hold numbers of attractors, not {shown(order)}."
        ) from None
    strange = [number for number in first if number not in known]
    if strange or len(set(first)) < len(first):
        what = f"there is no attractor {strange[0]}" if strange else "an attractor occurs twice"
        raise ParameterError(
            f"order={first}, but {what}. Known: {', '.join(map(str, known)) or 'none'}."
        )
    return first + [number for number in known if number not in first]


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
    """Name and options of the method of a map, such as ``ode45, rtol 0.0001, atol 1e-07``; "" for
    the exact method. ``suffix``: ``_a`` or ``_b`` for one of two maps.
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
    """Share in per cent. A share that rounds to none or all is written as more than none, or less
    than all.
    """
    if 0 < fraction < 0.0005:
        return "< 0.1 %"
    if 0.9995 <= fraction < 1:
        return "> 99.9 %"
    return f"{100 * fraction:.1f} %" if 0 < fraction < 1 else f"{100 * fraction:g} %"


def peak_text(one: xr.Dataset) -> str:
    """Largest first state of an attractor, such as ``peak 0.91 mm``; for an equilibrium its value,
    such as ``x = -0.91 mm``.
    """
    state = str(one.attrs.get("states", "")).split(" ")[0]
    unit = one["attractor_peak"].attrs.get("units", "")
    if str(one["attractor_type"].item()) == "equilibrium" and f"attractor_{state}" in one:
        place = float(np.ravel(one[f"attractor_{state}"].values)[0])
        return f"{state} = {display_scale(unit, abs(place)).text(float(f'{place:.3g}'))}"
    peak = float(one["attractor_peak"])
    return f"peak {display_scale(unit, abs(peak)).text(float(f'{peak:.3g}'))}"


# -- the plane -------------------------------------------------------------------------------------
@dataclass(frozen=True)
class Side:
    """One axis of a map.

    Attributes
    ----------
    name : str
        The state or parameter.
    label : str
        Text of the axis.
    scale : Scale
        Its display unit.
    values : array of float
        Centres of the cells [SI].
    log : bool
        Whether the axis is logarithmic.
    """

    name: str
    label: str
    scale: Scale
    values: np.ndarray
    log: bool = False

    @property
    def edges(self) -> np.ndarray:
        """Edges of the cells [display unit], half-way between neighbours: shape (cell + 1,)."""
        values = self.values * self.scale.factor
        return np.exp(_edges(np.log(values))) if self.log else _edges(values)


#: Both axes of a map.
Sides = tuple[Side, Side]


def plane(ds: xr.Dataset, variable: str) -> Sides:
    """The two states on the axes of a map."""
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
    return _state(ds, str(dims[0])), _state(ds, str(dims[1]))


def _state(ds: xr.Dataset, name: str) -> Side:
    starts = np.asarray(ds[name].values, dtype=float)
    scale = display_scale(ds[name].attrs.get("units", ""), float(np.abs(starts).max()))
    return Side(name, scale.label(name), scale, starts)


def parameter(ds: xr.Dataset, name: str) -> Side:
    """Axis of a parameter; logarithmic if its values have equal steps in their logarithms."""
    values = np.asarray(ds[name].values, dtype=float)
    log = is_log(values)
    scale = parameter_scale(values, ds[name].attrs.get("units", ""), log)
    return Side(name, scale.label(name.replace("_", " ")), scale, values, log)


def _edges(centres: np.ndarray) -> np.ndarray:
    """Edges half-way between neighbours; the outer cells are symmetric."""
    if centres.size == 1:
        half = 0.5 * abs(centres[0]) or 0.5
        return np.array([centres[0] - half, centres[0] + half])
    between = 0.5 * (centres[1:] + centres[:-1])
    return np.concatenate([[2 * centres[0] - between[0]], between, [2 * centres[-1] - between[-1]]])


# -- colours of cells ------------------------------------------------------------------------------
def paint(
    codes: np.ndarray, colors: Mapping[int, np.ndarray], level: np.ndarray | None = None
) -> np.ndarray:
    """The colour of each cell, uint8, shape (A, B, 3).

    Parameters
    ----------
    codes : array, shape (A, B)
        Attractor ids or kinds, and negative codes. NaN, or a code that has no colour, is drawn as
        not computed.
    colors : mapping of int to array of shape (3,)
        The colour of each code, sRGB in 0 to 1; negative ones have those of :data:`UNSETTLED` by
        default.
    level : array of int, shape (A, B), optional
        Shade of each cell that settles, 0 to 64.
    """
    looks = {code: np.array(to_rgb(one.color)) for code, one in UNSETTLED.items()} | dict(colors)
    row = {code: i for i, code in enumerate(looks)}
    found, where = np.unique(
        np.nan_to_num(np.asarray(codes), nan=Kind.NOT_COMPUTED), return_inverse=True
    )
    rows = np.array([row.get(int(code), row[Kind.NOT_COMPUTED]) for code in found])
    table = np.stack(list(looks.values()))[:, None]
    if level is not None:
        table = table.repeat(LEVELS, axis=1)
        settled = [i for code, i in row.items() if code >= 0]
        table[settled] = shades(table[settled, 0], LEVELS)
    painted: np.ndarray = np.round(255 * table).astype(np.uint8)[
        rows[where.reshape(np.shape(codes))], 0 if level is None else level
    ]
    return painted


def draw_cells(ax: Axes, sides: Sides, colors: np.ndarray) -> None:
    """Colour every cell, uint8, shape (A, B, 3), and name the axes.

    No colours are mixed, however small the cells: a mixture of two hues would be taken for a third
    attractor.
    """
    x, y = (side.edges for side in sides)
    image = np.ascontiguousarray(colors.swapaxes(0, 1))
    if all(_is_even(side) for side in sides):
        ax.imshow(
            image,
            origin="lower",
            extent=(x[0], x[-1], y[0], y[-1]),
            interpolation="nearest",
            aspect="auto",
            zorder=0,
            rasterized=True,
        )
    else:
        ax.pcolormesh(x, y, image, zorder=0, rasterized=True)
        for set_scale, side in zip((ax.set_xscale, ax.set_yscale), sides, strict=True):
            set_scale("log" if side.log else "linear")
    ax.set_xlim(x.min(), x.max())
    ax.set_ylim(y.min(), y.max())
    ax.set_xlabel(sides[0].label)
    ax.set_ylabel(sides[1].label)


def _is_even(side: Side) -> bool:
    """True if all cells have one width, like those of an image."""
    edges = side.edges
    width = (edges[-1] - edges[0]) / (edges.size - 1)
    return not side.log and np.allclose(np.diff(edges), width, rtol=1e-6, atol=0.0)
