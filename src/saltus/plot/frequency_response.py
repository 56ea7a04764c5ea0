"""Frequency response: size of the steady responses, branch by branch."""

from __future__ import annotations

import os
from typing import Literal, get_args

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from saltus.errors import ParameterError, UnitError
from saltus.plot import axes as draw
from saltus.plot import curves
from saltus.plot import response_points as points
from saltus.plot.picture import picture
from saltus.plot.style import OKABE_ITO
from saltus.results.dataset.schema import states_of
from saltus.results.files.measured import read_measured
from saltus.units import to_si

Quantity = Literal[curves.Size, "transmissibility"]
Measured = str | os.PathLike[str] | xr.Dataset | None
_DOTS = curves.Dots(((300, 3.0), (3000, 2.2), (np.inf, 1.5)), 1.2, 1.9, marked=True)


@picture(checks=False)
def frequency_response(
    ds: points.Source,
    *,
    quantity: Quantity = "rms",
    output: str | None = None,
    measured: Measured = None,
    log: bool = False,
    events: bool = True,
    legend: bool = True,
    ax: Axes | None = None,
) -> Axes:
    """Size of every steady response against the frequency (or any other parameter): a colour for
    each period, branches as lines.

    Parameters
    ----------
    ds : Dataset, or mapping of str to Dataset
        Result of ``sl.frequency_response``; a part of it, such as ``ds.sel(frequency=slice(14,
        17))``, is drawn alone. Several by name are drawn over each other, a colour and a marker for
        each: ``{"exact": a, "ode45": b}``.
    quantity : str
        ``"rms"`` (about zero), ``"peak"`` (largest magnitude), ``"maximum"``, ``"minimum"``,
        ``"peak_to_peak"``, ``"mean"``, ``"rms_about_mean"``; ``"amplitude"`` or ``"phase"`` of the
        first harmonic A cos(2 pi f t + phase); or ``"transmissibility"``, once
        :func:`saltus.transmissibility` has added it. For amplitude and phase under each other give
        two Axes one after the other.
    output : str, optional
        A state, or an output that was asked for; default the first state.
    measured : path or Dataset, optional
        Measured points to draw with it: a CSV with the columns ``frequency [Hz]`` and ``amplitude
        [mm]``, any units, or a Dataset with these two variables and their attribute ``units``.
    log : bool
        Whether the sizes stand on a logarithmic axis, on which small responses can be read beside
        large ones.
    events : bool
        Whether to mark grazes, folds, period doublings and so on above the picture.
    legend : bool
        Whether to draw the legend.
    ax : Axes, optional
        Axes to draw into; a new figure by default.

    Returns
    -------
    Axes

    Raises
    ------
    ParameterError
        If ``ds`` holds no responses over one parameter, or an argument doesn't fit it.
    ResultFileError
        If the measured points can't be read.
    """
    curves.check_quantity(quantity, get_args(Quantity))
    if log and quantity not in curves.SIZES:
        sizes = [name for name in get_args(Quantity) if name in curves.SIZES]
        raise ParameterError(
            f"log=True with quantity={quantity!r}, which has a sign. Choose one of "
            f"{', '.join(sizes)}."
        )
    datasets = points.shown(ds)
    heights = [_height(one.ds, quantity, output) for one in datasets]
    drawn = [
        curves.Curves(one, of.values, _along(one, of.values, quantity, output))
        for one, of in zip(datasets, heights, strict=True)
    ]
    _, unit, name = heights[0]
    marks = None if measured is None else _measured(measured, datasets[0], unit)
    up = curves.height_scale(unit, drawn, quantity)
    with curves.frame(ax, 3.4, drawn, up, _DOTS, events=events, legend=legend) as (panel, across):
        if marks is not None:
            _draw_measured(
                panel,
                marks[datasets[0].axis].values * across.factor,
                marks["amplitude"].values * up.factor,
            )
        curves.height_axis(panel, quantity, name, up, log)
    return panel


def _height(ds: xr.Dataset, quantity: str, output: str | None) -> curves.Height:
    """Heights of the responses."""
    if quantity != "transmissibility":
        return curves.height(ds, quantity, output)
    if quantity not in ds:
        raise ParameterError(
            f"there is no transmissibility yet. Add it: ds = "
            f'sl.transmissibility(ds, "{states_of(ds)[0]}", "base").'
        )
    of = ds[quantity]
    return curves.Height(of.values, of.attrs.get("units", ""), of.attrs["long_name"])


def _along(
    one: points.Shown, dots: np.ndarray, quantity: str, output: str | None
) -> list[np.ndarray]:
    """Heights of the branches that the responses lie on. Transmissibility has none: it is known of
    responses only.
    """
    if one.name or "point_branch" not in one.ds or quantity == "transmissibility":
        return []
    values = curves.height(one.ds, quantity, output, "point_").values
    return [curves.within_view(one.ds, values, dots)]


# -- measured points -------------------------------------------------------------------------------
def _measured(measured: Measured, one: points.Shown, unit: str) -> xr.Dataset:
    """Measured points in SI."""
    units = {one.axis: one.unit, "amplitude": unit}
    if not isinstance(measured, xr.Dataset):
        return read_measured(measured, one.axis, *units.values())  # type: ignore[arg-type]
    lacking = [name for name in units if name not in measured.variables]
    if lacking:
        raise ParameterError(
            f"measured has no {lacking[0]!r}. It needs {' and '.join(units)}, "
            f"each with the attribute units."
        )
    return xr.Dataset(
        {name: ("point", _in_si(measured[name], unit)) for name, unit in units.items()}
    )


def _draw_measured(ax: Axes, x: np.ndarray, y: np.ndarray) -> None:
    """Draw measured points as open circles above all computed curves."""
    marks = {"ms": 4.5, "mfc": "none", "mec": OKABE_ITO["black"], "mew": 0.9}
    draw.draw_points(ax, x, y, marker="o", zorder=4, label="measured", gid="measured", **marks)


def _in_si(values: xr.DataArray, unit: str) -> np.ndarray:
    given = values.attrs.get("units", "")
    if not given and unit not in ("", "1"):
        raise ParameterError(
            f"measured {values.name} has no attribute units. Write it, such as units='{unit}'."
        )
    try:
        return np.array(
            [
                to_si(f"{float(value)!r} {given}", unit, str(values.name))
                for value in np.ravel(values.values)
            ]
        )
    except UnitError as error:
        raise ParameterError(f"{error}") from None
