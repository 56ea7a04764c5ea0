"""The table of what ``lyapunov`` and ``wolf`` return."""

from __future__ import annotations

from saltus.results.dataset.variable import MINIMA, STATUS, TRAJECTORY_NUMBER, VARIED, Variable

_EACH = ("trajectory",)
#: Meaning of the values of ``near_graze``.
NEAR = {0: "clear_of_grazes", 1: "near_graze"}

#: Variables of what ``lyapunov`` and ``wolf`` return: exponents in descending order, and running
#: means. ``<rate>``: the unit that was asked for, such as ``bit/period``.
EXPONENTS_VARIABLES = {
    **TRAJECTORY_NUMBER,
    "kind": Variable(_EACH, "", "kind of motion", "str"),
    "response_period": Variable(
        _EACH, "1", "period in forcing periods, 0 if it doesn't repeat", "i8"
    ),
    "lyapunov_exponent": Variable(("trajectory", "exponent"), "<rate>", "Lyapunov exponent"),
    "lyapunov_error": Variable(
        ("trajectory", "exponent"), "<rate>", "standard error of the Lyapunov exponent"
    ),
    "lyapunov_low": Variable(
        ("trajectory", "exponent"), "<rate>", "Lyapunov exponent, lower end of the 95 % interval"
    ),
    "lyapunov_high": Variable(
        ("trajectory", "exponent"), "<rate>", "Lyapunov exponent, upper end of the 95 % interval"
    ),
    "flow_lyapunov_exponent": Variable(
        ("trajectory", "flow_exponent"),
        "<rate>",
        "Lyapunov exponent of the flow, its phase included",
    ),
    "exponent_sum": Variable(_EACH, "<rate>", "sum of the Lyapunov exponents"),
    "mean_divergence": Variable(_EACH, "<rate>", "mean rate at which volumes grow"),
    "independent_batches": Variable(
        _EACH, "1", "batches that the error of the largest exponent comes from", "i8"
    ),
    "near_graze": Variable(
        _EACH, "1", "whether the motion grazes a boundary, or nearly so", "i1", flags=NEAR
    ),
    "grazes": Variable(_EACH, "1", "grazes after the transient", "i8"),
    "grazes_unresolved": Variable(
        _EACH, "1", "grazes shallower than the local error, after the transient", "i8"
    ),
    "smallest_gap_margin": MINIMA["smallest_gap_margin"],
    "block_time": Variable(
        _EACH, "s", "time of a block: the forcing period, or the time between two samples"
    ),
    "status": STATUS,
    "replacements": Variable(_EACH, "1", "replacements of the neighbour", "i8"),
    "replaced_distance": Variable(
        _EACH, "1", "mean distance at replacement, as a share of the range of the motion"
    ),
    "replaced_angle": Variable(_EACH, "rad", "mean angle between old and new neighbour"),
    "running_time": Variable(("trajectory", "running"), "s", "time since the end of the transient"),
    "running_exponent": Variable(
        ("trajectory", "exponent", "running"), "<rate>", "Lyapunov exponent so far"
    ),
    "running_low": Variable(
        ("trajectory", "exponent", "running"),
        "<rate>",
        "Lyapunov exponent so far, lower end of the 95 % interval",
    ),
    "running_high": Variable(
        ("trajectory", "exponent", "running"),
        "<rate>",
        "Lyapunov exponent so far, upper end of the 95 % interval",
    ),
    **VARIED,
}
