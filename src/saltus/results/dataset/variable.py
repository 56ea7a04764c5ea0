"""Description of one variable of a result, and the variables that several kinds of result share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Variable:
    """Description of one variable of a result: a row of the table of its kind.

    The name of a row may hold ``<state>`` or ``<parameter>``: it then stands for one variable a
    state, or a parameter.

    Attributes
    ----------
    dims : tuple of str
        Its dims. ``trajectory`` is left out of a result that holds one trajectory only; ``...``
        stands for those of the grid, which are named after its states or parameters; one with ``?``
        is there only where the values need it.
    units : str
        SI unit, ``"1"`` for a plain number, ``""`` for text. In angle brackets, what follows the
        system or the caller.
    long_name : str
        A few words, as on an axis.
    dtype : str
        ``f8``, ``i8``, ``i4``, ``i2``, ``i1`` or ``str``.
    coord : bool
        Whether it is a coordinate.
    flags : mapping of int to str, optional
        Meaning of each value of a variable of codes, where it is always the same.
    clipped : bool
        Whether a number that the type can't hold is kept as its largest; else it is refused.
    """

    dims: tuple[str, ...]
    units: str
    long_name: str
    dtype: str = "f8"
    coord: bool = False
    flags: Mapping[int, str] | None = None
    clipped: bool = False


_EACH = ("trajectory",)
TRAJECTORY_NUMBER = {"trajectory": Variable(_EACH, "1", "trajectory", "i8", coord=True)}
VARIED = {"<parameter>": Variable(_EACH, "<parameter>", "<parameter>", coord=True)}
STATUS = Variable(_EACH, "", "how the trajectory ended", "str")
COUNTERS = {
    "events": Variable(_EACH, "1", "contacts", "i8"),
    "grazes": Variable(_EACH, "1", "grazes", "i8"),
    "grazes_unresolved": Variable(_EACH, "1", "grazes shallower than the local error", "i8"),
    "steps": Variable(_EACH, "1", "accepted steps", "i8"),
    "rejected_steps": Variable(_EACH, "1", "rejected steps", "i8"),
    "mode_violations": Variable(
        _EACH, "1", "accepted steps that ended on the wrong side of a guard", "i8"
    ),
}
MINIMA = {
    "smallest_contact_speed": Variable(_EACH, "<gap rate>", "smallest gap rate at a contact"),
    "smallest_gap_margin": Variable(
        _EACH, "<gap>", "smallest distance of a turning point of the gap from a guard"
    ),
}
END_TIME = {"end_time": Variable(_EACH, "s", "time at the end")}
END_STATES = {"end_<state>": Variable(_EACH, "<state>", "<state> at the end")}
#: The guards of the system; a boundary has the dims that move it.
GUARDS = {
    "guard": Variable(("guard",), "", "guard", "str", coord=True),
    "guard_state": Variable(("guard",), "", "state that the guard bounds", "str"),
    "guard_units": Variable(("guard",), "", "unit of the gap", "str"),
    "guard_boundary": Variable(
        ("guard", "trajectory?"), "<gap>", "value of the state on the guard"
    ),
}
#: Last variables of every table of trajectories. A period that all trajectories share is the
#: attribute ``forcing_period_s``.
SHARED = {
    "forcing_period": Variable(_EACH, "s", "forcing period", coord=True),
    **VARIED,
    **TRAJECTORY_NUMBER,
}
#: Variables of every table of motions from given starts: their ends and their costs.
ENDINGS = {
    "status": STATUS,
    **{
        name: COUNTERS[name]
        for name in ("steps", "rejected_steps", "mode_violations", "grazes_unresolved")
    },
    **END_TIME,
    **END_STATES,
}
#: Coefficient of the square root that a graze adds to motions after it.
SQRT_COEFFICIENT = (
    "change of the grazed gap when the orbit returns, over the square root of the depth by which a "
    "motion would pass the boundary"
)
#: An output, and its unit.
OUTPUT = {
    "output": Variable(
        ("output",), "", "output: a state, or a function of the motion", "str", coord=True
    ),
    "output_units": Variable(("output",), "", "unit of the output", "str", coord=True),
}
#: Variables of each output; ``<output>``: its unit in ``output_units``.
_OF_OUTPUT = {
    "maximum": Variable(("output",), "<output>", "largest value"),
    "minimum": Variable(("output",), "<output>", "smallest value"),
    "peak": Variable(("output",), "<output>", "largest magnitude"),
    "peak_to_peak": Variable(("output",), "<output>", "largest less smallest value"),
    "mean": Variable(("output",), "<output>", "mean"),
    "rms": Variable(("output",), "<output>", "root mean square about zero"),
    "rms_about_mean": Variable(("output",), "<output>", "root mean square about the mean"),
    "amplitude": Variable(
        ("output",),
        "<output>",
        "amplitude A of the first harmonic A cos(2 pi f t + phase), f the forcing frequency",
    ),
    "phase": Variable(
        ("output",),
        "rad",
        "phase of the first harmonic A cos(2 pi f t + phase), t the time of the equations",
    ),
}


def of_outputs(what: str, prefix: str = "") -> dict[str, Variable]:
    """Variables of each output of something: a response, a point of a branch."""
    return {
        f"{prefix}output_{name}": replace(row, dims=(what, "output"))
        for name, row in _OF_OUTPUT.items()
    }
