"""Quantities: functions that join a system read its guards' sides, make guards of their own behind
them, and say what is wrong.
"""

import pytest

import saltus as sl
from saltus.errors import ParameterError, TraceError, UnitError
from saltus.language.expression import Bit, Not
from saltus.language.text import to_text
from saltus.system.quantity import (
    remembering,
    turning_surfaces,
    with_integrals,
    with_level,
    with_surface,
)
from saltus.system.read_off import quantity
from saltus.system.tangent import tangent_system


@sl.system(states="x v", forced_at="frequency", units={"x": "m", "v": "m/s"})
def rig(t, x, v, *, stiffness=1.4e4, gap="0.4 mm", force=4.0, frequency=15.0):
    return v, force * sl.cos(2 * sl.pi * frequency * t) - x - sl.freeplay(
        x, stiffness=stiffness, upper_gap=gap
    )


# -- tracing ---------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("function", "payload"),
    [
        (lambda x, v, gap: sl.piecewise((v, x > gap), otherwise=0), Bit(0)),
        (lambda x, v, gap: sl.piecewise((v, 2 * x - 2 * gap > 0), otherwise=0), Bit(0)),
        (lambda x, v, gap: sl.piecewise((v, x < gap), otherwise=0), Not(Bit(0))),
    ],
)
def test_a_comparison_that_means_a_guard_reads_its_side(function, payload):
    root, guards = quantity(rig, function)
    assert guards == rig.guards
    assert root.payload == payload


def test_other_comparisons_become_guards_behind_those_of_the_system():
    root, guards = quantity(
        rig, lambda x, gap: sl.piecewise((1, x > -gap), (2, x > gap), otherwise=0)
    )
    assert guards[0] is rig.guards[0]
    # that of the system keeps its name, although both hold one parameter
    assert [guard.name for guard in guards] == ["gap", "x = -gap"]
    assert root.payload == Bit(1)
    assert root.args[1].payload == Bit(0)


@pytest.mark.parametrize(
    "function",
    [
        lambda t, x, v, *, stiffness, gap, force, frequency: stiffness * x + 0 * t,
        lambda tau, x, v, *, stiffness, **rest: stiffness * x + 0 * tau,
        lambda x, stiffness: stiffness * x,
        lambda *, stiffness, x: stiffness * x,
        lambda t, x, v, **values: values["stiffness"] * x,
        lambda x, *, stiffness=3.0: stiffness * x,
    ],
)
def test_arguments_are_found_by_name(function):
    assert to_text(quantity(rig, function)[0]) == "stiffness*x"


def _branches(x):
    return 1 if x > 0 else 0


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (
            lambda x, stifness: x,
            r"asks for 'stifness', which is neither t nor a state or parameter "
            r"of rig. Did you mean 'stiffness'\?",
        ),
        (lambda x: None, "returns nothing"),
        (_branches, r"if x > 0"),
        (lambda x: (x, x), "neither a number nor a traced value"),
        ("x - 0.3", "must be a function such as `lambda t, x, v: ...`, not 'x - 0.3'"),
        (lambda t, x: sl.piecewise((x, t * t > 1), otherwise=0), "depends on time only"),
    ],
)
def test_what_cant_be_traced_says_where_and_why(function, words):
    with pytest.raises(TraceError, match=words):
        quantity(rig, function)


# -- surfaces --------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("function", "gap", "state"),
    [
        (lambda x: x - 0.25, "x - 0.25", "x"),
        (lambda x: 0.25 - x, "0.25 - x", None),
        (lambda x: 2 * x - 0.25, "2*x - 0.25", None),
        (lambda v, x: v + x, "v + x", None),
        (lambda x, gap: x - gap, "x - gap", "x"),
    ],
)
def test_a_surface_is_the_last_guard_with_the_sign_and_scale_of_its_function(function, gap, state):
    system = with_surface(rig, function)
    assert system.guards[:-1] == rig.guards
    surface = system.guards[-1]
    assert (surface.name, to_text(surface.gap), surface.state) == ("surface", gap, state)
    assert system.field == rig.field


def test_a_surface_survives_data_and_has_a_fingerprint_of_its_own():
    system = with_surface(rig, lambda x, v: x * v - 1)
    assert (
        sl.System.from_dict(system.to_dict()).fingerprint()
        == system.fingerprint()
        != rig.fingerprint()
    )
    assert "surface" in repr(system)
    assert tangent_system(system).guards == system.guards


def test_names_of_surfaces_dont_collide():
    twice = with_surface(with_surface(rig, "v"), "x")
    assert [guard.name for guard in twice.guards] == ["gap", "surface", "surface'"]


def test_a_level_is_a_parameter():
    system = with_level(rig, "x", "0.3 mm")
    assert system.values["surface_level"] == 0.3e-3
    assert system.units["surface_level"] == "m"
    assert system.with_values(surface_level="1 mm").fingerprint() == system.fingerprint()
    assert (system.guards[-1].state, to_text(system.guards[-1].boundary)) == ("x", "surface_level")
    assert with_level(system, "v", 0.1).values["surface_level_2"] == 0.1


def test_a_state_turns_where_its_rate_is_zero():
    assert to_text(turning_surfaces(rig, "x")[0].guards[-1].gap) == "v"
    assert turning_surfaces(rig, "v")[0].guards[-1].gap is rig.field[1]


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lambda: with_surface(rig, "y"), ParameterError, "no state 'y'"),
        (lambda: with_surface(rig, lambda t: t - 1), TraceError, "depends on time only"),
        (lambda: with_surface(rig, lambda gap: gap - 1), TraceError, "depends on parameters only"),
        (
            lambda: with_surface(rig, lambda t, x: x - sl.cos(t)),
            TraceError,
            "the boundary 'surface' doesn't repeat",
        ),
        (lambda: with_level(rig, "x", "0.3 s"), UnitError, "level of x"),
        (lambda: turning_surfaces(rig, "y"), ParameterError, "no state 'y'"),
    ],
)
def test_what_is_no_surface_is_refused(make, error, words):
    with pytest.raises(error, match=words):
        make()


# -- integrals -------------------------------------------------------------------------------------
def test_a_system_that_remembers_is_one_for_all_values():
    """So that no call of :func:`saltus.simulate` prints and loads its flow again."""
    ball = sl.models.bouncing_ball()
    once, other = remembering(ball), remembering(ball.with_values(restitution=0.7))
    assert remembering(ball) is once
    assert other.origin is once.origin
    assert other.values == {**ball.values, "restitution": 0.7}


def test_integrals_are_the_last_states():
    system = with_integrals(
        rig, {"work": lambda v, force: force * v, "path": lambda v: abs(v)}, {"work": "J"}
    )
    assert system.states == ("x", "v", "work", "path")
    assert system.field[:2] == rig.field
    assert to_text(system.field[2]) == "force*v"
    assert [guard.name for guard in system.guards] == ["gap", "v = 0"]
    assert system.units["work"] == "J"
    assert system.units["path"] == ""
    assert sl.System.from_dict(system.to_dict()).fingerprint() == system.fingerprint()


@pytest.mark.parametrize("name", ["x", "gap", "t", "my work"])
def test_the_name_of_an_integral_is_free_and_a_name(name):
    with pytest.raises(ParameterError, match="can't be called"):
        with_integrals(rig, {name: lambda v: v})
