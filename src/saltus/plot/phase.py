"""Phase portrait: one state against another, coloured by region, with the stroboscopic points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from saltus.errors import ParameterError, shown
from saltus.plot import axes as draw
from saltus.plot import regions, selection
from saltus.plot.picture import picture
from saltus.plot.style import CYCLE, OKABE_ITO, Scale, display_scale
from saltus.results.dataset.schema import STROBOSCOPE, kind_of, told_of

#: Without `periods` the last part of a forced run is shown: transients of lightly damped systems
#: have mostly gone by then (of the rig with 3 % damping after 40 periods, at 15 Hz), and
#: subharmonic orbits still show several of their periods.
SETTLED_SHARE = 0.3


@picture()
def phase(
    run: xr.Dataset,
    trajectory: int | Sequence[int] | None = None,
    states: tuple[str, str] | None = None,
    periods: selection.Periods = None,
    ax: Axes | None = None,
    *,
    poincare: bool = True,
    units: Mapping[str, str] | None = None,
    legend: bool = True,
) -> Axes:
    """Phase portrait of one trajectory, coloured by region; or of several in one picture, a colour
    each.

    Gap lines are dashed, contact regions lightly shaded, the states at whole forcing periods
    (Poincare points) are dots. What ``stroboscope`` returned shows as dots alone.

    Parameters
    ----------
    run : Dataset
        Result of ``simulate`` or ``stroboscope``.
    trajectory : int or list of int, optional
        Trajectory of a batch; without it all are laid over one another, at most 8.
    states : pair of str, optional
        On the horizontal and the vertical axis, states or outputs; by default the first state and
        the one that is its rate, else the second one. Of a structure by its modes the sensors stand
        for the states.
    periods : int, float or pair, optional
        Number of forcing periods at the end, or (first, last) period. By default the last 30 % of a
        forced run, as the picture says, and all of a run without forcing.
    ax : Axes, optional
        Axes to draw into; a new figure by default.
    poincare : bool
        Whether to draw the Poincare points.
    units : mapping of str to str, optional
        Display units, such as ``{"x": "mm", "v": "mm/s"}``; by the size of the numbers by default.
    legend : bool
        Whether to name the colours.

    Returns
    -------
    Axes

    Raises
    ------
    ParameterError
        If ``run`` is not a result of saltus, or an argument doesn't fit it.
    """
    pair = _pair(run, states)
    labels = selection.chosen(run, trajectory)
    singles = [selection.single(run, label) for label in labels] or [selection.single(run, None)]
    share = SETTLED_SHARE if "period" in run else 1.0
    windows = [selection.window(motion, periods, share) for motion in singles]
    curves = [_values(motion, pair, shown) for motion, shown in zip(singles, windows, strict=True)]
    scales = _scales(run, pair, np.concatenate(curves), selection.units_of_states(run, units))
    with draw.panels(ax, 1, (4.6, 3.1)) as (panel,):
        if kind_of(run) != STROBOSCOPE and all(begin == end for begin, end in windows):
            draw.say(panel, "It stopped where it began: there is no motion to draw.", *singles)
            return panel
        for i, (motion, shown) in enumerate(zip(singles, windows, strict=True)):
            name = selection.named(run, motion, labels[i]) if len(labels) > 1 else None
            color = CYCLE[i % len(CYCLE)] if name else None
            if kind_of(run) != STROBOSCOPE:
                _curve(panel, motion, pair, shown, scales, color, name)
            if poincare or kind_of(run) == STROBOSCOPE:
                part = (
                    f", {shown[0]:g} T to {shown[1]:g} T"
                    if periods is None and shown[0] > 0
                    else ""
                )
                _dots(
                    panel,
                    selection.stroboscope_points(motion, pair, *shown),
                    scales,
                    color,
                    name or f"Poincaré points{part}",
                )
            draw.note_status(panel, motion)
        _frame(panel, singles[0], pair, np.concatenate(curves), scales)
        if legend:
            # The names of gaps take the room next to the Axes.
            right = 1.25 if any(text.get_position()[0] > 1.0 for text in panel.texts) else 1.02
            draw.legend(
                panel, regions.find(singles[0], pair), loc="upper left", bbox_to_anchor=(right, 1)
            )
    return panel


def _pair(run: xr.Dataset, states: Any) -> tuple[str, str]:
    """The two states to show."""
    known = told_of(run)
    if states is None:
        if len(known) < 2:
            of = "outputs" if run.attrs.get("outputs_first") else "states"
            raise ParameterError(
                f"a phase portrait needs two {of}, this system has only "
                f"{known[0]!r}. See plot.history."
            )
        return known[0], selection.rate_of(run, known[0]) or known[1]
    if (
        not isinstance(states, list | tuple | np.ndarray)
        or getattr(states, "shape", None) == ()
        or len(states) != 2
    ):
        raise ParameterError(
            f"states={shown(states)}. Give two names, such as states={known[:2]!r}."
        )
    first, second = (selection.state_named(run, name) for name in states)
    return first, second


def _values(ds: xr.Dataset, pair: tuple[str, str], shown: tuple[float, float]) -> np.ndarray:
    """Points of one trajectory in the window, shape (point, 2)."""
    if kind_of(ds) == STROBOSCOPE:
        return selection.stroboscope_points(ds, pair, *shown)
    return selection.path(ds, pair, *shown).values


def _scales(
    run: xr.Dataset, pair: tuple[str, str], values: np.ndarray, units: Mapping[str, str]
) -> tuple[Scale, Scale]:
    """Display units of the two axes."""
    largest = np.abs(np.where(np.isfinite(values), values, 0.0)).max(axis=0, initial=0.0)
    first, second = (
        display_scale(run[name].attrs.get("units", ""), float(largest[i]), units.get(name))
        for i, name in enumerate(pair)
    )
    return first, second


def _curve(
    ax: Axes,
    ds: xr.Dataset,
    pair: tuple[str, str],
    shown: tuple[float, float],
    scales: tuple[Scale, Scale],
    color: str | None,
    name: str | None,
) -> None:
    """Draw the orbit: a colour for each region, or one colour if there are several trajectories."""
    curve = selection.path(ds, pair, *shown)
    x, y = (curve.values[:, i] * scales[i].factor for i in (0, 1))
    width = 1.0 if shown[1] - shown[0] <= 40 or "period" not in ds else 0.6
    if color:
        ax.plot(x, y, color=color, lw=width, label=name, zorder=2)
    else:
        coloured = regions.find(ds, pair)
        draw.draw_pieces(ax, x, y, coloured.of(curve.mode), coloured, width)


def _dots(
    ax: Axes, points: np.ndarray, scales: tuple[Scale, Scale], color: str | None, name: str
) -> None:
    """Draw the Poincaré points; smaller if there are many."""
    size = 4.5 if len(points) <= 60 else 2.5 if len(points) <= 500 else 1.2
    label = name if color is None or name not in ax.get_legend_handles_labels()[1] else None
    marks = {
        "marker": "o",
        "ms": size,
        "mfc": color or OKABE_ITO["black"],
        "mec": "white",
        "mew": 0.4 if size > 2 else 0.0,
    }
    if color is None and size > 4:  # open circles: filled ones are contacts, in time histories
        marks |= {"ms": 4.2, "mfc": "white", "mec": OKABE_ITO["black"], "mew": 1.1}
    if len(points):
        draw.draw_points(
            ax,
            points[:, 0] * scales[0].factor,
            points[:, 1] * scales[1].factor,
            zorder=4,
            label=label,
            **marks,
        )


def _frame(
    ax: Axes, ds: xr.Dataset, pair: tuple[str, str], values: np.ndarray, scales: tuple[Scale, Scale]
) -> None:
    """Set limits, gap lines and names of the axes."""
    directions: tuple[draw.Direction, draw.Direction] = ("x", "y")
    state_regions = [regions.along(ds, name) for name in pair]
    for i, direction in enumerate(directions):
        marks = [boundary.value * scales[i].factor for boundary in state_regions[i].boundaries]
        draw.set_limits(ax, direction, values[:, i] * scales[i].factor, marks)
    for i, direction in enumerate(directions):
        draw.draw_gaps(ax, direction, state_regions[i], scales[i])
    draw.few_ticks(ax)
    ax.set_xlabel(scales[0].label(pair[0]))
    ax.set_ylabel(scales[1].label(pair[1]))
