"""Parts of every picture of a run: coloured pieces of curve, gap lines, contact regions, limits,
notes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from itertools import pairwise
from typing import Any, Literal, TypeAlias

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.legend import Legend
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import BboxBase

from saltus.errors import ParameterError
from saltus.plot.picture import drawable
from saltus.plot.regions import Regions
from saltus.plot.style import QUIET, RASTERISE_ABOVE, Scale, style, styled

Direction = Literal["x", "y"]
#: Axes of the user, one for each panel of a picture.
Panels: TypeAlias = Axes | Sequence[Axes] | np.ndarray
#: A gap is drawn into the limits if the axis grows by no more than this: an orbit far inside its
#: gap must stay visible.
_WIDEN = 2.0
#: Numbers that differ by no more than this share of their size are one number.
_FLAT = 1e-12
#: Mark of gap lines, contact regions and their names, by direction.
GAP_NAMES = "saltus-gaps-{}"
#: Room that the name of a gap takes above a picture, in widths of the Axes.
_NAME = 0.45


@contextmanager
def panels(ax: Panels | None, count: int, size: tuple[float, float]) -> Iterator[list[Axes]]:
    """Axes to draw into: those of the user, or a new figure of panels, one above the other, in
    saltus's style.
    """
    if ax is not None:
        given = _given(ax, count)
        with style() if all(styled(one.get_figure(root=True)) for one in given) else nullcontext():
            yield given
        return
    with style():
        _, grid = plt.subplots(count, 1, figsize=(size[0], size[1] * count), squeeze=False)
        yield list(grid[:, 0])


def _given(ax: Any, count: int) -> list[Axes]:
    """Axes of the user, one for each panel."""
    several = isinstance(ax, list | tuple | np.ndarray)
    axes = list(np.ravel(np.asarray(ax, dtype=object))) if several else [ax]
    if not all(isinstance(one, Axes) for one in axes):
        raise ParameterError(
            f"ax={type(ax).__name__}. Give matplotlib Axes, such as plt.subplots() makes."
        )
    if len(axes) != count:
        raise ParameterError(
            f"{count} trajectories need {count} Axes, not {len(axes)}. Choose one with trajectory=."
        )
    return axes


def draw_pieces(
    ax: Axes, x: np.ndarray, y: np.ndarray, region: np.ndarray, regions: Regions, width: float
) -> None:
    """Draw one line for each region that occurs. NaN separates pieces of the same region;
    neighbours share the point between them.
    """
    starts = np.concatenate([[0], np.flatnonzero(np.diff(region)) + 1])
    stops = np.concatenate([starts[1:] + 1, [region.size]])
    for k in np.unique(region):
        mine = [np.arange(a, b) for a, b in zip(starts, stops, strict=True) if region[a] == k]
        xs, ys = (_join([values[piece] for piece in mine]) for values in (x, y))
        ax.plot(
            xs,
            ys,
            color=regions.regions[k].color,
            label=regions.regions[k].label or None,
            lw=width,
            zorder=2,
            solid_capstyle="butt",
        )


def _join(pieces: Sequence[np.ndarray]) -> np.ndarray:
    """Pieces one after the other, NaN between them."""
    return np.concatenate([part for piece in pieces for part in (piece, [np.nan])][:-1])


def draw_points(ax: Axes, x: np.ndarray, y: np.ndarray, **marks: Any) -> None:
    """Draw markers, which the limits of the Axes don't cut. If there are many they become pixels in
    vector files.
    """
    (points,) = ax.plot(x, y, ls="none", rasterized=x.size > RASTERISE_ABOVE, **marks)
    points.set_clip_box(_Around(ax, points.get_markersize() / 2 + points.get_markeredgewidth()))


class _Around(BboxBase):
    """Frame of an Axes, wider by some points (1/72 inch) on each side, at any size of the
    figure.
    """

    def __init__(self, ax: Axes, wider: float) -> None:
        super().__init__()
        self._ax, self._wider = ax, wider
        self.set_children(ax.bbox)

    def get_points(self) -> np.ndarray:
        """Corners [pixel]."""
        figure = self._ax.get_figure(root=True)
        pixels = self._wider * (figure.dpi if figure is not None else 72) / 72
        return np.asarray(self._ax.bbox.padded(pixels).get_points())


def set_limits(
    ax: Axes,
    direction: Direction,
    values: np.ndarray,
    marks: Sequence[float] = (),
    margin: float = 0.06,
) -> None:
    """Set limits around the finite values, and around the marks if the axis doesn't grow too much.

    An Axes that was drawn into before keeps what it showed.
    """
    finite = values[np.isfinite(values)]
    if not finite.size:
        return
    low, high = float(finite.min()), float(finite.max())
    drawn = ax.dataLim.intervalx if direction == "x" else ax.dataLim.intervaly
    if np.isfinite(drawn).all():
        low, high = min(low, float(drawn[0])), max(high, float(drawn[1]))
    if high - low <= _FLAT * max(abs(low), abs(high)):  # what is at rest moves by rounding only
        low = high = 0.5 * (low + high)
    span = high - low or abs(high) or 1.0
    for mark in marks:
        if max(high, mark) - min(low, mark) <= _WIDEN * span:
            low, high = min(low, mark), max(high, mark)
    pad = margin * (high - low or span)
    (ax.set_xlim if direction == "x" else ax.set_ylim)(low - pad, high + pad)


def few_ticks(ax: Axes) -> None:
    """Set few ticks, with a common power of ten in place of leading zeros, so that numbers under a
    narrow picture don't touch.
    """
    ax.xaxis.set_major_locator(MaxNLocator(nbins=5))
    ax.ticklabel_format(axis="x", style="sci", scilimits=(-3, 5), useMathText=True)


def draw_gaps(
    ax: Axes, direction: Direction, regions: Regions, scale: Scale, label: bool = True
) -> None:
    """Draw gap lines dashed and named, and contact regions lightly shaded: once for an Axes, after
    its limits are set.
    """
    tag = GAP_NAMES.format(direction)
    if any(artist.get_gid() == tag for artist in ax.get_children()):
        return
    low, high = ax.get_xlim() if direction == "x" else ax.get_ylim()
    far = 1e3 * (high - low)  # so that a later change of the limits finds the region shaded too
    transform = ax.get_xaxis_transform() if direction == "x" else ax.get_yaxis_transform()
    for region in regions.regions:
        if region.contact:
            a, b = (
                np.clip(edge * scale.factor, low - far, high + far)
                for edge in (region.below, region.above)
            )
            corner, size = ((a, 0), (b - a, 1)) if direction == "x" else ((0, a), (1, b - a))
            ax.add_artist(
                Rectangle(
                    corner,
                    *size,
                    transform=transform,
                    fc=region.color,
                    alpha=0.07,
                    ec="none",
                    zorder=0,
                    gid=tag,
                )
            )
    line = ax.axvline if direction == "x" else ax.axhline
    names: list[tuple[float, str, bool]] = []
    for i, boundary in enumerate(regions.boundaries):
        position = boundary.value * scale.factor
        line(position, color=QUIET, lw=0.7, ls=(0, (4, 3)), zorder=1, gid=tag)
        if label and low <= position <= high:
            # Near the lower end, a name on the lower side would touch the ticks.
            lower = i == 0 and len(regions.boundaries) > 1 and position - low > 0.12 * (high - low)
            # Near the upper end, a name on the upper side would touch the title.
            high_up = direction == "y" and high - position < 0.12 * (high - low)
            names.append(
                (position, f"{boundary.label}\n{scale.text(boundary.value)}", lower or high_up)
            )
    if names:
        _name_gaps(ax, direction, names, tag)


def _name_gaps(
    ax: Axes, direction: Direction, names: list[tuple[float, str, bool]], tag: str
) -> None:
    """Name gap lines outside the Axes. Each name has a position, a text, and True for the lower
    (left) side.

    Above the picture they are labels of an axis of its own, which a title keeps clear of.
    """
    if direction == "y":
        for position, text, below in names:
            ax.text(
                1.01,
                position,
                text,
                transform=ax.get_yaxis_transform(),
                va="top" if below else "bottom",
                ha="left",
                color=QUIET,
                fontsize=7,
                linespacing=1.1,
            )
        return
    top = ax.secondary_xaxis("top")
    top.set_gid(tag)
    top.spines[:].set_visible(False)
    top.tick_params(length=0, pad=1, labelsize=7, labelcolor=QUIET)
    low, high = ax.get_xlim()
    close = [a[2] == b[2] and b[0] - a[0] < _NAME * (high - low) for a, b in pairwise(names)]
    texts = [
        drawable(f"{text}\n\n" if raised else text)
        for (_, text, _), raised in zip(names, [*close, False], strict=True)
    ]  # one above the other
    top.set_xticks([position for position, _, _ in names], texts, linespacing=1.1)
    for tick, (_, _, left) in zip(top.xaxis.get_major_ticks(), names, strict=True):
        tick.label2.set_horizontalalignment("right" if left else "left")


def legend(ax: Axes, regions: Regions, **place: Any) -> None:
    """Name the colours and markers: regions from the top of the picture to its bottom, then the
    others, in as many columns as fit the figure.
    """
    handles, labels = ax.get_legend_handles_labels()
    # Several trajectories share names: each name is listed once.
    first = dict(zip(labels[::-1], handles[::-1], strict=True))
    known = [region.label for region in regions.regions[::-1] if region.label in first]
    if regions.state is None:
        known.sort(key=lambda label: (label != "free", label))
    order = list(dict.fromkeys([*known, *labels]))
    if order:
        columns = place.pop("ncols", 1)
        shown = ax.legend([first[label] for label in order], order, ncols=columns, **place)
        while columns > 1 and not _fits(ax, shown):
            columns = min(columns, len(order)) - 1
            shown = ax.legend([first[label] for label in order], order, ncols=columns, **place)


def _fits(ax: Axes, shown: Legend) -> bool:
    """True if a legend is no wider than the figure."""
    figure = ax.get_figure(root=True)
    return figure is None or shown.get_window_extent().width <= figure.bbox.width


def status_text(ds: xr.Dataset) -> str:
    """Status of a trajectory that stopped early or has an undecided graze; else ""."""
    status = str(ds["status"].values)
    if status == "ok":
        return ""
    stopped = status != "graze_unresolved" and "end_time" in ds
    return f"status: {status}" + (f", stopped at {float(ds['end_time']):.6g} s" if stopped else "")


def note_status(ax: Axes, ds: xr.Dataset) -> None:
    """Note in the picture that a trajectory stopped early, or has an undecided graze."""
    text = status_text(ds)
    if text:
        ax.text(
            0.99,
            0.02,
            text,
            transform=ax.transAxes,
            ha="right",
            va="bottom",
            fontsize=7,
            color="#A00000",
        )


def say(ax: Axes, text: str, *datasets: xr.Dataset) -> None:
    """Write a sentence in place of an empty frame, with the ends of the trajectories."""
    singles = [
        one
        for ds in datasets
        for one in (
            [ds.sel(trajectory=i) for i in ds["trajectory"]] if "trajectory" in ds.dims else [ds]
        )
    ]
    ends = [status_text(one) for one in singles]
    ax.set_axis_off()
    ax.text(0.02, 0.95, text, transform=ax.transAxes, va="top", linespacing=1.6)
    if any(ends):
        ax.text(
            0.02,
            0.05,
            "\n".join(dict.fromkeys(filter(None, ends))),
            transform=ax.transAxes,
            va="bottom",
            fontsize=7,
            color="#A00000",
        )


def count_at_top(ax: Axes, unit: float, ticks: int) -> Any:
    """Add a second axis at the top, in multiples of a unit of the axis below."""

    def count(below: Any) -> Any:
        return np.asarray(below, dtype=float) / unit

    def place(above: Any) -> Any:
        return np.asarray(above, dtype=float) * unit

    top = ax.secondary_xaxis("top", functions=(count, place))
    top.xaxis.set_major_locator(MaxNLocator(nbins=ticks, steps=[1, 2, 5, 10], integer=True))
    return top
