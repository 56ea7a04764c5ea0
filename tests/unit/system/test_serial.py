"""Systems as data: nothing is lost, nothing is run, and the fingerprint knows equations only."""

import copy
import functools
import json
import os
import pickle
import subprocess
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from saltus.contact.boundaries import find_guards
from saltus.errors import SaltusError, TraceError
from saltus.language import abs, cos, max, pi, piecewise
from saltus.language import expression as ex
from saltus.models import MODELS, delangre
from saltus.system import System, system


def nested():
    @system(states="x v", forced_at="frequency", units={"x": "m"})
    def rig(t, x, v, *, gap=0.1, frequency=2.0):
        law = piecewise(
            (abs(x) - gap, (abs(x) > gap) & ~(v > 0) | (v > 3)),
            (max(x, v), x > 2 * v),
            otherwise=0.1,
        )
        return v, -law + cos(2 * pi * frequency * t)

    return rig


def same(a, b):
    guards = [[(g.name, g.gap, g.state, g.boundary) for g in made.guards] for made in (a, b)]
    plain = [
        (
            m.name,
            m.description,
            m.source,
            m.states,
            dict(m.values),
            dict(m.units),
            m.forced_at,
            m.fingerprint(),
        )
        for m in (a, b)
    ]
    # interned: equal expressions are one object
    return a.field == b.field and guards[0] == guards[1] and plain[0] == plain[1]


@pytest.mark.parametrize(
    "made", [model() for model in MODELS.values()] + [nested()], ids=lambda made: made.name
)
def test_round_trips(made):
    assert same(System.from_dict(json.loads(json.dumps(made.to_dict()))), made)
    assert same(pickle.loads(pickle.dumps(made)), made)
    assert same(copy.deepcopy(made), made)


@settings(max_examples=40)
@given(data=st.data())
def test_random_equations_round_trip(expressions, data):
    entry = data.draw(expressions)
    gap = data.draw(expressions) + 2 * ex.state("x")
    field, guards = find_guards([ex.state("v"), piecewise((entry, gap > 0), otherwise=-entry)])
    made = System(
        "random", ("x", "v"), field, guards, {"p": 0.1, "q": 1e300}, dict.fromkeys("xvpq", "")
    )
    assert same(System.from_dict(json.loads(json.dumps(made.to_dict()))), made)


def test_pickles_hold_no_code():
    @system(states="x")
    def local(t, x, *, rate=1.0):  # a local function can't be pickled; the system can
        return -rate * x

    assert pickle.loads(pickle.dumps(local)).field is not None


def variant(
    stiffness=2.0, states="x v", unit="Hz", name="k", guard=True, forced_at="f", factor=3.0
):
    def rig(t, x, v, *, k=stiffness, f=1.0):
        force = piecewise((k * x * factor, x > 1 if guard else x > 2), otherwise=0)
        return v, force + (
            cos(2 * pi * f * t) if unit == "Hz" else cos(f * t) * cos(2 * pi * f * t / (2 * pi))
        )

    return system(states=states, forced_at=forced_at, units={"f": unit}, name=name)(rig)


def test_the_fingerprint_knows_equations_only():
    reference = variant().fingerprint()
    assert len(reference) == 64
    assert variant(stiffness=5.0).fingerprint() == reference
    assert variant(name="other").fingerprint() == reference
    assert variant().with_values(k=7.0).fingerprint() == reference
    others = [
        variant(guard=False),
        variant(forced_at=None),
        variant(factor=3.0000000000000004),
        variant(unit="rad/s"),
    ]
    assert len({reference, *(other.fingerprint() for other in others)}) == 5


def test_the_fingerprint_knows_what_sets_the_period():
    def rig(t, x, *, f=1.0):
        return -x * f

    made = [
        system(states="x", forced_at=forced, units={"f": unit})(rig)
        for forced, unit in (("f", "Hz"), ("f", "rad/s"), (None, "Hz"))
    ]
    assert made[0].field == made[1].field == made[2].field
    assert len({one.fingerprint() for one in made}) == 3


def test_the_fingerprint_is_that_of_another_process():
    code = "from saltus.models import delangre; print(delangre('c').fingerprint())"
    for seed in ("1", "2"):
        run = subprocess.run(
            [sys.executable, "-c", code],
            check=True,
            capture_output=True,
            text=True,
            env={**os.environ, "PYTHONHASHSEED": seed},
        )
        assert run.stdout.strip() == delangre("b").fingerprint()


@pytest.fixture(scope="module")
def whole():
    return nested()


@pytest.mark.parametrize(
    ("change", "teaches"),
    [
        (lambda d: d.update(format="saltus-system/0"), "saltus-system/0"),
        (lambda d: d.pop("nodes"), "damaged"),
        (lambda d: d["nodes"].insert(0, ["eval", [], None]), "damaged"),
        (lambda d: d["nodes"].insert(0, ["param", [], "unknown"]), "damaged"),
        (lambda d: d["nodes"].insert(0, ["add", [1, 2], None]), "wrong operands"),
        (lambda d: d["nodes"].insert(0, ["add", [0], None]), "wrong operands"),
        (lambda d: d["nodes"].insert(0, ["add", [-1, -1], None]), "wrong operands"),
        (lambda d: d["nodes"].append(["select", [0, 1], ["bit", 99]]), None),
        (lambda d: d["nodes"].append(["select", [0, 1], ["xor", 1]]), "unknown condition"),
        (
            (lambda d: d["nodes"].append(["select", [0, 1], ["not", ["bit", 0], ["bit", 0]]])),
            "unknown condition",
        ),
        (lambda d: d["guards"].clear(), "unknown guard"),
        (lambda d: d["guards"].insert(0, d["guards"].pop(1)), "later guard"),
        (lambda d: d["guards"][0].__setitem__(2, "zzz"), "unknown state"),
        (lambda d: d["field"].pop(), "derivatives"),
        (lambda d: d["field"].__setitem__(0, -1), "stands in no node"),
        (lambda d: d["guards"][0].__setitem__(1, -1), "stands in no node"),
        (lambda d: d["guards"][0].__setitem__(3, -1), "stands in no node"),
        (
            (lambda d: d["guards"][0].__setitem__(0, "a\x1b]0;title\x07")),
            "no name of a boundary",
        ),
        (lambda d: d["guards"][0].__setitem__(0, 5), "must be text"),
        (lambda d: d["units"].update(x="\x1b[31m"), "unit .* can't be read"),
        (lambda d: d.update(forced_at="zzz"), "forced_at"),
        (lambda d: d["parameters"].__setitem__(0, "import os"), "no name"),
        (lambda d: d["parameters"].append("x"), "twice"),
        (lambda d: d.update(name='x"""\nopen("mark", "w")\n"""'), "one line"),
        (lambda d: d.update(name="\x1b]0;title\x07"), "one line"),
        (lambda d: d.update(name=7), "must be text"),
        (lambda d: d.update(description="a\0b"), "control characters"),
        (lambda d: d.update(source=["a"]), "must be text"),
        (lambda d: d["nodes"].insert(0, ["const", [], 10**400]), "damaged"),
        (
            (
                lambda d: d["nodes"].append(
                    [
                        "select",
                        [0, 1],
                        functools.reduce(lambda c, _: ["not", c], range(3000), ["bit", 0]),
                    ]
                )
            ),
            "damaged",
        ),
        (lambda d: d["values"].update(gap="a"), "damaged"),
        (lambda d: d["values"].update(frequency=-1.0), "forcing frequency"),
    ],
)
def test_damaged_data_is_refused(whole, change, teaches):
    data = json.loads(json.dumps(whole.to_dict()))
    change(data)
    if teaches is None:  # a node that nothing uses does no harm
        assert same(System.from_dict(data), whole)
        return
    with pytest.raises(SaltusError, match=teaches):
        System.from_dict(data)


@pytest.mark.parametrize("data", [[], {}])
def test_what_is_no_data_of_a_system_is_refused(data):
    with pytest.raises(SaltusError, match="isn't a system"):
        System.from_dict(data)


#: Names that mean something to Python, or to generated modules.
STRANGE = [
    "lambda",
    "None",
    "import",
    "np",
    "math",
    "njit",
    "kept",
    "kernel",
    "__builtins__",
    "__class__",
    "t",
    "a b",
    "x;y",
    "",
    "x" * 201,
]


@pytest.mark.parametrize("name", STRANGE)
@pytest.mark.parametrize("old", ["x", "gap"])
def test_a_state_or_parameter_of_a_strange_name_is_refused(whole, name, old):
    data = json.loads(json.dumps(whole.to_dict()).replace(json.dumps(old), json.dumps(name)))
    with pytest.raises(SaltusError, match="is no name"):
        System.from_dict(data)


@pytest.mark.parametrize("name", ["lambda", "np", "__builtins__"])
def test_a_traced_state_of_a_strange_name_is_refused(name):
    with pytest.raises(TraceError, match=f"'{name}' can't be the name of a state"):
        system(states=f"{name} v")(lambda t, x, v: (v, -x))


def test_text_of_a_name_is_no_code(tmp_path):
    """The name that once closed the docstring of the generated module and went on as code is
    refused as data and when it is traced.
    """
    name = f'x"""\nopen({str(tmp_path / "mark")!r}, "w")\n"""'
    with pytest.raises(SaltusError, match="one line of text"):
        System.from_dict(delangre("b").to_dict() | {"name": name})
    with pytest.raises(TraceError, match="one line of text"):
        system(states="x", name=name)(lambda t, x: -x)
    assert not (tmp_path / "mark").exists()
