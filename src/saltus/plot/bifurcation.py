"""Bifurcation diagram: what a state does in each response, against a parameter."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from saltus.errors import ParameterError, nearest, shown
from saltus.plot import axes as draw
from saltus.plot import motion_colors, regions
from saltus.plot import response_points as points
from saltus.plot.branches import draw_branches, draw_marks, within_view
from saltus.plot.picture import PictureError, caller, picture
from saltus.plot.style import QUIET, Scale
from saltus.results.dataset.schema import point_name, response_name, sample_name, states_of

#: What the vertical axis shows, by what was sampled.
_SHOWN = {
    "turning_points": "{} at turning points", "contacts": "{} at the contacts",
    "stroboscope": "{} at the "
        "Poincaré points",
}  # fmt: skip
#: What is drawn of branches where turning points are drawn of responses.
_EXTREMES = ("maximum", "minimum")
#: Diameter of the smallest dots [pt]: more than a pixel of a screen.
_SMALLEST = 0.6
#: Where the legend begins, in widths of the Axes, if the names of the gaps stand there.
_BESIDE_GAPS = 1.16


@picture(checks=False)
def bifurcation_diagram(
    ds: points.Source,
    *,
    state: str | None = None,
    events: bool = True,
    legend: bool = True,
    ax: Any = None,
) -> Axes:
    """Sampled values of every response against a parameter: a colour for each period, chaos in
    small dark dots, gaps dashed.

    The axis of the parameter is logarithmic where its values are even in their logarithms.

    Parameters
    ----------
    ds : Dataset, or mapping of str to Dataset
        What ``sl.bifurcation_diagram`` returned, or a part of it; of any other responses the points
        at whole periods are drawn. Several by name are drawn over each other, a colour for each:
        ``{"located": a, "ignored": b}``.
    state : str, optional
        Which state; by default the first.
    events : bool
        Whether to mark grazes, folds, period doublings and so on above the picture.
    legend : bool
        Whether to draw the legend.
    ax : Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    Axes

    Raises
    ------
    ParameterError
        If ``ds`` holds no responses over one parameter, or has no such state.
    """
    datasets = points.shown(ds)
    names = states_of(datasets[0].ds)
    state = names[0] if state is None else state
    if any(state not in states_of(one.ds) for one in datasets):
        raise ParameterError(f"there is no state {shown(state)}. {nearest(state, names)}")
    variables = [_variable(one, state) for one in datasets]
    scale = points.state_scale(
        [one.ds[name] for one, name in zip(datasets, variables, strict=True)]
    )
    with draw.panels(ax, 1, (6.3, 3.6)) as (panel,):
        across = points.parameter_axis(panel, datasets)
        named: dict[str, Any] = {}
        for one, name in zip(datasets, variables, strict=True):
            named |= (_compare if one.name else _kinds)(
                panel, one, one.ds[name].values * scale.factor, across
            )
            if not one.name and "point_branch" in one.ds:
                named |= _continued(panel, one, state, across, scale, events)
        _frame(panel, datasets, variables, state, scale, across)
        points.say_if_empty(panel, datasets)
        if events:
            points.draw_events(
                panel,
                [one for one in datasets if one.name or not one.ds.attrs.get("unstable")],
                across,
            )
        if legend:
            points.legend(panel, named, _BESIDE_GAPS if panel.texts else 1.02)
    return panel


def _variable(one: points.Shown, state: str) -> str:
    """The sampled values; where there are none, the points at whole periods."""
    name = sample_name(state) if sample_name(state) in one.ds else response_name(state)
    if name not in one.ds:
        raise PictureError(
            f"{caller()} misses {name} in this Dataset. Give it the whole "
            f"Dataset, not some variables of it."
        )
    return name


def _flat(
    one: points.Shown, values: np.ndarray, mask: np.ndarray, across: Scale
) -> tuple[np.ndarray, np.ndarray]:
    """All points of the responses of ``mask``; the padding is left out."""
    y = values[mask]
    x = np.broadcast_to(one.values[mask][:, None] * across.factor, y.shape)
    there = np.isfinite(y)
    return x[there], y[there]


def _size(count: int) -> float:
    return 2.4 if count <= 1000 else 1.6 if count <= 5000 else 1.1 if count <= 40_000 else 0.7


def _kinds(ax: Axes, one: points.Shown, values: np.ndarray, across: Scale) -> dict[str, Any]:
    """A colour for each kind of motion; chaos in small dots below the others."""
    of = motion_colors.of(one.ds)
    for code in np.unique(of).tolist():
        x, y = _flat(one, values, of == code, across)
        aperiodic = not motion_colors.repeats(code)
        size = _size(x.size) * (0.5 if aperiodic else 1.0)
        marks = {
            "marker": "o",
            "ms": max(size, _SMALLEST),
            "mfc": motion_colors.color(code),
            "mec": "none",
            "gid": f"kind {code}",
        }
        draw.draw_points(ax, x, y, zorder=2 if aperiodic else 3, **marks)
    return points.kind_handles(one, of)


def _continued(
    ax: Axes, one: points.Shown, state: str, across: Scale, up: Scale, events: bool
) -> dict[str, Any]:
    """The branches that the responses lie on: their extremes where turning points are drawn, else
    their points at whole periods.
    """
    ds = one.ds
    if sample_name(state) in ds and ds.attrs.get("sample") == "turning_points":
        curves = [ds[f"point_output_{end}"].sel(output=state).values for end in _EXTREMES]
    else:
        curves = list(ds[point_name(state)].values.T)
    named: dict[str, Any] = {}
    drawn = ds[_variable(one, state)].values
    for values in (within_view(ds, one, drawn) for one in curves):
        named |= draw_branches(ax, ds, values, across, up)
        if events and ds.attrs.get("unstable"):
            draw_marks(ax, ds, values, across, up)
    return named


def _compare(ax: Axes, one: points.Shown, values: np.ndarray, across: Scale) -> dict[str, Any]:
    """One colour for a Dataset among several; the first lies below in larger dots, so that all are
    seen.
    """
    x, y = _flat(one, values, np.ones(len(values), dtype=bool), across)
    color = points.dataset_color(one)
    size = _size(x.size) * (1.8 if one.rank == 0 else 1.0)
    draw.draw_points(
        ax,
        x,
        y,
        marker="o",
        ms=size,
        mfc=color,
        mec="none",
        zorder=2 + 0.1 * one.rank,
        gid=f"dataset {one.name}",
    )
    return {one.name: points.dot(color)}


# -- frame -----------------------------------------------------------------------------------------
def _frame(
    ax: Axes,
    datasets: list[points.Shown],
    variables: list[str],
    state: str,
    scale: Scale,
    across: Scale,
) -> None:
    """Limits, gaps and the name of the vertical axis."""
    ds = datasets[0].ds
    values = (
        np.concatenate(
            [np.ravel(one.ds[name].values) for one, name in zip(datasets, variables, strict=True)]
        )
        * scale.factor
    )
    varied, fixed = _boundaries(ds, state)
    marks = [boundary.value * scale.factor for boundary in fixed.boundaries] if fixed else []
    draw.set_limits(ax, "y", values, marks)
    if fixed:
        draw.draw_gaps(ax, "y", fixed, scale)
    names = ds["guard"].values[ds["guard_state"].values == state].tolist() if len(varied) else []
    for row, name in zip(varied, names, strict=True):  # a gap that the parameter itself moves
        text, low, high = str(name).replace("_", " "), *ax.get_ylim()
        if low <= row[-1] * scale.factor <= high:
            ax.text(
                1.01,
                row[-1] * scale.factor,
                text,
                transform=ax.get_yaxis_transform(),
                va="center",
                color=QUIET,
                fontsize=7,
            )
        ax.plot(
            ds[datasets[0].axis].values * across.factor,
            row * scale.factor,
            color=QUIET,
            lw=0.7,
            ls=(0, (4, 3)),
            zorder=1,
            gid="gap",
        )
    shown = (
        str(ds.attrs.get("sample", "stroboscope"))
        if variables[0] == sample_name(state)
        else "stroboscope"
    )
    ax.set_ylabel(scale.label(_SHOWN.get(shown, "{}").format(state)))


def _boundaries(ds: xr.Dataset, state: str) -> tuple[np.ndarray, regions.Regions | None]:
    """Boundaries of a state: those that move with the parameter, shape (guard, n), or the regions
    between fixed ones.
    """
    if "guard_boundary" not in ds or state not in ds["guard_state"].values.tolist():
        return np.empty((0, 0)), None
    if ds["guard_boundary"].ndim == 1:
        return np.empty((0, 0)), regions.along(ds, state)
    return ds["guard_boundary"].values[ds["guard_state"].values == state], None
