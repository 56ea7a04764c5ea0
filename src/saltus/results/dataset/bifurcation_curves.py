"""The table of what ``bifurcation_curve`` returns."""

from __future__ import annotations

from saltus.results.dataset.variable import Variable

_POINT = ("point",)
_CODIM2 = ("codim2",)
#: What a graze does to the motions behind it.
SQRT_COEFFICIENT = (
    "change of the grazed gap when the orbit returns, over the square root of the depth by which a "
    "motion would pass the boundary"
)

#: Variables of what ``bifurcation_curve`` returns. ``<first>``: the unit of the first state;
#: ``<gap>``: that of the gaps; ``<root gap>``: of their square roots.
CURVE_VARIABLES = {
    "point": Variable(_POINT, "1", "point of the curve", "i8", coord=True),
    "point_<parameter>": Variable(_POINT, "<parameter>", "<parameter>"),
    "point_arclength": Variable(
        _POINT, "1", "length of the curve from its first point, in ranges of its unknowns"
    ),
    "point_period": Variable(_POINT, "s", "period of the orbit"),
    "point_peak": Variable(_POINT, "<first>", "largest magnitude of the first state"),
    "point_rms": Variable(_POINT, "<first>", "root mean square of the first state"),
    "point_itinerary": Variable(
        _POINT, "", "guards met, with + where the gap becomes positive, in the order of time", "str"
    ),
    "point_margin": Variable(
        _POINT, "<gap>", "smallest distance by which the orbit misses or overshoots a boundary"
    ),
    "point_sqrt_coefficient": Variable(_POINT, "<root gap>", SQRT_COEFFICIENT),
    "point_multiplier_real": Variable(
        ("point", "multiplier"), "1", "Floquet multiplier, real part"
    ),
    "point_multiplier_imag": Variable(
        ("point", "multiplier"), "1", "Floquet multiplier, imaginary part"
    ),
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
