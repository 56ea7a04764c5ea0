"""Impact statistics and energy balances: bars of speeds, curves of energies."""

from __future__ import annotations

import textwrap

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from saltus.plot import axes as draw
from saltus.plot import selection
from saltus.plot.boundary_groups import MOST_ALONE, boundary_groups, legend_beside
from saltus.plot.picture import picture
from saltus.plot.style import OKABE_ITO, Scale, display_scale

#: Speeds closer than this share of the guard's largest speed are one speed.
_SAME = 1e-7
#: Most speeds that are listed in words; more make a histogram.
_MOST_SPEEDS = 6
#: Contacts per speed, at least, for speeds that repeat.
_REPEATED = 3
#: Characters of a line in a picture of words.
_LINE = 60


@picture()
def impacts(
    ds: xr.Dataset, trajectory: int | None = None, ax: Axes | None = None, *, legend: bool = True
) -> Axes:
    """Histogram of the speeds at contact, a colour for each guard; of more than eight guards
    stacked, a colour for each stop. Where they repeat, or there are none, it is said in words.

    Parameters
    ----------
    ds : Dataset
        Result of ``impact_statistics``.
    trajectory : int, optional
        Trajectory of a batch; all of them together by default.
    ax : Axes, optional
        Axes to draw into; a new figure by default.
    legend : bool
        Whether to name the guards.

    Returns
    -------
    Axes

    Raises
    ------
    ParameterError
        If ``ds`` is not from ``impact_statistics``, or there is no such trajectory.
    """
    counts = ds["speed_histogram"]
    labels: np.ndarray | None = None
    if "trajectory" in counts.dims:
        labels = (
            np.asarray(selection.chosen(ds, trajectory))
            if trajectory is not None
            else ds["trajectory"].values
        )
        counts = counts.sel(trajectory=labels).sum("trajectory")
    low, high = ds["speed_low"].values, ds["speed_high"].values
    scale = display_scale(ds["speed_low"].attrs.get("units", ""), float(np.abs(high).max()))
    names = ds["guard"].values.tolist()
    groups = boundary_groups(names)
    stacked = len(names) > MOST_ALONE  # bars side by side would be hairlines
    width = (high - low) * scale.factor / (1 if stacked else len(groups))
    sentence = _in_words(ds, labels, counts, scale)
    with draw.panels(ax, 1, (5.2, 2.8)) as (panel,):
        if sentence:
            draw.say(panel, sentence, ds if labels is None else ds.sel(trajectory=labels))
            return panel
        below = np.zeros(len(low))
        for i, group in enumerate(groups):
            height = counts.values[list(group.places)].sum(axis=0)
            if not height.any():
                continue
            panel.bar(
                low * scale.factor + (0 if stacked else i) * width,
                height,
                width=width,
                bottom=below if stacked else None,
                align="edge",
                color=group.color,
                label=group.label,
            )
            below += height
        panel.set_xlabel(scale.label("speed at contact"))
        panel.set_ylabel("contacts")
        if legend:
            legend_beside(panel)
    return panel


def _in_words(ds: xr.Dataset, labels: np.ndarray | None, counts: xr.DataArray, scale: Scale) -> str:
    """Describe contacts that make no histogram, because there are none, or because few speeds
    repeat; else "".
    """
    if not counts.values.sum():
        return "No contact in the observed time."
    mine = slice(None) if labels is None else np.isin(ds["contact_trajectory"].values, labels)
    speeds, guards = ds["contact_speed"].values[mine], ds["contact_guard"].values[mine].astype(str)
    lines = []
    for name in ds["guard"].values.tolist():
        guard_speeds = np.sort(speeds[(guards == name) & np.isfinite(speeds)])
        # Index of the first speed of each group of equal speeds.
        first = np.flatnonzero(
            np.diff(guard_speeds, prepend=-np.inf) > _SAME * guard_speeds.max(initial=0.0)
        )
        if len(guard_speeds) and (
            len(first) > _MOST_SPEEDS or len(guard_speeds) < _REPEATED * len(first)
        ):
            return ""
        if len(guard_speeds):
            values = ", ".join(scale.text(float(f"{guard_speeds[i]:.6g}")) for i in first)
            lines.append(
                textwrap.fill(
                    f"{name.replace('_', ' ')}: {len(guard_speeds)} contacts, at {values}",
                    _LINE,
                    subsequent_indent="    ",
                )
            )
    return "\n".join(["The speeds at contact repeat.", *lines])


@picture()
def energy(
    ds: xr.Dataset, trajectory: int | None = None, ax: Axes | None = None, *, legend: bool = True
) -> Axes:
    """Energy supplied, dissipated and stored, interval by interval; the largest imbalance is in the
    title.

    Parameters
    ----------
    ds : Dataset
        Result of ``energy_balance``.
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
        If ``ds`` is not from ``energy_balance``, or there is no such trajectory.
    """
    if "trajectory" in ds.dims:
        first = int(ds["trajectory"].values[0])
        ds = ds.sel(trajectory=selection.chosen(ds, first if trajectory is None else trajectory)[0])
    dim = str(ds["residual"].dims[0])
    lines = {
        "supplied": (OKABE_ITO["blue"], "-"),
        "dissipated": (OKABE_ITO["vermillion"], "-"),
        "friction": (OKABE_ITO["orange"], "-"),
        "impacts": (OKABE_ITO["purple"], "-"),
        "change": (OKABE_ITO["green"], "-"),
        "energy": (OKABE_ITO["black"], (0, (4, 2))),
    }
    curves = {name: line for name, line in lines.items() if name in ds}
    scale = display_scale(
        "J", max(float(np.abs(ds[name].values).max(initial=0.0)) for name in curves)
    )
    with draw.panels(ax, 1, (6.0, 2.8)) as (panel,):
        if not np.isfinite(ds["residual"].values).any():
            draw.say(
                panel,
                "There is no balance: the motion stopped before the first interval had passed.",
                ds,
            )
            return panel
        for name, (color, line) in curves.items():
            label = {"change": "change of the stored energy", "energy": "stored at the end"}.get(
                name, name
            )
            panel.plot(
                ds[dim].values,
                ds[name].values * scale.factor,
                color=color,
                ls=line,
                lw=1.0,
                label=label,
            )
        if dim != "time":
            panel.xaxis.set_major_locator(MaxNLocator(integer=True))
        panel.set_xlabel("time [s]" if dim == "time" else "forcing periods")
        panel.set_ylabel(scale.label("energy in an interval"))
        panel.set_title(f"imbalance {float(ds['imbalance']):.1e}", loc="left", fontsize=8)
        if legend:
            panel.legend(loc="upper left", bbox_to_anchor=(1.02, 1))
    return panel
