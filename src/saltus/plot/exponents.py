"""Convergence of Lyapunov exponents: running means and confidence intervals, against time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from saltus.plot import axes as draw
from saltus.plot import selection
from saltus.plot.picture import picture
from saltus.plot.style import CYCLE, QUIET, Scale, display_scale
from saltus.results.dataset.schema import kind_text

#: Share of the time at the beginning whose running means aren't shown: they start anywhere, with
#: intervals beyond any frame.
_EARLY = 0.1


@picture()
def exponents(
    ds: xr.Dataset,
    trajectory: int | Sequence[int] | None = None,
    ax: draw.Panels | None = None,
    *,
    legend: bool = True,
) -> Any:
    """Lyapunov exponents as they converge: mean so far and its 95 % interval, against the time
    since the transient.

    The first tenth of the time isn't shown. The values at the end stand in the legend; where the
    motion settled to an orbit, they are those of the orbit, drawn as dashed lines.

    Parameters
    ----------
    ds : Dataset
        Result of ``lyapunov`` or ``wolf``.
    trajectory : int or list of int, optional
        Trajectory of a batch; each gets a panel. Without it all are shown, at most 8.
    ax : Axes or array of Axes, optional
        Axes to draw into, one for each trajectory; a new figure by default.
    legend : bool
        Whether to give the values.

    Returns
    -------
    Axes, or array of Axes, shape (trajectory,)
        The array for several trajectories.

    Raises
    ------
    ParameterError
        If ``ds`` is not from ``lyapunov`` or ``wolf``, or an argument doesn't fit it.
    """
    labels = selection.chosen(ds, trajectory)
    with draw.panels(ax, len(labels), (6.3, 2.5)) as panels:
        for label, panel in zip(labels, panels, strict=True):
            one = ds.sel(trajectory=label)
            _panel(panel, one, legend)
            if len(labels) > 1:
                panel.set_ylabel(f"{selection.named(ds, one, label)}\n{panel.get_ylabel()}")
    return panels[0] if len(panels) == 1 else np.array(panels, dtype=object)


def _panel(ax: Axes, motion: xr.Dataset, legend: bool) -> None:
    """Draw one trajectory in one Axes."""
    unit = motion["lyapunov_exponent"].attrs.get("units", "")
    time = motion["running_time"].values
    finite = time[np.isfinite(time)]
    x = display_scale("s", float(finite.max(initial=0.0)))
    settled = int(motion["response_period"]) > 0 or motion["kind"].item() == "equilibrium"
    late = motion.isel(running=np.flatnonzero(time >= _EARLY * finite.max(initial=0.0)))
    time = late["running_time"].values
    shown = [late[f"running_{name}"].values.ravel() for name in ("low", "exponent", "high")]
    shown += [motion["lyapunov_low"].values, motion["lyapunov_high"].values, np.zeros(1)]
    draw.set_limits(ax, "y", np.concatenate(shown), margin=0.12)
    draw.set_limits(ax, "x", np.concatenate([[0.0], finite * x.factor]), margin=0.0)
    ax.axhline(0.0, color=QUIET, lw=0.7, zorder=1)
    for i in range(motion.sizes["exponent"]):
        color = CYCLE[i % len(CYCLE)]
        low, mean, high = (
            late[f"running_{name}"].values[i] for name in ("low", "exponent", "high")
        )
        ax.fill_between(time * x.factor, low, high, color=color, alpha=0.18, lw=0, zorder=1)
        ax.plot(time * x.factor, mean, color=color, lw=1.1, zorder=2, label=_value(motion, i, unit))
        if settled and np.isfinite(final := float(motion["lyapunov_exponent"][i])):
            ax.axhline(final, color=color, lw=0.9, ls=(0, (4, 3)), zorder=3)
    ax.set_xlabel(x.label("time after the transient"))
    ax.set_ylabel(Scale(1.0, unit).label("Lyapunov exponent"))
    ax.set_title("motion: " + kind_text(str(motion["kind"].item()), int(motion["response_period"])))
    draw.note_status(ax, motion)
    if legend:
        ax.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False)


def _value(one: xr.Dataset, i: int, unit: str) -> str:
    """Exponent with the half-width of its interval, in the digits that the interval justifies, six
    at most: ``5.98 ± 0.26 1/s``.
    """
    value = float(one["lyapunov_exponent"][i])
    half = float(one["lyapunov_high"][i]) - value
    if np.isneginf(value):
        return "\N{MINUS SIGN}\N{INFINITY}: nothing is left of it"
    if not np.isfinite(value):
        return "not known"
    if not half > 1e-6 * max(abs(value), 1e-300):
        return f"{value:.6g} {unit}".replace("-", "\N{MINUS SIGN}")
    digits = max(1 - int(np.floor(np.log10(half))), 0)
    return f"{value:.{digits}f} ± {half:.{digits}f} {unit}".replace("-", "\N{MINUS SIGN}")
