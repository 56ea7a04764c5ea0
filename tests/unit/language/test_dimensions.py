"""Dimensions of equations. Truth: textbook equations are consistent, and inconsistent with any of
their parameters in another unit.
"""

import pytest

import saltus as sl
from saltus.errors import SaltusError, UnitError
from saltus.language.dimensions import DimensionCheck
from saltus.language.expression import walk

METRES = {"x": "m", "v": "m/s"}


def traced(function, **options):
    return sl.system(**{"states": "x v", "units": METRES, "name": "rig", **options})(function)


def checked(system, units):
    """Everything that the equations of a system hold, checked with other units."""
    check = DimensionCheck(system.states, units)
    for node in walk(*system.field, *(guard.gap for guard in system.guards)):
        check(node)
    check.check_rates(system.field)


@pytest.mark.parametrize("model", ["chain", "gear_pair", "aeroelastic"])
def test_each_parameter_of_a_model_has_its_unit_and_no_other(model):
    system = sl.models.find(model)()
    checked(system, system.units)
    for name in (*system.states, *system.values):
        other = "m/s" if system.units[name] not in ("m/s", "rad/s") else "kg"
        with pytest.raises(UnitError):
            checked(system, {**system.units, name: other})


def test_a_published_model_whose_numbers_have_units_passes():
    assert sl.models.delangre().units["force"] == "N"  # 1 - 18/w**2


def missing_mass(t, x, v, *, stiffness="3 N/m", damping="2 N*s/m", mass="2 kg"):
    return v, -stiffness * x - damping * v / mass


def no_mass(t, x, v, *, stiffness="3 N/m", force="3 N"):
    return v, force - stiffness * x


def stiffness_as_damping(t, x, v, *, stiffness="3 N/m", mass="2 kg"):
    return v, -stiffness * v / mass


def wrong_gap(t, x, v, *, stiffness="3 N/m", mass="2 kg", gap="2 mm/s"):
    return v, -sl.piecewise((stiffness * x / mass, x > gap), otherwise=0)


def wrong_piece(t, x, v, *, stiffness="3 N/m", mass="2 kg", gap="2 mm"):
    return v, -sl.piecewise((stiffness * x, x > gap), otherwise=gap) / mass


def no_frequency(t, x, v, *, shaking="3 m/s^2", frequency="2 Hz"):
    return v, shaking * sl.cos(2 * sl.pi * frequency) - x / t / t


def swapped_states(t, x, v):
    return x, v / t


def powered(t, x, v, *, rate="3 1/s^2", length="2 mm"):
    return v, -rate * x * 2**length


@pytest.mark.parametrize(
    ("function", "says"),
    [
        (missing_mass, r"line \d+: return v, -stiffness \* x - damping \* v / mass\): "
                       r"-stiffness\*x \[N\] and damping\*v/mass "
                       r"\[m/s\^2\] are added or compared, which needs one unit: a division by a "
                       r"mass is missing in the first\. "
                       r".*check_units=False"),
        (no_mass, r"line \d+\): dv/dt is a rate in m/s\^2, but force is in N: a division by a mass "
                  r"is missing\."),
        (stiffness_as_damping, r"dv/dt is a rate in m/s\^2, but -stiffness\*v/mass is in m/s\^3: "
                               r"they differ by a factor in s\."),
        (wrong_gap, r"x \[m\] and gap \[m/s\] are added or compared"),
        (wrong_piece, r"stiffness\*x \[N\] and gap \[m\] are pieces of one value"),
        (no_frequency, r"2\*pi\*frequency is in 1/s, but stands in cos\(2\*pi\*frequency\), which "
                       r"takes a plain number or an angle"),
        (swapped_states, r"dx/dt is a rate in m/s, but x is in m: they differ by a factor in s"),
        (powered, r"length\*0.69.* is in m, but stands in exp|length is in m, but stands as the "
                  r"exponent"),
    ],
)  # fmt: skip
def test_what_does_not_add_up_is_named(function, says):
    with pytest.raises(UnitError, match=says):
        traced(function)
    traced(function, check_units=False)


def hertz(
    t, x, v, *, contact="1e9 N/m^1.5", mass="2 kg", preload="2 N", gap="0.1 mm", gravity="1 g0",
    f="2 Hz", slip="1 mm/s", mu="0.3"
):  # fmt: skip
    depth = sl.max(x - gap, 0)
    drive = gravity * sl.sin(2 * sl.pi * f * t) * sl.exp(-t * f) * (1 - sl.sign(v) / 2)
    friction = mu * preload * (sl.tanh(v / slip) + sl.hypot(v, slip) / slip)
    return v, drive - (contact * depth**1.5 + preload + friction) / mass - sl.sqrt(v**2 / x**2) * v


def numbers(t, x, v):
    return v, -4000 * x - 0.3 * v - 9.81 + 2.5e3 * sl.max(x - 1e-3, 0) + 3.7 * sl.cos(94.2 * t)


def unknown(t, x, v, *, stiffness=3.0, gap="1 mm"):
    return v, -stiffness * (x - gap) - x * stiffness**2


@pytest.mark.parametrize("function", [hertz, numbers, unknown])
def test_what_adds_up_or_is_not_known_passes(function):
    traced(function)


@pytest.mark.parametrize("units", [{}, {"x": "1", "v": "1"}, {"x": "rad"}])
def test_a_system_of_plain_numbers_has_a_plain_time(units):
    assert traced(lambda t, x, v: (v, sl.cos(t) - x - v), units=units).states == ("x", "v")


def test_parameters_are_checked_where_states_have_no_unit():
    with pytest.raises(SaltusError, match=r"gap \[m\] and force \[N\] are added"):
        traced(lambda t, x, v, *, gap="1 mm", force="2 N": (v, -x * (gap + force)), units={})
