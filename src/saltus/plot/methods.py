"""Comparison of methods over one parameter: the error of each, the share of different answers, and
the cost.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.ticker import LogFormatter

from saltus.intervals import wilson
from saltus.plot import axes as draw
from saltus.plot.picture import PictureError, caller, picture
from saltus.plot.response_points import is_log, parameter_scale
from saltus.plot.style import CYCLE

#: Pieces of the axis over which medians and shares are taken: the eye can't follow 2000 values, and
#: a share needs some dozen.
PIECES = 30
#: Most values that are drawn as large dots.
FEW = 100
#: Most pieces of the axis over which numbers are drawn as steps.
STEPS = 8


@picture()
def methods(ds: xr.Dataset, *, ax: draw.Panels | None = None) -> list[Axes]:
    """Draw the effect of the method on steady responses, against one parameter: three panels, the
    first method of ``ds`` being the reference.

    From above: the error of one forcing period started on the reference's own responses (dots, and
    medians over pieces of the axis); the share of starts whose answer differs from the reference's,
    piece by piece, with its 95 % interval; the steps tried in a forcing period.

    Parameters
    ----------
    ds : Dataset
        Result of ``sl.compare_methods`` for a frequency response or a bifurcation diagram over
        one parameter.
    ax : sequence of three Axes, optional
        Axes to draw into; a new figure by default.

    Returns
    -------
    list of Axes
        The three panels.

    Raises
    ------
    ParameterError
        If ``ds`` is something else.
    """
    if "step_error" not in ds or ds["step_error"].ndim != 2:
        raise PictureError(
            f"{caller()} draws responses over one parameter. For basins draw plot.agreement, for "
            f"two parameters select one."
        )
    axis = str(ds["step_error"].dims[1])
    values, unit = ds[axis].values, ds[axis].attrs.get("units", "")
    log = is_log(values)
    scale = parameter_scale(values, unit, log)
    x, bins = values * scale.factor, _pieces(values, log) * scale.factor
    with draw.panels(ax, 3, (6.3, 1.9)) as panels:
        for i, name in enumerate(ds["method"].values.astype(str)):
            color = CYCLE[i % len(CYCLE)]
            _draw_cost(panels[2], ds.isel(method=i), x, name, color)
            if i:
                _draw_error(panels[0], ds.isel(method=i), x, bins, name, color)
                _draw_share(panels[1], ds.isel(method=i), x, bins, color)
        _finish(panels, scale.label(axis.replace("_", " ")), log, x)
    return panels


def _pieces(values: np.ndarray, log: bool) -> np.ndarray:
    """Edges of the pieces of the axis."""
    count = min(PIECES, max(1, len(values) // 8))
    low, high = float(values[0]), float(values[-1])
    return np.geomspace(low, high, count + 1) if log else np.linspace(low, high, count + 1)


def _in_pieces(x: np.ndarray, bins: np.ndarray) -> list[np.ndarray]:
    number = np.clip(np.searchsorted(bins, x, side="right") - 1, 0, len(bins) - 2)
    return [np.flatnonzero(number == k) for k in range(len(bins) - 1)]


def _middles(bins: np.ndarray) -> np.ndarray:
    middles: np.ndarray = (
        np.sqrt(bins[1:] * bins[:-1])
        if bins[0] > 0 and bins[-1] > 100 * bins[0]
        else 0.5 * (bins[1:] + bins[:-1])
    )
    return middles


def _over(bins: np.ndarray, values: Any) -> tuple[np.ndarray, np.ndarray]:
    """Curve of a number for each piece: through the middles of many pieces, or steps over a few."""
    if len(bins) > STEPS:
        return _middles(bins), np.asarray(values)
    return np.repeat(bins, 2)[1:-1], np.repeat(np.asarray(values), 2)


def _draw_error(
    ax: Axes, one: xr.Dataset, x: np.ndarray, bins: np.ndarray, name: str, color: str
) -> None:
    error = np.where(one["step_error"].values > 0, one["step_error"].values, np.nan)
    few = x.size <= FEW
    draw.draw_points(
        ax,
        x,
        error,
        marker="o",
        ms=3.0 if few else 1.3,
        mfc=color,
        mec="none",
        alpha=0.6 if few else 0.35,
        zorder=2,
    )
    medians = [
        float(np.nanmedian(error[piece])) if np.isfinite(error[piece]).any() else np.nan
        for piece in _in_pieces(x, bins)
    ]
    ax.plot(*_over(bins, medians), color=color, lw=1.4, label=name, zorder=3)


def _draw_share(ax: Axes, one: xr.Dataset, x: np.ndarray, bins: np.ndarray, color: str) -> None:
    agrees = one["agrees"].values.reshape(len(x), -1)
    pieces = _in_pieces(x, bins)
    settled = np.array([(agrees[piece] >= 0).sum() for piece in pieces], float)
    differ = np.array([(agrees[piece] == 0).sum() for piece in pieces], float)
    share = np.divide(differ, settled, out=np.full(len(pieces), np.nan), where=settled > 0)
    low, high = wilson(differ, settled)
    ax.fill_between(
        *_over(bins, 100 * low), _over(bins, 100 * high)[1], color=color, alpha=0.2, lw=0, zorder=2
    )
    ax.plot(*_over(bins, 100 * share), color=color, lw=1.4, zorder=3)


def _draw_cost(ax: Axes, costs: xr.Dataset, x: np.ndarray, name: str, color: str) -> None:
    cost = float(costs["method_cpu_seconds"])
    label = f"{name}: {cost:.3g} s" if np.isfinite(cost) else name
    size = 3.0 if x.size <= FEW else 1.5
    draw.draw_points(
        ax,
        x,
        costs["steps_per_period"].values,
        marker="o",
        ms=size,
        mfc=color,
        mec="none",
        label=label,
        zorder=2,
    )


def _finish(panels: list[Axes], label: str, log: bool, x: np.ndarray) -> None:
    for panel in panels:
        panel.set_xscale("log" if log else "linear")
        panel.set_xlim(x[0], x[-1])
    panels[0].set_yscale("log")
    panels[2].set_yscale("log")
    panels[0].set_ylabel("error of a period [range]")
    panels[1].set_ylabel("other answer [%]")
    panels[1].set_ylim(-3, 103)  # a curve at 0 or 100 isn't hidden by the frame
    for axis in (panels[2].yaxis.set_major_formatter, panels[2].yaxis.set_minor_formatter):
        axis(LogFormatter(labelOnlyBase=False, minor_thresholds=(2, 0.5)))
    panels[2].set_ylabel("steps a period")
    panels[2].set_xlabel(label)
    for panel, title in ((panels[0], None), (panels[2], "processor time")):
        panel.legend(
            loc="center left",
            bbox_to_anchor=(1.01, 0.5),
            fontsize="small",
            title=title,
            markerscale=1.5 if x.size <= FEW else 3,
            frameon=False,
        )
