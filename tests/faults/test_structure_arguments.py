"""Odd arguments of structures, smooth stand-ins and inputs are refused in words."""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from saltus.errors import ParameterError, SaltusError, TraceError

pytestmark = pytest.mark.filterwarnings("ignore")

ODD = [
    None, True, 0, -1, 2.5, float("nan"), float("inf"), "", "abc", "1 m", "1 s", b"x", [], [1],
    [[1, 2], [3]], {}, {"a": 1}, object(), lambda u: u, np.zeros(3), np.eye(2),
    np.eye(2, dtype=object), np.array(["a"]), 10**400, range(3), (1, 2), sl,
    np.datetime64("2020"),
]  # fmt: skip
RIG = sl.models.delangre("a", force="4 N", frequency="17 Hz")
MATRICES = {"mass": np.eye(2), "stiffness": np.eye(2)}
CONTACT = {"at": "x1", "stiffness": 1.0, "gap": 1.0}
RIGID = {"at": "x1", "restitution": 0.0, "gap": 1.0, "friction": 0.2, "sliding": "x2"}
BASE = {"direction": "x", "amplitude": 1.0}
FORCE = {"at": "x1", "amplitude": 1.0}
STRUCTURE = {**MATRICES, "contacts": [CONTACT], "forces": [FORCE], "frequency": 1.0}
#: What is called, its usual arguments, and those that are made odd.
CALLS = {
    "structure": (sl.structure, STRUCTURE, "mass stiffness damping contacts forces base "
        "frequency damping_ratio modes names unit name source"),
    "contact": (lambda **part: sl.structure(**{**STRUCTURE, "contacts": [part]}), CONTACT,
        "at stiffness gap to side damping name restitution power preload friction sliding"),
    "rigid": (lambda **part: sl.structure(**{**STRUCTURE, "contacts": [part]}), RIGID,
        "at stiffness gap to side damping name restitution power preload friction sliding"),
    "base": (lambda **part: sl.structure(**{**STRUCTURE, "base": [part]}), BASE,
        "direction amplitude phase harmonic name"),
    "sweep": (sl.sweep, {"first": 1.0, "last": 2.0, "rate": 1.0}, "first last rate amplitude"),
    "force": (lambda **part: sl.structure(**{**STRUCTURE, "forces": [part]}), FORCE,
        "at amplitude phase harmonic name"),
    "structure_modes": (sl.structure_modes, MATRICES, "mass stiffness modes at names"),
    "regularise": (sl.regularise, {"system": RIG, "width": 1e-6}, "system law width"),
    "recorded": (sl.recorded, {"times": [0.0, 1.0], "values": [1.0, 2.0]},
        "times values unit time_unit kind outside name"),
    "square": (sl.square, {"phase": 1.0}, "phase duty"),
    "sawtooth": (sl.sawtooth, {"phase": 1.0}, "phase width"),
    "pulse": (sl.pulse, {"t": 1.0, "duration": 1.0}, "t duration start every shape"),
    "regularisation_widths": (sl.regularisation_widths,
        {"system": RIG, "transient": 1, "points": 1, "widths": [1e-6]},
        "law method start widths transient points threads"),
}  # fmt: skip


@pytest.mark.parametrize("name", CALLS)
def test_odd_arguments_are_refused_in_words(name):
    function, usual, arguments = CALLS[name]
    for argument in arguments.split():
        for odd in ODD:
            try:
                function(**{**usual, argument: odd})
            except SaltusError as error:
                assert str(error)  # noqa: PT017


CHAIN = 900.0 * (2 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1))
STOP = sl.Contact("x1", 1e3, 1e-3)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"contacts": STOP}, r"^contacts must be a list of sl\.Contact\(\.\.\.\), not Contact"),
        ({"forces": "x1"}, r"^forces must be a list of sl\.Force\(\.\.\.\), not 'x1'\.$"),
        ({"forces": [sl.Force("x1", 1, name="t")]}, r"^a force can't be called 't', the name of "
            r"the time\. Give it another name=\.$"),
        ({"forces": [sl.Force("x1", 1, name="frequency")], "frequency": 3}, r"'frequency', the "
            r"name of the forcing frequency\."),
        ({"forces": [sl.Force("x1", None)], "frequency": 3}, r"^force: the force needs amplitude="),
        ({"base": sl.Base("x", None), "frequency": 3}, r"^base: the acceleration needs amplitude="),
        ({"contacts": [sl.Contact("x1", 1e3, 1e-3, friction=0.1, sliding=())]},
            r"^stop: sliding must be a degree of freedom, or two of them, not \(\)\.$"),
        ({"sensors": {"f": sl.contact_force("stop")}}, r"no contact at 'stop'\. This structure "
            r"has none: give contacts=\.$"),
        ({"sensors": {"f": "acceleration(x1)"}}, r"Write sl\.acceleration\('x1'\)\.$"),
        ({"damping": 0.02}, r"^damping must be a square matrix; its shape is \(\)\. Of a ratio "),
        ({"mass": 0 * CHAIN}, r"^all entries of mass are zero\. Give the mass matrix\.$"),
        ({"mass": -np.eye(4)}, r"^mass must be positive definite, but its smallest eigenvalue is "
            r"-1\.$"),
    ],
)  # fmt: skip
def test_a_newcomers_mistakes_are_answered_in_a_sentence(given, said):
    with pytest.raises(ParameterError, match=said):
        sl.structure(**{"mass": np.eye(4), "stiffness": CHAIN, "modes": 2} | given)


@pytest.mark.parametrize("values", [[1j, 2.0], np.array(["2020-01-01", "2020-01-02"], "M8[s]")])
def test_records_are_real_numbers(values):
    for pair in (([0.0, 1.0], values), (values, [0.0, 1.0])):
        with pytest.raises(TraceError, match="must be real numbers"):
            sl.recorded(*pair, "N")
