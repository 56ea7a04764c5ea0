"""Curves of bifurcations over two parameters, alone or on the map of the motions that starts settle
to.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib import patheffects
from matplotlib.axes import Axes

from saltus.errors import shown
from saltus.plot import axes as draw
from saltus.plot import cells
from saltus.plot import response_points as points
from saltus.plot.picture import PictureError, caller, check, picture
from saltus.plot.response_points import MARKS
from saltus.plot.style import CYCLE, QUIET, Scale, display_scale
from saltus.plot.type_map import type_map
from saltus.results.dataset.schema import CURVE, RESPONSES, parameters_of, period_text, point_name

#: Name and marker of the points of codimension two.
_POINTS = {
    "cusp": ("cusp", "^"), "isola_birth": ("isola is born", "o"),
    "branches_join": ("branches join", "X"), "extremum": ("extremum", "P"),
    "resonance_1_1": ("1:1 resonance", "s"), "resonance_1_2": ("1:2 resonance", "s"),
    "resonance_1_3": ("1:3 resonance", "p"), "resonance_1_4": ("1:4 resonance", "h"),
    "fold_flip": ("fold and doubling", "D"), "degenerate_doubling": ("degenerate doubling", "d"),
    "fold_neimark_sacker": ("fold and torus", "<"),
    "flip_neimark_sacker": ("doubling and torus", ">"),
    "fold_graze": ("fold and graze", "v"), "flip_graze": ("doubling and graze", "^"),
    "resonant_graze": ("resonant graze", "*"), "double_graze": ("two grazes", "H"),
}  # fmt: skip


@picture(checks=False)
def bifurcation_curves(
    curves: Any, *, over: xr.Dataset | None = None, legend: bool = True, ax: Axes | None = None
) -> Axes:
    """Curves of bifurcations over two parameters, with their points of codimension two.

    Parameters
    ----------
    curves : Dataset, or sequence or mapping of Datasets
        Result of :func:`saltus.bifurcation_curve`, all over the same two parameters; in a
        mapping by the names that the legend shows.
    over : Dataset, optional
        Result of ``sl.bifurcation_diagram`` over the same two parameters: its map of types is
        drawn below the curves.
    legend : bool
        Whether to draw the legend of the curves.
    ax : Axes, optional
        Axes to draw into; a new figure by default.

    Returns
    -------
    Axes

    Raises
    ------
    ParameterError
        If these are no curves, or the parameters of the curves and the map differ.
    """
    given = named(curves)
    pair = _pair(given)
    if over is not None:
        check(over, ("type", "period", "response_of"), kinds=[RESPONSES], argument="over")
        below = parameters_of(over)
        check_pair(given, below, "over=")
        pair = (below[0], below[1])
    with draw.panels(ax, 1, (5.4, 3.9)) as (panel,):
        if over is not None:
            type_map(over, legend=False, ax=panel)
            draw_over(
                panel, given, (cells.parameter(over, pair[0]), cells.parameter(over, pair[1]))
            )
        else:
            scales = [_scale(name, given) for name in pair]
            panel.set_xlabel(scales[0].label(pair[0].replace("_", " ")))
            panel.set_ylabel(scales[1].label(pair[1].replace("_", " ")))
            panel.set_xlim(*_limits(pair[0], given, scales[0]))
            panel.set_ylim(*_limits(pair[1], given, scales[1]))
            _draw_all(panel, given, pair, scales)
        if legend:
            points.legend(panel, {})
    return panel


#: Curves by their names in the legend.
Named = list[tuple[str, xr.Dataset]]


def named(curves: Any, argument: str = "") -> Named:
    """Curves by their names in the legend.

    Raises
    ------
    ParameterError
        If these are no curves, or they are over different parameters. ``argument`` is what they
        were given as.
    """
    if isinstance(curves, Mapping) and not isinstance(curves, xr.Dataset):
        found = [(str(name), ds) for name, ds in curves.items()]
    else:
        given = curves if isinstance(curves, Sequence) else [curves]
        found = [("", ds) for ds in given]
    if not found:
        raise PictureError(f"{caller()} has no curves to draw: {shown(curves)}.")
    for _, ds in found:
        check(ds, kinds=[CURVE], argument=argument)
    pairs = {frozenset((ds.attrs["parameter_x"], ds.attrs["parameter_y"])) for _, ds in found}
    if len(pairs) > 1:
        texts = sorted(" and ".join(sorted(pair)) for pair in pairs)
        raise PictureError(
            f"{caller()}: the curves are over different parameters: {'; '.join(texts)}. Draw them "
            "apart."
        )
    return [(name or _name(ds), ds) for name, ds in found]


def check_pair(given: Named, below: Sequence[str], argument: str) -> None:
    """Raise a PictureError unless curves are over the two parameters of the map below them."""
    pair = _pair(given)
    if len(below) != 2 or set(below) != set(pair):
        raise PictureError(
            f"{caller()}: the curves are over {' and '.join(pair)}, the map in {argument} is over "
            f"{' and '.join(below)}."
        )


def draw_over(ax: Axes, given: Named, sides: cells.Sides) -> None:
    """Draw curves on a map with these axes."""
    _draw_all(ax, given, (sides[0].name, sides[1].name), [side.scale for side in sides])


def _draw_all(ax: Axes, given: Named, pair: tuple[str, str], scales: list[Scale]) -> None:
    """Draw each curve, those of one name in one colour."""
    names = list(dict.fromkeys(name for name, _ in given))
    for name, ds in given:
        _draw(ax, name, ds, pair, scales, CYCLE[names.index(name) % len(CYCLE)])


def _pair(given: Named) -> tuple[str, str]:
    """The parameters on the axes of the first curve."""
    first = given[0][1]
    return first.attrs["parameter_x"], first.attrs["parameter_y"]


def _name(ds: xr.Dataset) -> str:
    what = MARKS[ds.attrs["bifurcation"]][0]
    guard = ds.attrs["guard"]
    return f"{what} of {period_text(ds.attrs['periods'])}" + (f" at {guard}" if guard else "")


def _scale(name: str, given: Named) -> Scale:
    """Unit in which a parameter is shown."""
    unit = given[0][1][point_name(name)].attrs.get("units", "")
    return display_scale(unit, max(abs(end) for end in _limits(name, given, Scale(1.0, unit))))


def _limits(name: str, given: Named, scale: Scale) -> tuple[float, float]:
    """The widest range of a parameter."""
    ends = []
    for _, ds in given:
        axis = "x" if ds.attrs["parameter_x"] == name else "y"
        ends.append([ds.attrs[f"{axis}_low"], ds.attrs[f"{axis}_high"]])
    spans = np.array(ends) * scale.factor
    return float(spans[:, 0].min()), float(spans[:, 1].max())


def _draw(
    ax: Axes, name: str, ds: xr.Dataset, pair: tuple[str, str], scales: list[Scale], color: Any
) -> None:
    """Draw a curve and its points."""
    x, y = (ds[point_name(one)].values * s.factor for one, s in zip(pair, scales, strict=True))
    edge = [patheffects.withStroke(linewidth=2.6, foreground="white")]
    ax.plot(
        x, y, color=color, lw=1.3, zorder=4, label=name, path_effects=edge,
        gid=f"curve {ds.attrs['bifurcation']}",
    )  # fmt: skip
    at = [ds[f"codim2_{one}"].values * s.factor for one, s in zip(pair, scales, strict=True)]
    kinds = ds["codim2_kind"].values
    for kind, (text, marker) in _POINTS.items():
        here = kinds == kind
        if here.any():
            ax.plot(
                at[0][here], at[1][here], ls="none", marker=marker, ms=5, mfc="white", mec=QUIET,
                mew=0.9, zorder=6, label=text, gid=f"codim2 {kind}",
            )  # fmt: skip
