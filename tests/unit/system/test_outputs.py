"""Named outputs of a system: their names, units and arguments; what they keep of the system; their
data.
"""

import json
import pickle

import numpy as np
import pytest

import saltus as sl
from saltus.errors import ParameterError, SaltusError, TraceError, UnitError
from saltus.language.evaluate import evaluate
from saltus.system.quantity import with_level


@sl.system(
    states="x v",
    forced_at="frequency",
    units={"x": "m", "v": "m/s"},
    outputs={"spring force": lambda x, stiffness: stiffness * x},
)
def rig(t, x, v, *, mass="2 kg", stiffness="1 kN/m", gap="1 mm", force="4 N", frequency="3 Hz"):
    contact = sl.freeplay(x, stiffness=stiffness, upper_gap=gap)
    return v, (force * sl.cos(2 * sl.pi * frequency * t) - stiffness * x - contact) / mass


@sl.system(states="q1 q2 q1_rate q2_rate")
def pair(t, q1, q2, q1_rate, q2_rate):
    return q1_rate, q2_rate, -q1, -2 * q2


def value(system, name, **states):
    """The value of an output at a state in which no condition is asked."""
    formula = system.outputs.formulas[system.outputs.names.index(name)]
    return evaluate([formula], states=states, values=system.values)[0]


def test_the_unit_is_that_of_the_formula_or_the_one_given():
    system = rig.with_outputs({"a": lambda x: x, "b": (lambda x, t: 2 * x, "m"), "c": lambda v: v})
    assert system.outputs.names == ("spring force", "a", "b", "c")
    assert system.outputs.units == ("N", "m", "m", "m/s")


def test_neither_equations_nor_values_change():
    system = rig.with_outputs({"a": lambda x: x})
    assert system.fingerprint() == rig.fingerprint()
    assert (system.field, system.guards, dict(system.values)) == (
        rig.field, rig.guards, dict(rig.values),
    )  # fmt: skip
    assert system.with_values(force=1.0).outputs is system.outputs


def test_arguments_by_star_are_the_numbered_states_or_all():
    row = np.array([2.0, 3.0])
    system = pair.with_outputs({
        "place": lambda *q: row @ q,
        "speed": lambda *q_rate: row @ q_rate,
        "sum": lambda *y: sum(y),
        "with the time": lambda t, *y: y[3],
    })  # fmt: skip
    states = {"q1": 1.0, "q2": 10.0, "q1_rate": 100.0, "q2_rate": 1000.0}
    found = [value(system, name, **states) for name in system.outputs.names]
    assert found == [32.0, 3200.0, 1111.0, 1000.0]


def test_one_output_may_use_those_before_it():
    system = rig.with_outputs({"twice": lambda x: 2 * x, "four": lambda twice: 2 * twice})
    assert value(system, "four", x=3.0, v=0.0) == 12.0


@pytest.mark.parametrize(
    ("outputs", "error", "words"),
    [
        ({"x": lambda x: x}, ParameterError, "a state of this name"),
        ({"gap": lambda x: x}, ParameterError, "a parameter of this name"),
        ({"t": lambda x: x}, ParameterError, "it is the time"),
        ({"spring force": lambda x: x}, ParameterError, "an output of this name"),
        ({"end_x": lambda x: x}, ParameterError, "results call x at the end"),
        ({"a/b": lambda x: x}, ParameterError, "use no /"),
        ({"|a|": lambda x: x}, ParameterError, "begin with a letter"),
        ({3: lambda x: x}, ParameterError, "it must be text"),
        ({"a": (lambda x: x, "N")}, UnitError, "said to be in N, but its formula is in m"),
        ({"a": (lambda x: x, "elephant")}, UnitError, "elephant"),
        ({"a": lambda stifness: stifness}, TraceError, "Did you mean 'stiffness'"),
        ({"a": lambda x, t: x * t}, TraceError, "the output 'a' doesn't repeat"),
        ({"a": lambda x: None}, TraceError, "returns nothing"),
        ([lambda x: x], ParameterError, "functions by name"),
    ],
)
def test_what_cant_be_an_output_is_said(outputs, error, words):
    with pytest.raises(error, match=words):
        rig.with_outputs(outputs)


def test_an_output_too_many_is_refused():
    with pytest.raises(ParameterError, match="51 outputs, not more"):
        rig.with_outputs({f"a{i}": lambda x: x for i in range(60)})


def test_a_name_of_a_variable_of_results_is_refused_before_anything_is_computed():
    with pytest.raises(ParameterError, match="the name of something else in results"):
        sl.simulate(rig.with_outputs({"status": lambda x: x}), periods=10**9)


def test_boundaries_of_outputs_stand_behind_those_of_the_system():
    beyond = {
        "a": lambda x: sl.piecewise((x, x > 2e-3), otherwise=0),
        "b": lambda x, gap: sl.piecewise((x, x > gap), otherwise=0),
        "c": lambda v, a: sl.piecewise((a, v > 1), otherwise=0),
    }
    system = rig.with_outputs(beyond)
    assert len(system.guards) == 1
    assert len(system.outputs.guards) == 2
    formulas, guards = system.outputs.behind(system.guards)
    moved, more = system.outputs.behind(with_level(system, "v", 0.5).guards)
    assert len(more) == len(guards) + 1
    for states in ({"x": 3e-3, "v": 2.0}, {"x": 3e-3, "v": 0.0}, {"x": 1e-4, "v": 2.0}):
        about = {"states": states, "values": {**system.values, "surface_level": 0.5}}
        bits, shifted = [], []
        for guard in guards:
            bits.append(evaluate([guard.gap], **about, bits=bits)[0] > 0)
        for guard in more:
            shifted.append(evaluate([guard.gap], **about, bits=shifted)[0] > 0)
        expected = evaluate(formulas, **about, bits=bits)
        assert evaluate(moved, **about, bits=shifted) == expected
        x = states["x"]
        a = x if x > 2e-3 else 0
        assert expected[1:] == [a, x if x > 1e-3 else 0, a if states["v"] > 1 else 0]


@pytest.mark.parametrize("load", [lambda s: pickle.loads(pickle.dumps(s)),
    lambda s: sl.System.from_dict(json.loads(json.dumps(s.to_dict())))])  # fmt: skip
def test_outputs_are_data(load):
    system = rig.with_outputs({
        "a": lambda x: sl.piecewise((x, x > 2e-3), otherwise=0),
        "drive": lambda t, frequency, force: force * sl.cos(2 * sl.pi * frequency * t),
    })  # fmt: skip
    found, known = load(system).outputs, system.outputs
    assert (found.names, found.units, found.after, found.first) == (
        known.names, known.units, known.after, known.first,
    )  # fmt: skip
    assert found.formulas == known.formulas
    assert [guard.gap for guard in found.guards] == [guard.gap for guard in known.guards]


@pytest.mark.parametrize(
    "damage",
    [
        lambda d: d.update(names=["x"]), lambda d: d.update(names=["a/b"]),
        lambda d: d.update(formulas=[99]), lambda d: d.update(units=["elephant"]),
        lambda d: d.update(units=[]), lambda d: d.pop("nodes"),
        lambda d: d["nodes"].insert(0, ["state", [], "y"]),
    ],
)  # fmt: skip
def test_damaged_data_is_refused(damage):
    data = rig.to_dict()
    damage(data["outputs"])
    with pytest.raises(SaltusError):
        sl.System.from_dict(data)


def test_a_regularised_system_has_the_blended_force():
    with_force = rig.with_outputs({
        "stop force": lambda x, stiffness, gap: sl.freeplay(x, stiffness=stiffness, upper_gap=gap),
        "far": lambda x: sl.piecewise((1, x > 5e-3), otherwise=0),
    })  # fmt: skip
    smooth = sl.regularise(with_force, "tanh", width="0.1 mm")
    assert not smooth.guards
    assert smooth.outputs.units == with_force.outputs.units
    depth, width = 0.05e-3, 1e-4
    blend = 1e3 * depth * (1 + np.tanh(depth / width)) / 2
    assert value(smooth, "stop force", x=1e-3 + depth, v=0.0) == pytest.approx(blend, rel=1e-12)
    assert [guard.name for guard in smooth.outputs.guards] == ["x = 0.005"]
