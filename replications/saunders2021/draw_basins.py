"""Figs. 6, 8, 11 and 13: basins by ode45 with and without event location, and exact, in common
colours.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from saltus.analysis.basins.compare import compare
from saltus.plot import cells
from saltus.plot.palette import hues
from saltus.plot.unsettled import UNSETTLED
from saltus.replication.claims import Data
from saltus.results.dataset.schema import kind_text

from .looks import EXACT, OFF, ON, Look

#: Columns: the paper's two ways, then the exact one.
COLUMNS = (ON, OFF, EXACT)


@dataclass(frozen=True)
class _Entry:
    """An attractor that one of the three maps has: in words, with its share in each, NaN where it
    isn't there.
    """

    text: str
    shares: tuple[float, float, float]


@dataclass(frozen=True)
class _Row:
    """Three maps of one setting in one numbering: cells of each, what the numbers are, agreement
    with the exact map.
    """

    cells: dict[str, np.ndarray]
    entries: list[_Entry]
    agreement: dict[str, float]


def grid(data: Data, figure: str, settings: Sequence[str]) -> Figure:
    """A row for each setting, a column for each way of integrating."""
    drawn, panels = plt.subplots(
        len(settings),
        3,
        figsize=(9.0, 2.75 * len(settings) + 0.2),
        sharex=True,
        sharey=True,
        squeeze=False,
        layout="constrained",
    )
    for row, setting in zip(panels, settings, strict=True):
        found = {look.label: data[f"{figure}/{setting}, {look.end}"] for look in COLUMNS}
        one = _common(found)
        for ax, look in zip(row, COLUMNS, strict=True):
            _panel(ax, found[look.label], one, look)
        row[0].set_ylabel(f"{setting.replace(' per ', '/')}\n{row[0].get_ylabel()}")
        _legend(row[2], one, found[EXACT.label])
    for ax in panels[:-1].flat:
        ax.set_xlabel("")
    for ax in panels[:, 1:].flat:
        ax.set_ylabel("")
    return drawn


def _common(found: dict[str, xr.Dataset]) -> _Row:
    """The three maps in the numbers of the exact one; attractors that only ode45 has follow."""
    exact = found[EXACT.label]
    count = exact.sizes["attractor"]
    entries = [
        [_words(exact.isel(attractor=i)), [np.nan, np.nan, float(exact["attractor_fraction"][i])]]
        for i in range(count)
    ]
    cells, agreement = {EXACT.label: exact["basin"].values.astype(int)}, {}
    for column, look in enumerate((ON, OFF)):
        both = compare(exact, found[look.label])
        values = both["basin_b"].values.astype(int)
        number = np.arange(both.sizes["pair"])
        for pair in range(count, both.sizes["pair"]):
            number[pair] = len(entries)
            entries.append(
                [
                    f"{kind_text(str(both['match_type'].values[pair]), int(both['match_period'][pair]))}, "
                    f"not exact",
                    [np.nan] * 3,
                ]
            )
        for pair in range(both.sizes["pair"]):
            if int(both["match_b"][pair]) >= 0:
                entries[number[pair]][1][column] = float(both["match_fraction_b"][pair])
        cells[look.label] = np.where(values >= 0, number[np.maximum(values, 0)], values)
        agreement[look.label] = float(both.attrs["agreement"])
    return _Row(cells, [_Entry(str(text), tuple(shares)) for text, shares in entries], agreement)  # type: ignore[arg-type]


def _words(one: xr.Dataset) -> str:
    return (
        f"{kind_text(str(one['attractor_type'].item()), int(one['attractor_period']))}, "
        f"{cells.peak_text(one)}"
    )


def _panel(ax: Axes, ds: xr.Dataset, row: _Row, look: Look) -> None:
    colors = dict(enumerate(hues(max(len(row.entries), 1))))
    sides = cells.plane(ds, "basin")
    cells.draw_cells(ax, sides, cells.paint(row.cells[look.label], colors))
    values = json.loads(ds.attrs["parameters"])
    for place in (-values["lower_gap"], values["upper_gap"]):
        ax.axvline(
            place * sides[0].scale.factor, color="#222222", lw=0.6, ls=(0, (4, 3)), alpha=0.6
        )
    share = row.agreement.get(look.label)
    ax.set_title(
        look.label if share is None else f"{look.label}: {cells.share_text(share)} as exact",
        fontsize=8,
    )


def _legend(ax: Axes, row: _Row, exact: xr.Dataset) -> None:
    """The attractors beside the row, with their shares: located, not located, exact."""
    colors = hues(max(len(row.entries), 1))
    handles: list[Any] = []
    for entry, color in zip(row.entries, colors, strict=False):
        shares = " | ".join("–" if np.isnan(one) else cells.share_text(one) for one in entry.shares)
        handles.append(Patch(fc=color, label=f"{entry.text}\n{shares}"))
    lost = [int((cells < 0).sum()) for cells in row.cells.values()]
    if any(lost):
        handles.append(Patch(fc=UNSETTLED[-2].color, label="not settled"))
    title = f"located | not located | exact\nof {exact['basin'].size} starts"
    legend = ax.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(1.02, 1.0),
        fontsize=6.8,
        title=title,
        title_fontsize=6.8,
        labelspacing=0.5,
        handlelength=1.0,
        handleheight=1.0,
        frameon=False,
    )
    legend.get_title().set_color("#555555")
