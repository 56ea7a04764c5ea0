"""The variables of what ``compare_methods`` returns, beside the coordinates of the analysis."""

from __future__ import annotations

from saltus.results.dataset.response_variables import RESPONSES_VARIABLES
from saltus.results.dataset.variable import Variable

#: Every variable has the dim ``method``; but for the first four, those of the grid too, and where it belongs to a start ``start``.
METHODS_VARIABLES = {
    "method": Variable(("method",), "", "method, the reference first", "str"),
    "method_cpu_seconds": Variable((), "s", "processor time, all threads, without compiling"),
    "method_agreement": Variable((), "1", "share of the settled starts with the reference's answer"),
    "method_agreement_low": Variable((), "1", "the same, lower end of the 95 % interval"),
    "method_agreement_high": Variable((), "1", "the same, upper end of the 95 % interval"),
    **{name: RESPONSES_VARIABLES[name] for name in ("rms", "peak", "type", "period", "start", "start_direction")},
    "basin": Variable((), "1", "attractor, in the numbers of the reference", "i2"),
    "agrees": Variable((), "1", "whether the start has the reference's answer", "i1"),
    "known": Variable((), "1", "whether the reference has this response at that value, from any start", "i1"),
    "orbit_distance": Variable((), "1", "distance from the reference's response, in units of its size"),
    "step_error": Variable((), "1", "largest error of one forcing period from the reference's responses, in units of the motion's range"),
    "step_error_rms": Variable((), "1", "root mean square error of one forcing period, in units of the motion's range"),
    "steps_per_period": Variable((), "1", "steps tried in one forcing period"),
}
