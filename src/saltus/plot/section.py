"""Poincare section: the states at the crossings of a surface, as points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from saltus.errors import ParameterError, nearest, shown
from saltus.plot import axes as draw
from saltus.plot import regions, selection
from saltus.plot.picture import picture
from saltus.plot.style import CYCLE, OKABE_ITO, Scale, display_scale
from saltus.results.dataset.schema import outputs_in, states_of, told_of

#: Axes besides the states: variable and name.
_OTHERS = {
    "phase": ("crossing_phase", "phase of the forcing, t/T mod 1"),
    "time": ("crossing_time", "time"),
}
#: Colour and name of the two directions of a crossing.
_DIRECTIONS = {1: (OKABE_ITO["blue"], "upwards"), -1: (OKABE_ITO["vermillion"], "downwards")}


@picture()
def section(
    ds: xr.Dataset,
    x: str | None = None,
    y: str | None = None,
    trajectory: int | Sequence[int] | None = None,
    ax: Axes | None = None,
    *,
    units: Mapping[str, str] | None = None,
    legend: bool = True,
) -> Axes:
    """Points of a Poincare section: a state or output against another, or the phase of the forcing.

    A colour for each direction of crossing; of several trajectories one for each. Crossings too
    shallow to be sure of are hollow.

    Parameters
    ----------
    ds : Dataset
        Result of ``poincare``.
    x, y : str, optional
        A state, an output, ``"phase"`` (t/T mod 1) or ``"time"``; by default the first two of the
        states that differ between crossings, of a structure by its modes of the sensors; then
        phase (if forced), then time.
    trajectory : int or list of int, optional
        Trajectory of a batch; without it all are laid over one another, at most 8.
    ax : Axes, optional
        Axes to draw into; a new figure by default.
    units : mapping of str to str, optional
        Display units, such as ``{"v": "mm/s"}``; by the size of the numbers by default.
    legend : bool
        Whether to name the colours.

    Returns
    -------
    Axes

    Raises
    ------
    ParameterError
        If ``ds`` is not from ``poincare``, or an argument doesn't fit it.
    """
    labels = selection.chosen(ds, trajectory)
    names = _axes(ds, x, y)
    wanted = selection.units_of_states(ds, units)
    rows = (
        np.isin(ds["crossing_trajectory"].values, labels)
        if labels
        else np.ones(ds.sizes["crossing"], dtype=bool)
    )
    points = [_values(ds, name) for name in names]
    scales = [
        _scale(ds, name, values[rows], wanted.get(name))
        for name, values in zip(names, points, strict=True)
    ]
    with draw.panels(ax, 1, (4.6, 3.4)) as (panel,):
        if not rows.any():
            draw.say(
                panel,
                f"Section {ds.attrs.get('surface', '')}: no crossing in the observed time.",
                ds,
            )
            return panel
        for mask, color, name in _groups(ds, labels, rows):
            _draw(panel, ds, mask, points, scales, color, name)
        for direction, name, values, scale in zip(("x", "y"), names, points, scales, strict=True):
            _frame(panel, ds, direction, name, values[rows], scale)  # type: ignore[arg-type]
        panel.set_title(f"section {ds.attrs.get('surface', '')}", loc="left", fontsize=8)
        if legend and len(panel.get_legend_handles_labels()[1]) > 1:
            # The names of gaps take the room next to the Axes.
            panel.legend(
                loc="upper left",
                bbox_to_anchor=(1.25 if names[1] in ds["guard_state"].values else 1.02, 1),
            )
    return panel


def _axes(ds: xr.Dataset, x: str | None, y: str | None) -> tuple[str, str]:
    """Names of the two axes, checked."""
    forced = "crossing_phase" in ds and bool(np.isfinite(ds["crossing_phase"].values).any())
    known = [*outputs_in(ds), *(["phase"] if forced else []), "time"]
    for name in (x, y):
        if name is not None and name not in known:
            raise ParameterError(
                f"this section has no {shown(name)} to draw. {nearest(name, known)}"
            )
    surface = str(ds.attrs["surface"])
    sides = {side.strip() for side in surface.split("=")}
    turning = surface.removesuffix(" turns")
    if turning in outputs_in(ds) and turning != surface:
        sides.add(selection.rate_of(ds, turning))  # rounding is left of it there
    moving = [name for name in told_of(ds) if name not in sides]
    if ds.sizes["crossing"] and len(moving) == len(told_of(ds)):  # the surface fixes no state
        moving = [name for name in moving if np.ptp(ds[name].values) > 0]
    free = [name for name in (*moving, *known[len(outputs_in(ds)) :]) if name not in (x, y)]
    first = x if x is not None else free.pop(0)
    return first, y if y is not None else free[0]


def _values(ds: xr.Dataset, name: str) -> np.ndarray:
    return np.asarray(
        ds[_OTHERS[name][0] if name in _OTHERS and name not in outputs_in(ds) else name].values,
        dtype=float,
    )


def _scale(ds: xr.Dataset, name: str, values: np.ndarray, unit: str | None) -> Scale:
    if name in _OTHERS and name not in outputs_in(ds):
        return Scale(1.0, "s" if name == "time" else "1")
    return display_scale(
        ds[name].attrs.get("units", ""), float(np.abs(values).max(initial=0.0)), unit
    )


def _groups(
    ds: xr.Dataset, labels: Sequence[int], rows: np.ndarray
) -> list[tuple[np.ndarray, str, str]]:
    """Groups of crossings, each with its colour and its name."""
    if len(labels) > 1:
        who = ds["crossing_trajectory"].values
        names = [selection.named(ds, ds.sel(trajectory=label), label) for label in labels]
        return [
            (who == label, CYCLE[i % len(CYCLE)], name)
            for i, (label, name) in enumerate(zip(labels, names, strict=True))
        ]
    directions = ds["crossing_direction"].values
    return [(rows & (directions == way), *marks) for way, marks in _DIRECTIONS.items()]


def _draw(
    ax: Axes,
    ds: xr.Dataset,
    mask: np.ndarray,
    points: Sequence[np.ndarray],
    scales: Sequence[Scale],
    color: str,
    name: str,
) -> None:
    """Draw one group of crossings; smaller if there are many."""
    count = int(mask.sum())
    size = 4.5 if count <= 60 else 2.5 if count <= 500 else 1.2
    sure = ds["crossing_kind"].values.astype(str) == "crossing"
    for part, face, label in (
        (mask & sure, color, name),
        (mask & ~sure, "white", f"{name}, unresolved"),
    ):
        if part.any():
            x, y = (
                values[part] * scale.factor for values, scale in zip(points, scales, strict=True)
            )
            edge = 0.8 if face == "white" else 0.0
            draw.draw_points(
                ax, x, y, marker="o", ms=size, mfc=face, mec=color, mew=edge, label=label, zorder=3
            )


def _frame(
    ax: Axes, ds: xr.Dataset, direction: draw.Direction, name: str, values: np.ndarray, scale: Scale
) -> None:
    """Set limits, gap lines and name of one axis."""
    label = scale.label(
        _OTHERS[name][1] if name in _OTHERS and name not in outputs_in(ds) else name
    )
    (ax.set_xlabel if direction == "x" else ax.set_ylabel)(label)
    if name == "phase" and name not in outputs_in(ds):
        (ax.set_xlim if direction == "x" else ax.set_ylim)(0.0, 1.0)
        return
    state_regions = (
        regions.along(ds, name)
        if name in states_of(ds) and ds["guard_boundary"].ndim == 1
        else None
    )
    draw.set_limits(
        ax,
        direction,
        values * scale.factor,
        [b.value * scale.factor for b in state_regions.boundaries] if state_regions else [],
    )
    if direction == "x":
        draw.few_ticks(ax)
    if state_regions:
        draw.draw_gaps(ax, direction, state_regions, scale)
