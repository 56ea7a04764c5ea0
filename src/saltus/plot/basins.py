"""Map of basins: the attractor that each start settles to, and the time to settle."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.legend import Legend
from matplotlib.legend_handler import HandlerBase
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.text import Text

from saltus.plot import axes as draw
from saltus.plot import cells
from saltus.plot.palette import shades
from saltus.plot.picture import check, picture
from saltus.plot.style import QUIET
from saltus.plot.unsettled import UNSETTLED
from saltus.units import from_si

#: Share of the settled starts that may be lighter or darker than the ends of the scale. Without it,
#: a few late ones would make all others equally light.
_BEYOND = 0.02
#: Width of a digit, in font sizes.
_DIGIT = 0.64
#: A legend of more entries is set smaller, so that it fits next to its map.
_LONG_LEGEND = 14


@picture(checks=False)
def basins(
    ds: xr.Dataset,
    ax: Axes | None = None,
    legend: bool = True,
    order: Sequence[int] | None = None,
    points: bool = True,
    shade: bool = True,
) -> Axes:
    """Map of the basins: a hue for each attractor, darker where it takes longer to settle,
    near-black where a start doesn't.

    Cells are centred on the starts. White-edged dots are the attractors at whole forcing periods.
    Of more than two states the title says where the others start, and the method if it isn't the
    exact one.

    Parameters
    ----------
    ds : Dataset
        Result of ``sl.basins``.
    ax : Axes, optional
        Axes to draw into; a new figure by default.
    legend : bool
        Whether to draw the legend of the attractors.
    order : sequence of int, optional
        Ids of the attractors in the order of their colours, to give an attractor the same hue in
        several maps; those left out follow. By default the order of the ids: by period, then by
        amplitude.
    points : bool
        Whether to draw the attractors themselves.
    shade : bool
        Whether lightness shows the periods to settle.

    Returns
    -------
    Axes

    Raises
    ------
    ParameterError
        If ``ds`` is not from ``sl.basins``, or an argument doesn't fit it.
    """
    check(ds, ["basin", "attractor", *(["periods_to_settle"] if shade else [])])
    sides = cells.plane(ds, "basin")
    colors = cells.colors_of(ds, order)
    settling = _settling(ds) if shade else None
    with draw.panels(ax, 1, (6.3, 3.9)) as (panel,):
        level = settling.level(ds) if settling else None
        cells.draw_cells(panel, sides, cells.paint(ds["basin"].values, colors, level))
        if points:
            _points(panel, ds, sides, colors)
        if legend:
            _legend(panel, ds, sides, colors, settling, points)
        panel.set_title(
            ", ".join(filter(None, (_section(ds, sides), cells.method_text(ds)))),
            loc="left",
            fontsize=8,
            color=QUIET,
        )
    return panel


def _section(ds: xr.Dataset, sides: cells.Sides) -> str:
    """Initial values of the states that aren't axes of the map, in words; "" if there are none."""
    try:
        fixed = {
            name: float(value)
            for name, value in json.loads(ds.attrs.get("at", "{}")).items()
            if name not in [side.name for side in sides]
        }
    except (ValueError, TypeError, AttributeError):  # of another program
        return ""
    units = [
        ds[f"attractor_{name}"].attrs.get("units", "") if f"attractor_{name}" in ds else ""
        for name in fixed
    ]
    return ", ".join(
        f"{name.replace('_', ' ')} = {from_si(value, unit, 4)}"
        for (name, value), unit in zip(fixed.items(), units, strict=True)
    )


# -- cells -----------------------------------------------------------------------------------------
@dataclass(frozen=True)
class SettlingShade:
    """Periods to settle as lightness: logarithmic between the few that settle first and the few
    that settle last.
    """

    first: float
    last: float

    def share(self, periods: np.ndarray) -> np.ndarray:
        """Share of the scale: 0 for the first start that settles, 1 for the last. One is added to
        the periods: a start on the attractor needs none.
        """
        low, high = np.log1p([self.first, self.last])
        share: np.ndarray = np.clip(
            (np.log1p(np.maximum(periods, 0)) - low) / (high - low or 1.0), 0.0, 1.0
        )
        return share

    def level(self, ds: xr.Dataset) -> np.ndarray:
        """The shade of each cell, 0 to 64."""
        share = self.share(ds["periods_to_settle"].values)
        return np.round((cells.LEVELS - 1) * share).astype(np.int64)

    def ticks(self) -> list[int]:
        """Ends and middle of the scale, without repeats."""
        middle = np.expm1(0.5 * np.log1p([self.first, self.last]).sum())
        return sorted({round(value) for value in (self.first, middle, self.last)})


def _settling(ds: xr.Dataset) -> SettlingShade | None:
    """Scale of lightness; None if nothing settles, or all starts settle at once."""
    periods = ds["periods_to_settle"].values
    settled = periods[(ds["basin"].values >= 0) & (periods >= 0)]
    if not settled.size:
        return None
    first, last = np.quantile(settled, [_BEYOND, 1 - _BEYOND], method="nearest")
    return SettlingShade(float(first), float(last)) if last > first else None


# -- attractors ------------------------------------------------------------------------------------
def _stroboscopic(ds: xr.Dataset, sides: cells.Sides, key: int) -> np.ndarray:
    """The points of one attractor in the plane of the map [SI], shape (point, 2)."""
    one = ds.sel(attractor=key)
    names = [f"attractor_{side.name}" for side in sides]
    if any(name not in one for name in names):
        return np.empty((0, 2))
    both = np.stack([np.ravel(one[name].values) for name in names], axis=-1)
    finite: np.ndarray = both[np.isfinite(both).all(axis=-1)]
    return finite


def _points(
    ax: Axes,
    ds: xr.Dataset,
    sides: cells.Sides,
    colors: Mapping[int, np.ndarray],
) -> None:
    """Draw every attractor at whole periods. Those of many points come first, so that they never
    cover a single point.
    """
    clouds = {key: _stroboscopic(ds, sides, key) for key in colors}
    for key in sorted(colors, key=lambda key: -len(clouds[key])):
        cloud = clouds[key]
        if not len(cloud):
            continue
        size = _size(len(cloud), sum(map(len, clouds.values())))
        at = cloud.T * [[side.scale.factor] for side in sides]
        edge = 1.0 if size > 4 else 0.3
        draw.draw_points(
            ax, *at, marker="o", ms=size + edge + 0.9, mfc="#222222", mec="none", zorder=4
        )  # white alone is lost on light tints
        draw.draw_points(
            ax,
            *at,
            marker="o",
            ms=size,
            mfc=colors[key],
            mec="white",
            mew=edge,
            zorder=4,
            gid=f"attractor {key}",
        )


def _size(own: int, total: int) -> float:
    """Diameter of the points of an attractor [pt]: smaller if there are many, so that they hide no
    basin.
    """
    return min(
        5.5 if own <= 12 else 4.2 if own <= 40 else 2.0,
        5.5 if total <= 16 else 3.2 if total <= 60 else 2.0,
    )


# -- legend ----------------------------------------------------------------------------------------
class _Ramp(Rectangle):
    """Handle of a legend: a row of shades."""

    def __init__(self, row: np.ndarray) -> None:
        super().__init__((0, 0), 1, 1)
        self.row = row


class _Ruler(Line2D):
    """Handle of a legend: numbers along the ramps above it."""

    def __init__(self, values: Sequence[float], places: Sequence[float]) -> None:
        super().__init__([0, 1], [0, 0])
        self.values, self.places = values, places


class _DrawRamp(HandlerBase):
    """Draw a :class:`_Ramp`."""

    def create_artists(
        self,
        legend: Legend,  # noqa: ARG002
        orig_handle: Any,
        xdescent: float,
        ydescent: float,
        width: float,
        height: float,
        fontsize: float,  # noqa: ARG002
        trans: Any,
    ) -> list[Any]:
        left = np.arange(len(orig_handle.row)) * width / len(orig_handle.row)
        return [  # each reaches to the end, under the next: no seams
            Rectangle((x - xdescent, -ydescent), width - x, height, fc=color, lw=0, transform=trans)
            for x, color in zip(left, orig_handle.row, strict=True)
        ]


class _DrawRuler(HandlerBase):
    """Draw a :class:`_Ruler`."""

    def create_artists(
        self,
        legend: Legend,  # noqa: ARG002
        orig_handle: Any,
        xdescent: float,
        ydescent: float,
        width: float,
        height: float,
        fontsize: float,
        trans: Any,
    ) -> list[Any]:
        top = height - ydescent + 0.35 * fontsize
        artists: list[Any] = [
            Line2D([-xdescent, width - xdescent], [top, top], color=QUIET, lw=0.6, transform=trans)
        ]
        for value, position in _apart(
            orig_handle.values, orig_handle.places, width / (0.8 * fontsize)
        ):
            x = position * width - xdescent
            artists.append(
                Line2D([x, x], [top, top - 0.25 * fontsize], color=QUIET, lw=0.6, transform=trans)
            )
            side = "left" if position == 0 else "right" if position == 1 else "center"
            text = Text(
                x,
                top - 0.4 * fontsize,
                f"{value}",
                ha=side,
                va="top",
                color=QUIET,
                fontsize=0.8 * fontsize,
                transform=trans,
            )
            artists.append(text)
        return artists


def _apart(
    values: Sequence[float], places: Sequence[float], width: float
) -> list[tuple[float, float]]:
    """Numbers of a ruler that don't touch: the middle number is left out if it would. ``width`` is
    that of the ruler, in font sizes.
    """
    ticks = list(zip(values, places, strict=True))
    if len(ticks) == 3:
        first, middle, last = (_DIGIT * len(f"{value}") for value in values)
        at = places[1] * width
        if at - middle / 2 < first + _DIGIT or at + middle / 2 > width - last - _DIGIT:
            del ticks[1]
    return ticks


def _legend(
    ax: Axes,
    ds: xr.Dataset,
    sides: cells.Sides,
    colors: Mapping[int, np.ndarray],
    settling: SettlingShade | None,
    points: bool,
) -> None:
    """Legend of the hues, the shades and the codes that occur."""
    codes, counts = np.unique(
        np.nan_to_num(ds["basin"].values, nan=-4).astype(np.int64), return_counts=True
    )
    shares = dict(zip(codes.tolist(), (counts / ds["basin"].size).tolist(), strict=True))
    if "attractor_fraction" in ds:
        shares |= dict(
            zip(
                ds["attractor"].values.tolist(),
                ds["attractor_fraction"].values.tolist(),
                strict=True,
            )
        )
    named = [key for key in colors if shares.get(key) or _inside(ds, sides, key)]
    texts = _texts(ds, sides, named, shares)
    handles: list[Any] = [
        _Ramp(shades(colors[key][None], cells.LEVELS if settling else 1)[0][::2]) for key in named
    ]
    if settling and named:
        ticks = settling.ticks()
        shares_of_ticks, every = settling.share(np.array(ticks)).tolist(), ds.attrs.get("every")
        handles.append(
            _Ruler(
                ticks if every is None else [float(f"{tick * every:.3g}") for tick in ticks],
                shares_of_ticks,
            )
        )
        texts.append(f"shade: {'periods' if every is None else 's'} to settle")
    for code, unsettled in UNSETTLED.items():
        if code in shares:
            handles.append(_Ramp(np.array([to_rgb(unsettled.color)])))
            texts.append(f"{unsettled.label}, {cells.share_text(shares[code])}")
    if points and colors and any(len(_stroboscopic(ds, sides, key)) for key in colors):
        handles.append(
            Line2D([], [], ls="none", marker="o", ms=5, mfc="#BBBBBB", mec="#222222", mew=0.7)
        )
        texts.append(
            "points of the attractors"
            if "attractor_cycle" in ds
            else "Poincaré points of the attractors"
        )
    if len(named) < len(colors):
        handles.append(Line2D([], [], ls="none"))
        texts.append(f"{len(colors) - len(named)} more that no start of the map leads to")
    if handles:
        small = len(handles) > _LONG_LEGEND
        drawing = {_Ramp: _DrawRamp(), _Ruler: _DrawRuler()}
        ax.legend(
            handles,
            texts,
            handler_map=drawing,
            loc="upper left",
            bbox_to_anchor=(1.02, 1),
            handlelength=5.5,
            handleheight=0.9,
            frameon=False,
            fontsize=6.5 if small else 8,
            labelspacing=0.35 if small else 0.55,
        )


def _texts(
    ds: xr.Dataset, sides: cells.Sides, ids: Sequence[int], shares: Mapping[int, float]
) -> list[str]:
    """Each attractor in words, with its share of the cells. Equal texts get the peaks of their
    attractors.
    """
    names = [cells.describe(ds.sel(attractor=key)) for key in ids]
    texts = []
    for key, name in zip(ids, names, strict=True):
        one = ds.sel(attractor=key)
        if names.count(name) > 1 and "attractor_peak" in one:
            name = f"{name}, {cells.peak_text(one)}"
        share = cells.share_text(shares[key]) if shares.get(key) else "no start"
        outside = (
            ", outside the map"
            if len(_stroboscopic(ds, sides, key)) and not _inside(ds, sides, key)
            else ""
        )
        texts.append(f"{name}, {share}{outside}")
    return texts


def _inside(ds: xr.Dataset, sides: cells.Sides, key: int) -> bool:
    """True if a point of the attractor lies within the axes of the map."""
    cloud = _stroboscopic(ds, sides, key) * [side.scale.factor for side in sides]
    low, high = zip(*((side.edges.min(), side.edges.max()) for side in sides), strict=True)
    return bool(((cloud >= low) & (cloud <= high)).all(axis=1).any())
