"""Sets of uncertain values: numbers over parameters, and parameters over each other."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from saltus.errors import ParameterError, among, nearest, shown
from saltus.plot.axes import draw_points
from saltus.plot.picture import picture
from saltus.plot.style import CYCLE, Scale, display_scale, style
from saltus.results.dataset.schema import kind_text

#: Colour of sets whose start reaches no response, and of numbers of a user's function.
GREY = "0.55"
#: Most bins of a histogram.
BINS = 40
#: Diameter of a point of a single set, and the ends of that of one of many [pt]: the points
#: together cover the same share of a picture.
SPREAD, SIZES = 45.0, (1.25, 5.0)


@picture()
def scatter(ds: xr.Dataset, outcome: str | None = None, start: int = 0) -> Axes:
    """A number over each uncertain parameter, a point for each set, and how often it occurs.

    The colour tells the response that the start reaches; lines in the last panel are quantiles:
    5 %, 50 %, 95 %.

    Parameters
    ----------
    ds : Dataset
        Result of ``scatter``.
    outcome : str, optional
        Which number; the first one by default.
    start : int
        From which start.

    Returns
    -------
    Axes
        That of the first parameter. ``axes.figure.axes`` are all: one for each parameter, and that
        of the histogram.

    Raises
    ------
    ParameterError
        If ``ds`` is not from ``scatter``, or there is no such outcome or start.
    """
    one = _of_start(ds, start)
    known = ds["outcome"].values.tolist()
    name = known[0] if outcome is None else outcome
    if not among(name, known):
        raise ParameterError(f"the Dataset has no outcome {shown(name)}. {nearest(name, known)}")
    one = one.sel(outcome=name)
    up = _scale(str(one["outcome_units"].item()), one["number"].values)
    groups, count = _groups(one), ds.sizes["uncertain"]
    with style():
        _, grid = plt.subplots(
            1, count + 1, figsize=(2.3 * (count + 1), 2.6), sharey=True, squeeze=False
        )
        axes = grid[0]
        for k in range(count):
            _points(axes[k], one, k, up.factor * one["number"].values, groups)
        axes[0].set_ylabel(up.label(name))
        finite = up.factor * one["number"].values[np.isfinite(one["number"].values)]
        most = _bins(ds)
        bins = np.histogram_bin_edges(finite, most) if finite.size else most
        heights = [up.factor * one["number"].values[here] for here, _, _ in groups]
        axes[-1].hist(
            [values[np.isfinite(values)] for values in heights],
            bins=bins, stacked=True, orientation="horizontal",
            color=[color for _, color, _ in groups], label=[label for *_, label in groups],
        )  # fmt: skip
        for q in (0.05, 0.5, 0.95):
            axes[-1].axhline(
                up.factor * float(one["quantile_of"].sel(quantile=q)), color="0.2", lw=0.7, ls="--"
            )
        axes[-1].set_xlabel("sets")
        if any(label for *_, label in groups):
            axes[-1].legend(loc="upper left", bbox_to_anchor=(1.02, 1))
    first: Axes = axes[0]
    return first


@picture()
def corner(ds: xr.Dataset, start: int = 0) -> Axes:
    """Each uncertain parameter over each other one, coloured by the response that a start reaches.

    Parameters
    ----------
    ds : Dataset
        Result of ``scatter``.
    start : int
        Which start.

    Returns
    -------
    Axes
        That of the first parameter alone. ``axes.figure.axes`` are all, row by row, a row and a
        column for each parameter; those above the diagonal are empty.

    Raises
    ------
    ParameterError
        If ``ds`` is not from ``scatter``, or there is no such start.
    """
    one, count = _of_start(ds, start), ds.sizes["uncertain"]
    groups = _groups(one)
    with style():
        figure, axes = plt.subplots(
            count, count, figsize=(1.9 * count + 0.6, 1.8 * count), sharex="col", squeeze=False
        )
        for row in range(count):
            scale, values = _parameter(ds, row)
            for column in range(count):
                panel = axes[row, column]
                if column > row:
                    panel.axis("off")
                elif column < row:
                    _points(panel, one, column, values, groups, name=row == count - 1)
                    panel.tick_params(labelleft=column == 0)
                    if column == 0:
                        panel.set_ylabel(scale.label(_words(ds, row)))
                else:
                    panel.hist(
                        [values[here] for here, _, _ in groups], _bins(ds), stacked=True,
                        color=[color for _, color, _ in groups],
                        label=[label for *_, label in groups],
                    )  # fmt: skip
                    panel.set_yticks([])
            if row == count - 1:
                axes[row, row].set_xlabel(scale.label(_words(ds, row)))
        if any(label for *_, label in groups):
            figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="upper right")
    first: Axes = axes[0, 0]
    return first


def _bins(ds: xr.Dataset) -> int:
    """Bins of a histogram, each with some sets."""
    return min(BINS, int(np.ceil(2.0 * np.cbrt(ds.sizes["set"]))))  # Rice's rule


def _of_start(ds: xr.Dataset, start: int) -> xr.Dataset:
    if start not in ds["start"].values:
        raise ParameterError(f"the Dataset has starts 0 to {ds.sizes['start'] - 1}, no {start}.")
    one: xr.Dataset = ds.sel(start=start)
    return one


def _groups(one: xr.Dataset) -> list[tuple[np.ndarray, str, str]]:
    """Sets that are drawn alike, bool[set], with their colour and name: by the response that is
    reached.
    """
    done = one["set_status"].values == "computed"
    if "response_of" not in one:
        return [(done, CYCLE[0], "")]
    reached, about = one["response_of"].values, one["response_of"].attrs
    words = dict(zip(about["flag_values"].tolist(), about["flag_meanings"].split(), strict=True))
    found = []
    for code in np.unique(reached[done])[::-1].tolist():
        color = CYCLE[code % len(CYCLE)] if code >= 0 else GREY
        label = _motion(one, code) if code >= 0 else words[code].replace("_", " ")
        found.append((done & (reached == code), color, label))
    names = [label for *_, label in found]
    return [
        (here, color, f"{label} (no. {int(reached[here][0])})" if names.count(label) > 1 else label)
        for here, color, label in found[::-1]
    ] or [(done, GREY, "")]


def _motion(one: xr.Dataset, k: int) -> str:
    """A response in a word."""
    return kind_text(str(one["response_type"].values[k]), int(one["response_period"].values[k]))


def _points(
    ax: Axes, one: xr.Dataset, k: int, up: np.ndarray,
    groups: list[tuple[np.ndarray, str, str]], name: bool = True,
) -> None:  # fmt: skip
    """Points of some numbers over a parameter."""
    scale, values = _parameter(one, k)
    size = float(np.clip(SPREAD / np.sqrt(len(values)), *SIZES))
    for here, color, _ in groups:
        draw_points(ax, values[here], up[here], color=color, marker="o", ms=size, mew=0)
    if name:
        ax.set_xlabel(scale.label(_words(one, k)))


def _parameter(ds: xr.Dataset, k: int) -> tuple[Scale, np.ndarray]:
    """Scale and values, in its unit, of a parameter."""
    values = ds["value"].values[:, k]
    scale = _scale(str(ds["uncertain_units"].values[k]), values)
    return scale, scale.factor * values


def _scale(unit: str, values: np.ndarray) -> Scale:
    finite = np.abs(values[np.isfinite(values)])
    return display_scale(unit, float(finite.max(initial=0.0)))


def _words(ds: xr.Dataset, k: int) -> str:
    return str(ds["uncertain"].values[k]).replace("_", " ")
