"""Picture of a fit: what was measured, what the equations say, and what is left."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from saltus.errors import ParameterError, must_be
from saltus.plot import axes as draw
from saltus.plot.curves import of_output
from saltus.plot.picture import picture
from saltus.plot.style import OKABE_ITO, QUIET, display_scale

#: Lines of the noise, in standard deviations.
BAND = 2.0


@picture()
def fit(
    ds: xr.Dataset,
    output: str | None = None,
    span: tuple[float, float] | None = None,
    ax: draw.Panels | None = None,
    *,
    legend: bool = True,
) -> Axes:
    """Measured values and what the equations say to them, with the residuals below.

    The residuals lie mostly within the grey band, two standard deviations of the noise, where the
    equations describe the data.

    Parameters
    ----------
    ds : Dataset
        Result of ``fit``.
    output : str, optional
        Which measured output; by default the first.
    span : (float, float), optional
        Part of the axis that is shown, of the time [s] or of the parameter [SI]; by default all.
    ax : two Axes, optional
        Axes to draw into, for the data and for the residuals; a new figure by default.
    legend : bool
        Whether to name the points and the curve.

    Returns
    -------
    Axes
        That of the data.

    Raises
    ------
    ParameterError
        If ``ds`` is not from ``fit``, there is no such output, or nothing lies in the span.
    """
    name = str(ds["output"].values[0]) if output is None else output
    one, sizes = of_output(ds, name)
    at = one["at"].values
    if span is not None:
        if not isinstance(span, tuple | list) or len(span) != 2:
            raise must_be("span", "(first, last)", span)
        one = one.isel(sample=np.flatnonzero((at >= span[0]) & (at <= span[1])))
        at = one["at"].values
    if not len(at):
        raise ParameterError(f"no sample lies between {span[0]:g} and {span[1]:g}.")  # type: ignore[index]
    along, unit = str(ds.attrs["along"]), str(one["at"].attrs["units"])
    across = display_scale(unit, float(np.abs(at).max()))
    up = display_scale(sizes, float(np.nanmax(np.abs(one["measured"].values), initial=0.0)))
    noise = float(one["noise"])
    low = display_scale(sizes, max(float(np.nanmax(np.abs(one["residual"]), initial=0.0)), noise))
    with draw.panels(ax, 2, (6.3, 2.0)) as (above, below):
        x = at * across.factor
        marks = {"marker": "o", "ms": 2.6, "mfc": "none", "mew": 0.7, "zorder": 2}
        seen = one["measured"].values * up.factor
        draw.draw_points(above, x, seen, mec=QUIET, label="measured", **marks)
        # responses of one frequency may lie on several branches: no curve joins them
        line = {"lw": 1.0} if along == "time" else {"ls": "none", "marker": "+"}
        above.plot(
            x,
            one["fitted"].values * up.factor,
            color=OKABE_ITO["vermillion"],
            label="fitted",
            zorder=3,
            **line,
        )
        left = one["residual"].values * low.factor
        band = BAND * noise * low.factor
        below.axhspan(-band, band, color="0.9", zorder=0)
        draw.draw_points(below, x, left, mec=OKABE_ITO["blue"], **marks)
        draw.set_limits(below, "y", np.append(left, [-band, band]))
        above.set_ylabel(up.label(name))
        below.set_ylabel(low.label("residual"))
        below.set_xlabel(across.label(along))
        above.tick_params(labelbottom=False)
        for panel in (above, below):
            draw.set_limits(panel, "x", x, margin=0.02)
        if legend:
            above.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)
    return above
