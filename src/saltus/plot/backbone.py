"""Backbones: amplitude of resonant vibrations over their frequency."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from saltus.errors import ParameterError, among, nearest, shown
from saltus.plot import axes as draw
from saltus.plot.picture import picture
from saltus.plot.style import OKABE_ITO, display_scale


@picture()
def backbone(ds: xr.Dataset, *, output: str | None = None, ax: Any = None) -> Axes:
    """Largest magnitude of a state in free vibration, or in phase quadrature, over the frequency;
    where it is unstable, dashed.

    Parameters
    ----------
    ds : Dataset
        What :func:`saltus.backbone` returned.
    output : str, optional
        A state; default that whose amplitude was followed.
    ax : Axes, optional
        Where to draw, such as what :func:`saltus.plot.branches` returned; a new figure by default.

    Returns
    -------
    Axes

    Raises
    ------
    ParameterError
        If ``ds`` holds no backbone, or has no such state.
    """
    known = ds["output"].values.tolist()
    name = str(ds.attrs["amplitude_of"]) if output is None else output
    if not among(name, known):
        raise ParameterError(f"the backbone has no state {shown(name)}. {nearest(name, known)}")
    one = ds.sel(output=name)
    peak, frequency = one["point_output_peak"].values, ds["backbone_frequency"].values
    up = display_scale(str(one["output_units"].item()), float(peak.max(initial=0.0)))
    across = display_scale("Hz", float(frequency.max(initial=0.0)))
    stable = ds["point_stable"].values
    with draw.panels(ax, 1, (4.6, 3.4)) as (panel,):
        for wanted, dashes in ((True, "-"), (False, (0, (3.0, 1.6)))):
            mine = stable == wanted
            if mine.any():
                keep = mine | np.append(mine[1:], False) | np.append(False, mine[:-1])
                panel.plot(
                    frequency * across.factor, np.where(keep, peak, np.nan) * up.factor, ls=dashes,
                    color=OKABE_ITO["black"], lw=1.2, zorder=4,
                    gid="backbone" if wanted else "backbone unstable",
                )  # fmt: skip
        if not panel.get_xlabel():
            panel.set_xlabel(across.label("frequency"))
            panel.set_ylabel(up.label(f"peak |{name}|"))
            panel.set_ylim(bottom=0)
    return panel
