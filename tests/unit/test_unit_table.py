"""The table of units. Truth: another library's definitions (pint), which was written by others from
the same standards.
"""

import math
from decimal import Context, Decimal
from fractions import Fraction
from functools import cache

import pytest

from saltus.errors import UnitError
from saltus.unit_table import _LONG, _TABLE, COHERENT, Unit, _taken, read_unit

pytest.importorskip("pint")
#: What pint calls them, where its word is another or means something else there.
THEIRS = {
    "Nm": "newton*meter", "Ns": "newton*second", "Nms": "newton*meter*second",
    "Nmm": "newton*millimeter", "in": "inch", "mil": "thou",
    "t": "metric_ton", "tonne": "metric_ton", "tonnes": "metric_ton", "lb": "pound", "lbm": "pound",
    "g0": "standard_gravity",
    "g_0": "standard_gravity", "g_n": "standard_gravity", "Ω": "ohm", "Ohm": "ohm", "hr": "hour",
    "C": "coulomb", "L": "liter",
    "deg": "degree", "°": "degree", "rev": "turn", "turns": "turn", "revolution": "turn",
    "revolutions": "turn", "cycles": "cycle",
    "kgf": "force_kilogram", "kp": "force_kilogram", "kilogram_force": "force_kilogram",
    "pound_force": "force_pound", "kip": "kip",
    "min": "minute", "F": "farad", "H": "henry", "%": "percent", "knots": "knot",
    "degrees": "degree", "g": "gram", "psi": "psi",
    "pound_force_per_square_inch": "psi", "dyn": "dyne", "Hz": "turn/second", "h": "hour",
    "J": "joule", "K": "kelvin", "T": "tesla",
    "V": "volt", "W": "watt", "l": "liter", "N": "newton", "rad": "radian", "s": "second",
    "m": "meter", "A": "ampere",
}  # fmt: skip


@cache
def registry():
    """Their definitions, which take a second to read: not while tests are collected."""
    import pint

    return pint.UnitRegistry(non_int_type=Decimal)


@pytest.mark.parametrize("symbol", sorted(_TABLE))
def test_a_unit_is_what_another_library_says(symbol):
    ours = _TABLE[symbol][0]
    theirs = registry().Quantity(Decimal(1), THEIRS.get(symbol, symbol)).to_base_units()
    dimension = {str(name): Fraction(str(power)) for name, power in theirs.units._units.items()}
    names = {
        "m": "meter",
        "kg": "kilogram",
        "s": "second",
        "A": "ampere",
        "K": "kelvin",
        "rad": "radian",
    }
    assert {names[base]: power for base, power in ours.dimension.items()} == dimension
    value = float(ours.factor) * (2 * math.pi) ** float(ours.turns) * math.pi ** float(ours.pi)
    assert value == pytest.approx(float(theirs.magnitude), rel=1e-15)


def test_prefixes_are_powers_of_ten():
    for symbol, (unit, _) in _TABLE.items():
        for prefix in _taken(symbol):
            if prefix + symbol not in _TABLE:
                scale = (
                    registry()
                    .Quantity(Decimal(1), {"μ": "µ"}.get(prefix, prefix) + "meter")
                    .to("meter")
                    .magnitude
                )
                assert read_unit(prefix + symbol).factor == unit.factor.scaleb(
                    scale.adjusted(), Context(prec=60)
                )


def test_names_written_out_are_those_of_the_symbols():
    for word, symbol in _LONG.items():
        for given, short in ((word, symbol), (f"{word}s", symbol), (f"milli{word}", f"m{symbol}")):
            unit, other = read_unit(given), _TABLE[symbol][0]
            assert (unit.parts, unit.factor) == (
                other.parts,
                other.factor * (Decimal("1e-3") if given.startswith("milli") else 1),
            ), short
            assert not unit.doubtful


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("kg m2", {"kg": 1, "m": 2}),
        ("kg*m^2/s^2", {"kg": 1, "m": 2, "s": -2}),
        ("1/s", {"s": -1}),
        ("/s", {"s": -1}),
        ("N/m^1.5", {"N": 1, "m": Fraction(-3, 2)}),
        ("N/(m*s)", {"N": 1, "m": -1, "s": -1}),
        ("N/m*s", {"N": 1, "m": -1, "s": 1}),
        ("N/m/s", {"N": 1, "m": -1, "s": -1}),
        ("J/(kg K)", {"J": 1, "kg": -1, "K": -1}),
        ("(N*m)^2", {"N": 2, "m": 2}),
        ("m·s⁻¹", {"m": 1, "s": -1}),
        ("newton / meter ** 2", {"N": 1, "m": -2}),
        ("", {}),
    ],
)
def test_the_grammar(text, parts):
    assert dict(read_unit(text).parts) == parts


@pytest.mark.parametrize(
    "text",
    [
        "N//m",
        "N/",
        "(N",
        "N)",
        "N**",
        "m^0",
        "m^21",
        "m^1.23456",
        "2 m",
        "m 2",
        "N m/s kg",
        "m.s",
        "m^2^2",
        "µ",
        "k",
    ],
)
def test_what_the_grammar_refuses(text):
    with pytest.raises(UnitError):
        read_unit(text)


def test_every_coherent_unit_is_read_as_itself():
    for symbol in COHERENT:
        assert read_unit(symbol) == Unit(
            {symbol: Fraction(1)}, doubtful=(symbol,) if symbol in "CF" else ()
        )
