"""The units that saltus reads: a short table, and the grammar by which they are combined.

A unit that isn't in the table is refused; none is guessed. The vocabulary of a general library is
too large for that: in one of them ``Nm`` is a measure of yarn and ``mil`` an angle. Symbols that
mean different things to different people (``g``, ``lb``, ``mil``) are marked :attr:`Unit.doubtful`.

Factors are decimals of 60 digits. Powers of pi are counted separately, so that 900 rpm are 15 Hz
exactly.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from decimal import Context, Decimal
from fractions import Fraction

from saltus.errors import UnitError

#: Symbols that a declared unit may be made of, the coherent SI units, each with its exponents of m,
#: kg, s, A, K and rad. A hertz is one turn a second: the turn is counted apart, see
#: :attr:`Unit.turns`.
COHERENT: dict[str, dict[str, int]] = {
    "m": {"m": 1}, "kg": {"kg": 1}, "s": {"s": 1}, "rad": {"rad": 1}, "Hz": {"s": -1, "rad": 1},
    "N": {"kg": 1, "m": 1, "s": -2},
    "Pa": {"kg": 1, "m": -1, "s": -2}, "J": {"kg": 1, "m": 2, "s": -2},
    "W": {"kg": 1, "m": 2, "s": -3}, "K": {"K": 1}, "A": {"A": 1},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1}, "C": {"A": 1, "s": 1},
    "F": {"kg": -1, "m": -2, "s": 4, "A": 2},
    "H": {"kg": 1, "m": 2, "s": -2, "A": -2}, "T": {"kg": 1, "s": -2, "A": -1},
    "Wb": {"kg": 1, "m": 2, "s": -2, "A": -1},
    "ohm": {"kg": 1, "m": 2, "s": -3, "A": -2},
}  # fmt: skip

_WIDE = Context(prec=60, Emin=-999_999, Emax=999_999)
_PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494459")
#: The largest exponent that a unit may carry.
_MOST = 20


@dataclass(frozen=True)
class Unit:
    """A unit that was read.

    Attributes
    ----------
    parts : mapping of str to Fraction
        Exponents of the coherent units that it is a multiple of: lbf/in is {"N": 1, "m": -1}.
    factor : Decimal
        That multiple, apart from powers of pi.
    pi : Fraction
        The power of pi in it.
    doubtful : tuple of str
        Symbols in it that have more than one meaning, as written.
    """

    parts: Mapping[str, Fraction] = field(default_factory=dict)
    factor: Decimal = Decimal(1)
    pi: Fraction = Fraction(0)
    doubtful: tuple[str, ...] = ()

    @property
    def dimension(self) -> dict[str, Fraction]:
        """Exponents of m, kg, s, A, K and rad; those that are zero are left out."""
        total: dict[str, Fraction] = {}
        for symbol, exponent in self.parts.items():
            for base, power in COHERENT[symbol].items():
                total[base] = total.get(base, Fraction(0)) + power * exponent
        return {base: exponent for base, exponent in total.items() if exponent}

    @property
    def turns(self) -> Fraction:
        """Number of its radians that are rotations: the exponent of Hz."""
        return self.parts.get("Hz", Fraction(0))

    def convert(self, number: Decimal, other: Unit) -> Decimal:
        """So many of this unit in another, of the same dimension but for the angle; a turn is 2 pi
        rad.
        """
        turns = self.turns - other.turns
        factor = _WIDE.divide(self.factor, other.factor)
        factor = _WIDE.multiply(factor, _power(Decimal(2), turns))
        return _WIDE.multiply(
            _WIDE.multiply(number, factor), _power(_PI, self.pi - other.pi + turns)
        )

    def times(self, other: Unit, exponent: Fraction = Fraction(1)) -> Unit:
        """Its product with a power of another."""
        parts = dict(self.parts)
        for symbol, power in other.parts.items():
            parts[symbol] = parts.get(symbol, Fraction(0)) + power * exponent
        return Unit(
            {symbol: power for symbol, power in parts.items() if power},
            _WIDE.multiply(self.factor, _power(other.factor, exponent)),
            self.pi + other.pi * exponent,
            self.doubtful + other.doubtful,
        )


def _power(base: Decimal, exponent: Fraction) -> Decimal:
    return _WIDE.power(
        base, _WIDE.divide(Decimal(exponent.numerator), Decimal(exponent.denominator))
    )


# -- the table -------------------------------------------------------------------------------------
_SMALL, _LARGE = "fpnuµμmcd", "hkMGT"
_PREFIXES = dict(
    zip("fpnuµμmcdhkMGT", (-15, -12, -9, -6, -6, -6, -3, -2, -1, 2, 3, 6, 9, 12), strict=True)
) | {"da": 1}
_LONG_PREFIXES = {
    "nano": -9,
    "micro": -6,
    "milli": -3,
    "centi": -2,
    "deci": -1,
    "kilo": 3,
    "mega": 6,
    "giga": 9,
}


def _entries() -> dict[str, tuple[Unit, str]]:
    """Symbol: its unit, and the prefixes it takes."""
    usual = "pnuµμmkMG"
    table: dict[str, tuple[Unit, str]] = {}

    def add(symbols: str, factor: str, parts: str, prefixes: str = "", pi: int = 0) -> None:
        powers = {}
        for part in parts.split():
            symbol, _, power = part.partition("^")
            powers[symbol] = Fraction(power or 1)
        top, _, bottom = factor.partition("/")
        for symbol in symbols.split():
            table[symbol] = (
                Unit(powers, _WIDE.divide(Decimal(top), Decimal(bottom or 1)), Fraction(pi)),
                prefixes,
            )

    for symbol in ("Hz", "N", "Pa", "J", "W", "V", "A", "K", "C", "F", "H", "T", "Wb", "ohm"):
        add(symbol, "1", symbol, usual)
    table["N"] = table["N"][0], usual + "da"
    table["Pa"] = table["Pa"][0], usual + "h"
    add("m", "1", "m", "fpnuµμmcdk")
    add("s", "1", "s", "fpnuµμm")
    add("g", "1e-3", "kg", "uµμmk")
    add("rad", "1", "rad", "uµμm")
    add("Ω Ohm", "1", "ohm", usual)
    add("Nm", "1", "N m", usual)  # a torque
    add("Ns", "1", "N s", usual)
    add("Nms", "1", "N m s", usual)
    add("Nmm", "1e-3", "N m", "k")
    # lengths, areas, volumes, masses
    add("in inch inches", "0.0254", "m")
    add("ft foot feet", "0.3048", "m")
    add("yd yard yards", "0.9144", "m")
    add("mile miles", "1609.344", "m")
    add("mil thou", "25.4e-6", "m")
    add("micron microns", "1e-6", "m")
    add("l L", "1e-3", "m^3", "uµμmcd")
    add("t tonne tonnes metric_ton", "1000", "kg")
    add("lb lbm pound pounds", "0.45359237", "kg")
    add("slug", "14.593902937206364829396325459317585301837270341207", "kg")
    # times, angles, speeds
    add("min minute minutes", "60", "s")
    add("h hr hour hours", "3600", "s")
    add("day days", "86400", "s")
    add("deg degree degrees °", "1/180", "rad", pi=1)
    add("arcmin", "1/10800", "rad", pi=1)
    add("arcsec", "1/648000", "rad", pi=1)
    add("turn turns rev revolution revolutions cycle cycles", "2", "rad", pi=1)
    add("rpm revolutions_per_minute", "2/60", "rad s^-1", pi=1)
    add("mph", "0.44704", "m s^-1")
    add("knot knots", "1852/3600", "m s^-1")
    add("g0 g_0 g_n standard_gravity", "9.80665", "m s^-2")
    # forces and pressures
    add("lbf force_pound pound_force", "4.4482216152605", "N")
    add("kip", "4448.2216152605", "N")
    add("kgf kp kilogram_force", "9.80665", "N")
    add("dyn", "1e-5", "N")
    add("bar", "1e5", "Pa", "m")
    add("atm", "101325", "Pa")
    add(
        "psi pound_force_per_square_inch",
        "6894.757293168361336722673445346890693781387562775",
        "Pa",
        "k",
    )
    add("% percent", "0.01", "")
    return table


_TABLE = _entries()
_LONG = {
    "meter": "m", "metre": "m", "gram": "g", "second": "s", "radian": "rad", "hertz": "Hz",
    "newton": "N", "pascal": "Pa", "joule": "J",
    "watt": "W", "kelvin": "K", "ampere": "A", "volt": "V", "coulomb": "C", "farad": "F",
    "henry": "H", "tesla": "T", "weber": "Wb",
    "liter": "l", "litre": "l",
}  # fmt: skip

#: Symbols with more than one meaning, as written, and what to write instead; {0} stands for the
#: number.
DOUBTFUL = {
    "g": "may mean gravity or gram: write '{0} g0' for gravity (9.80665 m/s^2), or '{0} gram'",
    "lb": "may mean a force or a mass: write '{0} lbf' or '{0} lbm'",
    "mil": "may mean a length or an angle: write '{0} thou' for thousandths of an inch, or '{0} "
    "mrad'",
    "C": "may mean coulomb or degrees Celsius: write '{0} coulomb', or a temperature in K",
    "F": "may mean farad or degrees Fahrenheit: write '{0} farad', or a temperature in K",
}
for _prefix in ("m", "u", "µ", "μ"):
    DOUBTFUL[f"{_prefix}g"] = (
        f"may mean gravity or gram: write '{{0}}e{-3 if _prefix == 'm' else -6} g0' for gravity "
        f"(9.80665 m/s^2), or "
        f"'{{0}} {'milli' if _prefix == 'm' else 'micro'}gram'"
    )
_SCALE = (
    "is no plain multiple of an SI unit, for it counts from another zero or on a logarithmic "
    "scale: write {}"
)
#: Symbols that are refused with a word of their own.
_REFUSED = {
    **dict.fromkeys(
        ("degC", "°C", "celsius", "degF", "°F", "fahrenheit"), _SCALE.format("the temperature in K")
    ),
    **dict.fromkeys(
        ("dB", "dBA", "dBm", "Np", "neper", "decibel", "octave", "decade"),
        _SCALE.format("the ratio as a number"),
    ),
    "ton": "may mean 1000 kg, 2000 lb or 2240 lb: write tonne, or the mass in kg",
    "oz": "may mean a mass, a force or a volume: write it in kg, N or m^3",
    "hp": "may mean 745.7 W or 735.5 W: write it in W or kW",
    "cal": "may mean 4.184 J or 4.1868 J: write it in J",
    "kn": "may mean knot or kilonewton: write knot or kN",
}


def _symbol(text: str) -> Unit:
    """The unit of one symbol with its prefix."""
    if text in _REFUSED:
        raise UnitError(f"{text!r} {_REFUSED[text]}")
    if text in _TABLE:
        unit, exponent = _TABLE[text][0], 0
    else:
        unit, exponent = _prefixed(text)
    if text in DOUBTFUL:
        unit = Unit(unit.parts, unit.factor, unit.pi, (text,))
    return Unit(unit.parts, unit.factor.scaleb(exponent, _WIDE), unit.pi, unit.doubtful)


def _prefixed(text: str) -> tuple[Unit, int]:
    """A unit with a prefix, or written out."""
    for prefix, exponent in _PREFIXES.items():
        rest = text[len(prefix) :]
        if text.startswith(prefix) and rest in _TABLE and prefix in _taken(rest):
            return _TABLE[rest][0], exponent
    for prefix, exponent in {"": 0, **_LONG_PREFIXES}.items():
        rest = text[len(prefix) :]
        if text.startswith(prefix) and (rest in _LONG or rest.removesuffix("s") in _LONG):
            return _TABLE[_LONG.get(rest) or _LONG[rest.removesuffix("s")]][0], exponent
    raise UnitError(f"the unit {text!r} isn't known")


def _taken(symbol: str) -> tuple[str, ...]:
    """The prefixes that a symbol takes."""
    given = _TABLE[symbol][1]
    return (*given.removesuffix("da"), *(["da"] if given.endswith("da") else []))


# -- the grammar -----------------------------------------------------------------------------------
_SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_TOKEN = re.compile(
    r"(?P<symbol>g_?0(?![0-9])|[A-Za-zµμΩ°%]+(?:_[A-Za-z]+)*)(?P<direct>[+-]?[0-9]+(?![0-9.]))?"
    r"|(?P<power>\s*(?:\^|\*\*)\s*(?:[+-]?[0-9]+(?:\.[0-9]+)?|\(\s*[+-]?[0-9]+(?:\.[0-9]+)?\s*(?:/\s*[0-9]+\s*)?\)))"
    r"|(?P<raised>[⁻]?[⁰¹²³⁴⁵⁶⁷⁸⁹]+)|(?P<sign>\s*[*·⋅×/]\s*)|(?P<one>1(?![0-9.]))|(?P<bracket>[()])|(?P<blank>\s+)"
)


def read_unit(text: str) -> Unit:
    """A unit from its text: symbols of the table joined by ``*``, ``/``, blanks, parentheses and
    powers.

    Parameters
    ----------
    text : str
        Such as ``"kN/mm"``, ``"kg m^2"``, ``"N/m^1.5"``, ``"m/s2"``, ``"J/(kg*K)"``; ``""`` is the
        plain number.

    Returns
    -------
    Unit

    Raises
    ------
    UnitError
        With the beginning of a sentence, no full stop: what can't be read, and what to write
        instead.
    """
    return _Reader(text).whole()


class _Reader:
    """Reads one unit from left to right."""

    def __init__(self, text: str) -> None:
        self.text, self.at = text.strip(), 0

    def whole(self) -> Unit:
        if not self.text:
            return Unit()
        if self.text.startswith("/"):
            self.text = "1" + self.text
        unit = self.product(inside=False)
        if self.at < len(self.text):
            raise self.wrong()
        return unit

    def product(self, inside: bool) -> Unit:
        """Factors from left to right, to the end or the closing parenthesis."""
        unit, divided = self.factor(Unit(), Fraction(1)), False
        while self.at < len(self.text) and not (inside and self.text[self.at] == ")"):
            token = self.token("sign", "blank")
            sign = token.strip()
            if sign != "/" and divided and sign != "*":
                raise UnitError(
                    f"{self.text!r} can be read in two ways: use parentheses, as in N/(m*s), or "
                    f"put what multiplies first, as in N*s/m"
                )
            divided = divided or sign == "/"
            unit = self.factor(unit, Fraction(-1 if sign == "/" else 1))
        return unit

    def factor(self, before: Unit, sign: Fraction) -> Unit:
        """The product of what came before with the next symbol or parenthesis, and its power."""
        match = _TOKEN.match(self.text, self.at)
        if (
            match is None
            or match.lastgroup not in ("symbol", "direct", "one", "bracket")
            or match["bracket"] == ")"
        ):
            raise self.wrong()
        self.at = match.end()
        if match["bracket"]:
            unit = self.product(inside=True)
            self.token("bracket")
        else:
            unit = _symbol(match["symbol"]) if match["symbol"] else Unit()
        return before.times(
            unit,
            sign
            * (self.limited(Fraction(match["direct"])) if match["direct"] else self.exponent()),
        )

    def exponent(self) -> Fraction:
        """The power behind a symbol: 1 if there is none."""
        match = _TOKEN.match(self.text, self.at)
        if match is None or not (match["power"] or match["raised"]):
            return Fraction(1)
        self.at = match.end()
        digits = (
            match["raised"].translate(_SUPERSCRIPTS)
            if match["raised"]
            else re.sub(r"[\s()^*]", "", match["power"])
        )
        top, _, bottom = digits.partition("/")
        return self.limited(Fraction(top) / Fraction(int(bottom) or 1) if bottom else Fraction(top))

    def limited(self, exponent: Fraction) -> Fraction:
        """The exponent, which must be one that units have."""
        if not exponent or abs(exponent) > _MOST or exponent.denominator > _MOST:
            raise UnitError(f"{self.text!r} holds a power that no unit has")
        return exponent

    def token(self, *kinds: str) -> str:
        match = _TOKEN.match(self.text, self.at)
        if match is None or match.lastgroup not in kinds or match[0] == "(":
            raise self.wrong()
        self.at = match.end()
        return match[0]

    def wrong(self) -> UnitError:
        rest = self.text[self.at :]
        return UnitError(
            f"{rest[:20]!r} can't stand in a unit"
            if rest
            else f"the unit {self.text!r} isn't complete"
        )
