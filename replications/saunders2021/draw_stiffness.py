"""Figs. 3 and 7: frequency responses, bifurcation diagrams, and where ode45 goes wrong as the
contact gets harder.
"""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from saltus import plot
from saltus.replication.claims import Data
from saltus.replication.papers import folder_of

from .looks import OFF, ON
from .sameness import UNSETTLED, classes, running_median, running_share

CASES = ("a1.5", "a4", "b1.5", "b4", "c1.5", "c4")
PANELS = {"d": "5 Hz", "e": "17 Hz", "f": "23 Hz"}
STIFFNESS = {"a": "14 kN/m", "b": "70 kN/m", "c": "14 GN/m"}
_GREY = "#9A9A9A"
#: Chaos under shares: intervals that overlap look grey too.
_HATCHED: dict[str, Any] = {"fc": "none", "ec": "#B0B0B0", "hatch": "////", "lw": 0.0}


def six_cases(data: Data) -> Figure:
    """Fig. 3: a panel for each case, exact, with ode45 at the paper's tolerances laid over, and
    measured points if there are any.
    """
    figure, grid = plt.subplots(3, 2, figsize=(9.0, 9.2), sharex=True, layout="constrained")
    for ax, case in zip(grid.flat, CASES, strict=True):
        path = folder_of("saunders2021") / f"measured_{case}.csv"
        plot.frequency_response(
            data[f"fig3/{case}, exact"],
            measured=path if path.exists() else None,
            events=False,
            legend=False,
            ax=ax,
        )
        own = data[f"fig3/{case}, ode45"]
        ax.plot(
            own["response_frequency"],
            own["response_rms"] * 1e3,
            "o",
            ms=5.0,
            mfc="none",
            mec="#222222",
            mew=0.8,
            label="ode45 (1e-12, 1e-12), located",
        )
        ax.set_title(f"case {case[0]}, {case[1:]} N")
        ax.set_yscale("log")
        sizes = 1e3 * data[f"fig3/{case}, exact"]["response_rms"].values
        ax.set_ylim(0.7 * sizes.min(), 1.5 * sizes.max())
        ax.set_ylabel("rms of x [mm]")
        _plain_numbers(ax)
        ax.set_xlabel("")
    for ax in grid[-1]:
        ax.set_xlabel("frequency [Hz]")
    _legend_of_kinds(figure, data)
    return figure


def _plain_numbers(ax: Axes) -> None:
    """0.1, 0.3, 1 in place of powers of ten along a logarithmic axis."""
    ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.3g}"))
    ax.yaxis.set_minor_formatter(NullFormatter())


def _legend_of_kinds(figure: Figure, data: Data) -> None:
    from saltus.plot import motion_colors

    codes, periods = set(), []
    for case in CASES:
        ds = data[f"fig3/{case}, exact"]
        codes |= set(np.unique(motion_colors.of(ds)).tolist())
        periods.append(ds["response_period"].values)
    every = np.concatenate(periods)
    handles = []
    for code in sorted(codes):
        look: dict[str, Any] = {
            "ls": "none",
            "marker": "o",
            "ms": 5,
            "color": motion_colors.color(code),
            "label": motion_colors.label(code, every),
        }
        handles.append(Line2D([], [], **look))
    handles.append(
        Line2D(
            [],
            [],
            ls="none",
            marker="o",
            ms=5,
            mfc="none",
            mec="#222222",
            label="ode45 (1e-12, 1e-12), located",
        )
    )
    figure.legend(handles=handles, loc="outside lower center", ncols=6)


def three_stiffnesses(data: Data) -> Figure:
    """Fig. 7(a-c): every response in three ways."""
    figure, axes = plt.subplots(1, 3, figsize=(9.0, 3.4), layout="constrained")
    for ax, (panel, stiffness) in zip(axes, STIFFNESS.items(), strict=True):
        for end, color, size, label in (
            ("exact", _GREY, 6.0, "exact"),
            (ON.end, ON.color, 3.4, ON.label),
            (OFF.end, OFF.color, 1.6, OFF.label),
        ):
            ds = data[f"fig7/{panel}, {end}"]
            frequency = np.broadcast_to(ds["frequency"].values[:, None], ds["rms"].shape)
            ax.plot(
                frequency.ravel(),
                1e3 * ds["rms"].values.ravel(),
                "o",
                ms=size,
                mfc=color,
                mec="none",
                label=label,
                rasterized=True,
            )
        ax.set(title=f"({panel})  Kc = {stiffness}", xlabel="frequency [Hz]", yscale="log")
        _plain_numbers(ax)
    axes[0].set_ylabel("rms of x [mm]")
    figure.legend(
        *axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, markerscale=1.5
    )
    return figure


def one_branch(data: Data, of: str) -> Figure:
    """Stable and unstable orbits over a parameter."""
    figure, ax = plt.subplots(figsize=(7.0, 3.8), layout="constrained")
    plot.branches(data[of], ax=ax)
    return figure


def _turning(ax: Axes, ds: xr.Dataset, color: str, size: float) -> None:
    y = ds["sample_x"].values * 1e3
    x = np.broadcast_to(ds["response_contact_stiffness"].values[:, None], y.shape)
    there = np.isfinite(y)
    ax.plot(x[there], y[there], "o", ms=size, mfc=color, mec="none", rasterized=True)


def diagrams(data: Data) -> Figure:
    """Fig. 7(d-f): turning points by the paper's two ways above, exact below."""
    figure, grid = plt.subplots(
        3, 2, figsize=(9.0, 9.6), sharex=True, sharey="row", layout="constrained"
    )
    for row, (panel, frequency) in zip(grid, PANELS.items(), strict=True):
        many = data[f"fig7/{panel}, exact"].sizes["contact_stiffness"] > 500
        for ax, ends in zip(row, ((ON, OFF), (None,)), strict=True):
            for i, look in enumerate(ends):
                ds = data[f"fig7/{panel}, {look.end if look else 'exact'}"]
                base = 0.9 if many else 2.0
                _turning(
                    ax,
                    ds,
                    look.color if look else "#222222",
                    base * (1.6 if look is ON else 0.9) if i == 0 else 0.7 * base,
                )
            for gap in (0.0, 0.8):
                ax.axhline(gap, color="#777777", lw=0.6, ls=(0, (4, 3)), zorder=0)
            ax.set_xscale("log")
        row[0].set_ylabel("x at rest [mm]")
        row[0].set_title(f"({panel})  {frequency}: ode45, located (blue) and not (red)")
        row[1].set_title(f"({panel})  {frequency}: exact")
    for ax in grid[-1]:
        ax.set_xlabel("contact stiffness Kc [N/m]")
    return figure


def differences(data: Data) -> Figure:
    """The central question: how often ode45 ends in another response, and how large its own error
    is, over the stiffness.
    """
    figure, axes = plt.subplots(4, 1, figsize=(9.0, 9.6), sharex=True, layout="constrained")
    for ax, (panel, frequency) in zip(axes, PANELS.items(), strict=False):
        ds = data[f"fig7/{panel}, compared"]
        for number, look in ((1, ON), (2, OFF)):
            _shares(ax, ds, number, look.color, look.label)
        _chaos(ax, ds)
        ax.set(ylim=(-0.03, 1.03), ylabel="other than exact")
        ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:.0f} %"))
        ax.set_title(f"{frequency}")
    for panel, style in zip(PANELS, ("-", (0, (4, 2)), (0, (1, 1.2))), strict=True):
        ds = data[f"fig7/{panel}, compared"]
        for number, look in ((1, ON), (2, OFF)):
            at, median = running_median(
                ds["contact_stiffness"].values, ds["step_error_rms"].values[number]
            )
            axes[3].plot(
                at,
                median,
                color=look.color,
                ls=style,
                lw=1.2,
                label=f"{look.label}, {PANELS[panel]}",
            )
            tighter = data[f"fig7/{panel}, tighter"]
            at, median = running_median(
                tighter["contact_stiffness"].values, tighter["step_error_rms"].values[number - 1]
            )
            axes[3].plot(at, median, color=look.color, ls=style, lw=0.7)
    axes[3].set(
        yscale="log",
        xscale="log",
        xlabel="contact stiffness Kc [N/m]",
        ylabel="error after one period",
    )
    axes[3].set_title(
        "Error of one forcing period begun on the exact response, in units of the "
        "motion's range (median)"
    )
    axes[3].set_ylim(top=1.0)
    axes[3].legend(ncols=3, fontsize=7, loc="upper left")
    extra = [
        Line2D([], [], color="#555555", ls=(0, (1, 1.5)), label="of these: never settles"),
        Patch(label="exact: chaotic", **_HATCHED),
    ]
    axes[0].legend(
        handles=[*axes[0].get_legend_handles_labels()[0], *extra], loc="upper left", ncols=2
    )
    return figure


def _shares(ax: Axes, ds: xr.Dataset, number: int, color: str, label: str) -> None:
    of = classes(ds, number)[:, 0]
    at, share, low, high = running_share(ds["contact_stiffness"].values, of != 1)
    ax.fill_between(at, low, high, color=color, alpha=0.15, lw=0)
    ax.plot(at, share, color=color, lw=1.4, label=label)
    lost = running_share(ds["contact_stiffness"].values, of == UNSETTLED)
    ax.plot(lost[0], lost[1], color=color, lw=1.0, ls=(0, (1, 1.5)))


def _chaos(ax: Axes, ds: xr.Dataset) -> None:
    at, share, _, _ = running_share(
        ds["contact_stiffness"].values, ds["type"].values[0, :, 0] == "chaotic"
    )
    ax.fill_between(at, 0, share, zorder=0, **_HATCHED)
