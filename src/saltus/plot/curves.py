"""Curves over a parameter: responses as dots, branches as lines, in one frame."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from saltus.errors import ParameterError, among, nearest, shown
from saltus.plot import axes as draw
from saltus.plot import motion_colors
from saltus.plot import response_points as points
from saltus.plot.style import QUIET, Scale, display_scale
from saltus.results.dataset.schema import event_name, first_of, point_name, states_of

#: Quantities that both responses and points of branches have.
Size = Literal[
    "rms", "peak", "maximum", "minimum", "peak_to_peak", "mean", "rms_about_mean", "amplitude",
    "phase",
]  # fmt: skip
#: Name of each quantity on its axis.
LABELS = {
    "rms": "rms of {}", "peak": "peak |{}|", "maximum": "largest {}", "minimum": "smallest {}",
    "peak_to_peak": "peak to peak of {}", "mean": "mean of {}",
    "rms_about_mean": "rms of {} about its mean", "amplitude": "first harmonic of {}",
    "phase": "phase of {}", "transmissibility": "{}", "period": "period", "frequency": "frequency",
}  # fmt: skip
#: Quantities that begin at zero.
SIZES = ("rms", "peak", "peak_to_peak", "rms_about_mean", "amplitude", "transmissibility", "period")
#: Phases over more than this [deg] have ticks at parts of a right angle.
_WIDE_PHASE = 20.0
#: Dashes of unstable orbits.
DASHES = (0, (3.0, 1.6))
#: Diameter of the smallest dots [pt]: more than a pixel of a screen.
_SMALLEST = 0.6
#: Left edge of a legend next to the Axes, in widths of the Axes.
_BESIDE = 1.02
#: Left edge of a legend next to the names of gaps, in widths of the Axes.
_BESIDE_NAMES = 1.16


class Height(NamedTuple):
    """Heights of responses or of points [SI], their unit and their quantity."""

    values: np.ndarray
    unit: str
    quantity: str


@dataclass(frozen=True)
class Curves:
    """Curves of one Dataset.

    Attributes
    ----------
    shown : Shown
        The Dataset, with the responses that are shown.
    dots : array of float, shape (response,) or (response, sample), optional
        Heights of its responses [SI].
    along : sequence of array of float, shape (point,)
        Heights of the points of its branches [SI], each a set of curves.
    """

    shown: points.Shown
    dots: np.ndarray | None
    along: Sequence[np.ndarray] = ()

    @property
    def largest(self) -> float:
        """Largest magnitude, which decides the display unit."""
        seen = self.along if self.dots is None else [self.dots]
        return max((float(np.nanmax(np.abs(one), initial=0.0)) for one in seen), default=0.0)

    @property
    def events_above(self) -> bool:
        """True if events stand above the picture, not on the branches."""
        return self.dots is not None and bool(
            self.shown.name or not self.shown.ds.attrs.get("unstable")
        )


@dataclass(frozen=True)
class Dots:
    """Style of the dots of responses.

    Attributes
    ----------
    sizes : tuple of (float, float)
        Largest number of dots, and their diameter [pt]. Dots must not hide each other.
    aperiodic : float
        Factor on the diameter for motion that never repeats.
    first : float
        Factor on the diameter for the first of several Datasets, so that none is hidden.
    marked : bool
        Whether kinds and Datasets have markers of their own, and the first Dataset is hollow.
    """

    sizes: tuple[tuple[float, float], ...]
    aperiodic: float
    first: float
    marked: bool

    def size(self, count: int, times: float = 1.0) -> float:
        """Diameter of dots [pt], given their number."""
        return max(times * next(size for most, size in self.sizes if count <= most), _SMALLEST)


# -- quantities ------------------------------------------------------------------------------------
def check_quantity(quantity: Any, known: Sequence[str]) -> None:
    """Raise a ParameterError unless a quantity is known."""
    if not among(quantity, known):
        raise ParameterError(f"quantity={shown(quantity)} isn't known. {nearest(quantity, known)}")


def height(ds: xr.Dataset, quantity: str, output: str | None, prefix: str = "") -> Height:
    """A quantity of each response, or with the prefix ``point_`` of each point of the branches."""
    first = states_of(ds)[0]
    output = first_of(ds) if output is None else output
    if quantity in ("period", "frequency"):
        period = ds[f"{prefix}period"].values
        return Height(period, "s", "") if quantity == "period" else Height(1.0 / period, "Hz", "")
    name = output
    if not prefix and name == first and f"response_{quantity}" in ds:
        own = ds[f"response_{quantity}"]
        return Height(own.values, own.attrs.get("units", ""), first)
    chosen, unit = of_output(ds, name)
    return Height(
        chosen[f"{prefix}output_{quantity}"].values, "rad" if quantity == "phase" else unit, name
    )


def of_output(ds: xr.Dataset, name: str) -> tuple[xr.Dataset, str]:
    """The Dataset of one output, and its unit.

    Raises
    ------
    ParameterError
        If it has no such output.
    """
    known = ds["output"].values.tolist() if "output" in ds else []
    if not among(name, known):
        raise ParameterError(f"the Dataset has no output {shown(name)}. {nearest(name, known)}")
    chosen = ds.sel(output=name)
    return chosen, str(chosen["output_units"].item())


def height_scale(unit: str, drawn: Sequence[Curves], quantity: str = "") -> Scale:
    """Display unit of a quantity, over all Datasets; of a phase degrees."""
    largest = max(one.largest for one in drawn)
    return display_scale(unit, largest, "deg" if quantity == "phase" else None)


def height_axis(ax: Axes, quantity: str, long_name: str, up: Scale, log: bool = False) -> None:
    """Set name, limits and ticks of the vertical axis."""
    if log:
        ax.set_yscale("log")
    elif quantity in SIZES:
        ax.set_ylim(bottom=0)
    if quantity == "phase" and np.ptp(ax.get_ylim()) > _WIDE_PHASE:
        ax.yaxis.set_major_locator(MaxNLocator(nbins=6, steps=[1, 1.5, 3, 4.5, 9, 10]))
    ax.set_ylabel(up.label(LABELS[quantity].format(long_name)))


# -- frame -----------------------------------------------------------------------------------------
@contextmanager
def frame(
    ax: Any,
    tall: float,
    drawn: Sequence[Curves],
    up: Scale,
    look: Dots | None = None,
    *,
    events: bool,
    legend: bool,
) -> Iterator[tuple[Axes, Scale]]:
    """Draw Datasets over their parameter. Give the Axes and the display unit of the parameter to
    the caller, who draws more and names the vertical axis. Then mark events and name the colours.
    """
    datasets = [drawing.shown for drawing in drawn]
    with draw.panels(ax, 1, (6.3, tall)) as (panel,):
        across = points.parameter_axis(panel, datasets)
        named: dict[str, Any] = {}
        for drawing in drawn:
            if drawing.dots is not None and look is not None:
                named |= (_compare if drawing.shown.name else _kinds)(
                    panel, drawing, look, across, up
                )
            for curve in drawing.along:
                named |= draw_branches(panel, drawing.shown, curve, across, up)
                named |= _lost_ends(panel, drawing.shown.ds, curve, across, up)
                if events and not drawing.events_above:
                    draw_marks(panel, drawing.shown.ds, curve, across, up)
        yield panel, across
        if events:
            points.draw_events(
                panel, [drawing.shown for drawing in drawn if drawing.events_above], across
            )
        if legend:
            points.legend(panel, named, _BESIDE_NAMES if panel.texts else _BESIDE)
        if look is not None:
            points.say_if_empty(panel, datasets)


# -- responses -------------------------------------------------------------------------------------
def _flat(
    shown: points.Shown, heights: np.ndarray, mask: np.ndarray, across: Scale, up: Scale
) -> tuple[np.ndarray, np.ndarray]:
    """Dots of the responses of ``mask`` in one row; padding is left out."""
    y = heights[mask].reshape(int(mask.sum()), -1) * up.factor
    x = np.broadcast_to(shown.values[mask][:, None] * across.factor, y.shape)
    there = np.isfinite(y)
    return x[there], y[there]


def _kinds(ax: Axes, drawn: Curves, look: Dots, across: Scale, up: Scale) -> dict[str, Any]:
    """Draw each kind of motion in its colour: dots, and lines along branches without points of
    their own. Chaos lies under the others.
    """
    shown, dots = drawn.shown, np.asarray(drawn.dots)
    kinds = motion_colors.of(shown.ds)
    for code in np.unique(kinds).tolist():
        mine, repeats, color = kinds == code, motion_colors.repeats(code), motion_colors.color(code)
        if repeats and not drawn.along and dots.ndim == 1:
            x, y = points.branch_lines(shown, dots, mine)
            ax.plot(
                x * across.factor,
                y * up.factor,
                color=color,
                lw=0.8,
                zorder=2,
                gid=f"branches {code}",
            )
        x, y = _flat(shown, dots, mine, across, up)
        draw.draw_points(
            ax,
            x,
            y,
            marker=motion_colors.marker(code) if look.marked else "o",
            mfc=color,
            mec="none",
            ms=look.size(x.size, 1.0 if repeats else look.aperiodic),
            zorder=3 if repeats else 2,
            gid=f"kind {code}",
        )
    return points.kind_handles(shown, kinds, markers=look.marked)


def _compare(ax: Axes, drawn: Curves, look: Dots, across: Scale, up: Scale) -> dict[str, Any]:
    """Draw one of several Datasets in one colour. The first lies below, in larger dots."""
    shown, dots = drawn.shown, np.asarray(drawn.dots)
    x, y = _flat(shown, dots, np.ones(len(dots), dtype=bool), across, up)
    color, marker = points.dataset_color(shown), points.MARKERS[shown.rank] if look.marked else "o"
    hollow = look.marked and shown.rank == 0
    draw.draw_points(
        ax,
        x,
        y,
        marker=marker,
        ms=look.size(x.size, look.first if shown.rank == 0 else 1.0),
        mfc="none" if hollow else color,
        mec=color,
        mew=0.6 if hollow else 0.0,
        zorder=3 + 0.1 * shown.rank,
        gid=f"dataset {shown.name}",
    )
    return {shown.name: points.dot(color, marker, hollow)}


# -- branches --------------------------------------------------------------------------------------
def within_view(ds: xr.Dataset, values: np.ndarray, drawn: np.ndarray) -> np.ndarray:
    """Heights of the points of branches, float64[point], NaN far beyond ``drawn``, the heights of
    the responses. Only branches that stopped at the largest number of points are cut: they may grow
    without bound.
    """
    ends = np.stack([ds["branch_begin"].values, ds["branch_end"].values])
    stopped = np.isin(ds["point_branch"].values, np.flatnonzero((ends == "points").any(axis=0)))
    seen = np.concatenate([np.ravel(drawn), values[~stopped]])
    largest = float(np.nanmax(np.abs(seen), initial=0.0))
    return np.where(stopped & (np.abs(values) > 1.2 * largest), np.nan, values)


def draw_branches(
    ax: Axes, shown: points.Shown, values: np.ndarray, across: Scale, up: Scale
) -> dict[str, Any]:
    """Draw lines along the branches, in a colour each kind of motion, or each of several Datasets;
    return the entries of the legend.
    """
    ds = shown.ds
    kind = ds["branch_kind"].values
    codes = motion_colors.codes(kind, np.where(kind == "periodic", ds["branch_periods"].values, 0))
    periods = points.periods_of(ds)
    position, height, branch_of, stable = _with_events(ds, values)
    position, height = position * across.factor, height * up.factor
    named: dict[str, Any] = {}
    for code in np.unique(codes).tolist():
        own = motion_colors.color(code).tolist()
        color = points.dataset_color(shown) if shown.name else tuple(own)
        mine = np.flatnonzero(codes[branch_of] == code)
        for solid in (False, True):
            ax.plot(
                *lines(mine, branch_of, stable == solid, position, height),
                color=color,
                lw=1.3 if solid else 0.9,
                ls="-" if solid else DASHES,
                zorder=3 if solid else 2,
                gid=f"{'stable' if solid else 'unstable'} {code}",
            )
        label = shown.name or motion_colors.label(code, periods)
        named[label] = Line2D([], [], color=color, lw=1.3)
    if (ds["point_unstable_multipliers"].values > 0).any():
        named["unstable"] = Line2D([], [], color=QUIET, lw=0.9, ls=DASHES)
    return named


def _lost_ends(
    ax: Axes, ds: xr.Dataset, values: np.ndarray, across: Scale, up: Scale
) -> dict[str, Any]:
    """Mark the ends of branches beyond which no orbit was found, so that no gap is left without a
    word; return the entry of the legend.
    """
    of = ds["point_branch"].values
    branches, first, count = np.unique(of, return_index=True, return_counts=True)
    lost = [
        at[ds[f"branch_{end}"].values[branches] == "lost"]
        for end, at in (("begin", first), ("end", first + count - 1))
    ]
    at = np.concatenate(lost)
    at = at[np.isfinite(values[at])]
    if not len(at):
        return {}
    mark: dict[str, Any] = {
        "ls": "none",
        "marker": "s",
        "ms": 3.6,
        "mfc": "white",
        "mec": QUIET,
        "mew": 0.8,
    }
    x = ds[point_name(ds.attrs["parameter"])].values[at] * across.factor
    ax.plot(x, values[at] * up.factor, zorder=4, gid="lost ends", **mark)
    return {"no orbit found beyond": Line2D([], [], **mark)}


def _with_events(
    ds: xr.Dataset, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Positions, heights, branches and stability of the points of branches, with the events at
    which stability changes inserted.
    """
    position, branch_of = ds[point_name(ds.attrs["parameter"])].values, ds["point_branch"].values
    stable = ds["point_stable"].values > 0
    if not ds.sizes.get("event"):
        return position, values, branch_of, stable
    before = ds["event_point"].values
    after = np.minimum(before + 1, ds.sizes["point"] - 1)
    turns = np.flatnonzero(
        (stable[before] != stable[after]) & (branch_of[before] == branch_of[after])
    )
    at, height = _heights(ds, values)
    where = before[turns] + 1
    return (
        np.insert(position, where, at[turns]),
        np.insert(values, where, height[turns]),
        np.insert(branch_of, where, branch_of[before[turns]]),
        np.insert(stable, where, stable[after[turns]]),
    )


def _heights(ds: xr.Dataset, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions and heights of events, interpolated between their neighbouring points."""
    at = ds[event_name(ds.attrs["parameter"])].values
    before = ds["event_point"].values
    after = np.minimum(before + 1, ds.sizes["point"] - 1)
    position = ds[point_name(ds.attrs["parameter"])].values
    with np.errstate(all="ignore"):
        share = (at - position[before]) / (position[after] - position[before])
    share = np.where((share >= 0) & (share <= 1), share, 0.5)
    return at, values[before] + share * (values[after] - values[before])


def lines(
    mine: np.ndarray, of: np.ndarray, wanted: np.ndarray, x: np.ndarray, y: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Curves through neighbours on one branch, where the first of two neighbours is wanted; NaN
    between the curves.
    """
    first = mine[:-1]
    joined = (np.diff(mine) == 1) & (of[first] == of[first + 1]) & wanted[first]
    keep = np.zeros(len(x) + 1, bool)
    keep[first[joined]] = keep[first[joined] + 1] = True
    breaks = np.setdiff1d(np.flatnonzero(keep[:-1]), first[joined])  # last point of each piece
    index = np.flatnonzero(keep[:-1])
    after = np.searchsorted(index, breaks) + 1
    return np.insert(x[index], after, np.nan), np.insert(y[index], after, np.nan)


def draw_marks(ax: Axes, ds: xr.Dataset, values: np.ndarray, across: Scale, up: Scale) -> None:
    """Mark bifurcations on the branches, between their neighbouring points."""
    if not ds.sizes.get("event"):
        return
    at, height = _heights(ds, values)
    size = 4.5 if len(at) <= 40 else 3.2
    for kind, (text, marker) in points.MARKS.items():
        here = ds["event_kind"].values == kind
        if here.any():
            ax.plot(
                at[here] * across.factor,
                height[here] * up.factor,
                ls="none",
                marker=marker,
                ms=size,
                mfc="white",
                mec=QUIET,
                mew=0.8,
                zorder=5,
                label=text,
                gid=f"event {kind}",
            )
