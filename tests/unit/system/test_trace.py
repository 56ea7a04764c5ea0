"""Tracing: what a System is made from, and what the errors say."""

import math
import subprocess
import sys

import numpy as np
import pytest

from saltus.contact import freeplay
from saltus.errors import ParameterError, SaltusError, TraceError, UnitError
from saltus.language import cos, pi, piecewise, sin
from saltus.language.text import to_text
from saltus.system import system

# equations that use some of their parameters only
pytestmark = pytest.mark.filterwarnings("ignore::saltus.errors.UnusedParameterWarning")


def test_many_states_come_together():
    def row(t, *y, spring=4.0):
        return [*y[2:], *(-spring * x for x in y[:2])]

    def written_out(t, a, b, c, d, *, spring=4.0):
        return c, d, -spring * a, -spring * b

    together, apart = (
        system(states="a b c d", name="row")(function) for function in (row, written_out)
    )
    assert together.equations() == apart.equations()
    assert together.states == ("a", "b", "c", "d")


def make(function, **options):
    return system(**{"states": "x v", **options})(function)


def oscillator(t, x, v, *, stiffness=4.0, gap=0.1, force=1.0, frequency=2.0):
    """A block behind a gap.

    More about it.
    """
    return v, force * cos(2 * pi * frequency * t) - piecewise(
        (stiffness * (x - gap), x > gap), otherwise=0
    )


def test_what_a_system_is_made_from():
    made = make(oscillator, forced_at="frequency", source="a paper")
    assert made.name == "oscillator"
    assert made.states == ("x", "v")
    assert dict(made.values) == {"stiffness": 4.0, "gap": 0.1, "force": 1.0, "frequency": 2.0}
    assert dict(made.units) == {
        "x": "",
        "v": "",
        "stiffness": "",
        "gap": "",
        "force": "",
        "frequency": "Hz",
    }
    assert (made.forced_at, made.source) == ("frequency", "a paper")
    assert made.description == "A block behind a gap.\n\nMore about it."
    assert [to_text(entry) for entry in made.field] == [
        "v", "force*cos(2*pi*frequency*t) - piecewise((stiffness*(x - gap), guard0 > 0), "
             "otherwise=0)",
    ]  # fmt: skip
    assert [guard.name for guard in made.guards] == ["gap"]


def test_it_is_called_twice_and_not_for_other_values():
    calls = []

    def counted(t, x, v, *, stiffness=4.0):
        calls.append(stiffness)
        return v, -stiffness * x

    made = make(counted)
    made.with_values(stiffness=5.0)
    assert len(calls) == 2
    assert {call.op for call in calls} == {"param"}


def test_states_as_a_list_and_one_state():
    assert make(lambda t, x, v: (v, -x), states=["x", "v"]).states == ("x", "v")
    assert make(lambda t, x, v: (v, -x), states="x, v").states == ("x", "v")
    one = make(lambda t, x, *, rate=2.0: -rate * x, states="x")
    assert len(one.field) == 1
    assert make(lambda t, x, v: np.array([v, -x])).field == make(lambda t, x, v: (v, -x)).field
    assert make(lambda t, x: 1.0, states="x").field[0].payload == 1.0
    assert make(lambda t, x=0.1, v=0.0: (v, -x)).values == {}


def test_defaults_with_units():
    def rig(
        t,
        x,
        v,
        *,
        mass="3 kg",
        gap="0.4 mm",
        stiffness="14 kN/m",
        frequency="900 rpm",
        own="2 Hz",
        angle="90 deg",
    ):
        return v, -stiffness * x / mass * cos(2 * pi * frequency * t) + 0 * own - v * angle / gap

    made = make(rig, forced_at="frequency", units={"x": "m"})
    assert dict(made.values) == {
        "mass": 3.0,
        "gap": 4e-4,
        "stiffness": 14e3,
        "frequency": 15.0,
        "own": 2.0,
        "angle": math.pi / 2,
    }
    assert dict(made.units) == {
        "x": "m", "v": "", "mass": "kg", "gap": "m", "stiffness": "N/m", "frequency": "Hz",
        "own": "Hz", "angle": "rad",
    }  # fmt: skip
    declared = make(rig, forced_at="frequency", units={"frequency": "Hz", "own": "rad/s"})
    assert declared.values["own"] == pytest.approx(4 * math.pi, rel=1e-15)


def test_a_default_in_rad_per_second_says_that_the_forcing_is_counted_so():
    def rig(t, x, v, *, force=1.0, omega="10 rad/s"):
        return v, force * cos(omega * t) - x

    made = make(rig, forced_at="omega")
    assert (made.units["omega"], made.values["omega"]) == ("rad/s", 10.0)
    assert made.period() == pytest.approx(2 * math.pi / 10, rel=1e-15)

    def turning(t, x, v, *, force=1.0, speed="900 rpm"):
        return v, force * cos(2 * pi * speed * t) - x

    assert make(turning, forced_at="speed").units["speed"] == "Hz"


@pytest.mark.parametrize(
    "law", [lambda x: freeplay(x, 4.0, 0.1), lambda x: freeplay(x, k=4.0, gap=0.1)]
)
def test_a_law_called_otherwise_is_answered_by_how_it_is_called(law):
    with pytest.raises(
        TraceError,
        match=r"sl\.freeplay\(\) .*Write sl\.freeplay\(x, "
        r"stiffness=\.\.\., gap=\.\.\.\)",
    ) as caught:
        make(lambda t, x, v: (v, -law(x)))
    assert "np.interp" not in str(caught.value)


def test_a_forcing_frequency_in_rad_per_second():
    def rig(t, x, v, *, omega=10.0):
        return v, cos(omega * t)

    made = make(rig, forced_at="omega", units={"omega": "rad/s"})
    assert made.period() == pytest.approx(2 * math.pi / 10, rel=1e-15)
    assert made.with_values(omega="900 rpm").period() == pytest.approx(1 / 15, rel=1e-15)


SIGNATURES = [
    (lambda x, v: (v, x), "the time is the first argument"),
    (lambda t, x: x, r"the function takes \(t, x\)"),
    (lambda t, v, x: (v, x), r"the function takes \(t, v, x\)"),
    (lambda t, x, v, k=1.0: (v, x), r"put a \* between"),
    (lambda t, x, v, *args: (v, x), "name every parameter"),
    (lambda t, x, v, **kwargs: (v, x), "name every parameter"),
    (lambda t, x, v, *, k: (v, k * x), "'k' has no default"),
]


@pytest.mark.parametrize(("function", "teaches"), SIGNATURES)
def test_signatures(function, teaches):
    with pytest.raises(TraceError, match=teaches):
        make(function)


@pytest.mark.parametrize(
    ("states", "teaches"),
    [("", "names no state"), ("x x", "twice"), ("x 2v", "'2v' can't be"), ("x-v", "can't be")],
)
def test_names_of_states(states, teaches):
    with pytest.raises(TraceError, match=teaches):
        make(lambda t, x, v: (v, x), states=states)


@pytest.mark.parametrize(
    ("word", "teaches"),
    [("forcing", 'Write forced_at=.*forced_at="frequency"'), ("unit", "Did you mean 'units'")],
)
def test_an_option_that_is_not_there_is_answered_by_one_that_is(word, teaches):
    with pytest.raises(TraceError, match=teaches):
        system(states="x v", **{word: "f"})


def test_the_decorator_needs_its_states():
    with pytest.raises(TraceError, match=r'@sl.system\(states="x v"\)'):
        system(states=lambda t, x, v: (v, x))


@pytest.mark.parametrize(
    "first", ["import saltus.models", "from saltus.system import System", "sl.system", "pass"]
)
def test_the_public_name_is_the_decorator_whatever_was_imported_before(first):
    code = (
        f"import saltus as sl\n{first}\n@sl.system(states='x')\ndef rig(t, x):\n    return "
        f"-x\nassert isinstance(rig, sl.System)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize(
    ("options", "error", "teaches"),
    [
        ({"units": {"mas": "kg"}}, ParameterError, "Did you mean 'mass'"),
        ({"units": {"mass": "g"}}, UnitError, "'g', which isn't a coherent SI unit"),
        ({"forced_at": "frequenzy"}, ParameterError, "Did you mean 'frequency'"),
        ({"forced_at": "frequency", "units": {"frequency": "s"}}, UnitError, "in 'Hz' or 'rad/s'"),
    ],
)
def test_options(options, error, teaches):
    with pytest.raises(error, match=teaches):
        make(lambda t, x, v, *, mass=1.0, frequency=1.0: (v, -x / mass), **options)


@pytest.mark.parametrize(
    ("defaults", "error", "teaches"),
    [
        ({"mass": 0.0}, ParameterError, "mass = 0 must be positive"),
        ({"mass": "3 s"}, UnitError, "measured in kg"),
        ({"gap": math.nan}, ParameterError, "finite"),
        ({"gap": None}, ParameterError, "not a number"),
        ({"gap": [1.0]}, ParameterError, "gap"),
    ],
)
def test_defaults(defaults, error, teaches):
    def rig(t, x, v, *, mass=1.0, gap=0.1):
        return v, -x / mass - gap

    rig.__kwdefaults__ = {"mass": 1.0, "gap": 0.1, **defaults}
    with pytest.raises(error, match=teaches):
        make(rig, units={"mass": "kg"})


def branching(t, x, v, *, gap=0.1):
    if x > gap:
        return v, -x
    return v, 0.0


def numpy_call(t, x, v):
    return v, -np.floor(x)


def math_call(t, x, v):
    return v, -math.cos(x)


def mpmath_call(t, x, v):
    import mpmath

    return v, -mpmath.cos(x)


def unknown_name(t, x, v):
    return v, -stiffness * x  # noqa: F821


def modulo(t, x, v):
    return v, x % 1


def too_few(t, x, v):
    return (v,)


def nothing(t, x, v):
    pass


def text(t, x, v):
    return "v", "x"


def an_object(t, x, v):
    return object()


def a_dict(t, x, v):
    return {"x": v, "v": object()}


def chained(t, x, v):
    return v, piecewise((x, 0 < x < 1), otherwise=0)


def of_time(t, x, v):
    return v, piecewise((1, sin(t * t) > 0), otherwise=0)


def of_parameters(t, x, v, *, a=1.0, b=2.0):
    return v, piecewise((x, a > b), otherwise=0)


@pytest.mark.parametrize(
    ("function", "line", "teaches"),
    [
        (branching, "if x > gap:", "sl.piecewise"),
        (numpy_call, "return v, -np.floor", "np.floor on a traced value.*sl.mod"),
        (math_call, "return v, -math.cos", "sl.cos"),
        (mpmath_call, "return v, -mpmath.cos", "sl.cos"),
        (unknown_name, "return v, -stiffness", "'stiffness' is no state, no parameter"),
        (modulo, "return v, x % 1", "sl.mod of x"),
        (chained, "return v, piecewise", "a < x < b"),
        (too_few, "", "returns 1 value, but there are 2 states"),
        (nothing, "", "returns nothing. End it with: return dx/dt, dv/dt"),
        (an_object, "", "in place of the time derivatives of x, v"),
        (text, "", "the text 'v'"),
        (a_dict, "", "in the order of the states"),
        (of_time, "", "depends on time only"),
        (of_parameters, "", "depends on parameters only"),
    ],
)
def test_errors_name_the_line_and_teach(function, line, teaches):
    with pytest.raises(TraceError, match=teaches) as caught:
        make(function)
    message = str(caught.value)
    assert message.startswith(f"{function.__name__} ({__file__}, line ")
    assert line in message
    number = int(message.partition("line ")[2].partition(")")[0].partition(":")[0])
    first = function.__code__.co_firstlineno
    assert first <= number <= first + 4
    assert caught.value.__cause__ is not None


def test_an_error_in_a_helper_names_the_helper():
    def helper(x):
        return x if x > 0 else 0

    with pytest.raises(TraceError, match="return x if x > 0 else 0"):
        make(lambda t, x, v: (v, helper(x)))


class TestPeriodicity:
    """A forced system repeats after the period that forced_at sets."""

    @staticmethod
    def forced(law, **options):
        def rig(t, x, v, *, amplitude=1e-3, stiffness=1e10, frequency=15.0, other=30.0):
            return v, law(t, x, amplitude, frequency, other) - stiffness * x - freeplay(
                x, stiffness=stiffness, gap=0.1
            )

        return make(rig, **{"forced_at": "frequency", **options})

    def test_the_forgotten_two_pi(self):
        with pytest.raises(
            TraceError,
            match=r"dv/dt doesn't repeat.*T = 0.0666667 "
            r"s.*cos\(2\*pi\*frequency\*t\)",
        ):
            self.forced(lambda t, x, a, f, g: a * cos(f * t))
        with pytest.raises(
            TraceError,
            match=r"as cos\(frequency\*t\), or as "
            r"cos\(2\*pi\*frequency\*t\) with units={\"frequency\": "
            r"\"Hz\"}",
        ):
            self.forced(lambda t, x, a, f, g: a * cos(2 * pi * f * t), units={"frequency": "rad/s"})

    def test_revolutions_per_minute_are_hertz_unless_said_otherwise(self):
        def rotor(t, x, v, *, speed="1200 rpm"):
            return v, cos(speed * t) - x

        with pytest.raises(
            TraceError,
            match=r"as cos\(2\*pi\*speed\*t\), or as cos\(speed\*t\) "
            r"with units={\"speed\": \"rad/s\"}",
        ):
            make(rotor, forced_at="speed")
        assert make(rotor, forced_at="speed", units={"speed": "rad/s"}).period() == pytest.approx(
            0.05, rel=1e-15
        )

    def test_a_ramp(self):
        with pytest.raises(TraceError, match="leave forced_at= out"):
            self.forced(lambda t, x, a, f, g: a * cos(2 * pi * f * t) * t)

        with pytest.raises(TraceError, match="leave forced_at= out"):
            self.forced(lambda t, x, a, f, g: a * t)

    def test_a_weak_drive_beside_a_strong_preload(self):
        with pytest.raises(TraceError, match="doesn't repeat"):
            self.forced(lambda t, x, a, f, g: 1e10 + a * cos(f * t))

    def test_a_second_frequency_must_be_a_multiple(self):
        made = self.forced(lambda t, x, a, f, g: a * cos(2 * pi * f * t) + a * cos(2 * pi * g * t))
        with pytest.raises(TraceError, match="multiple"):
            made.with_values(other=31.0)

    def test_a_boundary_that_moves(self):
        def moving(t, x, a, f, g):
            return piecewise((x - a * sin(g * t), x > a * sin(g * t)), otherwise=0)

        with pytest.raises(TraceError, match="doesn't repeat"):
            self.forced(moving)
        assert len(self.forced(lambda t, x, a, f, g: moving(t, x, a, f, 2 * pi * f)).guards) == 3

    def test_phases_and_harmonics_pass(self):
        assert (
            self.forced(
                lambda t, x, a, f, g: a * cos(2 * pi * f * t + x) ** 3 + a * sin(200 * pi * f * t)
            ).period()
            == 1 / 15
        )
        assert self.forced(lambda t, x, a, f, g: 0.0).period() == 1 / 15
        assert self.forced(lambda t, x, a, f, g: a * cos(f * t), forced_at=None).period() is None


@pytest.mark.parametrize(
    ("default", "teaches"),
    [
        ("2 g", "'2 g0' for gravity .* or '2 gram'"),
        ("2 mil", "a length or an angle"),
        ("4 N!", "'!' can't stand in a unit"),
        ("3 dB", "logarithmic"),
    ],
)
def test_a_default_whose_unit_has_several_meanings_or_none_is_refused(default, teaches):
    with pytest.raises(UnitError, match=f"shaking = {default!r}.*{teaches}"):

        @system(states="x")
        def shaken(t, x, *, shaking=default):
            return shaking - x


def test_defaults_in_torques_and_half_powers_are_read():
    @system(states="x")
    def geared(t, x, *, torque="2.82 Nm", twist="40 kNm/rad", hertz="1e9 N/m^1.5"):
        return torque * x + twist * x + hertz * x

    assert dict(geared.values) == {"torque": 2.82, "twist": 4e4, "hertz": 1e9}
    assert [geared.units[name] for name in geared.values] == ["N*m", "N*m/rad", "N/m^1.5"]


def test_letters_that_only_look_alike_are_told():
    """The micro sign of keyboards; Python reads it as the Greek letter in the names of arguments,
    not in texts.
    """

    def block(t, x, v, *, µ=0.3):
        return v, -x - µ * v

    with pytest.raises(
        SaltusError,
        match=r"Write 'μ' \('\\u03bc'\), which is how Python reads 'µ' "
        r"\('\\xb5'\) in the function",
    ):
        system(states="x v", units={"\u00b5": "1"})(block)
    traced = system(states="x v", units={"\u03bc": "1"})(block)
    with pytest.raises(SaltusError, match="they only appear alike"):
        traced.resolve("\u00b5", 0.5)
    assert traced.resolve("\u03bc", 0.5) == 0.5


def test_a_name_that_turns_the_direction_of_text_is_refused():
    with pytest.raises(SaltusError, match="without control characters"):
        system(states="x", name="\u202egir")(lambda t, x, *, k=1.0: -k * x)
