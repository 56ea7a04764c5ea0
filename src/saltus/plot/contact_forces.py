"""Contacts in time: the peak force of each, or its impulse, as a stem."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from saltus.errors import ParameterError
from saltus.plot import axes as draw
from saltus.plot import selection
from saltus.plot.boundary_groups import boundary_groups, legend_beside
from saltus.plot.picture import picture
from saltus.plot.style import display_scale

#: Heights of the stems: the first of these that the result has.
_HEIGHTS = ("contact_peak_force", "contact_impulse")
#: Words for each on the axis.
_WORDS = {"contact_peak_force": "peak force", "contact_impulse": "impulse"}


@picture()
def contact_forces(
    ds: xr.Dataset, trajectory: int | None = None, ax: Any = None, *, legend: bool = True
) -> Axes:
    """Stems of the peak force of each contact over the time at which it begins, a colour for each
    guard (of more than eight for each stop); of rigid stops the impulse.

    Parameters
    ----------
    ds : Dataset
        Result of ``impact_statistics``.
    trajectory : int, optional
        Trajectory of a batch; all of them together by default.
    ax : Axes, optional
        Axes to draw into; a new figure by default.
    legend : bool
        Whether to name the guards.

    Returns
    -------
    Axes

    Raises
    ------
    ParameterError
        If ``ds`` is not from ``impact_statistics``, there is no such trajectory, or its contacts
        have neither a peak force nor an impulse.
    """
    shown = height_of(ds)
    if shown is None:
        raise ParameterError(
            "this result has contacts, but no peak force and no impulse of any. Compute it with "
            "sl.impact_statistics(..., peaks=True); where that finds no force in the equations, "
            "give it by force=."
        )
    mine = np.isfinite(ds[shown].values)
    if trajectory is not None and "contact_trajectory" in ds:
        mine &= np.isin(ds["contact_trajectory"].values, selection.chosen(ds, trajectory))
    time, height = ds["contact_time"].values[mine], ds[shown].values[mine]
    guards = ds["contact_guard"].values[mine].astype(str)
    x = display_scale("s", float(np.abs(time).max(initial=0.0)))
    y = display_scale(str(ds[shown].attrs.get("units", "")), float(np.abs(height).max(initial=0.0)))
    with draw.panels(ax, 1, (5.2, 2.8)) as (panel,):
        if not mine.any():
            draw.say(panel, "No contact in the observed time.", ds)
            return panel
        names = ds["guard"].values.tolist()
        for group in boundary_groups(names):
            if (rows := np.isin(guards, [names[place] for place in group.places])).any():
                top = height[rows] * y.factor
                panel.vlines(time[rows] * x.factor, 0.0, top, color=group.color, linewidth=0.8)
                panel.plot(
                    time[rows] * x.factor,
                    top,
                    "o",
                    color=group.color,
                    markersize=3.5,
                    label=group.label,
                )
        panel.axhline(0.0, color="0.6", linewidth=0.6)
        panel.set_xlabel(x.label("time"))
        panel.set_ylabel(y.label(_WORDS[shown]))
        if legend:
            legend_beside(panel)
    return panel


def height_of(ds: xr.Dataset) -> str | None:
    """The variable that stems show; None if a result with contacts has neither forces nor
    impulses.
    """
    if not ds.sizes["contact"]:
        return "contact_speed"  # there is no contact to show
    return next((n for n in _HEIGHTS if n in ds and np.isfinite(ds[n].values).any()), None)
