"""Result of ``bifurcation_curve``: a bifurcation over two parameters."""

from __future__ import annotations

import xarray as xr

from saltus.results.dataset.schema import ResultKind, period_text, point_name
from saltus.results.dataset.variable import SQRT_COEFFICIENT, Variable
from saltus.results.kinds import branches
from saltus.results.table import Column, TextTable, quantity, spread, table, words
from saltus.results.wording import plain, unit_of

_POINT = ("point",)
_CODIM2 = ("codim2",)

#: Variables of the result of ``bifurcation_curve``. ``<first>``: the unit of the first state;
#: ``<margin>``: that of the gaps that count; ``<root gap>``: of their square roots.
VARIABLES = {
    "point": Variable(_POINT, "1", "point of the curve", "i8", coord=True),
    "point_<parameter>": Variable(_POINT, "<parameter>", "<parameter>"),
    "point_arclength": Variable(
        _POINT, "1", "length of the curve from its first point, in ranges of its unknowns"
    ),
    "point_period": Variable(_POINT, "s", "period of the orbit"),
    **{
        f"point_{name}": branches.VARIABLES[f"point_{name}"]
        for name in ("peak", "rms", "itinerary", "margin", "multiplier_real", "multiplier_imag")
    },
    "point_sqrt_coefficient": Variable(_POINT, "<root gap>", SQRT_COEFFICIENT),
    "point_<state>": Variable(("point", "phase"), "<state>", "<state> <when>"),
    "codim2": Variable(_CODIM2, "1", "point of codimension two", "i8", coord=True),
    "codim2_kind": Variable(_CODIM2, "", "kind of point", "str"),
    "codim2_point": Variable(_CODIM2, "1", "point of the curve that comes before it", "i8"),
    "codim2_extremum": Variable(_CODIM2, "", "parameter that has an extremum there", "str"),
    "codim2_<parameter>": Variable(_CODIM2, "<parameter>", "<parameter>"),
    "codim2_multiplier_real": Variable(
        ("codim2", "multiplier"), "1", "Floquet multiplier, real part"
    ),
    "codim2_multiplier_imag": Variable(
        ("codim2", "multiplier"), "1", "Floquet multiplier, imaginary part"
    ),
    "codim2_<state>": Variable(("codim2", "phase"), "<state>", "<state> <when>"),
}


def account(ds: xr.Dataset) -> list[str]:
    """The extent of the curve, and a line on each point of codimension two."""
    spans = [
        f"{name} {one.values.min():.6g} to {one.values.max():.6g} {unit_of(one)}".rstrip()
        for name, one in ((name, ds[point_name(name)]) for name in _names(ds))
    ]
    what = f"{plain(ds.attrs['bifurcation'])} of {period_text(ds.attrs['periods'])}"
    lines = [f"found    {what} at {ds.sizes['point']} points, {', '.join(spans)}"]
    for i, kind in enumerate(ds["codim2_kind"].values):
        at = ", ".join(f"{name} {float(ds[f'codim2_{name}'][i]):.10g}" for name in _names(ds))
        lines.append(f"  {plain(kind)} at {at}")
    return lines


def rows(title: str, ds: xr.Dataset) -> list[TextTable]:
    """Points of the curve, some of them on the screen; points of codimension two."""
    count = ds.sizes["point"]
    points = [_along(ds, name, point_name(name)) for name in _names(ds)]
    points.append(words("contacts", ds["point_itinerary"].values))
    note = (
        f"{plain(ds.attrs['bifurcation'])}: {count} points; it ends with {ds.attrs['begin']} and "
        f"{ds.attrs['end']}."
    )
    tables = [table(title, points, (note,), spread(count))]
    if ds.sizes["codim2"]:
        special = [words("point", [plain(one) for one in ds["codim2_kind"].values])]
        special += [_along(ds, name, f"codim2_{name}") for name in _names(ds)]
        tables.append(table(f"{title}: codimension two", special))
    return tables


def _names(ds: xr.Dataset) -> tuple[str, str]:
    """The two parameters."""
    return ds.attrs["parameter_x"], ds.attrs["parameter_y"]


def _along(ds: xr.Dataset, parameter: str, variable: str) -> Column:
    """A column of a parameter."""
    return quantity(plain(parameter), ds[variable].values, unit_of(ds[variable]), branches.DIGITS)


KIND = ResultKind(
    "sl.bifurcation_curve", VARIABLES, ("point_arclength", "codim2_kind"), account, rows
)
