"""Bifurcation diagram: a state in each response, against a parameter."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from saltus.errors import ParameterError, nearest, shown
from saltus.plot import axes as draw
from saltus.plot import curves, regions
from saltus.plot import response_points as points
from saltus.plot.picture import PictureError, caller, picture
from saltus.plot.style import QUIET, Scale
from saltus.results.dataset.schema import (
    output_word,
    outputs_in,
    point_name,
    response_name,
    sample_name,
)

#: Label of the vertical axis, by kind of sample.
_SHOWN = {
    "turning_points": "{} at turning points",
    "contacts": "{} at the contacts",
    "stroboscope": "{} at the Poincaré points",
}
#: Numbers of branches that are drawn beside turning points of responses.
_EXTREMES = ("maximum", "minimum")
_DOTS = curves.Dots(
    ((1000, 2.4), (5000, 1.6), (40_000, 1.1), (np.inf, 0.7)), 0.5, 1.8, marked=False
)


@picture(checks=False)
def bifurcation_diagram(
    ds: points.Source,
    *,
    state: str | None = None,
    events: bool = True,
    legend: bool = True,
    ax: Axes | None = None,
) -> Axes:
    """Sampled values of every response against a parameter: a colour for each period, chaos in
    small dark dots, gaps dashed.

    The axis of the parameter is logarithmic where its values are even in their logarithms.

    Parameters
    ----------
    ds : Dataset, or mapping of str to Dataset
        Result of ``sl.bifurcation_diagram``, or a part of it; of any other responses the points
        at whole periods are drawn. Several by name are drawn over each other, a colour for each:
        ``{"located": a, "ignored": b}``.
    state : str, optional
        State or output to show; by default the first state, of a structure by its modes the first
        sensor.
    events : bool
        Whether to mark grazes, folds, period doublings and so on above the picture.
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
        If ``ds`` holds no responses over one parameter, or has no such state.
    """
    datasets = points.shown(ds)
    names = outputs_in(datasets[0].ds)
    state = names[0] if state is None else state
    if any(state not in outputs_in(one.ds) for one in datasets):
        word = output_word(datasets[0].ds)
        raise ParameterError(f"there is no {word} {shown(state)}. {nearest(state, names)}")
    sampled = [one.ds[_variable(one, state)] for one in datasets]
    drawn = [
        curves.Curves(one, of.values, _along(one, of.values, state))
        for one, of in zip(datasets, sampled, strict=True)
    ]
    up = curves.height_scale(sampled[0].attrs.get("units", ""), drawn)
    with curves.frame(ax, 3.6, drawn, up, _DOTS, events=events, legend=legend) as (panel, across):
        _limits_and_gaps(panel, drawn, state, up, across)
        panel.set_ylabel(up.label(_SHOWN[_sample(datasets[0].ds, state)].format(state)))
    return panel


def _variable(one: points.Shown, state: str) -> str:
    """Name of the sampled values; if there are none, of the points at whole periods."""
    name = sample_name(state) if sample_name(state) in one.ds else response_name(state)
    if name not in one.ds:
        raise PictureError(
            f"{caller()} misses {name} in this Dataset. Give it the whole "
            f"Dataset, not some variables of it."
        )
    return name


def _sample(ds: xr.Dataset, state: str) -> str:
    """Kind of samples that are drawn of a state."""
    sampled = ds.attrs.get("sample") if sample_name(state) in ds else None
    return sampled if sampled in _SHOWN else "stroboscope"


def _along(one: points.Shown, dots: np.ndarray, state: str) -> list[np.ndarray]:
    """Heights of the branches that the responses lie on: extremes if turning points are drawn, else
    points at whole periods.
    """
    ds = one.ds
    known = _sample(ds, state) == "turning_points" or point_name(state) in ds
    if one.name or "point_branch" not in ds or not known:
        return []
    if _sample(ds, state) == "turning_points":
        along = [ds[f"point_output_{end}"].sel(output=state).values for end in _EXTREMES]
    else:
        along = list(ds[point_name(state)].values.T)
    return [curves.within_view(ds, values, dots) for values in along]


# -- frame -----------------------------------------------------------------------------------------
def _limits_and_gaps(
    ax: Axes, drawn: Sequence[curves.Curves], state: str, up: Scale, across: Scale
) -> None:
    """Set limits around all dots, and draw the gaps near them."""
    first = drawn[0].shown
    values = np.concatenate([np.ravel(each.dots) for each in drawn if each.dots is not None])
    varied, fixed = _boundaries(first.ds, state)
    marks = [boundary.value * up.factor for boundary in fixed.boundaries] if fixed else []
    draw.set_limits(ax, "y", values * up.factor, marks)
    if fixed:
        draw.draw_gaps(ax, "y", fixed, up)
    names = first.ds["guard"].values[first.ds["guard_state"].values == state] if len(varied) else []
    for row, name in zip(varied * up.factor, names, strict=True):  # moved by the parameter itself
        low, high = ax.get_ylim()
        if low <= row[-1] <= high:
            ax.text(
                1.01,
                row[-1],
                str(name).replace("_", " "),
                transform=ax.get_yaxis_transform(),
                va="center",
                color=QUIET,
                fontsize=7,
            )
        ax.plot(
            first.grid * across.factor,
            row,
            color=QUIET,
            lw=0.7,
            ls=(0, (4, 3)),
            zorder=1,
            gid="gap",
        )


def _boundaries(ds: xr.Dataset, state: str) -> tuple[np.ndarray, regions.Regions | None]:
    """Boundaries of a state: those that move with the parameter, shape (guard, n), or the regions
    between fixed ones.
    """
    if "guard_boundary" not in ds or state not in ds["guard_state"].values.tolist():
        return np.empty((0, 0)), None
    if ds["guard_boundary"].ndim == 1:
        return np.empty((0, 0)), regions.along(ds, state)
    return ds["guard_boundary"].values[ds["guard_state"].values == state], None
