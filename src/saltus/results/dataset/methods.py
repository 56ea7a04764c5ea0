"""The tables of what ``compare_methods`` and ``regularisation_widths`` return."""

from __future__ import annotations

from dataclasses import replace

from saltus.results.dataset.attractors import AGREEING
from saltus.results.dataset.responses import RESPONSES_VARIABLES
from saltus.results.dataset.variable import Variable

#: What belongs to a method and a place of the grid, and may belong to a start there.
_FIELD = ("method", "...", "start?")

#: Variables of what ``compare_methods`` returns, beside the coordinates of the analysis.
METHODS_VARIABLES = {
    "method": Variable(("method",), "", "method, the reference first", "str", coord=True),
    "method_cpu_seconds": Variable(
        ("method",), "s", "processor time, all threads, without compiling"
    ),
    "method_agreement": Variable(
        ("method",), "1", "share of the settled starts with the reference's answer"
    ),
    "method_agreement_low": Variable(("method",), "1", "the same, lower end of the 95 % interval"),
    "method_agreement_high": Variable(("method",), "1", "the same, upper end of the 95 % interval"),
    **{name: RESPONSES_VARIABLES[name] for name in ("start", "start_direction")},
    **{
        name: replace(RESPONSES_VARIABLES[name], dims=_FIELD)
        for name in ("rms", "peak", "type", "period")
    },
    "basin": Variable(_FIELD, "1", "attractor, in the numbers of the reference", "i2"),
    "agrees": Variable(
        _FIELD, "1", "whether the start has the reference's answer", "i1", flags=AGREEING
    ),
    "known": Variable(
        _FIELD,
        "1",
        "whether the reference has this response at that value, from any start",
        "i1",
        flags=AGREEING,
    ),
    "orbit_distance": Variable(
        _FIELD, "1", "distance from the reference's response, in units of its size"
    ),
    "step_error": Variable(
        _FIELD,
        "1",
        "largest error of one forcing period from the reference's responses, in units "
        "of the motion's range",
    ),
    "step_error_rms": Variable(
        _FIELD, "1", "root mean square error of one forcing period, in units of the motion's range"
    ),
    "steps_per_period": Variable(_FIELD, "1", "steps tried in one forcing period"),
}

#: Variables of what ``regularisation_widths`` returns.
WIDTHS_VARIABLES = {
    "width": Variable(("width",), "<gap>", "width of the blend", coord=True),
    "regularisation_error": Variable(("width",), "1", "error of a forcing period by the width"),
    "error": Variable(("width",), "1", "error of a forcing period by width and method"),
    "steps_per_period": Variable(
        ("width",), "1", "steps tried in one forcing period of the stand-in"
    ),
    "method_error": Variable((), "1", "error of a forcing period by the method"),
    "method_steps_per_period": Variable(
        (), "1", "steps tried in one forcing period of the system with contacts"
    ),
    "equal_width": Variable((), "<gap>", "width of equal errors"),
    "equal_steps_per_period": Variable(
        (), "1", "steps tried in one forcing period at the width of equal errors"
    ),
}
