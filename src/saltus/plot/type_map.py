"""Map of two parameters: the kind of motion that a start settles to."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.patches import Patch

from saltus.errors import ParameterError, shown
from saltus.plot import axes as draw
from saltus.plot import cells, motion_colors
from saltus.plot.picture import PictureError, caller, picture
from saltus.plot.unsettled import UNSETTLED
from saltus.results.dataset.kinds import Kind
from saltus.results.dataset.schema import parameters_of, start_name, states_of
from saltus.units import from_si

#: Colours of starts that settle to nothing: white and pale greys, as chaos is dark.
_PALE = {
    Kind.ESCAPED: "#FFFFFF",
    Kind.UNCONVERGED: "#D2D2D2",
    Kind.FAILED: "#B9A9A0",
    Kind.NOT_COMPUTED: "#F3F3F3",
}
_UNSETTLED: dict[int, tuple[str, str]] = {
    code: (UNSETTLED[code].label, color) for code, color in _PALE.items()
}


@picture(needs=("type", "period", "response_of"))
def type_map(
    ds: xr.Dataset, *, start: int = 0, legend: bool = True, ax: Axes | None = None
) -> Axes:
    """Kind of motion over two parameters: a hue for each period, grey for motion that never
    repeats, chaos dark.

    The hues are those of :func:`saltus.plot.bifurcation_diagram`. An axis is logarithmic where its
    values are even in their logarithms.

    Parameters
    ----------
    ds : Dataset
        Result of ``sl.bifurcation_diagram`` with two entries in ``vary``.
    start : int
        Number of the start. Each start has its own map.
    legend : bool
        Whether to draw the legend of the colours, with their shares.
    ax : Axes, optional
        Axes to draw into; a new figure by default.

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
    chosen = _of_start(ds, start).transpose(*pair, ...)
    code = np.where(
        chosen["response_of"].values < 0,
        chosen["response_of"].values,
        motion_colors.codes(chosen["type"].values, chosen["period"].values),
    )
    sides = cells.parameter(ds, pair[0]), cells.parameter(ds, pair[1])
    with draw.panels(ax, 1, (5.8, 3.9)) as (panel,):
        colors = {key: _color(key) for key in _order(code)}
        cells.draw_cells(panel, sides, cells.paint(code, colors))
        panel.set_title(_title(ds, start))
        if legend:
            handles = [_handle(key, code, chosen["period"].values) for key in _order(code)]
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


def _order(code: np.ndarray) -> list[int]:
    """Kinds in the order of the legend: by period, then motion that never repeats, then starts that
    never settle.
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
        label=f"{name}, {cells.share_text(float((code == key).mean()))}",
    )


def _title(ds: xr.Dataset, start: int) -> str:
    """Start in words; the direction of a sweep."""
    ds = ds.sel(start=start) if "start" in ds.dims else ds
    if "start_direction" in ds.coords:
        return f"swept {ds['start_direction'].item()}"
    names = [name for name in states_of(ds) if start_name(name) in ds.coords]
    return ", ".join(
        f"{name} = "
        f"{from_si(float(ds[start_name(name)]), ds[start_name(name)].attrs.get('units', ''), 4)}"
        for name in names
    )
