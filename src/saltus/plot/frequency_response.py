"""Frequency response: how large the steady responses are, branch by branch."""

from __future__ import annotations

import os
from dataclasses import replace
from typing import Any, Literal, get_args

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from saltus.errors import ParameterError, UnitError, among, nearest, shown
from saltus.plot import axes as draw
from saltus.plot import motion_colors
from saltus.plot import response_points as points
from saltus.plot.branches import draw_branches, draw_marks, within_view
from saltus.plot.picture import picture
from saltus.plot.style import OKABE_ITO, Scale
from saltus.results.dataset.schema import states_of
from saltus.results.files.measured import read_measured
from saltus.units import to_si

Quantity = Literal[
    "rms", "peak", "maximum", "minimum", "peak_to_peak", "mean", "rms_about_mean", "amplitude",
    "phase", "transmissibility"
]  # fmt: skip
_LABELS = {
    "rms": "rms of {}", "peak": "peak |{}|", "maximum": "largest {}",
    "minimum": "smallest {}", "peak_to_peak": "peak to peak of {}",
    "mean": "mean of {}", "rms_about_mean": "rms of {} about its mean",
    "amplitude": "first harmonic of {}", "phase": "phase of {} [deg]",
    "transmissibility": "{}",
}  # fmt: skip
#: Quantities that begin at zero.
_SIZES = ("rms", "peak", "peak_to_peak", "rms_about_mean", "amplitude", "transmissibility")
Measured = str | os.PathLike[str] | xr.Dataset | None


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
    ax: Any = None,
) -> Axes:
    """Size of every steady response against the frequency (or any other parameter): a colour for
    each period, branches as lines.

    Parameters
    ----------
    ds : Dataset, or mapping of str to Dataset
        What ``sl.frequency_response`` returned; a part of it, such as ``ds.sel(frequency=slice(14,
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
        Where to draw; a new figure by default.

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
    if not among(quantity, get_args(Quantity)):
        raise ParameterError(f"quantity={shown(quantity)}. Known: {', '.join(get_args(Quantity))}.")
    if log and quantity not in _SIZES:
        raise ParameterError(
            f"log=True with quantity={quantity!r}, which has a sign. Choose one of "
            f"{', '.join(_SIZES)}."
        )
    datasets = [_chosen(one, quantity, output) for one in points.shown(ds)]
    variable = "drawn"
    marks = None if measured is None else _measured(measured, datasets[0], variable)
    with draw.panels(ax, 1, (6.3, 3.4)) as (panel,):
        across, up = (
            points.parameter_axis(panel, datasets),
            points.state_scale([one.ds[variable] for one in datasets]),
        )
        named: dict[str, Any] = {}
        for one in datasets:
            named |= (_compare if one.name else _kinds)(
                panel, one, one.ds[variable].values * up.factor, across
            )
            if not one.name and "point_branch" in one.ds:
                named |= _continued(panel, one, quantity, output, across, up, events)
        if marks is not None:
            _draw_measured(
                panel,
                marks[datasets[0].axis].values * across.factor,
                marks["amplitude"].values * up.factor,
            )
        points.say_if_empty(panel, datasets)
        if log:
            panel.set_yscale("log")
        elif quantity in _SIZES:
            panel.set_ylim(bottom=0)
        if quantity == "phase":
            panel.yaxis.set_major_locator(MaxNLocator(nbins=6, steps=[1, 1.5, 3, 4.5, 9, 10]))
        named_output = datasets[0].ds[variable].attrs["long_name"]
        panel.set_ylabel(
            _LABELS[quantity].format(named_output)
            if quantity == "phase"
            else up.label(_LABELS[quantity].format(named_output))
        )
        if events:
            points.draw_events(
                panel,
                [one for one in datasets if one.name or not one.ds.attrs.get("unstable")],
                across,
            )
        if legend:
            points.legend(panel, named)
    return panel


def _chosen(one: points.Shown, quantity: str, output: str | None) -> points.Shown:
    """The responses with what is drawn of them as the variable ``drawn``."""
    ds = one.ds
    first = states_of(ds)[0]
    if quantity == "transmissibility":
        if quantity not in ds:
            raise ParameterError(
                f"there is no transmissibility yet. Add it: ds = "
                f'sl.transmissibility(ds, "{first}", "base").'
            )
        return replace(one, ds=ds.assign(drawn=ds[quantity]))
    if f"response_{quantity}" in ds and output in (None, first):
        return replace(
            one, ds=ds.assign(drawn=ds[f"response_{quantity}"].assign_attrs(long_name=first))
        )
    known = ds["output"].values.tolist() if "output" in ds else []
    name = first if output is None else output
    if name not in known:
        raise ParameterError(f"the Dataset has no output {shown(name)}. {nearest(name, known)}")
    chosen = ds.sel(output=name)
    unit = "1" if quantity == "phase" else chosen["output_units"].item()
    values = (
        np.rad2deg(chosen["output_phase"].values)
        if quantity == "phase"
        else chosen[f"output_{quantity}"].values
    )
    return replace(
        one, ds=ds.assign(drawn=("response", values, {"units": unit, "long_name": name}))
    )


def _size(count: int) -> float:
    """Markers small enough not to hide the branches that they lie on."""
    return 3.0 if count <= 300 else 2.2 if count <= 3000 else 1.5


def _kinds(ax: Axes, one: points.Shown, y: np.ndarray, across: Scale) -> dict[str, Any]:
    """A colour for each kind of motion: lines along branches, dots at every response."""
    of = motion_colors.of(one.ds)
    # chaos lies under the others
    for code in sorted(
        np.unique(of).tolist(), key=lambda code: (code != motion_colors.CHAOTIC, code)
    ):
        color, mine = motion_colors.color(code), of == code
        if motion_colors.repeats(code) and "point_branch" not in one.ds:
            line = points.branch_lines(one, y, mine)
            ax.plot(
                line[0] * across.factor,
                line[1],
                color=color,
                lw=0.8,
                zorder=2,
                gid=f"branches {code}",
            )
        # of its marker half is seen
        size = _size(mine.sum()) * (1.2 if code == motion_colors.CHAOTIC else 1.0)
        marks = {"marker": motion_colors.marker(code), "mfc": color, "mec": "none"}
        draw.draw_points(
            ax,
            one.values[mine] * across.factor,
            y[mine],
            ms=size,
            zorder=3,
            gid=f"kind {code}",
            **marks,
        )
    return points.kind_handles(one, of, markers=True)


def _continued(
    ax: Axes,
    one: points.Shown,
    quantity: str,
    output: str | None,
    across: Scale,
    up: Scale,
    events: bool,
) -> dict[str, Any]:
    """The branches that the responses lie on: stable solid, unstable dashed."""
    if quantity == "transmissibility":
        raise ParameterError("a transmissibility isn't known on branches: draw it without them.")
    name = states_of(one.ds)[0] if output is None else output
    values = one.ds[f"point_output_{quantity}"].sel(output=name).values
    values = np.rad2deg(values) if quantity == "phase" else values
    values = within_view(one.ds, values, one.ds["drawn"].values)
    named = draw_branches(ax, one.ds, values, across, up)
    if events and one.ds.attrs.get("unstable"):
        draw_marks(ax, one.ds, values, across, up)
    return named


def _compare(ax: Axes, one: points.Shown, y: np.ndarray, across: Scale) -> dict[str, Any]:
    """One colour and marker for a Dataset among several; the first is drawn largest, so that none
    hides another.
    """
    color, marker = points.dataset_color(one), points.MARKERS[one.rank]
    size = _size(y.size) * (1.9 if one.rank == 0 else 1.0)
    draw.draw_points(
        ax, one.values * across.factor, y, marker=marker, ms=size,
        mfc="none" if one.rank == 0 else color, mec=color,
        mew=0.6 if one.rank == 0 else 0.0, zorder=3, gid=f"dataset {one.name}",
    )  # fmt: skip
    return {one.name: points.dot(color, marker, hollow=one.rank == 0)}


# -- measured points -------------------------------------------------------------------------------
def _measured(measured: Measured, one: points.Shown, variable: str) -> xr.Dataset:
    """Measured points in SI."""
    units = {
        one.axis: one.ds[one.axis].attrs.get("units", ""),
        "amplitude": one.ds[variable].attrs.get("units", ""),
    }
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
    """Open circles above all that was computed."""
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
