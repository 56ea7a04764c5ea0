"""Result of ``sensitivity``: motions or periodic orbits, and their derivatives with respect to
parameters.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from saltus.errors import counted
from saltus.results.dataset.schema import ResultKind
from saltus.results.dataset.variable import ENDINGS, OUTPUT, SHARED, Variable
from saltus.results.kinds.trajectory import told
from saltus.results.table import TextTable, left_out, number, table, words
from saltus.results.wording import failed

_SAMPLE = ("trajectory", "time", "output")
_EACH = ("trajectory", "output")

#: Variables of the result of ``sensitivity``. Trajectories whose forcing periods differ share
#: phases, not times. ``<slope>``: the unit in ``output_units``, or that of the time, over the unit
#: in ``to_units``.
VARIABLES = {
    "time": Variable(("trajectory?", "time"), "s", "time", coord=True),
    "to": Variable(
        ("to",),
        "",
        "what the derivatives are with respect to: a parameter or a start",
        "str",
        coord=True,
    ),
    "to_units": Variable(("to",), "", "unit of it", "str", coord=True),
    "to_value": Variable(("trajectory", "to"), "<to>", "its value"),
    "value": Variable(_SAMPLE, "<output>", "states and outputs"),
    "derivative": Variable((*_SAMPLE, "to"), "<slope>", "their derivatives, at fixed times"),
    "contact_time": Variable(("contact",), "s", "time of the contact"),
    "contact_time_derivative": Variable(
        ("contact", "to"), "<slope>", "derivative of the time of the contact"
    ),
    "contact_guard": Variable(("contact",), "", "guard that was met", "str"),
    "contact_kind": Variable(("contact",), "", "kind of contact", "str"),
    "contact_velocity": Variable(("contact",), "<gap rate>", "rate of the gap at the contact"),
    "contact_trajectory": Variable(
        ("contact",), "1", "trajectory that the contact belongs to", "i8"
    ),
    **{
        name: row
        for word, most in (("maximum", "largest"), ("minimum", "smallest"))
        for name, row in {
            word: Variable(_EACH, "<output>", f"{most} value"),
            f"{word}_time": Variable(_EACH, "s", f"time of the {most} value"),
            f"{word}_derivative": Variable(
                (*_EACH, "to"), "<slope>", f"derivative of the {most} value"
            ),
        }.items()
    },
    "end_derivative": Variable(
        (*_EACH, "to"), "<slope>", "derivatives at the end of the trajectory"
    ),
    "period": Variable(("trajectory",), "s", "period of the orbit"),
    "period_derivative": Variable(("trajectory", "to"), "<slope>", "derivative of the period"),
    **{
        name: row
        for part, word in (("real", "real"), ("imag", "imaginary"))
        for name, row in {
            f"multiplier_{part}": Variable(
                ("trajectory", "multiplier"), "1", f"Floquet multiplier, {word} part"
            ),
            f"multiplier_{part}_derivative": Variable(
                ("trajectory", "multiplier", "to"),
                "<slope>",
                f"derivative of the Floquet multiplier, {word} part",
            ),
        }.items()
    },
    **ENDINGS,
    **OUTPUT,
    **SHARED,
}


def account(ds: xr.Dataset) -> list[str]:
    """Extent, status, and what the largest values depend on most."""
    to = ", ".join(str(one) for one in ds["to"].values)
    lines = [
        f"extent   {counted(ds.sizes.get('trajectory', 1), 'trajectory')}, "
        f"{ds.sizes['time']} samples, derivatives with respect to {to}",
        f"status   {told(ds['status'].values)}",
    ]
    if "trajectory" not in ds.dims and "maximum" in ds:
        for name, most, slopes in zip(
            ds["output"].values, ds["maximum"].values, _relative(ds), strict=True
        ):
            parts = ", ".join(
                f"{100 * slope:+.3g} % for 1 % of {one}"
                for one, slope in zip(ds["to"].values, slopes, strict=True)
                if np.isfinite(slope)
            )
            if parts:
                lines.append(f"largest  {name} = {most:.6g}: {parts}")
    return lines


def _relative(ds: xr.Dataset) -> np.ndarray:
    """Relative change of each largest value for that of each parameter, float64[output, to]."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(
            0.01
            * ds["maximum_derivative"].values
            * ds["to_value"].values
            / ds["maximum"].values[..., None]
        )


def rows(title: str, ds: xr.Dataset) -> list[TextTable]:
    """A row for each output and parameter, of the first trajectory."""
    one = ds.isel(trajectory=0) if "trajectory" in ds.dims else ds
    outputs, to = ds["output"].values, ds["to"].values
    pairs = [(i, j) for i in range(len(outputs)) for j in range(len(to))]
    first, second = np.array([i for i, _ in pairs]), np.array([j for _, j in pairs])
    columns = [words("output", outputs[first]), words("with respect to", to[second])]
    for name in ("maximum", "minimum"):
        if name in one:
            columns.append(number(f"{name} [SI]", one[name].values[first], ".8g"))
            columns.append(
                number("derivative [SI]", one[f"{name}_derivative"].values[first, second], ".8g")
            )
    columns.append(
        number("derivative at the end [SI]", one["end_derivative"].values[first, second], ".8g")
    )
    notes = left_out(len(pairs), "pairs")
    if "trajectory" in ds.dims:
        notes.append("The first of the trajectories; the file holds all.")
    return [table(title, columns, [*notes, *failed(ds)])]


KIND = ResultKind("sl.sensitivity", VARIABLES, ("derivative", "to", "status"), account, rows)
