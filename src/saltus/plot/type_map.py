"""Map of two parameters: the kind of motion that a start settles to."""

from __future__ import annotations

from dataclasses import dataclass

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
_PALE: dict[int, str] = {
    Kind.ESCAPED: "#FFFFFF",
    Kind.UNCONVERGED: "#D2D2D2",
    Kind.FAILED: "#B9A9A0",
    Kind.NOT_COMPUTED: "#F3F3F3",
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
    map_ = mapped(ds, start)
    with draw.panels(ax, 1, (5.8, 3.9)) as (panel,):
        colors = {code: _color(code) for code in map_.codes}
        cells.draw_cells(panel, map_.sides, cells.paint(map_.code, colors))
        panel.set_title(map_.title)
        if legend:
            panel.legend(
                handles=[
                    Patch(fc=_color(code), ec="#999999", lw=0.4, label=map_.label(code))
                    for code in map_.codes
                ],
                loc="upper left",
                bbox_to_anchor=(1.02, 1),
                handlelength=1.0,
                handleheight=0.9,
            )
    return panel


@dataclass(frozen=True)
class TypeMap:
    """The kinds of motion of one start over two parameters.

    Attributes
    ----------
    sides : Sides
        Both axes.
    response : array of int, shape (A, B)
        Response of each cell, or a code below zero.
    code : array of int, shape (A, B)
        Kind of each cell (:mod:`saltus.plot.motion_colors`), or a code below zero.
    period : array of int, shape (A, B)
        Period of each cell in forcing periods.
    title : str
        The start in words, or the direction of a sweep.
    """

    sides: cells.Sides
    response: np.ndarray
    code: np.ndarray
    period: np.ndarray
    title: str

    @property
    def codes(self) -> list[int]:
        """Kinds in the order of the legend: by period, then motion that never repeats, then starts
        that never settle.
        """
        found = np.unique(self.code).tolist()
        return [code for code in found if code > 0] + [code for code in found[::-1] if code < 0]

    def label(self, code: int) -> str:
        """A kind in the legend, with its share of the cells."""
        name = motion_colors.label(code, self.period) if code > 0 else UNSETTLED[code].label
        return f"{name}, {cells.share_text(float((self.code == code).mean()))}"


def mapped(ds: xr.Dataset, start: int) -> TypeMap:
    """The kinds of motion of one start. Raises ParameterError if ``ds`` isn't over two parameters,
    or there is no such start.
    """
    pair = parameters_of(ds)
    if len(pair) != 2:
        raise PictureError(
            f"{caller()} draws two parameters, this Dataset has {', '.join(pair) or 'none'}. See "
            f"plot.bifurcation_diagram."
        )
    one = _of_start(ds, start).transpose(*pair, ...)
    response, period = one["response_of"].values, one["period"].values
    code = np.where(response < 0, response, motion_colors.codes(one["type"].values, period))
    sides = cells.parameter(ds, pair[0]), cells.parameter(ds, pair[1])
    return TypeMap(sides, response, code, period, _title(ds, start))


def _of_start(ds: xr.Dataset, start: int) -> xr.Dataset:
    if "start" not in ds.dims:
        return ds
    if start not in ds["start"].values.tolist():
        raise ParameterError(
            f"there is no start {shown(start)}; this Dataset has "
            f"{ds.sizes['start']}, counted from 0."
        )
    return ds.sel(start=start)


def _color(code: int) -> np.ndarray:
    return motion_colors.color(code, dots=False) if code > 0 else np.array(to_rgb(_PALE[code]))


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
