"""Shares of the basins of responses over a parameter, as bands on top of each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb

from saltus.errors import ParameterError
from saltus.intervals import wilson
from saltus.plot import cells, curves
from saltus.plot import response_points as points
from saltus.plot.palette import hues
from saltus.plot.picture import picture
from saltus.plot.style import QUIET, Scale, display_scale
from saltus.plot.unsettled import UNSETTLED
from saltus.results.dataset.schema import kind_text

#: Most bands of branches; those of the smallest shares are one band.
MOST = 10
#: Colour of the branches that have no band of their own.
_REST = "#C9C2B5"


@dataclass(frozen=True)
class Band:
    """The starts that lead to one branch, to one of the small ones, or to no response.

    Attributes
    ----------
    name : str
        Its name in the legend.
    color : array of float, shape (3,)
        sRGB in 0 to 1.
    count : array of int, shape (value,)
        Number of starts at each value of the parameter.
    """

    name: str
    color: np.ndarray
    count: np.ndarray


@picture(needs=points.NEEDS)
def shares(
    ds: xr.Dataset,
    *,
    quantity: curves.Size = "peak",
    output: str | None = None,
    legend: bool = True,
    ax: Axes | None = None,
) -> Axes:
    """Share of the starts that lead to each branch of responses over a parameter: bands on top of
    each other.

    A pale strip about the edge of a band is the 95 % Wilson interval of the share of all that lies
    below the edge. Bands are in the order of their periods, then of their sizes. The smallest
    branches are one band where there are more than ten.

    Parameters
    ----------
    ds : Dataset
        Result of ``sl.frequency_response`` or ``sl.bifurcation_diagram`` over one parameter from
        random starts: ``start="random 200"`` with ``box``.
    quantity : str
        The size that the legend tells of each branch, as for
        :func:`saltus.plot.frequency_response`.
    output : str, optional
        A state, or an output that was asked for, of which it is told; default the first state.
    legend : bool
        Whether to draw the legend.
    ax : Axes, optional
        Axes to draw into; a new figure by default.

    Returns
    -------
    Axes

    Raises
    ------
    ParameterError
        If ``ds`` isn't over one parameter, or its starts weren't random.

    References
    ----------
    Wilson, J. Am. Stat. Assoc. 22 (1927) 209-212.
    """
    curves.check_quantity(quantity, curves.SIZES[:-2])
    (one,) = points.shown(ds)
    if not ds.attrs.get("random_starts") or "start" not in ds.dims:
        raise ParameterError(
            "the starts of this Dataset weren't drawn at random, so that shares of them say "
            'nothing of basins. Compute it with start="random 200" and box.'
        )
    bands = _bands(ds, curves.height(ds, quantity, output))
    frame = curves.frame(
        ax, 3.4, [curves.Curves(one, None)], Scale(1.0, ""), events=False, legend=legend
    )
    with frame as (panel, _):
        edges = cells.parameter(ds, one.axis).edges
        edges[[0, -1]] = panel.get_xlim()
        _stack(panel, edges, bands, ds.sizes["start"])
        panel.set_ylabel("share of the starts")
        panel.set_ylim(0, 1)
    return panel


def _stack(ax: Axes, edges: np.ndarray, bands: list[Band], starts: int) -> None:
    """Draw bands from the top down, then the edges between them with their intervals; ``edges``
    are those of the values, float64[value + 1].
    """
    x = np.repeat(edges, 2)[1:-1]
    tops = np.cumsum([band.count for band in bands], axis=0)
    for band, top in zip(bands[::-1], tops[::-1], strict=True):
        low, high = (np.repeat(count / starts, 2) for count in (top - band.count, top))
        ax.fill_between(x, low, high, fc=band.color, lw=0, label=band.name, gid=f"band {band.name}")
    for band, top in zip(bands, tops, strict=True):
        there = np.repeat((band.count > 0) & (top < starts), 2)
        low, high = (np.repeat(end, 2) for end in wilson(top, starts))
        ax.fill_between(
            x, low, high, where=there, fc="white", alpha=0.45, lw=0, gid=f"interval {band.name}"
        )
        ax.plot(x, np.where(there, np.repeat(top / starts, 2), np.nan), color=QUIET, lw=0.6)


def _bands(ds: xr.Dataset, of: curves.Height) -> list[Band]:
    """Bands of the branches by period and size, of the small ones together, of starts without a
    response.
    """
    reached = ds["response_of"].values
    branch = ds["response_branch"].values
    on = np.where(reached >= 0, branch[np.maximum(reached, 0)], reached)
    numbers = np.unique(on[on >= 0])
    total = [np.count_nonzero(on == number) for number in numbers]
    large = numbers[np.argsort(total, kind="stable")[::-1][:MOST]]
    rows = {number: np.flatnonzero(branch == number) for number in large.tolist()}
    period = ds["response_period"].values
    order = sorted(
        rows,
        key=lambda one: (
            period[rows[one]].min() == 0,
            period[rows[one]].min(),
            np.nanmax(of.values[rows[one]], initial=0.0),
        ),
    )
    bands = [
        Band(_name(ds, rows[one], of), color, np.count_nonzero(on == one, axis=1))
        for one, color in zip(order, hues(len(order)), strict=True)
    ]
    if small := len(numbers) - len(large):
        others = (on >= 0) & ~np.isin(on, large)
        name = f"{small} smaller branch{'es' if small > 1 else ''}"
        bands.append(Band(name, np.array(to_rgb(_REST)), np.count_nonzero(others, axis=1)))
    for code, look in UNSETTLED.items():
        if (on == code).any():
            color = np.array(to_rgb(look.color))
            bands.append(Band(look.label, color, np.count_nonzero(on == code, axis=1)))
    return bands


def _name(ds: xr.Dataset, rows: np.ndarray, of: curves.Height) -> str:
    """A branch in the legend: its kinds, its largest size, and its number."""
    kinds = zip(ds["response_type"].values[rows], ds["response_period"].values[rows], strict=True)
    words = list(dict.fromkeys(kind_text(str(kind), int(period)) for kind, period in kinds))
    text = ", ".join(words[:2]) + (" ..." if len(words) > 2 else "")
    size = float(np.nanmax(of.values[rows], initial=0.0))
    shown = display_scale(of.unit, size).text(float(f"{size:.3g}"))
    return f"{text}, to {shown} (branch {int(ds['response_branch'].values[rows[0]])})"
