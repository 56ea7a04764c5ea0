"""Comparison of two maps of the same starts."""

from __future__ import annotations

import textwrap
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.patches import Patch
from matplotlib.transforms import ScaledTranslation

from saltus.errors import ParameterError
from saltus.plot import cells
from saltus.plot.axes import Panels
from saltus.plot.palette import hues
from saltus.plot.picture import picture
from saltus.plot.style import style
from saltus.plot.unsettled import AGREEMENT, UNSETTLED
from saltus.results.dataset.schema import kind_text

_WHERE = {(True, True): "in both", (True, False): "left only", (False, True): "right only"}
#: More attractors than this are not named in a legend of their own: the maps of plot.basins do
#: that.
_NAMED = 8
#: Characters of a title that fit above a map.
_TITLE = 34


_NEEDS = ("agreement", "basin_a", "basin_b", "match_a", "match_b", "match_type", "match_period")


@picture(needs=_NEEDS)
def agreement(ds: xr.Dataset, ax: Panels | None = None) -> Any:
    """Two maps of basins side by side, and where they differ; with one Axes only where they differ.

    Both maps have the same hues. Titles name the maps (attributes ``name_a`` and ``name_b``, where
    the Dataset has them) and the share of the starts that settle to the same attractor in both.

    Parameters
    ----------
    ds : Dataset
        Result of ``sl.compare``.
    ax : Axes or array of 3 Axes, optional
        Axes to draw into; a new figure of three panels by default.

    Returns
    -------
    array of Axes, shape (3,), or Axes
        The Axes for one that was given.

    Raises
    ------
    ParameterError
        If ``ds`` is not from ``sl.compare``, or ``ax`` holds neither one nor three Axes.
    """
    sides = cells.plane(ds, "agreement")
    if ax is None:
        with style():
            _, panels = plt.subplots(1, 3, figsize=(9.0, 3.3), sharex=True, sharey=True)
            return _three(panels, ds, sides)
    panels = np.ravel(np.asarray(ax, dtype=object))
    if panels.size not in (1, 3) or not all(isinstance(one, Axes) for one in panels):
        raise ParameterError(
            f"ax={type(ax).__name__}. Give one Axes, or three, such as plt.subplots(1, 3) makes."
        )
    if panels.size == 1:
        _difference(panels[0], ds, sides)
        return panels[0]
    return _three(panels, ds, sides)


def _three(panels: np.ndarray, ds: xr.Dataset, sides: cells.Sides) -> np.ndarray:
    """Both maps and their difference."""
    ids, codes = _occurring(ds)
    colors = dict(zip(ids, hues(max(ids, default=-1) + 1)[ids], strict=True))
    methods = {which: cells.method_text(ds, f"_{which}") for which in "ab"}
    other = "exact" if any(methods.values()) else ""
    for panel, which in zip(panels, "ab", strict=False):
        cells.draw_cells(panel, sides, cells.paint(ds[f"basin_{which}"].values, colors))
        name = str(ds.attrs.get(f"name_{which}", methods[which] or other or f"map {which}"))
        panel.set_title(textwrap.fill(name, _TITLE))
    _difference(panels[2], ds, sides)
    for panel in panels[1:]:
        panel.set_ylabel("")
    handles = (
        [Patch(fc=colors[key], label=_name(ds, key)) for key in ids] if len(ids) <= _NAMED else []
    )
    handles += [Patch(fc=UNSETTLED[code].color, label=UNSETTLED[code].label) for code in codes]
    if handles:
        _below(panels[0], handles, columns=2)
    return panels


def _difference(ax: Axes, ds: xr.Dataset, sides: cells.Sides) -> None:
    """Draw the cells in which the maps differ. The title gives the share that agrees."""
    values = ds["agreement"].values
    colors = {key: np.array(to_rgb(look.color)) for key, look in AGREEMENT.items()}
    cells.draw_cells(ax, sides, cells.paint(np.nan_to_num(values, nan=-1), colors))
    settled = int((values >= 0).sum())
    ax.set_title(
        f"{cells.share_text((values == 1).sum() / settled)} agree"
        if settled
        else "nothing settles in both"
    )
    handles = [
        Patch(fc=look.color, label=f"{look.label}, {int((values == key).sum())}")
        for key, look in AGREEMENT.items()
        if (values == key).any()
    ]
    _below(ax, handles, columns=1)


def _below(ax: Axes, handles: list[Any], columns: int) -> None:
    """Draw a legend below the name of the axis."""
    below = ax.transAxes + ScaledTranslation(0, -0.4, ax.figure.dpi_scale_trans)
    ax.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(0, 0),
        bbox_transform=below,
        ncols=columns,
        frameon=False,
        handlelength=1.0,
        handleheight=0.9,
        fontsize=7.5,
        labelspacing=0.35,
    )


def _occurring(ds: xr.Dataset) -> tuple[list[int], list[int]]:
    """Ids of the attractors and codes of the rest that occur in one of the cells."""
    both = np.concatenate(
        [np.unique(np.nan_to_num(ds[name].values, nan=-4)) for name in ("basin_a", "basin_b")]
    )
    found = np.unique(both).astype(np.int64).tolist()
    return [key for key in found if key >= 0], [code for code in UNSETTLED if code in found]


def _name(ds: xr.Dataset, key: int) -> str:
    """A pair of attractors in words: ``3T, in both``."""
    pair = ds.sel(pair=key)
    known = int(pair["match_a"]) >= 0, int(pair["match_b"]) >= 0
    return (
        f"{kind_text(str(pair['match_type'].item()), int(pair['match_period']))}, {_WHERE[known]}"
    )
