"""Map of two parameters: the size of the motion that a start settles to, and its kind."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import ListedColormap, LogNorm, Normalize, to_rgb
from matplotlib.patches import Patch
from matplotlib.ticker import FormatStrFormatter, LogLocator

from saltus.errors import ParameterError
from saltus.plot import axes as draw
from saltus.plot import cells, curves, motion_colors
from saltus.plot import response_points as points
from saltus.plot.bifurcation_curves import check_pair, draw_over, named
from saltus.plot.picture import picture
from saltus.plot.style import QUIET, display_scale
from saltus.plot.type_map import TypeMap, mapped
from saltus.plot.unsettled import UNSETTLED
from saltus.results.dataset.schema import parameters_of

#: Hatching of the kinds of motion; what follows the forcing period for period has none.
_HATCHES = {
    2: "////", 3: "\\\\\\\\", 4: "xxxx", 5: "----", 6: "||||", 7: "++++", 8: "//--",
    motion_colors.LONG: "\\\\||", motion_colors.QUASI_PERIODIC: "....",
    motion_colors.CHAOTIC: "oooo", motion_colors.EQUILIBRIUM: "**",
    motion_colors.NOT_REPEATING: "OO",
}  # fmt: skip
#: Sizes from light to dark, light enough throughout that hatching can be read; grey is left to
#: starts without a response.
_SIZES = ListedColormap(colormaps["YlGnBu"](np.linspace(0.04, 0.72, 256)))
#: Colour of hatching.
_INK = "#1A1A1A"
#: Left edge of the legend, in widths of the bar of sizes: beyond its numbers.
_BEYOND = 5.0


@picture(needs=("type", "period", "response_of"))
def amplitude_map(
    ds: xr.Dataset,
    *,
    quantity: curves.Size = "peak",
    output: str | None = None,
    start: int = 0,
    bifurcations: Any = None,
    log: bool = False,
    legend: bool = True,
    ax: Axes | None = None,
) -> Axes:
    """Size of the motion that a start settles to over two parameters, its kind as hatching, and
    curves of bifurcations.

    What has the period of the forcing isn't hatched. Starts without a response are grey, as on a
    map of basins. An axis is logarithmic where its values are even in their logarithms.

    Parameters
    ----------
    ds : Dataset
        Result of ``sl.bifurcation_diagram`` with two entries in ``vary``.
    quantity : str
        The size that is drawn, as for :func:`saltus.plot.frequency_response`.
    output : str, optional
        A state, or an output that was asked for; default the first state.
    start : int
        Number of the start. Each start has its own map.
    bifurcations : Dataset, or sequence or mapping of Datasets, optional
        Results of :func:`saltus.bifurcation_curve` over the same two parameters; in a mapping by
        the names that the legend shows.
    log : bool
        Whether colours are even in the logarithm of the size.
    legend : bool
        Whether to draw the legend of hatching and curves.
    ax : Axes, optional
        Axes to draw into; a new figure by default.

    Returns
    -------
    Axes

    Raises
    ------
    ParameterError
        If ``ds`` isn't over two parameters, has no such start or output, or the curves are over
        other parameters.
    """
    curves.check_quantity(quantity, get_args(curves.Size))
    of = curves.height(ds, quantity, output)
    map_ = mapped(ds, start)
    if bifurcations is not None:
        over = named(bifurcations, "bifurcations")
        check_pair(over, parameters_of(ds), "ds")
    there = map_.response >= 0
    if log and not (of.values > 0).all():
        raise ParameterError(
            f"log=True, but the {quantity} isn't above zero everywhere. Leave log out."
        )
    size = np.where(there, np.append(of.values, np.nan)[map_.response], np.nan)
    largest = float(np.nanmax(np.abs(size), initial=0.0))
    up = display_scale(of.unit, largest, "deg" if quantity == "phase" else None)
    bar = _bar(up.factor * size[there], quantity, log)
    with draw.panels(ax, 1, (6.3, 3.9)) as (panel,):
        _paint(panel, map_, bar.to_rgba(up.factor * size)[..., :3])
        panel.set_title(map_.title)
        figure = panel.get_figure()
        assert figure is not None
        sizes = figure.colorbar(bar, ax=panel, pad=0.02, aspect=30)
        if log:
            sizes.set_ticks(LogLocator(subs=(1, 2, 5)), minor=False)
            sizes.formatter = FormatStrFormatter("%g")
            sizes.minorticks_off()
        label = up.label(curves.LABELS[quantity].format(of.quantity))
        sizes.ax.set_title(label, loc="left", size="medium")  # beside it stands the legend
        if bifurcations is not None:
            draw_over(panel, over, map_.sides)
        if legend:
            lines, names = panel.get_legend_handles_labels()
            known = _handles(map_) | dict(zip(names, lines, strict=True))
            points.legend(sizes.ax, known, _BEYOND)
    return panel


def _bar(size: np.ndarray, quantity: str, log: bool) -> ScalarMappable:
    """Colours of sizes [display unit]. Phases, which have no ends, have colours without ends."""
    if quantity == "phase":
        return ScalarMappable(Normalize(-180.0, 180.0), "twilight")
    low, high = (size.min(), size.max()) if size.size else (0.0, 1.0)
    if not log and quantity in curves.SIZES:
        low = 0.0
    return ScalarMappable((LogNorm if log else Normalize)(low, high), _SIZES)


def _paint(ax: Axes, map_: TypeMap, colors: np.ndarray) -> None:
    """Colour all cells, float64[A, B, 3], and hatch them by the kind of motion."""
    for code, one in UNSETTLED.items():
        colors[map_.code == code] = to_rgb(one.color)
    cells.draw_cells(ax, map_.sides, np.round(255 * colors).astype(np.uint8))
    for code in map_.codes:
        if code in _HATCHES:
            boxes = PolyCollection(
                _boxes(map_, map_.code == code), facecolors="none", edgecolors=_INK,
                linewidths=0.0, hatch=_HATCHES[code], zorder=1, gid=f"kind {code}",
            )  # fmt: skip
            ax.add_collection(boxes, autolim=False)


def _boxes(map_: TypeMap, where: np.ndarray) -> list[list[tuple[float, float]]]:
    """Corners of rectangles that cover some cells, bool[A, B]: one for each run along a column."""
    x, y = (side.edges for side in map_.sides)
    found = []
    for i, column in enumerate(where):
        ends = np.flatnonzero(np.diff(column, prepend=False, append=False))
        for a, b in ends.reshape(-1, 2):
            found.append([(x[i], y[a]), (x[i + 1], y[a]), (x[i + 1], y[b]), (x[i], y[b])])
    return found


def _handles(map_: TypeMap) -> dict[str, Any]:
    """Hatching and greys in the legend, with the shares of cells."""
    return {
        map_.label(code): Patch(
            fc=UNSETTLED[code].color if code < 0 else "white", ec=_INK if code > 0 else QUIET,
            lw=0.4, hatch=None if code < 0 else _HATCHES.get(code),
        )
        for code in map_.codes
    }  # fmt: skip
