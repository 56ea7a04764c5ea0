"""The table of what ``backbone`` returns."""

from __future__ import annotations

from saltus.results.dataset.variable import Variable

_POINT = ("point",)
_OUTPUT = ("point", "output")

#: Variables of what ``backbone`` returns. ``<first>``: the unit of the first state; ``<output>``:
#: that in ``output_units``.
BACKBONE_VARIABLES = {
    "point": Variable(_POINT, "1", "point of the backbone", "i8", coord=True),
    "backbone_frequency": Variable(_POINT, "Hz", "frequency of the vibration"),
    "point_period": Variable(_POINT, "s", "period of the orbit"),
    "point_stable": Variable(_POINT, "1", "whether the vibration is stable", "i1"),
    "point_itinerary": Variable(
        _POINT, "", "guards met, with + where the gap becomes positive, in the order of time", "str"
    ),
    "point_multiplier_real": Variable(
        ("point", "multiplier"), "1", "Floquet multiplier, real part"
    ),
    "point_multiplier_imag": Variable(
        ("point", "multiplier"), "1", "Floquet multiplier, imaginary part"
    ),
    "fictitious_damping": Variable(_POINT, "1/s", "damping that closes the orbit: rounding"),
    "point_<parameter>": Variable(_POINT, "<parameter>", "<parameter> in quadrature"),
    "point_<state>": Variable(_POINT, "<state>", "<state> <when>"),
    "output": Variable(("output",), "", "output: a state", "str", coord=True),
    "output_units": Variable(("output",), "", "unit of the output", "str", coord=True),
    "point_output_maximum": Variable(_OUTPUT, "<output>", "largest value"),
    "point_output_minimum": Variable(_OUTPUT, "<output>", "smallest value"),
    "point_output_peak": Variable(_OUTPUT, "<output>", "largest magnitude"),
    "point_output_rms": Variable(_OUTPUT, "<output>", "root mean square about zero"),
}
