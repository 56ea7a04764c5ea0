"""Figs. 9, 10, 12 and 14: each attractor by the three ways of integrating, and how far ode45's lies
from the exact one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from saltus.analysis.basins.compare import compare
from saltus.plot import cells
from saltus.plot.style import display_scale
from saltus.replication.claims import Data
from saltus.results.dataset.schema import kind_text

from .looks import EXACT, LOOKS, OFF, ON, Look, lag, periods_of, strobe

#: What stands in place of the deviations where there are none: ode45 lacks the attractor, or the
#: exact map does.
_ABSENT = ("ode45 doesn't find it", "no exact attractor to compare with")
#: Forcing periods shown in time: at least these.
SHOWN = 4


@dataclass(frozen=True)
class Trio:
    """One attractor: its number in each map, -1 where it isn't there; keyed by the end of the jobs'
    names.
    """

    number: dict[str, int]
    kind: str
    period: int


def trios(data: Data, figure: str, setting: str) -> list[Trio]:
    """The attractors of three maps, matched: those of the exact map, then those that only ode45
    has.
    """
    exact = data[f"{figure}/{setting}, {EXACT.end}"]
    rows = [
        Trio(
            {EXACT.end: i},
            str(exact["attractor_type"].values[i]),
            int(exact["attractor_period"][i]),
        )
        for i in range(exact.sizes["attractor"])
    ]
    for look in (ON, OFF):
        both = compare(exact, data[f"{figure}/{setting}, {look.end}"])
        for a, b, kind, n in zip(
            *(both[f"match_{name}"].values for name in ("a", "b", "type", "period")), strict=True
        ):
            if a >= 0 and b >= 0:
                rows[int(a)].number[look.end] = int(b)
            elif b >= 0:
                rows.append(Trio({look.end: int(b)}, str(kind), int(n)))
    return [
        Trio({look.end: row.number.get(look.end, -1) for look in LOOKS}, row.kind, row.period)
        for row in rows
    ]


def attractors(data: Data, figure: str, setting: str) -> Figure:
    """A row for each attractor: time history, phase portrait with Poincaré points, and these points
    seen from the exact ones.
    """
    rows = trios(data, figure, setting)
    drawn, grid = plt.subplots(
        len(rows),
        3,
        figsize=(9.0, 2.0 * len(rows) + 0.5),
        width_ratios=(2.0, 1.1, 1.1),
        squeeze=False,
        layout="constrained",
    )
    for row, trio in zip(grid, rows, strict=True):
        _row(row, data, figure, setting, trio)
    grid[-1, 0].set_xlabel("time [T]")
    named = {
        label: handle
        for one in grid.flat
        for handle, label in zip(*one.get_legend_handles_labels(), strict=True)
    }
    order = [look.label for look in LOOKS if look.label in named]
    drawn.legend([named[label] for label in order], order, loc="outside lower center", ncols=3)
    return drawn


def _row(row: np.ndarray, data: Data, figure: str, setting: str, trio: Trio) -> None:
    n = max(trio.period, 1)
    reference = None
    for look in LOOKS:
        number = trio.number[look.end]
        if number < 0:
            continue
        run = data[f"{figure}/{setting}, {look.end}, motions"]
        points = strobe(run, number)
        reference = points if reference is None else reference
        shift = lag(reference, points, n) if trio.period else 0
        _curves(row, run, number, n, shift, look)
    _deviations(row[2], data, figure, setting, trio)
    run = data[f"{figure}/{setting}, {EXACT.end}, motions"]
    for boundary in run["guard_boundary"].values:
        row[0].axhline(boundary * 1e3, color="#555555", lw=0.7, ls=(0, (4, 3)), zorder=0)
        row[1].axvline(boundary * 1e3, color="#555555", lw=0.7, ls=(0, (4, 3)), zorder=0)
    row[0].set(ylabel="x [mm]", title=_title(data, figure, setting, trio))
    row[0].margins(x=0)
    row[1].set(xlabel="x [mm]", ylabel="v [mm/s]")


def _curves(row: np.ndarray, run: xr.Dataset, number: int, n: int, shift: int, look: Look) -> None:
    """Time history and phase portrait of one motion over its last periods."""
    one, period = periods_of(run, number)
    last = max(n, SHOWN)
    begin = round(period[0]) + shift
    inside = (period >= begin - 1e-6) & (period <= begin + last + 1e-6)
    line: dict[str, Any] = {"color": look.color, "lw": look.width, "ls": look.dashes}
    row[0].plot(period[inside] - begin, one["x"].values[inside] * 1e3, label=look.label, **line)
    cycle = (period >= begin - 1e-6) & (period <= begin + n + 1e-6)
    row[1].plot(one["x"].values[cycle] * 1e3, one["v"].values[cycle] * 1e3, **line)
    points = strobe(run, number)
    size = 6.5 if look is EXACT else 3.0
    row[1].plot(
        points[:, 0] * 1e3,
        points[:, 1] * 1e3,
        "o",
        ms=size,
        mfc=look.color,
        mec="white",
        mew=0.3,
        zorder=4,
    )


def _deviations(ax: Axes, data: Data, figure: str, setting: str, trio: Trio) -> None:
    """States at whole periods, less the nearest exact one."""
    clouds = deviations(data, figure, setting, trio)
    if not clouds:
        ax.text(
            0.5,
            0.5,
            _ABSENT[trio.number[EXACT.end] < 0],
            ha="center",
            va="center",
            transform=ax.transAxes,
            fontsize=7,
            color="#555555",
        )
        ax.set_axis_off()
        return
    every = np.concatenate(list(clouds.values()))
    scales = [
        display_scale(unit, float(np.abs(every[:, i]).max())) for i, unit in enumerate(("m", "m/s"))
    ]
    for look in (OFF, ON):
        if look.end in clouds:
            cloud = clouds[look.end]
            ax.plot(
                cloud[:, 0] * scales[0].factor,
                cloud[:, 1] * scales[1].factor,
                "o",
                ms=2.2,
                mfc=look.color,
                mec="none",
                alpha=0.75,
            )
    ax.plot(0, 0, "+", color="#333333", ms=9, mew=1.2)
    ax.set_xlabel(f"Δx [{scales[0].unit}]")
    ax.set_ylabel(f"Δv [{scales[1].unit}]")


def deviations(data: Data, figure: str, setting: str, trio: Trio) -> dict[str, np.ndarray]:
    """By end of the jobs' names: states of ode45's motion at whole periods, less those of the exact
    one, float64[n, 2].
    """
    if trio.number[EXACT.end] < 0 or not trio.period:
        return {}
    n = trio.period
    reference = strobe(data[f"{figure}/{setting}, {EXACT.end}, motions"], trio.number[EXACT.end])
    clouds = {}
    for look in (ON, OFF):
        if trio.number[look.end] >= 0:
            points = strobe(data[f"{figure}/{setting}, {look.end}, motions"], trio.number[look.end])
            points = np.roll(points[: len(points) // n * n], -lag(reference, points, n), axis=0)
            clouds[look.end] = points - reference[np.arange(len(points)) % n]
    return clouds


def _title(data: Data, figure: str, setting: str, trio: Trio) -> str:
    source = next(look for look in LOOKS if trio.number[look.end] >= 0)
    one = data[f"{figure}/{setting}, {source.end}"].isel(attractor=trio.number[source.end])
    texts = []
    for look in LOOKS:
        if trio.number[look.end] >= 0:
            found = data[f"{figure}/{setting}, {look.end}, variational"][
                "lyapunov_exponent"
            ].values[trio.number[look.end], 0]
            texts.append(f"{look.label.removeprefix('ode45, ')} {round(float(found), 2) + 0.0:.2f}")
    name = kind_text(trio.kind, trio.period)
    return f"{name}, {cells.peak_text(one)};  exponent along it [1/s]: {', '.join(texts)}"
