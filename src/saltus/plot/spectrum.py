"""Amplitude spectrum: lines for a periodic response, a curve for any other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from saltus.errors import ParameterError, nearest, shown
from saltus.plot import axes as draw
from saltus.plot import selection
from saltus.plot.picture import picture
from saltus.plot.style import CYCLE, QUIET, Scale, display_scale
from saltus.results.dataset.schema import output_word, outputs_in

#: The picture reaches down to this share of the largest amplitude, and up to the last frequency
#: that has so much; the rest is what sampling folds back.
_SHOWN = 1e-5
#: The least number of orders shown, so that a harmonic response isn't a single line.
_ORDERS = 5.0


@picture()
def spectrum(
    ds: xr.Dataset,
    state: str | None = None,
    trajectory: int | Sequence[int] | None = None,
    ax: Axes | None = None,
    *,
    highest: float | None = None,
    units: Mapping[str, str] | None = None,
    legend: bool = True,
) -> Axes:
    """Amplitudes of one state by frequency, on a logarithmic scale, with the orders of the forcing
    at the top.

    A response that repeats shows as lines, any other as a curve.

    Parameters
    ----------
    ds : Dataset
        Result of ``spectrum``.
    state : str, optional
        Name of the state, or of an output; by default the first state, of a structure by its modes
        the first sensor.
    trajectory : int or list of int, optional
        Trajectory of a batch; without it all are laid over one another, at most 8.
    ax : Axes, optional
        Axes to draw into; a new figure by default.
    highest : float, optional
        Highest frequency to show [Hz]; by default the last one with 1e-5 of the largest amplitude,
        and at least order 5.
    units : mapping of str to str, optional
        Display units, such as ``{"x": "mm"}``; by the size of the numbers by default.
    legend : bool
        Whether to name the trajectories.

    Returns
    -------
    Axes

    Raises
    ------
    ParameterError
        If ``ds`` is not from ``spectrum``, or an argument doesn't fit it.
    """
    known = outputs_in(ds)
    state = known[0] if state is None else state
    if state not in known:
        raise ParameterError(
            f"this spectrum has no {output_word(ds)} {shown(state)}. {nearest(state, known)}"
        )
    labels = selection.chosen(ds, trajectory)
    singles = [ds.sel(trajectory=label) for label in labels] or [ds]
    curves = [np.asarray(motion[f"{state}_amplitude"].values, dtype=float) for motion in singles]
    largest = max((float(np.nanmax(curve, initial=0.0)) for curve in curves), default=0.0) or 1.0
    scale = display_scale(
        ds[f"{state}_amplitude"].attrs.get("units", ""),
        largest,
        selection.units_of_states(ds, units).get(state),
    )
    with draw.panels(ax, 1, (6.0, 2.8)) as (panel,):
        if not any(np.isfinite(curve).any() for curve in curves):
            draw.say(panel, "There is no spectrum: the motion stopped before its end.", *singles)
            return panel
        floor = _SHOWN * largest * scale.factor / 3
        for i, (motion, curve) in enumerate(zip(singles, curves, strict=True)):
            name = selection.named(ds, motion, labels[i]) if len(labels) > 1 else None
            _curve(panel, motion, curve * scale.factor, floor, CYCLE[i % len(CYCLE)], name)
        panel.set_yscale("log")
        panel.set_ylim(floor, 3 * largest * scale.factor)
        top = (
            float(highest)
            if highest is not None
            else max(
                _top(motion, curve, largest) for motion, curve in zip(singles, curves, strict=True)
            )
        )
        panel.set_xlim(0.0, top)
        panel.set_xlabel("frequency [Hz]")
        panel.set_ylabel(Scale(scale.factor, scale.unit).label(f"amplitude of {state}"))
        _mark_orders(panel, singles, top)
        if legend and len(labels) > 1:
            panel.legend(loc="upper left", bbox_to_anchor=(1.02, 1))
    return panel


def _curve(
    ax: Axes, one: xr.Dataset, values: np.ndarray, floor: float, color: str, name: str | None
) -> None:
    """Draw stems for a response that repeats, a curve for any other."""
    frequency = one["frequency"].values
    if int(one["response_period"]) and one["window"].item() == "none":
        seen = values > floor
        ax.vlines(frequency[seen], floor, values[seen], color=color, lw=0.9, zorder=2)
        draw.draw_points(
            ax, frequency[seen], values[seen], marker="o", ms=2.6, color=color, label=name, zorder=3
        )
    else:
        ax.plot(frequency, values, color=color, lw=0.4, alpha=0.8, label=name, zorder=2)


def _top(one: xr.Dataset, values: np.ndarray, largest: float) -> float:
    """Highest frequency worth showing [Hz]."""
    frequency = one["frequency"].values
    seen = np.flatnonzero(values > _SHOWN * largest)
    top = float(frequency[seen[-1]]) if seen.size else float(frequency[-1])
    if "order" in one:
        top = max(top, _ORDERS * float(frequency[-1] / one["order"].values[-1]))
    return min(1.05 * top, float(frequency[-1]))


def _mark_orders(ax: Axes, singles: Sequence[xr.Dataset], top: float) -> None:
    """Draw whole orders of the forcing as quiet lines, with an axis at the top, if all trajectories
    share a forcing frequency.
    """
    forcing = {
        float(one["frequency"].values[-1] / one["order"].values[-1])
        for one in singles
        if "order" in one
    }
    if len(forcing) != 1:
        return
    frequency = forcing.pop()
    if top / frequency <= 40:
        for order in range(1, int(top / frequency) + 1):
            ax.axvline(order * frequency, color=QUIET, lw=0.4, ls=(0, (1, 3)), zorder=1)

    above = draw.count_at_top(ax, frequency, ticks=10)
    above.set_xlabel("order")
