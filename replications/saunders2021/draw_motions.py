"""Figs. 2, 4 and 5: motions, their contacts, and the orbit inside the longest one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from saltus import plot
from saltus.plot import cells
from saltus.plot.style import OKABE_ITO
from saltus.replication.claims import Data
from saltus.study.answers.compare import residuals

from . import printed

#: Half-width of the zoom onto one contact [s].
ZOOM = 1.2e-3


def located(data: Data) -> Figure:
    """Fig. 2: the run of Table 2 coloured by region, a zoom onto a contact, and what its residuals
    hide.
    """
    run, exact = data["fig2/ode45"], data["fig2/exact"]
    figure = plt.figure(figsize=(9.0, 6.0), layout="constrained")
    grid = figure.add_gridspec(2, 2, height_ratios=(1.1, 1), width_ratios=(1, 3.2))
    top, near, bottom = (
        figure.add_subplot(place) for place in (grid[0, :], grid[1, 0], grid[1, 1])
    )
    plot.history(run, ax=top, periods=(0, 3))
    top.set_title("Case b4, 7 Hz, from rest: ode45 (1e-4, 1e-7), located", pad=18)
    times = run["contact_time"].values
    marked = {letter: number for letter, number, _ in printed.contacts()}
    for letter, number in marked.items():
        x = float(run["contact_x"][number]) * 1e3
        top.annotate(
            letter,
            (times[number], x),
            (0, 9 if x < 0.2 else -14),
            textcoords="offset points",
            ha="center",
            fontweight="bold",
        )
    _zoom(near, run, marked["D"])
    _residuals(bottom, run, exact, marked)
    return figure


def _zoom(ax: Axes, run: xr.Dataset, number: int) -> None:
    """One contact near by: the motion, and the located point on the boundary."""
    at, place = float(run["contact_time"][number]), float(run["contact_x"][number])
    near = np.abs(run["time"].values - at) < ZOOM
    ax.plot(
        (run["time"].values[near] - at) * 1e3,
        (run["x"].values[near] - place) * 1e6,
        "-",
        color="#777777",
        lw=1.0,
    )
    ax.axhline(0, color="#222222", lw=0.7, ls=(0, (4, 3)))
    ax.plot(0, 0, "o", ms=5, color=OKABE_ITO["black"])
    ax.set(xlabel="time since D [ms]", ylabel="x − j [µm]", title="Contact D")


def _residuals(ax: Axes, run: xr.Dataset, exact: xr.Dataset, marked: Mapping[str, int]) -> None:
    """For each contact: the error of its time, and the error that its residual suggests."""
    count = min(run.sizes["contact"], exact.sizes["contact"])
    number = np.arange(1, count + 1)
    error = np.abs(run["contact_time"].values[:count] - exact["contact_time"].values[:count])
    suggested = residuals(run)[:count] / np.abs(run["contact_velocity"].values[:count])
    ours = np.maximum(np.abs(exact["contact_time_error"].values[:count]), 1e-18)
    ax.semilogy(
        number,
        error,
        "o-",
        ms=3.5,
        color=OKABE_ITO["vermillion"],
        label="true error of ode45's contact time",
        lw=0.8,
    )
    ax.semilogy(
        number,
        np.maximum(suggested, 1e-18),
        "s",
        ms=3.5,
        color=OKABE_ITO["blue"],
        label="error that |x − j| suggests: |x − j| / |v|",
    )
    ax.semilogy(
        number, ours, "-", color="#999999", lw=1.0, label="claimed error of the exact times"
    )
    for letter, place in marked.items():
        ax.annotate(
            letter,
            (place + 1, error[place]),
            (0, 5),
            textcoords="offset points",
            ha="center",
            fontweight="bold",
        )
    ax.set(xlabel="contact", ylabel="time [s]", ylim=(1e-18, 1e-2), xlim=(0, count + 1))
    ax.set_title("A state on the boundary to 1e-16 m says nothing about when it got there")
    ax.legend(loc="center right")


def three_responses(data: Data) -> Figure:
    """Fig. 4: the response at 16 Hz and two at 17 Hz."""
    titles = ("16 Hz", "17 Hz, small response", "17 Hz, large response")
    return _rows(data["fig4/exact"], titles, (4, 4, 6))


def four_starts(data: Data) -> Figure:
    """Fig. 5: what the four starts settle to."""
    starts = [f"$x_0$ = {x} mm" for x in ("1.0", "0.2", "0.4", "2.0")]
    return _rows(data["fig5/exact"], starts, (24, 24, 24, 24))


def _rows(run: xr.Dataset, titles: Sequence[str], shown: Sequence[int]) -> Figure:
    """A row for each trajectory: time history, and phase portrait with Poincaré points."""
    from saltus.analysis.motion.settled import settled
    from saltus.results.dataset.schema import period_text

    found = settled(run)["response_period"].values
    figure, grid = plt.subplots(
        len(titles),
        2,
        figsize=(9.0, 1.9 * len(titles) + 0.3),
        width_ratios=(2.4, 1),
        layout="constrained",
    )
    for i, (row, title, periods) in enumerate(zip(grid, titles, shown, strict=True)):
        plot.history(run, i, periods=periods, ax=row[0], time="T", legend=False)
        plot.phase(
            run, i, periods=max(int(found[i]), 1) if found[i] else 48, ax=row[1], legend=False
        )
        row[0].set_title(f"{title}: {period_text(int(found[i]))}")
        for text in list(row[1].texts):
            text.remove()
        if i < len(titles) - 1:
            row[0].set_xlabel("")
    named = {
        label: handle
        for one in grid.flat
        for handle, label in zip(*one.get_legend_handles_labels(), strict=True)
    }
    figure.legend(list(named.values()), list(named), loc="outside lower center", ncols=len(named))
    return figure


def doubled(data: Data) -> Figure:
    """Fig. 5, x0 = 0.4 mm: the stable orbit around the unstable one that it doubled from."""
    ds = data["fig5/halved"]
    order = np.argsort(-ds["attractor_period"].values)
    outer, inner = (ds.isel(attractor=int(i)) for i in order[:2])
    figure, axes = plt.subplots(1, 2, figsize=(9.0, 3.9), layout="constrained")
    looks: list[dict[str, Any]] = [
        {"marker": "o", "ms": 4.5, "mfc": OKABE_ITO["blue"], "mec": "white", "mew": 0.4},
        {"marker": "x", "ms": 6.0, "mec": OKABE_ITO["vermillion"], "mew": 1.6},
    ]
    for ax in axes:
        for one, look in zip((outer, inner), looks, strict=True):
            n = int(one["attractor_period"])
            ax.plot(
                one["attractor_x"] * 1e3,
                one["attractor_v"] * 1e3,
                ls="none",
                label=f"{n}T, {_multipliers(one)}",
                **look,
            )
        ax.set(xlabel="x [mm]", ylabel="v [mm/s]")
    axes[0].set_title("States at whole forcing periods")
    pair = _widest_pair(outer, inner)
    for name, limits in (("x", axes[1].set_xlim), ("v", axes[1].set_ylim)):
        values = outer[f"attractor_{name}"].values[pair] * 1e3
        limits(values.mean() - 1.6 * np.ptp(values), values.mean() + 1.6 * np.ptp(values))
    axes[1].set_title("Near by: two points of the stable orbit, one of the unstable")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


def _widest_pair(outer: xr.Dataset, inner: xr.Dataset) -> np.ndarray:
    """Two points of the long orbit, half its period apart, that lie farthest from one another."""
    n = int(inner["attractor_period"])
    x = outer["attractor_x"].values
    gap = np.abs(x[:n] - x[n : 2 * n])
    first = int(np.nanargmax(gap))
    return np.array([first, first + n])


def _multipliers(one: xr.Dataset) -> str:
    parts = zip(
        one["attractor_multiplier_real"].values,
        one["attractor_multiplier_imag"].values,
        strict=True,
    )
    texts = [
        f"{real:.4f}" if imag == 0 else f"{real:.4f} ± {abs(imag):.4f}i" for real, imag in parts
    ]
    return f"multipliers {', '.join(dict.fromkeys(texts))}"


def where_a_step_leads(data: Data) -> Figure:
    """Fig. 4: which response at 17 Hz the motion at 16 Hz turns into, by where it is when the
    frequency changes.
    """
    ds, run = data["fig4/step"], data["fig4/exact"].isel(trajectory=0)
    colors = cells.colors_of(ds, None)
    dim = run["x"].dims[0]
    last = run.isel({dim: slice(-201, -1)})
    figure, ax = plt.subplots(figsize=(5.6, 3.6), layout="constrained")
    ax.plot(last["x"] * 1e3, last["v"], color="#BBBBBB", lw=1.0, zorder=1)
    for key in ds["attractor"].values.tolist():
        here = ds["basin"].values == key
        label = f"{cells.describe(ds.sel(attractor=key))}: {cells.share_text(here.mean())}"
        ax.plot(
            last["x"].values[here] * 1e3,
            last["v"].values[here],
            "o",
            ms=4.5,
            mfc=colors[key],
            mec="white",
            mew=0.4,
            label=label,
        )
    ax.set(
        xlabel="x [mm]",
        ylabel="v [m/s]",
        title="State at the step from 16 Hz to 17 Hz, and what it turns into",
    )
    ax.legend(loc="center")
    return figure
