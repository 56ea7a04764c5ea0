"""Time history: a state against time, coloured by region, contacts marked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.transforms import ScaledTranslation

from saltus.errors import ParameterError, among, shown
from saltus.plot import axes as draw
from saltus.plot import regions, selection
from saltus.plot.picture import picture
from saltus.plot.style import OKABE_ITO, QUIET, Scale, display_scale
from saltus.results.dataset.schema import (
    contact_name,
    equations_of,
    first_of,
    forcing_period,
)

#: Marker, face and name of each kind of contact. Hollow means undecided.
_MARKERS: dict[str, dict[str, Any]] = {
    "crossing": {"marker": "o", "mfc": OKABE_ITO["black"], "label": "contact"},
    "impact": {"marker": "o", "mfc": OKABE_ITO["black"], "label": "impact"},
    "graze": {"marker": "D", "mfc": OKABE_ITO["orange"], "label": "graze"},
    "graze_unresolved": {"marker": "o", "mfc": "white", "label": "unresolved graze"},
}
#: More contacts than these would be a band of marks over the width of a picture.
_MOST_MARKED = 120


@picture()
def history(
    run: xr.Dataset,
    trajectory: int | Sequence[int] | None = None,
    state: str | None = None,
    periods: selection.Periods = None,
    ax: draw.Panels | None = None,
    *,
    time: Literal["s", "T", "both"] = "both",
    units: Mapping[str, str] | None = None,
    legend: bool = True,
) -> Any:
    """Time history of one state or output, coloured by region, contacts marked.

    Gap lines are dashed, contact regions lightly shaded. Colours change exactly at the contacts.
    More than 120 contacts aren't marked; choose fewer periods to see them. A
    trajectory that did not reach its end says so in the picture.

    Parameters
    ----------
    run : Dataset
        Result of ``simulate``.
    trajectory : int or list of int, optional
        Trajectory of a batch; each gets a panel. Without it all are shown, at most 8.
    state : str, optional
        Name of the state, or of an output; by default the first state, of a structure by its modes
        the first sensor.
    periods : int, float or pair, optional
        Number of forcing periods at the end, or (first, last) period; the whole run by default.
    ax : Axes or array of Axes, optional
        Axes to draw into, one for each trajectory; a new figure by default.
    time : {"both", "s", "T"}
        Axis of time: seconds with forcing periods at the top, or one of the two.
    units : mapping of str to str, optional
        Display units, such as ``{"x": "mm"}``; by the size of the numbers by default.
    legend : bool
        Whether to name the colours and markers.

    Returns
    -------
    Axes, or array of Axes, shape (trajectory,)
        The array for several trajectories.

    Raises
    ------
    ParameterError
        If ``run`` is not from ``simulate``, or an argument doesn't fit it.
    """
    if not among(time, ("s", "T", "both")):
        raise ParameterError(f"time={shown(time)}. Known: 'both', 's', 'T'.")
    state = first_of(run) if state is None else selection.state_named(run, state)
    wanted = selection.units_of_states(run, units).get(state)
    labels = selection.chosen(run, trajectory)
    singles = [selection.single(run, label) for label in labels] or [selection.single(run, None)]
    windows = [selection.window(motion, periods) for motion in singles]
    with draw.panels(ax, len(singles), (6.3, 2.5)) as panels:
        for i, (panel, motion, part) in enumerate(zip(panels, singles, windows, strict=True)):
            _panel(panel, motion, state, part, time, wanted)
            if len(labels) > 1:
                panel.set_ylabel(f"{selection.named(run, motion, labels[i])}\n{panel.get_ylabel()}")
            if legend and i == 0:
                ticks = 0.25 if time == "both" and "period" in motion else 0.05  # inches
                above = panel.transAxes + ScaledTranslation(0, ticks, panel.figure.dpi_scale_trans)
                draw.legend(
                    panel,
                    regions.find(motion, [state]),
                    loc="lower right",
                    bbox_to_anchor=(1, 1),
                    bbox_transform=above,
                    ncols=8,
                )
    return panels[0] if len(singles) == 1 else np.array(panels, dtype=object)


def _panel(
    ax: Axes, ds: xr.Dataset, state: str, shown: tuple[float, float], time: str, unit: str | None
) -> None:
    """Draw one trajectory in one Axes."""
    curve = selection.path(ds, (state,), *shown)
    if shown[0] == shown[1]:
        who = f"Trajectory {int(ds['trajectory'])}" if "trajectory" in ds.coords else "It"
        draw.say(ax, f"{who} stopped where it began: there is no motion to draw.", ds)
        return
    values = curve.values[:, 0]
    finite = np.abs(values[np.isfinite(values)])
    y = display_scale(ds[state].attrs.get("units", ""), float(finite.max(initial=0.0)), unit)
    period = forcing_period(ds)
    in_periods = time == "T" and "period" in ds
    x = (
        Scale(1 / period, "T")
        if in_periods
        else display_scale("s", float(np.abs(curve.time).max()))
    )
    coloured = regions.find(ds, [state])
    state_regions = regions.along(ds, state)

    width = 1.1 if shown[1] - shown[0] <= 40 or "period" not in ds else 0.7
    draw.draw_pieces(
        ax, curve.time * x.factor, values * y.factor, coloured.of(curve.mode), coloured, width
    )
    draw.set_limits(ax, "x", curve.time * x.factor, margin=0.0)
    draw.set_limits(
        ax,
        "y",
        values * y.factor,
        [boundary.value * y.factor for boundary in state_regions.boundaries],
    )
    table = selection.contacts_in(ds, *shown)
    owners = {
        str(guard): str(owner)
        for guard, owner in zip(ds["guard"].values, ds["guard_state"].values, strict=True)
    }
    mine = {
        "",
        state,
        *(owner for owner in owners.values() if f"d{owner}/dt = {state}" in equations_of(ds)),
    }
    theirs = np.array(
        [owners[str(guard)] not in mine for guard in table["contact_guard"].values], dtype=bool
    )
    _mark_contacts(ax, table.isel(contact=~theirs), state, x, y)
    _note_contacts(ax, table.isel(contact=theirs), owners, x)
    draw.draw_gaps(ax, "y", state_regions, y)
    draw.note_status(ax, ds)
    ax.set_xlabel(x.label("time"))
    ax.set_ylabel(y.label(state))
    if time == "both" and "period" in ds:
        top = draw.count_at_top(ax, period * x.factor, ticks=8)
        top.xaxis.set_major_formatter("{x:g} T")


def _note_contacts(ax: Axes, table: xr.Dataset, owners: Mapping[str, str], x: Scale) -> None:
    """Draw a stroke at the foot of the picture for each contact of another state: its boundary
    isn't on this axis.
    """
    if table.sizes["contact"]:
        names = ", ".join(
            dict.fromkeys(owners[str(guard)] for guard in table["contact_guard"].values)
        )
        place = np.full(table.sizes["contact"], 0.03)
        draw.draw_points(
            ax,
            table["contact_time"].values * x.factor,
            place,
            transform=ax.get_xaxis_transform(),
            marker="|",
            ms=6,
            mew=0.8,
            color=QUIET,
            label=f"contact of {names}",
        )


def _mark_contacts(ax: Axes, table: xr.Dataset, state: str, x: Scale, y: Scale) -> None:
    """Draw a marker for each contact, by its kind; smaller if there are many. The legend counts
    contacts that are too many to mark.
    """
    kinds = table["contact_kind"].values.astype(str)
    size = 3.4 if kinds.size <= 40 else 2.4
    for kind, marker in _MARKERS.items():
        rows = np.flatnonzero(kinds == kind)
        if rows.size > _MOST_MARKED:
            ax.plot([], [], " ", label=f"{rows.size} {marker['label']}s, too many to mark")
        elif rows.size:
            grow = 1.5 if kind.startswith("graze") else 1.0
            at = (
                table["contact_time"].values[rows] * x.factor,
                table[contact_name(state)].values[rows] * y.factor,
            )
            draw.draw_points(
                ax, *at, ms=size * grow, mec=OKABE_ITO["black"], mew=0.5, zorder=3, **marker
            )
