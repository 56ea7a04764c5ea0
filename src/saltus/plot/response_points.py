"""Parts of all pictures of responses: one or several Datasets, the responses that are shown, axes,
events, legends.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from saltus.errors import ParameterError
from saltus.plot import motion_colors
from saltus.plot.picture import PictureError, caller, check
from saltus.plot.style import CYCLE, QUIET, Scale, display_scale
from saltus.results.dataset.kinds import WITHOUT_WORDS
from saltus.results.dataset.schema import event_name, parameters_of, point_name, response_name

#: Input of a picture of responses: a Dataset, or several by their names.
Source = xr.Dataset | Mapping[str, xr.Dataset]
#: Variables without which no response can be drawn.
NEEDS = ("response_of", "response_branch", "response_type", "response_period")
#: Markers of Datasets that are drawn over each other.
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
#: Name and marker of each event on a branch.
MARKS = {
    "fold": ("fold", ">"), "period_doubling": ("period doubling", "D"),
    "branch_point": ("branch point", "X"), "neimark_sacker": ("Neimark-Sacker", "h"),
    "hopf": ("Hopf", "p"), "graze": ("graze", "^"), "corner": ("two contacts at once", "v"),
    "boundary_equilibrium": ("boundary equilibrium", "P"),
}  # fmt: skip
#: Height of the lowest marks of events, in heights of the Axes.
_EVENTS_AT = 1.025
#: Distance of marks that would overlap, in sizes of a mark: they stand in rows above each other.
_ROW = 1.3
#: Most rows of marks.
_MOST_ROWS = 3
#: Mark of the empty axis that keeps the title clear of the marks of events.
_ROOM = "saltus-room-of-events"
#: Largest relative difference of steps that count as equal. An axis whose steps are equal only in
#: the logarithm is logarithmic.
_EVEN = 1e-6
#: Most marks of bifurcations in full size; more are drawn smaller.
_MANY_EVENTS = 40
#: Most marks of bifurcations that stand on lines through the picture.
_FEW_EVENTS = 12
#: A legend of more entries is set smaller, so that it fits next to its picture.
_LONG_LEGEND = 14


@dataclass(frozen=True)
class Shown:
    """The responses of one Dataset that are drawn.

    Attributes
    ----------
    ds : Dataset
        With these responses only; or branches alone.
    axis : str
        The parameter that they are drawn over.
    place : array of int, shape (response,)
        Index of the response's value among the values of that parameter.
    name : str
        Name of the Dataset among several; empty for one alone.
    rank : int
        Its number among them.
    """

    ds: xr.Dataset
    axis: str
    place: np.ndarray
    name: str = ""
    rank: int = 0

    @property
    def values(self) -> np.ndarray:
        """Value of the parameter at each response [SI]."""
        return np.asarray(self.ds[response_name(self.axis)].values, dtype=float)

    @property
    def grid(self) -> np.ndarray:
        """Values of the parameter [SI]; of branches alone the ends of its range."""
        if self.axis in self.ds:
            return np.asarray(self.ds[self.axis].values, dtype=float)
        return np.array([self.ds.attrs[f"parameter_{end}"] for end in ("low", "high")])

    @property
    def unit(self) -> str:
        """Unit of the parameter."""
        known = self.ds[self.axis if self.axis in self.ds else point_name(self.axis)]
        return str(known.attrs.get("units", ""))


# -- which responses -------------------------------------------------------------------------------
def shown(source: Any) -> list[Shown]:
    """Datasets to draw, each with its remaining responses.

    Raises
    ------
    ParameterError
        If there is none, one is of another kind, has two parameters, or they aren't over the same
        parameter.
    """
    several = isinstance(source, Mapping) and not isinstance(source, xr.Dataset)
    named = dict(source) if several else {"": source}
    if not named:
        raise ParameterError(
            "there is nothing to draw. Give a Dataset, or several by name: "
            "{'exact': a, 'ode45': b}."
        )
    if len(named) > len(MARKERS):
        raise PictureError(
            f"{caller()} tells {len(MARKERS)} Datasets apart, not {len(named)}. "
            f"Draw them in several pictures."
        )
    found = [_of(ds, str(name), i) for i, (name, ds) in enumerate(named.items())]
    if len({one.axis for one in found}) > 1:
        raise ParameterError(
            f"these are over {', '.join(sorted({one.axis for one in found}))}. "
            f"Draw each in a picture of its own."
        )
    return found


def _of(ds: Any, name: str, rank: int) -> Shown:
    check(ds, NEEDS)
    axes = parameters_of(ds)
    if len(axes) != 1:
        over = (
            (
                f"{' and '.join(axes)}: choose one value, such as ds.isel({axes[-1]}=0), or draw "
                f"plot.type_map or plot.amplitude_map"
            )
            if axes
            else "no parameter"
        )
        raise PictureError(
            f"{caller()} draws responses over one parameter; this Dataset has {over}."
        )
    left = select(ds)
    values = ds[axes[0]].values
    order = np.argsort(values, kind="stable")
    place = np.searchsorted(values[order], left[response_name(axes[0])].values)
    return Shown(left, axes[0], place, name, rank)


def select(ds: xr.Dataset) -> xr.Dataset:
    """Dataset with the responses at its remaining values and starts, for example after
    ``ds.sel(frequency=...)``.

    Responses that no start leads to at any value (found by following a branch) stay.
    """
    keep = np.isin(
        np.arange(ds.sizes["response"]) if "response" not in ds.coords else ds["response"].values,
        ds["response_of"].values,
    )
    if "response_share" in ds:
        keep |= ds["response_share"].values == 0
    for coord in map(str, ds.coords):
        own = response_name(coord)
        if own in ds and ds[own].dims == ("response",):
            keep &= np.isin(ds[own].values, ds[coord].values)
    return ds.isel(response=np.flatnonzero(keep))


# -- curves ----------------------------------------------------------------------------------------
def branch_lines(shown: Shown, y: np.ndarray, mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Curves through the responses of ``mask``, neighbours on a branch joined, NaN between the
    pieces; shape (n,) each.
    """
    index = np.flatnonzero(mask)
    branch, place = shown.ds["response_branch"].values[index], shown.place[index]
    order = np.lexsort((place, branch))
    index, branch, place = index[order], branch[order], place[order]
    breaks = np.flatnonzero((np.diff(branch) != 0) | (np.diff(place) > 1)) + 1
    return np.insert(shown.values[index], breaks, np.nan), np.insert(y[index], breaks, np.nan)


# -- axes ------------------------------------------------------------------------------------------
def is_log(values: np.ndarray) -> bool:
    """True if a grid has equal steps in its logarithms rather than in its values."""
    values = np.sort(np.asarray(values, dtype=float))
    if values.size < 3 or values[0] <= 0:
        return False
    steps, ratios = np.diff(values), np.diff(np.log(values))
    return bool(np.ptp(ratios) <= _EVEN * ratios.max() and np.ptp(steps) > _EVEN * steps.max())


def parameter_scale(values: np.ndarray, unit: str, log: bool) -> Scale:
    """Display unit of a parameter. A logarithmic axis shows many sizes at once, so it has the SI
    unit.
    """
    return Scale(1.0, unit) if log else display_scale(unit, float(np.abs(values).max(initial=0.0)))


def parameter_axis(ax: Axes, datasets: Sequence[Shown]) -> Scale:
    """Set name, limits and scale of the horizontal axis; return its display unit."""
    name = datasets[0].axis
    grids = [one.grid for one in datasets]
    values, log = np.concatenate(grids), all(is_log(grid) for grid in grids)
    scale = parameter_scale(values, datasets[0].unit, log)
    if log:
        ax.set_xscale("log")
    if np.ptp(values) > 0:
        low, high = float(values.min() * scale.factor), float(values.max() * scale.factor)
        before = ax.dataLim.intervalx  # an Axes that was drawn into keeps what it showed
        if np.isfinite(before).all() and before[0] < before[1]:
            low, high = min(low, float(before[0])), max(high, float(before[1]))
        ax.set_xlim(low, high)
    ax.set_xlabel(scale.label(name.replace("_", " ")))
    return scale


# -- colours and legend ----------------------------------------------------------------------------
def dataset_color(one: Shown) -> str:
    """Colour of a Dataset among several."""
    return CYCLE[one.rank % len(CYCLE)]


def kind_handles(one: Shown, kinds: np.ndarray, markers: bool = False) -> dict[str, Line2D]:
    """Legend handles of the kinds that occur, in order, with their colours, and their markers if
    asked for.
    """
    periods = periods_of(one.ds)
    return {
        motion_colors.label(code, periods): dot(
            motion_colors.color(code), motion_colors.marker(code) if markers else "o"
        )
        for code in np.unique(kinds).tolist()
    }


def periods_of(ds: xr.Dataset) -> np.ndarray:
    """Periods of the responses and of the branches; 0 for those that don't follow a forcing."""
    parts = [ds["response_period"].values] if "response_period" in ds else []
    if "branch_periods" in ds:
        forced = ds["branch_kind"].values == "periodic"
        parts.append(np.where(forced, ds["branch_periods"].values, 0))
    return np.concatenate(parts)


def draw_events(ax: Axes, datasets: Sequence[Shown], scale: Scale) -> None:
    """Mark the events of branches above the picture, clear of its ticks. Each kind is named
    once.
    """
    rows = 0
    for shown in datasets:
        name = event_name(shown.axis)
        if name not in shown.ds or not shown.ds.sizes.get("event"):
            continue
        values, words = shown.ds[name].values * scale.factor, shown.ds["event_kind"].values
        low, high = ax.get_xlim()
        drawn = np.isin(words, list(MARKS)) & (values >= low) & (values <= high)
        values, words = values[drawn], words[drawn]
        size, width = (4.5, 0.8) if values.size <= _MANY_EVENTS else (3.0, 0.5)
        row = _rows(ax, values, size)
        rows = max(rows, int(row.max(initial=-1)) + 1)
        for word, (text, marker) in MARKS.items():
            mine = words == word
            if not mine.any():
                continue
            above = _EVENTS_AT + row[mine] * size * _ROW / _points(ax)[1]
            if values.size <= _FEW_EVENTS:
                stems = ax.vlines(
                    values[mine],
                    0,
                    above,
                    transform=ax.get_xaxis_transform(),
                    color=QUIET,
                    lw=0.5,
                    ls=":",
                    clip_on=False,
                )
                stems.set(zorder=1, gid=f"line of event {word}")
            ax.plot(
                values[mine], above, transform=ax.get_xaxis_transform(), ls="none", marker=marker,
                ms=size, mfc="white",
                mec=dataset_color(shown) if shown.name else QUIET, mew=width, clip_on=False,
                zorder=5, label=text, gid=f"event {word}",
            )  # fmt: skip
    if rows:
        _raise_titles(ax, rows)


def _points(ax: Axes) -> np.ndarray:
    """Approximate width and height of an Axes [1/72 inch]."""
    figure = ax.get_figure(root=True)
    size = (6.3, 3.4) if figure is None else figure.get_size_inches()
    return np.asarray(72.0 * np.multiply(size, ax.get_position().bounds[2:]))


def _rows(ax: Axes, values: np.ndarray, size: float) -> np.ndarray:
    """Row of each mark of a size [1/72 inch], int64[e]: the lowest of _MOST_ROWS rows in which no
    mark overlaps it, else the first.
    """
    position = ax.transAxes.inverted().transform(
        ax.transData.transform(np.stack([values, np.zeros(len(values))], axis=1))
    )[:, 0]
    apart, ends = size * _ROW / _points(ax)[0], np.full(_MOST_ROWS, -np.inf)
    row = np.zeros(len(values), np.int64)
    for i in np.argsort(position, kind="stable"):
        row[i] = int(np.argmax(free)) if (free := position[i] - ends >= apart).any() else 0
        ends[row[i]] = position[i]
    return row


def _raise_titles(ax: Axes, rows: int) -> None:
    """Make room for the marks below a title, which may be set later: titles keep clear of an axis
    at the top.
    """
    if any(one.get_gid() == _ROOM for one in ax.child_axes):
        return
    top = ax.secondary_xaxis("top")
    top.set_gid(_ROOM)
    top.spines[:].set_visible(False)
    top.tick_params(length=0, pad=4 + (rows - 1) * 4.5 * _ROW, labelsize=8)
    top.set_xticks(
        [
            float(np.sqrt(np.prod(ax.get_xlim())))
            if ax.get_xscale() == "log"
            else float(np.mean(ax.get_xlim()))
        ],
        [" "],
    )
    top.minorticks_off()


def say_if_empty(ax: Axes, datasets: Sequence[Shown]) -> None:
    """State in the picture that there are no responses, and the fate of the starts."""
    if any(shown.ds.sizes["response"] for shown in datasets):
        return
    labels = np.concatenate([shown.ds["response_of"].values.ravel() for shown in datasets])
    ends = [
        f"{count} {WITHOUT_WORDS[code].replace('_', ' ')}"
        for code in sorted(WITHOUT_WORDS, reverse=True)
        if (count := int(np.count_nonzero(labels == code)))
    ]
    values = sum(shown.ds.sizes[shown.axis] for shown in datasets)
    text = f"no response at any of {values} values" + (f":\n{', '.join(ends)}" if ends else "")
    ax.text(0.5, 0.5, text, transform=ax.transAxes, ha="center", va="center")


def legend(ax: Axes, named: Mapping[str, Any], left: float = 1.02) -> None:
    """Draw the legend of the colours, and above it that of the marks. ``left`` is its left edge, in
    widths of the Axes.
    """
    known = dict(named)
    for handle, text in zip(*ax.get_legend_handles_labels(), strict=True):
        known.setdefault(text, handle)
    if known:
        small = len(known) > _LONG_LEGEND
        ax.legend(
            list(known.values()),
            list(known),
            loc="upper left",
            bbox_to_anchor=(left, 1),
            fontsize=6.5 if small else 8,
            labelspacing=0.35 if small else 0.5,
        )


def dot(color: Any, marker: str = "o", hollow: bool = False) -> Line2D:
    """A handle of a legend."""
    return Line2D(
        [],
        [],
        ls="none",
        marker=marker,
        ms=4.5,
        mfc="none" if hollow else color,
        mec=color,
        mew=0.8 if hollow else 0.0,
    )
