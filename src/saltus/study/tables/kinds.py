"""Parameters of the analyses, by name, that a study file writes in another way than Python."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Discriminator, Field, Tag

from saltus.fence import MOST_COUNT, MOST_PERIODS
from saltus.study.tables.methods import OWN_METHOD
from saltus.study.tables.parts import Formula, Interval, Outputs, Quantity, Range, Start, Starts
from saltus.study.tables.signature import WrittenAs

#: Most bins of a histogram.
MOST_BINS = 10_000


def whole(example: int, least: int = 1, most: int = MOST_COUNT) -> WrittenAs:
    """A whole number."""
    return WrittenAs(int, (example,), limits={"ge": least, "le": most})


def _time(example: str) -> WrittenAs:
    return WrittenAs(Quantity, (example,), convert="time")


def _one_level(surface: Any) -> Any:
    if isinstance(surface, dict) and len(surface) != 1:
        raise ValueError('surface is a level of one state, such as { x = "0.3 mm" }')
    return surface


#: A level of a state, or a surface by its name.
Surface = Annotated[
    Annotated[dict[str, Quantity], Tag("dict[str]")] | Annotated[str, Tag("str")],
    Discriminator(lambda given: "dict[str]" if isinstance(given, dict) else "str"),
    AfterValidator(_one_level),
]
_POWER = "Power that {} [W], a formula; of a published model it is known."
_STARTS = (
    'Every state at the start, the same at every value, lists making a batch; or "sweep_up", '
    '"sweep_down", "random 20" with box. '
    "At rest by default."
)
_FORMULAS_OF_GUARDS = (
    "For guards by name: the force of that contact, right in contact only, or the name of an "
    "output. Its integral is the impulse."
)
KINDS = {
    "start": WrittenAs(
        dict[str, Start],
        ({"x": ["0.2 mm", "0.4 mm"], "v": "0 m/s"},),
        "Every state at the start; lists make a batch. At rest by default.",
        None,
        convert="start",
    ),
    "values": WrittenAs(
        dict[str, Start],
        ({"frequency": ["14 Hz", "15 Hz"]},),
        "Values that differ from [system], for this question only; lists hold one for "
        "each trajectory.",
        {},
        convert="values",
    ),
    "method": OWN_METHOD,
    "flow": OWN_METHOD,
    "periods": whole(60, most=MOST_PERIODS),
    "keep": whole(12, most=MOST_PERIODS),
    "last": whole(64, most=MOST_PERIODS),
    "samples": whole(200),
    "seed": whole(1, least=0),
    "intervals": whole(100),
    "bins": whole(20, most=MOST_BINS),
    "t_end": _time("20 s"),
    "t_start": _time("0 s"),
    "every": _time("1 s"),
    "transient": WrittenAs(Quantity, (500, "5 s"), convert="transient"),
    "box": WrittenAs(
        dict[str, Interval],
        ({"x": ["-5 mm", "5 mm"], "v": ["-1 m/s", "1 m/s"]},),
        'Range (low, high) of each state for random starts: start = "random 20".',
        convert="box",
    ),
    "outputs": WrittenAs(
        Outputs,
        ({"spring force": "k*x", "power": {"formula": "c*v**2", "unit": "W"}},),
        "What to read off each response besides its states, by name: formulas.",
        {},
        convert="outputs",
    ),
    "frequency": WrittenAs(
        Range,
        ({"first": "2 Hz", "last": "30 Hz", "count": 281},),
        "Forcing frequencies.",
        convert="frequency",
    ),
    "vary": WrittenAs(
        dict[str, Range],
        (
            {
                "contact_stiffness": {
                    "first": "1e3 N/m",
                    "last": "1e9 N/m",
                    "count": 200,
                    "scale": "log",
                }
            },
        ),
        "One parameter, or two for a map of the kinds of motion.",
        convert="vary",
    ),
    "at": WrittenAs(dict[str, Quantity], ({"y": "0 mm"},), default={}, convert="at"),
    "surface": WrittenAs(
        Surface,
        ({"x": "0.3 mm"}, "x turns", {"formula": "x - 0.1*v"}),
        'A level of a state or an output; its turning points, "x turns"; a guard of the system by '
        "name; or where a formula is zero.",
    ),
    "contact_side": WrittenAs(dict[str, Literal[-1, 1]], ({"upper_gap": 1},), default={}),
    "force": WrittenAs(
        dict[str, Formula],
        ({"upper_gap": "contact_stiffness*(x - upper_gap)"},),
        _FORMULAS_OF_GUARDS,
        {},
    ),
    "energy": WrittenAs(
        Formula,
        ("(mass*v**2 + stiffness*x**2)/2",),
        "Stored energy [J], a formula; of a published model it is known.",
        None,
    ),
    "supplied": WrittenAs(
        Formula, ("force*cos(2*pi*frequency*t)*v",), _POWER.format("flows in"), None
    ),
    "dissipated": WrittenAs(Formula, ("damping*v**2",), _POWER.format("is lost"), None),
    "friction": WrittenAs(
        Formula,
        ("slip*sign(v)*v",),
        "Power that friction takes [W], a formula, a "
        "part of its own beside dissipated; 0 by default.",
        None,
    ),
}
#: Keys of a motion besides its samples.
OF_MOTION = KINDS | {
    "at": WrittenAs(
        Annotated[list[Quantity], Field(min_length=1)],
        (["10 ms", "25 ms"],),
        "Times at which the states are wanted, in any order, in place of samples.",
        None,
        convert="times",
    ),
    "until": WrittenAs(
        str,
        ("x > 2 mm", "x > 2 mm and v < 0 m/s"),
        "Condition at which a motion ends, at the instant at which it becomes true: a comparison, "
        "or several joined by and, or; numbers may have units.",
        None,
    ),
}
#: Starts of the analyses that follow many, and values that are the same for all of them.
OF_RESPONSES = KINDS | {
    "start": WrittenAs(
        Starts, (*KINDS["start"].examples, "sweep_up"), _STARTS, None, convert="start"
    ),
    "values": WrittenAs(
        dict[str, Quantity],
        ({"contact_stiffness": "25.5 kN/m"},),
        "Values that differ from [system], for this question only.",
        {},
        convert="values",
    ),
    "periods": whole(2000, most=MOST_PERIODS),
}
