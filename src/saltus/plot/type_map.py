"""Map of two parameters: which kind of motion a start settles to."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.patches import Patch

from saltus.errors import ParameterError, shown
from saltus.plot import axes as draw
from saltus.plot import maps, motion_colors
from saltus.plot import response_points as points
from saltus.plot.picture import PictureError, caller, picture
from saltus.plot.style import Scale
from saltus.results.dataset.kinds import Kind
from saltus.results.dataset.schema import parameters_of, start_name, states_of
from saltus.units import from_si

#: Where a start settles to nothing: white and pale greys, as chaos is dark.
_PALE = {
    Kind.ESCAPED: "#FFFFFF",
    Kind.UNCONVERGED: "#D2D2D2",
    Kind.FAILED: "#B9A9A0",
    Kind.NOT_COMPUTED: "#F3F3F3",
}
_UNSETTLED: dict[int, tuple[str, str]] = {
    code: (maps.UNSETTLED[code].label, color) for code, color in _PALE.items()
}


@picture(needs=("type", "period", "response_of"))
def type_map(ds: xr.Dataset, *, start: int = 0, legend: bool = True, ax: Any = None) -> Axes:
    """Kind of motion over two parameters: a hue for each period, grey for motion that never
    repeats, chaos dark.

    The hues are those of :func:`saltus.plot.bifurcation_diagram`. An axis is logarithmic where its
    values are even in their logarithms.

    Parameters
    ----------
    ds : Dataset
        What ``sl.bifurcation_diagram`` returned with two entries in ``vary``.
    start : int
        Which start, by its number: each leads to a map of its own.
    legend : bool
        Whether to draw the legend of the colours, with their shares.
    ax : Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    Axes

    Raises
    ------
    ParameterError
        If ``ds`` isn't over two parameters, or there is no such start.
    """
    pair = parameters_of(ds)
    if len(pair) != 2:
        raise PictureError(
            f"{caller()} draws two parameters, this Dataset has {', '.join(pair) or 'none'}. See "
            f"plot.bifurcation_diagram."
        )
    one = _of_start(ds, start)
    code = np.where(
        one["response_of"].values < 0,
        one["response_of"].values,
        motion_colors.codes(one["type"].values, one["period"].values),
    )
    with draw.panels(ax, 1, (5.8, 3.9)) as (panel,):
        _cells(panel, ds, (pair[0], pair[1]), code)
        panel.set_title(_title(ds, start))
        if legend:
            handles = [_handle(key, code, one["period"].values) for key in _order(code)]
            panel.legend(
                handles=handles,
                loc="upper left",
                bbox_to_anchor=(1.02, 1),
                handlelength=1.0,
                handleheight=0.9,
            )
    return panel


def _of_start(ds: xr.Dataset, start: int) -> xr.Dataset:
    if "start" not in ds.dims:
        return ds
    if start not in ds["start"].values.tolist():
        raise ParameterError(
            f"there is no start {shown(start)}; this Dataset has "
            f"{ds.sizes['start']}, counted from 0."
        )
    return ds.sel(start=start)


def _cells(ax: Axes, ds: xr.Dataset, pair: tuple[str, str], code: np.ndarray) -> None:
    """Colour every cell; log axes get cells of even width there."""
    logs = [points.is_log(ds[name].values) for name in pair]
    scales = [
        points.parameter_scale(ds[name].values, ds[name].attrs.get("units", ""), log)
        for name, log in zip(pair, logs, strict=True)
    ]
    colors = np.zeros((*code.shape, 3), dtype=np.uint8)
    for key in _order(code):
        colors[code == key] = maps.as_bytes(_color(key))
    if any(logs):
        x, y = (
            _edges(ds[name].values * scale.factor, log)
            for name, scale, log in zip(pair, scales, logs, strict=True)
        )
        ax.pcolormesh(x, y, np.ascontiguousarray(colors.swapaxes(0, 1)), zorder=0, rasterized=True)
        for set_scale, log in zip((ax.set_xscale, ax.set_yscale), logs, strict=True):
            set_scale("log" if log else "linear")
        ax.set_xlim(x[0], x[-1])
        ax.set_ylim(y[0], y[-1])
        _name(ax, pair, scales)
    else:
        maps.draw_cells(ax, ds.transpose(*pair, ...), pair, (scales[0], scales[1]), colors)
        _name(ax, pair, scales)


def _edges(values: np.ndarray, log: bool) -> np.ndarray:
    return np.exp(maps.edges(np.log(values))) if log else maps.edges(values)


def _name(ax: Axes, pair: tuple[str, str], scales: list[Scale]) -> None:
    ax.set_xlabel(scales[0].label(pair[0].replace("_", " ")))
    ax.set_ylabel(scales[1].label(pair[1].replace("_", " ")))


def _order(code: np.ndarray) -> list[int]:
    """Kinds in the order of the legend: by period, then what never repeats, then what never
    settles.
    """
    found = np.unique(code).tolist()
    return [key for key in found if key > 0] + [key for key in found[::-1] if key < 0]


def _color(key: int) -> np.ndarray:
    return motion_colors.color(key, dots=False) if key > 0 else np.array(to_rgb(_UNSETTLED[key][1]))


def _handle(key: int, code: np.ndarray, period: np.ndarray) -> Patch:
    name = motion_colors.label(key, period) if key > 0 else _UNSETTLED[key][0]
    return Patch(
        fc=_color(key),
        ec="#999999",
        lw=0.4,
        label=f"{name}, {maps.share_text(float((code == key).mean()))}",
    )


def _title(ds: xr.Dataset, start: int) -> str:
    """The start in words; of a sweep its direction."""
    one = ds.sel(start=start) if "start" in ds.dims else ds
    if "start_direction" in one.coords:
        return f"swept {one['start_direction'].item()}"
    names = [name for name in states_of(ds) if start_name(name) in one.coords]
    return ", ".join(
        f"{name} = "
        f"{from_si(float(one[start_name(name)]), one[start_name(name)].attrs.get('units', ''), 4)}"
        for name in names
    )
