"""The System: values, checks, period, derived equations."""

import copy
import datetime
import decimal
import math
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from saltus.errors import ParameterError, SaltusError, UnitError
from saltus.language.evaluate import evaluate
from saltus.models import aeroelastic, chain, delangre, gear_pair
from saltus.system import System, system
from saltus.system.tangent import tangent_system

RIG = delangre()


def test_with_values_gives_a_copy_and_traces_nothing():
    stiff = RIG.with_values(contact_stiffness="70 kN/m", upper_gap=0.8e-3)
    assert (stiff.values["contact_stiffness"], stiff.values["upper_gap"]) == (70e3, 0.8e-3)
    assert RIG.values["contact_stiffness"] == 14e3
    assert stiff.field is RIG.field
    assert stiff.guards is RIG.guards
    assert stiff.fingerprint() == RIG.fingerprint()


def test_values_are_given_by_name():
    with pytest.raises(
        ParameterError,
        match=r"takes values by name, and \{'force': 3\} has none. "
        r"Write with_values\(mass=...\)",
    ):
        RIG.with_values({"force": 3})


some_values = st.dictionaries(st.sampled_from(sorted(RIG.values)), st.floats(1e-6, 1e6))


@given(values=some_values, later=some_values)
def test_later_values_win_and_order_does_not_matter(values, later):
    changed = RIG.with_values(**values).with_values(**later)
    assert dict(changed.values) == {**RIG.values, **values, **later}
    assert list(changed.values) == list(RIG.values)


def test_nothing_can_be_changed_in_place():
    for change in (
        lambda: RIG.values.__setitem__("mass", 2.0),
        lambda: RIG.values.pop("mass"),
        lambda: RIG.values.update(mass=2.0),
        lambda: RIG.values.setdefault("mass", 2.0),
        lambda: RIG.values.__delitem__("mass"),
    ):
        with pytest.raises(ParameterError, match=r"with_values\(mass=\.\.\.\)"):
            change()
    for change in (RIG.values.clear, RIG.values.popitem, lambda: RIG.values.__ior__({})):
        with pytest.raises(ParameterError, match="never changed"):
            change()
    with pytest.raises(ParameterError, match=r"@sl\.system\(units="):
        RIG.units["x"] = "mm"
    own = copy.deepcopy(RIG.values)
    own["mass"] = 2.0  # a copy is one's own
    assert own != RIG.values
    with pytest.raises(ParameterError, match="with_values"):
        RIG.name = "other"


@pytest.mark.parametrize(
    ("values", "error", "teaches"),
    [
        (
            {"contact_stifness": 1.0},
            ParameterError,
            "no parameter 'contact_stifness'. Did you mean 'contact_stiffness'",
        ),
        ({"zzz": 1.0}, ParameterError, "Known: mass, "),
        ({"mass": 0.0}, ParameterError, "mass = 0 must be positive"),
        ({"mass": "-3 kg"}, ParameterError, "mass = -3 must be positive"),
        (
            {"upper_gap": "-0.1 mm"},
            ParameterError,
            "lower_gap = 0, upper_gap = -0.0001 the contacts at .* overlap",
        ),
        ({"frequency": 0.0}, ParameterError, "it is the forcing frequency"),
        ({"frequency": "-1 Hz"}, ParameterError, "it is the forcing frequency"),
        ({"force": math.nan}, ParameterError, "force = nan is not a finite number"),
        ({"force": math.inf}, ParameterError, "not a finite number"),
        ({"force": "4 N/m"}, UnitError, "measured in N"),
        ({"force": "4"}, UnitError, "no unit"),
        ({"force": [1.0, 2.0]}, ParameterError, "a system holds one"),
    ],
)
def test_errors_teach(values, error, teaches):
    with pytest.raises(error, match=teaches):
        RIG.with_values(**values)


@pytest.mark.parametrize(
    ("call", "teaches"),
    [
        (
            lambda: RIG["upper_gap"],
            r"no items: delangre\.values\['upper_gap'\] is .* "
            r"delangre\.with_values\(upper_gap=\.\.\.\)",
        ),
        (lambda: RIG.upper_gap, r"no attribute 'upper_gap': delangre\.values\['upper_gap'\]"),
        (
            lambda: RIG["x"],
            r"'x' is a state\. Its motion is sl\.simulate\(delangre, "
            r"\.\.\.\)\['x'\]",
        ),
        (lambda: RIG["uper_gap"], "Did you mean 'upper_gap'"),
        (lambda: RIG[0], r"parameters are in delangre\.values"),
        (lambda: list(RIG), r"parameters are in delangre\.values"),
        (lambda: "x" in RIG, r"parameters are in delangre\.values"),
        (
            lambda: RIG.__setitem__("upper_gap", 1),
            r"never changed: "
            r".*delangre\.with_values\(upper_gap=\.\.\.\)",
        ),
    ],
)
def test_a_system_taken_for_a_table_says_what_to_write(call, teaches):
    with pytest.raises((ParameterError, AttributeError), match=teaches):
        call()
    assert not hasattr(RIG, "upper_gap")


def test_resolve_takes_one_or_many():
    assert RIG.resolve("frequency", "900 rpm") == 15.0
    assert type(RIG.resolve("frequency", 3)) is float
    many = RIG.resolve("frequency", ["900 rpm", 16, "94.2 rad/s"])
    assert many.dtype == np.float64
    assert many == pytest.approx([15, 16, 94.2 / (2 * math.pi)], rel=1e-15)
    grid = np.linspace(1, 30, 7)
    resolved = RIG.resolve("frequency", grid)
    assert np.array_equal(resolved, grid)
    assert resolved is not grid
    with pytest.raises(ParameterError, match=r"mass = -1 \(entry 1 of 3\) must be positive"):
        RIG.resolve("mass", np.array([1.0, -1.0, -2.0]))
    with pytest.raises(ParameterError, match=r"entry 0 of 1\) is not a finite"):
        RIG.resolve("force", np.array([math.nan]))


def test_period():
    assert RIG.period() == 1 / 15
    assert RIG.period({"frequency": 20.0}) == 0.05
    assert np.array_equal(RIG.period({"frequency": np.array([1.0, 2.0])}), [1.0, 0.5])
    assert RIG.period({"force": 1.0}) == 1 / 15
    assert aeroelastic().period() is None
    for frequency in ({}, "9 Hz", None, [], 0):
        with pytest.raises(
            ParameterError,
            match=r"frequency must be a positive number or an array "
            r"of them, not .+\.$",
        ):
            RIG.period({"frequency": frequency})


@pytest.mark.parametrize(
    "value",
    [{}, set(), b"3 N", np.zeros((2, 2)), np.array([None]), np.ma.masked_array([1.0], [True]),
        np.datetime64("2020"), datetime.timedelta(1),
     decimal.Decimal("sNaN"), 1j, RIG, lambda: 3, np.array(["3 N"] * 2)],
    ids=lambda value: type(value).__name__,
)  # fmt: skip
def test_what_is_no_value_is_refused_on_one_line(value):
    """Whatever it is, and however its text looks."""
    data = RIG.to_dict()
    calls = [
        lambda: RIG.with_values(force=value), lambda: RIG.with_values(value),
        lambda: System.from_dict({**data, "name": value}),
        lambda: System.from_dict({**data, "field": [value]}),
        lambda: System.from_dict({**data, "nodes": [[value, [], 1.0]]}),
        lambda: system(states="x", name=value), lambda: system(states="x", check_units=value),
        lambda: system(states="x")(value),
    ]  # fmt: skip
    for call in calls:
        with pytest.raises(SaltusError) as caught:
            call()
        assert "\n" not in str(caught.value)
        assert len(str(caught.value)) < 700


def test_units_and_texts():
    assert RIG.state_unit("v") == "m/s"
    assert RIG.parameter_text("contact_stiffness") == "14 kN/m"
    with pytest.raises(ParameterError, match="no state 'y'"):
        RIG.state_unit("y")
    with pytest.raises(ParameterError, match="no parameter"):
        RIG.parameter_text("y")


@pytest.mark.parametrize(
    "made", [delangre("c"), chain(), gear_pair(), aeroelastic()], ids=lambda made: made.name
)
def test_jacobian_and_gradients_against_differences(made):
    random = np.random.default_rng(3)
    y = random.uniform(-3e-3, 3e-3, len(made.states))
    bits = list(random.random(len(made.guards)) < 0.5)
    expressions = [*made.field, *(guard.gap for guard in made.guards)]
    derived = np.array(
        [
            evaluate(
                row,
                t=0.01,
                states=dict(zip(made.states, y, strict=True)),
                values=made.values,
                bits=bits,
            )
            for row in (*made.jacobian, *made.guard_gradients)
        ]
    )
    for column in range(len(y)):
        ends = []
        for sign in (-1, 1):
            moved = y.copy()
            moved[column] += sign * 1e-6
            states = dict(zip(made.states, moved, strict=True))
            ends.append(
                np.array(
                    evaluate(expressions, t=0.01, states=states, values=made.values, bits=bits)
                )
            )
        scale = np.abs(derived).max()
        assert (ends[1] - ends[0]) / 2e-6 == pytest.approx(
            derived[:, column], rel=1e-5, abs=1e-8 * scale
        )


def test_derived_equations_are_computed_once():
    assert RIG.jacobian is RIG.jacobian
    assert RIG.guard_gradients is RIG.guard_gradients


def test_copies_share_what_follows_from_the_equations(monkeypatch):
    from saltus.system import display

    other = RIG.with_values(force="5 N").with_values(upper_gap="1 mm")
    assert other.origin is RIG.origin
    assert RIG.with_values() is RIG
    assert other.equations() == RIG.equations()
    monkeypatch.setattr(display, "equation_lines", lambda _: pytest.fail("written again"))
    lines = other.equations()
    lines.clear()  # a list of the caller's own
    assert other.with_values(force=1.0).equations() == RIG.equations()


def test_copies_share_their_tangent_system():
    """Of two systems that are no copies of one another the flow is compiled, or
    looked up, twice.
    """
    other = RIG.with_values(force="5 N")
    assert tangent_system(other).origin is tangent_system(RIG).origin
    assert (tangent_system(other).values, tangent_system(RIG).values) == (other.values, RIG.values)
    assert tangent_system(other) is tangent_system(other)


def test_importing_the_layer_is_light():
    code = (
        "import sys, saltus.system, saltus.models; print([m for m in ('sympy', 'llvmlite', "
        "'scipy', 'xarray') if m in sys.modules])"
    )
    assert (
        subprocess.run(
            [sys.executable, "-c", code], check=True, capture_output=True, text=True
        ).stdout.strip()
        == "[]"
    )


def test_the_right_hand_side_is_a_plain_function():
    rig = delangre("b", force="4 N", frequency="7 Hz")
    t, y = 0.123, np.array([[-1e-4, 2e-4, 1e-3], [0.1, -0.2, 0.3]])
    wn, w, (x, v) = 2 * np.pi * 5.0, 2 * np.pi * 7.0, y
    stop = np.where(x < 0, x, np.where(x > 0.4e-3, x - 0.4e-3, 0.0))
    rate = (
        -2 * 0.03 * wn * v
        - wn**2 * x
        - 7e8 / 3 * x**3
        - 1.4e4 / 3 * stop
        + 4 * (1 - 18 / w**2) * np.cos(w * t) / 3
    )
    np.testing.assert_allclose(rig.rhs(t, y), [v, rate], rtol=1e-14)
    np.testing.assert_allclose(rig.rhs(t, y[:, 2]), [v[2], rate[2]], rtol=1e-14)
    with pytest.raises(ParameterError, match="delangre has the states x, v, but y holds 3 of them"):
        rig.rhs(t, (1.0, 2.0, 3.0))
