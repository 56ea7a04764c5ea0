"""Branches of periodic orbits and equilibria: stable ones solid, unstable ones dashed,
bifurcations marked.
"""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from saltus.plot import curves
from saltus.plot.picture import picture
from saltus.plot.response_points import Shown

Quantity = Literal[curves.Size, "period", "frequency"]


@picture()
def branches(
    ds: xr.Dataset,
    *,
    quantity: Quantity = "peak",
    output: str | None = None,
    events: bool = True,
    legend: bool = True,
    ax: Axes | None = None,
) -> Axes:
    """Size of the periodic orbits over the parameter: stable solid, unstable dashed, a colour for
    each period, bifurcations where they are.

    Parameters
    ----------
    ds : Dataset
        Result of :func:`saltus.branches`.
    quantity : str
        ``"peak"`` (largest magnitude), ``"rms"``, ``"maximum"``, ``"minimum"``,
        ``"peak_to_peak"``, ``"mean"``, ``"rms_about_mean"``; ``"amplitude"`` or ``"phase"`` of the
        first harmonic; ``"period"`` of the orbit, or ``"frequency"``, its inverse.
    output : str, optional
        A state, or an output that was asked for; default the first state.
    events : bool
        Whether to mark bifurcations.
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
        If ``ds`` holds no branches, or an argument doesn't fit it.
    """
    curves.check_quantity(quantity, get_args(Quantity))
    values, unit, long_name = curves.height(ds, quantity, output, "point_")
    one = Shown(ds, ds.attrs["parameter"], np.empty(0, dtype=int))
    drawn = [curves.Curves(one, None, [values])]
    up = curves.height_scale(unit, drawn, quantity)
    with curves.frame(ax, 3.4, drawn, up, events=events, legend=legend) as (panel, _):
        curves.height_axis(panel, quantity, long_name, up)
    return panel
