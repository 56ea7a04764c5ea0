"""Points of periodic orbits in the plane of two states, alone or on a map of basins."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from saltus.errors import ParameterError, nearest, shown
from saltus.plot import axes as draw
from saltus.plot import cells
from saltus.plot.basins import basins
from saltus.plot.picture import check, picture
from saltus.plot.style import CYCLE, display_scale
from saltus.results.dataset.schema import BASINS, kind_text, orbit_name, states_of

#: Orbits that are named in the legend.
_NAMED = 14


@picture()
def periodic_orbits(
    ds: xr.Dataset,
    x: str | None = None,
    y: str | None = None,
    ax: Axes | None = None,
    *,
    over: xr.Dataset | None = None,
    units: Mapping[str, str] | None = None,
    legend: bool = True,
) -> Axes:
    """Points of periodic orbits at whole periods: dots for the stable ones, crosses for those that
    repel.

    Parameters
    ----------
    ds : Dataset
        Result of ``periodic_orbits`` or ``edge_orbit``.
    x, y : str, optional
        States on the axes; by default those of ``over``, else the first two.
    ax : Axes, optional
        Axes to draw into; a new figure by default.
    over : Dataset, optional
        A map of basins to draw them over: the saddles lie on its boundaries.
    units : mapping of str to str, optional
        Display units, such as ``{"v": "mm/s"}``; by the size of the numbers by default, or as the
        map has them.
    legend : bool
        Whether to name the orbits.

    Returns
    -------
    Axes

    Raises
    ------
    ParameterError
        If ``ds`` or ``over`` is of another kind, or an argument doesn't fit.
    """
    pair = _pair(ds, x, y, over)
    with draw.panels(ax, 1, (4.6, 3.4) if over is None else (6.3, 3.9)) as (panel,):
        if over is None:
            scales = tuple(
                display_scale(
                    ds[orbit_name(name)].attrs.get("units", ""),
                    float(np.nanmax(np.abs(ds[orbit_name(name)].values), initial=0.0)),
                    (units or {}).get(name),
                )
                for name in pair
            )
            panel.set_xlabel(scales[0].label(pair[0]))
            panel.set_ylabel(scales[1].label(pair[1]))
        else:
            basins(over, ax=panel, legend=False, points=False)
            scales = tuple(side.scale for side in cells.plane(over, "basin"))
        for i in range(ds.sizes["orbit"]):
            _orbit(panel, ds.isel(orbit=i), pair, scales, i, over is not None)
        if legend and ds.sizes["orbit"]:
            panel.legend(loc="upper left", bbox_to_anchor=(1.02, 1), fontsize=7)
    return panel


def _pair(ds: xr.Dataset, x: str | None, y: str | None, over: xr.Dataset | None) -> tuple[str, str]:
    """The states on the axes."""
    known = states_of(ds)
    for name in (x, y):
        if name is not None and name not in known:
            raise ParameterError(
                f"these orbits have no state {shown(name)}. {nearest(name, known)}"
            )
    if over is not None:
        check(over, kinds=[BASINS], argument="over")
        first, second = (side.name for side in cells.plane(over, "basin"))
        pair = first, second
        if any(name not in known for name in pair) or (x or pair[0], y or pair[1]) != pair:
            raise ParameterError(
                f"over is a map of {pair[0]} and {pair[1]}. Leave x and y out, and give orbits of "
                f"the same system."
            )
        return pair
    if len(known) < 2:
        raise ParameterError(f"this picture needs two states; these orbits have {known[0]} only.")
    first = x or next(name for name in known if name != y)
    return first, y or next(name for name in known if name != first)


def _orbit(
    ax: Axes, orbit: xr.Dataset, pair: tuple[str, str], scales: Any, number: int, over: bool
) -> None:
    """Draw the points of an orbit."""
    at = [
        orbit[orbit_name(name)].values * scale.factor
        for name, scale in zip(pair, scales, strict=True)
    ]
    finite = np.isfinite(at[0]) & np.isfinite(at[1])
    stable = int(orbit["orbit_stable"]) == 1
    name = kind_text(str(orbit["orbit_type"].item()), int(orbit["orbit_period"]))
    color = "#222222" if over else CYCLE[number % len(CYCLE)]
    marks: dict[str, Any] = (
        {"marker": "o", "ms": 5, "mfc": color, "mec": "white", "mew": 0.8}
        if stable
        else {"marker": "x", "ms": 6, "mec": color, "mew": 1.6}
    )
    label = f"{name}, {orbit['orbit_stability'].item()}" if number < _NAMED else None
    draw.draw_points(ax, at[0][finite], at[1][finite], label=label, zorder=5, **marks)
