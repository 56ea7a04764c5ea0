"""The table of what ``branches`` returns."""

from __future__ import annotations

from saltus.results.dataset.bifurcation_curves import SQRT_COEFFICIENT
from saltus.results.dataset.variable import GUARDS, Variable

_POINT = ("point",)
_MULTIPLIER = ("point", "multiplier")
_OUTPUT = ("point", "output")
_BRANCH = ("branch",)
_EVENT = ("event",)

#: What a branch's end says.
BRANCH_ENDS = {
    "range": "the end of the range",
    "closed": "closed: an isola",
    "branch": "where it leaves another branch",
    "hopf": "where a limit cycle shrinks to an equilibrium",
    "boundary_equilibrium": "where an equilibrium meets a boundary",
    "period_doubling": "where it becomes an orbit of half the period",
    "points": "as many points as were asked for",
    "lost": "no step leads on, however short",
    "graze": "a graze behind which it isn't known how it goes on",
    "corner": "two contacts at once, behind which it isn't known how it goes on",
    "held": "where the impacts that chatter before a contact is held become others",
    "accumulates": "before the value at which its grazes accumulate: an orbit that chatters",
    "interrupted": "interrupted",
}

#: Variables of what ``branches`` returns. ``<first>``: the unit of the first state; ``<gap>``: that
#: of the gaps; ``<varied>``: that of the parameter; ``<output>``: that in ``output_units``, which
#: an output has of its own.
BRANCHES_VARIABLES = {
    "point": Variable(_POINT, "1", "point of a branch", "i8", coord=True),
    "point_branch": Variable(_POINT, "1", "branch that the point lies on", "i8"),
    "point_<parameter>": Variable(_POINT, "<parameter>", "<parameter>"),
    "point_arclength": Variable(
        _POINT, "1", "length of the branch from its first point, in ranges of its unknowns"
    ),
    "point_stable": Variable(_POINT, "1", "whether the orbit attracts", "i1"),
    "point_unstable_multipliers": Variable(
        _POINT,
        "1",
        "Floquet multipliers outside the unit circle; eigenvalues of positive real part",
        "i4",
    ),
    "point_period": Variable(_POINT, "s", "period of the orbit; NaN of an equilibrium"),
    "point_peak": Variable(_POINT, "<first>", "largest magnitude of the first state"),
    "point_rms": Variable(_POINT, "<first>", "root mean square of the first state"),
    "point_contacts": Variable(_POINT, "1", "contacts in one period of the orbit"),
    "point_itinerary": Variable(
        _POINT, "", "guards met, with + where the gap becomes positive, in the order of time", "str"
    ),
    "point_margin": Variable(
        _POINT, "<gap>", "smallest distance by which the orbit misses or overshoots a boundary"
    ),
    "point_multiplier_real": Variable(_MULTIPLIER, "1", "Floquet multiplier, real part"),
    "point_multiplier_imag": Variable(_MULTIPLIER, "1", "Floquet multiplier, imaginary part"),
    "point_eigenvalue_real": Variable(
        _MULTIPLIER, "1/s", "eigenvalue of an equilibrium, real part"
    ),
    "point_eigenvalue_imag": Variable(
        _MULTIPLIER, "1/s", "eigenvalue of an equilibrium, imaginary part"
    ),
    "point_<state>": Variable(("point", "orbit_point"), "<state>", "<state> <when>"),
    "output": Variable(
        ("output",), "", "output: a state, or a function of the motion", "str", coord=True
    ),
    "output_units": Variable(("output",), "", "unit of the output", "str", coord=True),
    "point_output_maximum": Variable(_OUTPUT, "<output>", "largest value"),
    "point_output_minimum": Variable(_OUTPUT, "<output>", "smallest value"),
    "point_output_peak": Variable(_OUTPUT, "<output>", "largest magnitude"),
    "point_output_peak_to_peak": Variable(_OUTPUT, "<output>", "largest less smallest value"),
    "point_output_mean": Variable(_OUTPUT, "<output>", "mean"),
    "point_output_rms": Variable(_OUTPUT, "<output>", "root mean square about zero"),
    "point_output_rms_about_mean": Variable(_OUTPUT, "<output>", "root mean square about the mean"),
    "point_output_amplitude": Variable(
        _OUTPUT,
        "<output>",
        "amplitude A of the first harmonic A cos(2 pi f t + phase), f the forcing frequency",
    ),
    "point_output_phase": Variable(
        _OUTPUT,
        "rad",
        "phase of the first harmonic A cos(2 pi f t + phase), t the time of the equations",
    ),
    "branch": Variable(_BRANCH, "1", "branch", "i8", coord=True),
    "branch_kind": Variable(
        _BRANCH, "", "what lies on it: periodic, limit_cycle, equilibrium", "str"
    ),
    "branch_periods": Variable(
        _BRANCH,
        "1",
        "period of its orbits in forcing periods; without forcing 1, of equilibria 0",
        "i8",
    ),
    "branch_closed": Variable(_BRANCH, "1", "whether it returns to where it began", "i1"),
    "branch_parent": Variable(
        _BRANCH, "1", "branch that it leaves at its first point, -1 if none", "i8"
    ),
    "branch_twin": Variable(
        _BRANCH, "1", "whether its mirror image is a branch of its own, which isn't listed", "i1"
    ),
    "branch_begin": Variable(_BRANCH, "", "why it ends at its first point", "str"),
    "branch_end": Variable(_BRANCH, "", "why it ends at its last point", "str"),
    "branch_begin_limit": Variable(
        _BRANCH, "<varied>", "parameter at which its grazes accumulate beyond its first point"
    ),
    "branch_end_limit": Variable(
        _BRANCH, "<varied>", "parameter at which its grazes accumulate beyond its last point"
    ),
    "branch_unexplained": Variable(
        _BRANCH, "1", "changes of stability that its events don't explain", "i8"
    ),
    "event": Variable(_EVENT, "1", "event", "i8", coord=True),
    "event_kind": Variable(_EVENT, "", "bifurcation", "str"),
    "event_guard": Variable(
        _EVENT, "", "guard that is grazed, or guards that are met at once", "str"
    ),
    "event_phase": Variable(
        _EVENT, "1", "when it is grazed, in forcing periods since the orbit's first point"
    ),
    "event_outcome": Variable(
        _EVENT,
        "",
        "how a branch goes on behind a graze or a boundary; what is born at a Hopf point",
        "str",
    ),
    "event_sqrt_coefficient": Variable(_EVENT, "<root gap>", SQRT_COEFFICIENT),
    "event_branch": Variable(_EVENT, "1", "branch on which it lies", "i8"),
    "event_point": Variable(_EVENT, "1", "point of the branch that comes before it", "i8"),
    "event_<parameter>": Variable(_EVENT, "<parameter>", "<parameter>"),
    "event_peak": Variable(_EVENT, "<first>", "largest magnitude of the first state"),
    "event_rms": Variable(_EVENT, "<first>", "root mean square of the first state"),
    "event_multiplier_real": Variable(
        ("event", "multiplier"), "1", "Floquet multiplier, real part"
    ),
    "event_multiplier_imag": Variable(
        ("event", "multiplier"), "1", "Floquet multiplier, imaginary part"
    ),
    "event_eigenvalue_real": Variable(
        ("event", "multiplier"), "1/s", "eigenvalue of an equilibrium, real part"
    ),
    "event_eigenvalue_imag": Variable(
        ("event", "multiplier"), "1/s", "eigenvalue of an equilibrium, imaginary part"
    ),
    "event_<state>": Variable(("event", "orbit_point"), "<state>", "<state> <when>"),
    **GUARDS,
}
