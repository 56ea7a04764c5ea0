"""Branches of periodic orbits and equilibria: stable ones solid, unstable ones dashed,
bifurcations marked.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, get_args

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from saltus.errors import ParameterError, counted
from saltus.plot import curves
from saltus.plot.picture import check, picture
from saltus.plot.response_points import Shown

#: Input of the picture: a Dataset, or several.
Source = xr.Dataset | Sequence[xr.Dataset] | Mapping[str, xr.Dataset]
Quantity = Literal[curves.Size, "period", "frequency"]


@picture(checks=False)
def branches(
    ds: Source,
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
    ds : Dataset, or several in a list or by their names
        Result of :func:`saltus.branches`. Several over one parameter are drawn over each other, a
        colour for each: ``{"exact": a, "9 harmonics": b}``; in a list they have the names
        ``exact`` and the number of their harmonics.
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
    named = _named(ds)
    heights = [curves.height(one, quantity, output, "point_") for one in named.values()]
    _, unit, long_name = heights[0]
    drawn = [
        curves.Curves(
            Shown(one, one.attrs["parameter"], np.empty(0, dtype=int), name, rank),
            None,
            [of.values],
        )
        for rank, ((name, one), of) in enumerate(zip(named.items(), heights, strict=True))
    ]
    up = curves.height_scale(unit, drawn, quantity)
    with curves.frame(ax, 3.4, drawn, up, events=events, legend=legend) as (panel, _):
        curves.height_axis(panel, quantity, long_name, up)
    return panel


def _named(source: Any) -> dict[str, xr.Dataset]:
    """Datasets of branches by their names; of one alone it is empty."""
    if isinstance(source, xr.Dataset) or not isinstance(source, Mapping | list | tuple):
        several = {"": source}
    elif isinstance(source, Mapping):
        several = {str(name): one for name, one in source.items()}
    else:
        several = {}
        for one in source:
            count = getattr(one, "attrs", {}).get("harmonics")
            name = "exact" if count is None else counted(int(count), "harmonic")
            several[name if name not in several else f"{name} ({len(several) + 1})"] = one
    for one in several.values():
        check(one)
    if len({one.attrs["parameter"] for one in several.values()}) != 1:
        raise ParameterError("branches over one parameter are drawn over each other: give such.")
    return several
