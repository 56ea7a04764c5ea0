"""Gallery of attractors: each in time, in the phase plane and at whole forcing periods."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import ScaledTranslation

from saltus.errors import ParameterError
from saltus.plot import axes as draw
from saltus.plot import cells, selection
from saltus.plot.history import history
from saltus.plot.phase import phase
from saltus.plot.picture import PictureError, caller, check, picture
from saltus.plot.style import display_scale, style
from saltus.results.dataset import schema

#: Forcing periods in the time history of a response that doesn't repeat.
_SHOWN_IF_APERIODIC = 12
#: Fewest forcing periods in the time history of one that does: a repeat shows only in two.
_FEWEST = 2
#: Most rows that fit a figure.
_MOST = 20
_ELSEWHERE = "#D2D2D2"
#: A picture of Poincare points is no narrower than this share of the orbit: a single point would
#: have no scale.
_NARROWEST = 0.25


@picture(needs=("attractor", "attractor_period", "attractor_contacts"))
def gallery(
    ds: xr.Dataset,
    runs: xr.Dataset,
    attractors: Sequence[int] | None = None,
    *,
    order: Sequence[int] | None = None,
) -> Figure:
    """A row for each attractor: time history over its period, phase portrait, Poincare points in
    the hue that it has in the map.

    Poincare points of the other attractors stay in the background, pale, where they lie nearby.

    Parameters
    ----------
    ds : Dataset
        Result of ``sl.basins`` or ``sl.attractors``.
    runs : Dataset
        Result of ``simulate`` for a batch whose trajectory i starts on attractor i.
    attractors : sequence of int, optional
        Ids of those to show; all by default, at most 20.
    order : sequence of int, optional
        Of the colours, as in ``plot.basins``; the rows are in this order too.

    Returns
    -------
    Figure

    Raises
    ------
    ParameterError
        If ``ds`` or ``runs`` is something else, they don't fit one another, or there is nothing to
        show.
    """
    check(runs, kinds=[schema.TRAJECTORY], argument="runs")
    colors = cells.colors_of(ds, order)
    ids = _chosen(runs, list(colors), attractors)
    pair = _pair(runs)
    columns = (
        3
        if len(pair) == 2 and all(f"attractor_{name}" in ds for name in pair)
        else 2
        if len(pair) == 2
        else 1
    )
    with style():
        figure, grid = plt.subplots(
            len(ids),
            columns,
            figsize=((4.6, 6.6, 9.0)[columns - 1], 1.75 * len(ids) + 0.35),
            squeeze=False,
            width_ratios=[2.4, 1.15, 1.15][:columns],
            layout="constrained",
        )
        for row, key in zip(grid, ids, strict=True):
            _row(row, ds, runs, key)
            if columns == 3 and not row[1].axison:  # at rest
                row[2].set_axis_off()
            elif columns == 3:
                _poincare(row[2], ds, runs, key, colors[key])
            _title(row[0], ds, key, colors[key])
        for one in grid[:-1].flat:
            one.set_xlabel("")
        _name_colours(figure, grid)
    return figure


def _chosen(runs: xr.Dataset, ids: list[int], attractors: Any) -> list[int]:
    """Ids of the attractors to show, each with a trajectory."""
    chosen = (
        ids
        if attractors is None
        else [int(number) for number in np.atleast_1d(attractors).tolist()]
    )
    strange = [number for number in chosen if number not in ids]
    if strange:
        raise ParameterError(
            f"there is no attractor {strange[0]}. Known: {', '.join(map(str, ids)) or 'none'}."
        )
    if not 0 < len(chosen) <= _MOST:
        some = " Choose, such as attractors=[0, 1]." if ids else " Nothing settled in this Dataset."
        raise PictureError(f"{caller()} shows 1 to {_MOST} attractors, not {len(chosen)}.{some}")
    held = runs["trajectory"].values.tolist() if "trajectory" in runs.dims else [0]
    lacking = [number for number in chosen if number not in held]
    if lacking:
        raise ParameterError(
            f"runs holds {len(held)} trajectories, none for attractor {lacking[0]} of {len(ids)}. "
            f"Simulate a batch whose "
            f"trajectory i starts on attractor i: from ds.attractor_{schema.states_of(runs)[0]}[:, "
            f"0] and so on."
        )
    return chosen


def _pair(runs: xr.Dataset) -> tuple[str, ...]:
    """States of the phase portrait, chosen as in plot.phase; one state if there is only one."""
    known = schema.states_of(runs)
    return (
        (known[0], selection.rate_of(runs, known[0]) or known[1]) if len(known) > 1 else known[:1]
    )


# -- one row ---------------------------------------------------------------------------------------
def _row(row: np.ndarray, ds: xr.Dataset, runs: xr.Dataset, key: int) -> None:
    """Draw the time history and the phase portrait."""
    n = int(ds["attractor_period"].sel(attractor=key))
    label = key if "trajectory" in runs.dims else None
    motion = selection.single(runs, label)
    axis = selection.sample_axis(motion)
    held = float(axis[-1] - axis[0])
    shown = (max(n, _FEWEST), n) if n else (_SHOWN_IF_APERIODIC, held)
    in_time, in_phase = (min(periods, held) if "period" in motion else None for periods in shown)
    history(runs, label, periods=in_time, ax=row[0], time="T", legend=False)
    # A picture of an equilibrium would show rounding errors only.
    if len(row) > 1 and str(ds["attractor_type"].sel(attractor=key).item()) == "equilibrium":
        names = [name for name in schema.states_of(runs) if f"attractor_{name}" in ds]
        places = [ds[f"attractor_{name}"].sel(attractor=key).values.ravel()[0] for name in names]
        scales = [
            display_scale(runs[name].attrs.get("units", ""), abs(place))
            for name, place in zip(names, places, strict=True)
        ]
        places_text = [
            f"{name} = {scale.text(place)}"
            for name, place, scale in zip(names, places, scales, strict=True)
        ]
        draw.say(row[1], "\n".join(["At rest at", *places_text]))
    elif len(row) > 1:
        phase(runs, label, periods=in_phase, ax=row[1], legend=False)
        for names in [
            child for child in row[1].child_axes if child.get_gid() == draw.GAP_NAMES.format("x")
        ]:
            # The time history next to it names the gaps too; here the names would touch the title.
            names.remove()


def _poincare(ax: Axes, ds: xr.Dataset, runs: xr.Dataset, key: int, color: np.ndarray) -> None:
    """Draw the attractor at whole periods, and the others pale behind it."""
    pair = _pair(runs)
    clouds = np.stack(
        [ds[f"attractor_{name}"].transpose("attractor", "phase").values for name in pair], axis=-1
    )
    own = ds["attractor"].values == key
    mine, others = (cloud[np.isfinite(cloud).all(axis=-1)] for cloud in (clouds[own], clouds[~own]))
    orbit = selection.single(runs, key if "trajectory" in runs.dims else None)
    directions: tuple[draw.Direction, draw.Direction] = ("x", "y")
    scales = []
    for i, (name, direction) in enumerate(zip(pair, directions, strict=True)):
        low, high = _window(mine[:, i], orbit[name].values)
        scales.append(display_scale(runs[name].attrs.get("units", ""), max(abs(low), abs(high))))
        draw.set_limits(ax, direction, np.array([low, high]) * scales[i].factor, margin=0.1)
        (ax.set_xlabel if direction == "x" else ax.set_ylabel)(scales[i].label(name))
    draw.few_ticks(ax)
    mine, others = (cloud * [scale.factor for scale in scales] for cloud in (mine, others))
    size = 5.0 if len(mine) <= 12 else 3.6 if len(mine) <= 60 else 1.8
    marks: dict[str, Any] = {
        "marker": "o",
        "ms": size,
        "mfc": color,
        "mec": "#333333",
        "mew": 0.5 if size > 2 else 0.0,
        "gid": f"attractor {key}",
    }
    if len(others):
        draw.draw_points(
            ax,
            *others.T,
            marker="o",
            ms=2.4,
            mfc=_ELSEWHERE,
            mec="none",
            zorder=1,
            label="other attractors",
            gid="others",
        )
    draw.draw_points(ax, *mine.T, zorder=3, **marks)


def _window(points: np.ndarray, orbit: np.ndarray) -> tuple[float, float]:
    """Limits around the points, at least as wide as the labels of an axis need."""
    ends = [points.min(), points.max()] if points.size else [np.nanmin(orbit), np.nanmax(orbit)]
    middle = 0.5 * (ends[0] + ends[1])
    half = max(
        0.5 * (ends[1] - ends[0]), 0.5 * _NARROWEST * float(np.nanmax(orbit) - np.nanmin(orbit))
    )
    return float(middle - half), float(middle + half)


# -- words -----------------------------------------------------------------------------------------
def _title(ax: Axes, ds: xr.Dataset, key: int, color: np.ndarray) -> None:
    """Write the title of an attractor, after a dot in its hue."""
    title: Text = ax.set_title(title_of(ds, key))
    shift = ScaledTranslation(12 / 72, 0, ax.figure.dpi_scale_trans)
    title.set_transform(title.get_transform() + shift)
    ax.annotate(
        "\N{BLACK CIRCLE}",
        (0, 1),
        (0, 4.5),
        xycoords="axes fraction",
        textcoords="offset points",
        color=tuple(color),
        fontsize=11,
        ha="left",
        va="baseline",
        annotation_clip=False,
    )


def title_of(ds: xr.Dataset, key: int) -> str:
    """An attractor in one line: ``3T, 8 contacts, multipliers |µ| = 0.53, peak 0.91 mm, 12.3 % of
    the starts``.
    """
    attractor = ds.sel(attractor=key)
    parts = [cells.describe(attractor), _stability(attractor)]
    if "attractor_peak" in attractor:
        parts.append(cells.peak_text(attractor))
    if "attractor_fraction" in attractor and math.isfinite(float(attractor["attractor_fraction"])):
        parts.append(f"{cells.share_text(float(attractor['attractor_fraction']))} of the starts")
    return ", ".join(part for part in parts if part)


def _stability(attractor: xr.Dataset) -> str:
    """Largest multiplier if the motion repeats, else the largest exponent."""
    if int(attractor["attractor_period"]) > 0 and "attractor_multiplier_real" in attractor:
        size = np.hypot(
            attractor["attractor_multiplier_real"].values,
            attractor["attractor_multiplier_imag"].values,
        )
        size = np.sort(size[np.isfinite(size)])[::-1]
        texts = list(dict.fromkeys(f"{value:.3g}" for value in size))
        return f"multipliers |µ| = {', '.join(texts[:3])}" if texts else ""
    if "attractor_exponent" in attractor and math.isfinite(float(attractor["attractor_exponent"])):
        error = (
            float(attractor["attractor_exponent_error"])
            if "attractor_exponent_error" in attractor
            else math.nan
        )
        spread = f" ± {error:.1g}" if math.isfinite(error) else ""
        return f"exponent {float(attractor['attractor_exponent']):.3g}{spread} 1/s"
    return ""


def _name_colours(figure: Figure, grid: np.ndarray) -> None:
    """Draw one legend for all rows."""
    named = {
        label: handle
        for one in grid.flat
        for handle, label in zip(*one.get_legend_handles_labels(), strict=True)
    }
    if named:
        figure.legend(
            list(named.values()), list(named), loc="outside lower center", ncols=len(named)
        )
