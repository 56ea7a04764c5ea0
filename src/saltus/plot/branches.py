"""Branches of periodic orbits and equilibria: stable ones solid, unstable ones dashed,
bifurcations marked.
"""

from __future__ import annotations

from typing import Any, Literal, get_args

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from saltus.errors import ParameterError, among, nearest, shown
from saltus.plot import axes as draw
from saltus.plot import motion_colors
from saltus.plot import response_points as points
from saltus.plot.picture import picture
from saltus.plot.style import QUIET, Scale, display_scale
from saltus.results.dataset.schema import event_name, point_name, states_of

Quantity = Literal[
    "peak", "rms", "maximum", "minimum", "peak_to_peak", "mean", "rms_about_mean", "amplitude",
    "phase", "period", "frequency",
]  # fmt: skip
_LABELS = {
    "peak": "peak |{}|", "rms": "rms of {}", "maximum": "largest {}", "minimum": "smallest {}",
    "peak_to_peak": "peak to peak of {}", "mean": "mean of {}",
    "rms_about_mean": "rms of {} about its mean", "amplitude": "first harmonic of {}",
    "phase": "phase of {}", "period": "period", "frequency": "frequency",
}  # fmt: skip
#: Quantities that begin at zero.
_SIZES = ("peak", "rms", "peak_to_peak", "rms_about_mean", "amplitude", "period")
#: Dashes of what is unstable.
_DASHES = (0, (3.0, 1.6))


@picture()
def branches(
    ds: xr.Dataset,
    *,
    quantity: Quantity = "peak",
    output: str | None = None,
    events: bool = True,
    legend: bool = True,
    ax: Any = None,
) -> Axes:
    """Size of the periodic orbits over the parameter: stable solid, unstable dashed, a colour for
    each period, bifurcations where they are.

    Parameters
    ----------
    ds : Dataset
        What :func:`saltus.branches` returned.
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
        Where to draw; a new figure by default.

    Returns
    -------
    Axes

    Raises
    ------
    ParameterError
        If ``ds`` holds no branches, or an argument doesn't fit it.
    """
    if not among(quantity, get_args(Quantity)):
        raise ParameterError(f"quantity={shown(quantity)}. Known: {', '.join(get_args(Quantity))}.")
    values, unit, name = _values(ds, quantity, output)
    with draw.panels(ax, 1, (6.3, 3.4)) as (panel,):
        parameter = ds.attrs["parameter"]
        place = ds[point_name(parameter)]
        across = display_scale(
            place.attrs.get("units", ""), float(np.abs(place.values).max(initial=0.0))
        )
        up = display_scale(unit, float(np.nanmax(np.abs(values), initial=0.0)))
        panel.set_xlim(*(ds.attrs[f"parameter_{end}"] * across.factor for end in ("low", "high")))
        panel.set_xlabel(across.label(parameter.replace("_", " ")))
        panel.set_ylabel(up.label(_LABELS[quantity].format(name)))
        named = draw_branches(panel, ds, values, across, up)
        if quantity in _SIZES:
            panel.set_ylim(bottom=0)
        if events:
            draw_marks(panel, ds, values, across, up)
        if legend:
            points.legend(panel, named)
    return panel


def _values(ds: xr.Dataset, quantity: str, output: str | None) -> tuple[np.ndarray, str, str]:
    """What is drawn of each point, its unit, and of what it is."""
    first = states_of(ds)[0]
    if quantity == "period":
        return ds["point_period"].values, "s", ""
    if quantity == "frequency":
        return 1.0 / ds["point_period"].values, "Hz", ""
    known = ds["output"].values.tolist()
    name = first if output is None else output
    if name not in known:
        raise ParameterError(f"the Dataset has no output {shown(name)}. {nearest(name, known)}")
    chosen = ds.sel(output=name)
    unit = "rad" if quantity == "phase" else chosen["output_units"].item()
    return chosen[f"point_output_{quantity}"].values, unit, name


def within_view(ds: xr.Dataset, values: np.ndarray, drawn: np.ndarray) -> np.ndarray:
    """Heights float64[point] of branches, NaN far above and below all responses, drawn at
    float64[..], where a branch was stopped after so many points: it may grow without bound.
    """
    ends = np.stack([ds["branch_begin"].values, ds["branch_end"].values])
    stopped = np.isin(ds["point_branch"].values, np.flatnonzero((ends == "points").any(axis=0)))
    seen = np.concatenate([np.ravel(drawn), values[~stopped]])
    largest = float(np.nanmax(np.abs(seen), initial=0.0))
    return np.where(stopped & (np.abs(values) > 1.2 * largest), np.nan, values)


def draw_branches(
    ax: Axes, ds: xr.Dataset, values: np.ndarray, across: Scale, up: Scale
) -> dict[str, Any]:
    """Lines along the branches; the entries of the legend."""
    kind = ds["branch_kind"].values
    drawn = motion_colors.codes(kind, np.where(kind == "periodic", ds["branch_periods"].values, 0))
    periods = points.periods_of(ds)
    place, height, of, stable = _with_events(ds, values)
    place, height = place * across.factor, height * up.factor
    named: dict[str, Any] = {}
    for code in np.unique(drawn):
        color = tuple(motion_colors.color(int(code)).tolist())
        mine = np.flatnonzero(drawn[of] == code)
        for solid in (False, True):
            x, y = _lines(mine, of, stable == solid, place, height)
            ax.plot(
                x, y, color=color, lw=1.3 if solid else 0.9, ls="-" if solid else _DASHES,
                zorder=3 if solid else 2, gid=f"{'stable' if solid else 'unstable'} {code}",
            )  # fmt: skip
        named[motion_colors.label(int(code), periods)] = Line2D([], [], color=color, lw=1.3)
    if (ds["point_unstable_multipliers"].values > 0).any():
        named["unstable"] = Line2D([], [], color=QUIET, lw=0.9, ls=_DASHES)
    return named


def _with_events(
    ds: xr.Dataset, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Where points lie and how high, their branches, and whether orbits behind them are stable;
    between them the events at which stability changes.
    """
    place, of = ds[point_name(ds.attrs["parameter"])].values, ds["point_branch"].values
    stable = ds["point_stable"].values > 0
    if not ds.sizes.get("event"):
        return place, values, of, stable
    before = ds["event_point"].values
    after = np.minimum(before + 1, ds.sizes["point"] - 1)
    turns = np.flatnonzero((stable[before] != stable[after]) & (of[before] == of[after]))
    at, height = _heights(ds, values)
    where = before[turns] + 1
    return (
        np.insert(place, where, at[turns]),
        np.insert(values, where, height[turns]),
        np.insert(of, where, of[before[turns]]),
        np.insert(stable, where, stable[after[turns]]),
    )


def _heights(ds: xr.Dataset, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where events lie, and how high: between the points that they lie between."""
    at = ds[event_name(ds.attrs["parameter"])].values
    before = ds["event_point"].values
    after = np.minimum(before + 1, ds.sizes["point"] - 1)
    place = ds[point_name(ds.attrs["parameter"])].values
    with np.errstate(all="ignore"):
        share = (at - place[before]) / (place[after] - place[before])
    share = np.where((share >= 0) & (share <= 1), share, 0.5)
    return at, values[before] + share * (values[after] - values[before])


def _lines(
    mine: np.ndarray, of: np.ndarray, wanted: np.ndarray, x: np.ndarray, y: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Curves through neighbours on one branch of which the first is wanted, NaN between them."""
    first = mine[:-1]
    joined = (np.diff(mine) == 1) & (of[first] == of[first + 1]) & wanted[first]
    keep = np.zeros(len(x) + 1, bool)
    keep[first[joined]] = keep[first[joined] + 1] = True
    breaks = np.setdiff1d(np.flatnonzero(keep[:-1]), first[joined])  # last point of each piece
    index = np.flatnonzero(keep[:-1])
    after = np.searchsorted(index, breaks) + 1
    return np.insert(x[index], after, np.nan), np.insert(y[index], after, np.nan)


def draw_marks(ax: Axes, ds: xr.Dataset, values: np.ndarray, across: Scale, up: Scale) -> None:
    """Bifurcations on the branches, between the points that they lie between."""
    if not ds.sizes.get("event"):
        return
    at, height = _heights(ds, values)
    size = 4.5 if len(at) <= 40 else 3.2
    for kind, (text, marker) in points.MARKS.items():
        here = ds["event_kind"].values == kind
        if here.any():
            ax.plot(
                at[here] * across.factor, height[here] * up.factor, ls="none", marker=marker,
                ms=size, mfc="white", mec=QUIET, mew=0.8, zorder=5, label=text,
                gid=f"event {kind}",
            )  # fmt: skip
