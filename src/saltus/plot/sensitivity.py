"""Derivatives of a motion with respect to parameters, over the time."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from saltus.plot import axes as draw
from saltus.plot import selection
from saltus.plot.curves import of_output
from saltus.plot.picture import picture
from saltus.plot.style import CYCLE, display_scale
from saltus.results.dataset.schema import first_of


@picture()
def sensitivity(
    ds: xr.Dataset,
    output: str | None = None,
    trajectory: int | None = None,
    ax: Axes | None = None,
    *,
    legend: bool = True,
) -> Axes:
    """Change of a state or an output for one per cent more of each parameter, over the time.

    A start is changed by one per cent of the range of its state. A parameter that is zero isn't
    drawn: nothing says how much of it is little.

    Parameters
    ----------
    ds : Dataset
        Result of ``sensitivity``.
    output : str, optional
        Which state or output; by default the first that pictures show.
    trajectory : int, optional
        Trajectory of a batch; the first one by default.
    ax : Axes, optional
        Axes to draw into; a new figure by default.
    legend : bool
        Whether to name the curves.

    Returns
    -------
    Axes

    Raises
    ------
    ParameterError
        If ``ds`` is not from ``sensitivity``, or there is no such output or trajectory.
    """
    if "trajectory" in ds.dims:
        first = int(ds["trajectory"].values[0])
        ds = ds.sel(trajectory=selection.chosen(ds, first if trajectory is None else trajectory)[0])
    name = first_of(ds) if output is None else output
    one, unit = of_output(ds, name)
    parts = ds["to_value"].values.copy()
    for k, to in enumerate(ds["to"].values):
        if to.endswith("(0)"):
            parts[k] = np.ptp(ds["value"].sel(output=to[:-3]).values)
    change = 0.01 * one["derivative"].values * parts
    scale = display_scale(unit, float(np.nanmax(np.abs(change), initial=0.0)))
    with draw.panels(ax, 1, (6.0, 2.8)) as (panel,):
        for k in np.flatnonzero(parts).tolist():
            to = ds["to"].values[k]
            label = f"{to}: 1 % of its range" if to.endswith("(0)") else f"1 % of {to}"
            panel.plot(
                one["time"].values,
                change[:, k] * scale.factor,
                color=CYCLE[k % len(CYCLE)],
                lw=1.0,
                label=label,
            )
        panel.axhline(0.0, color="0.7", lw=0.6, zorder=0)
        panel.set_xlabel("time [s]")
        panel.set_ylabel(scale.label(f"change of {name}"))
        if legend:
            panel.legend(loc="upper left", bbox_to_anchor=(1.02, 1))
        draw.note_status(panel, ds)
    return panel
