"""Backbones: amplitude of resonant vibrations over their frequency."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from saltus.plot import axes as draw
from saltus.plot import curves
from saltus.plot.picture import picture
from saltus.plot.style import OKABE_ITO, display_scale


@picture()
def backbone(ds: xr.Dataset, *, output: str | None = None, ax: Axes | None = None) -> Axes:
    """Largest magnitude of a state in free vibration, or in phase quadrature, over the frequency;
    where it is unstable, dashed.

    Parameters
    ----------
    ds : Dataset
        Result of :func:`saltus.backbone`.
    output : str, optional
        A state; default that whose amplitude was followed.
    ax : Axes, optional
        Axes to draw into, such as those of :func:`saltus.plot.branches`; a new figure by default.

    Returns
    -------
    Axes

    Raises
    ------
    ParameterError
        If ``ds`` holds no backbone, or has no such state.
    """
    name = str(ds.attrs["amplitude_of"]) if output is None else output
    one, unit = curves.of_output(ds, name)
    peak, frequency = one["point_output_peak"].values, ds["backbone_frequency"].values
    up = display_scale(unit, float(peak.max(initial=0.0)))
    across = display_scale("Hz", float(frequency.max(initial=0.0)))
    every, branch = np.arange(len(peak)), np.zeros(len(peak), dtype=int)
    with draw.panels(ax, 1, (4.6, 3.4)) as (panel,):
        for solid in (True, False):
            x, y = curves.lines(every, branch, ds["point_stable"].values == solid, frequency, peak)
            panel.plot(
                x * across.factor,
                y * up.factor,
                ls="-" if solid else curves.DASHES,
                color=OKABE_ITO["black"],
                lw=1.2,
                zorder=4,
                gid="backbone" if solid else "backbone unstable",
            )
        if not panel.get_xlabel():
            panel.set_xlabel(across.label("frequency"))
            curves.height_axis(panel, "peak", name, up)
    return panel
