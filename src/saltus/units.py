"""Units at the edge: text such as ``"0.4 mm"`` becomes a number in SI here, and nowhere below.

A declared unit is a product of coherent SI units (``"m"``, ``"N/m^3"``, ``"Hz"``, ``"rad/s"``,
``"1"``), so that a bare number always means SI. The angle is a dimension of its own where it
decides between a frequency [Hz] and an angular frequency [rad/s]: ``"94.2 rad/s"`` given to a
parameter in Hz is divided by 2 pi, and a bare rate in 1/s, which could mean either, is refused.

The units that can be read are in a table of our own (unit_table.py, docs/decisions/0020). Its
arithmetic runs on decimals: ``"0.4 mm"`` is the double nearest to 0.0004, ``"900 rpm"`` is 15 Hz
exactly.
"""

from __future__ import annotations

import functools
import math
import numbers
import re
from collections.abc import Mapping
from decimal import Decimal
from fractions import Fraction
from typing import Any

from saltus.errors import ParameterError, UnitError, shown
from saltus.unit_table import COHERENT, DOUBTFUL, Unit, read_unit

_NUMBER = re.compile(
    r"\s*(?P<number>[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?(?P<tens>[0-9]+))?)(?P<unit>.*)",
    re.DOTALL,
)
_HEAD = re.compile(r"(?:m|s|Hz|Nms|Nm|Ns|N|Pa|J|W|V|A)(?=$|[*/])")
_PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
#: The longest text that is read as a quantity: the longest that anybody writes has some 30
#: characters.
LONGEST = 100


# -- declared units --------------------------------------------------------------------------------
def check_declared(unit: str, name: str) -> str:
    """A declared unit, checked: a product of coherent SI units.

    Parameters
    ----------
    unit : str
        Such as ``"N/m"``, ``"kg*m^2"``, ``"N/m^1.5"``, ``"1"`` (a plain number) or ``""`` (not
        known).
    name : str
        What carries the unit; used in the message.

    Returns
    -------
    str
        The unit without blanks around it; ``"dimensionless"`` becomes ``"1"``.

    Raises
    ------
    UnitError
        If it can't be read, or isn't coherent (``"mm"``): numbers inside equations are in SI.
    """
    if not isinstance(unit, str):
        raise UnitError(f"the unit of {name!r} is {shown(unit)}; write it as text, such as 'N/m'.")
    unit = re.sub(r"\s*([*/])\s*", r"\1", unit.strip())
    unit = "1" if unit == "dimensionless" else unit
    if not unit:
        return unit
    try:
        parsed = _parsed(unit)
    except UnitError as error:
        raise UnitError(
            f"the unit {shown(unit)} of {name!r} can't be read: {error}. Write it like "
            f"{_LIKE_DECLARED}."
        ) from None
    if parsed.factor != 1 or parsed.pi:
        raise UnitError(
            f"{name!r} is declared in {shown(unit)}, which isn't a coherent SI unit. Numbers "
            f"inside equations are in SI: declare it by "
            f"{', '.join(list(COHERENT)[:8])}, ..., such as {_join(parsed.parts)!r}, and give "
            f"values as text, such as '0.4 mm', which is "
            "converted."
        )
    own = all(
        symbol in COHERENT or symbol in ("Nm", "Ns", "Nms")
        for symbol in re.findall(r"[^\W\d_]+", unit)
    )
    return unit if own else _join(parsed.parts)


_LIKE_DECLARED = "'N/m', 'N*s/m', 'kg*m^2/s^2' or '1'"


def coherent_unit(text: str, name: str) -> str:
    """The coherent SI unit in which a text value is stored: ``"14 kN/m"`` gives ``"N/m"``, ``"0.4
    mm"`` gives ``"m"``, ``"2 lbf/in"`` gives ``"N/m"``, ``"900 rpm"`` gives ``"rad/s"``.

    Raises
    ------
    UnitError
        If the text can't be read, or its unit has several meanings and nothing says which: ``"2
        g"``.
    """
    number, unit = _split(text, name)
    if unit is None:
        return "1"
    _refuse_doubtful(unit, number, text, name)
    return _join(unit.parts)


def is_unit(text: str) -> bool:
    """True if a text can be read as a unit, one with several meanings included."""
    try:
        return _split(f"1 {text}", "")[1] is not None
    except UnitError:
        return False


def dimension(unit: str) -> dict[str, Fraction]:
    """Exponents of m, kg, s, A and K in a declared unit; the angle counts as a plain number.
    ``"N/m"`` gives ``{"kg": 1, "s": -2}``.
    """
    return _without_angle(_parsed(unit))[0]


def unit_text(exponents: Mapping[str, Fraction]) -> str:
    """A dimension as the unit that people know it by: ``{"kg": 1, "s": -2}`` gives ``"N/m"``."""
    for unit in _USUAL:
        if dimension(unit) == exponents:
            return unit
    order = ("kg", "m", "s", "A", "K")
    return _join({base: exponents[base] for base in order if base in exponents})


#: Units that messages call a dimension by, the first that fits.
_USUAL = (
    "1", "m", "m/s", "m/s^2", "kg", "s", "1/s", "1/s^2", "N", "N/m", "N*s/m", "N/m^2", "N/m^3",
    "N/m^1.5", "N*m", "N*m*s", "N*s", "kg*m^2",
    "W", "V", "ohm", "N*s/m^2", "N*s", "kg/m^3", "m^2", "m^3", "N/kg", "N*m/s^2", "N*m^2", "N/s",
)  # fmt: skip


def _join(parts: Mapping[str, Fraction]) -> str:
    """A unit written from exponents: ``{"N": 1, "m": -3}`` gives ``"N/m^3"``."""

    def power(symbol: str, exponent: Fraction) -> str:
        if exponent == 1:
            return symbol
        exact = exponent.denominator == 1 or 10**6 % exponent.denominator == 0
        return (
            f"{symbol}^{_plain(Decimal(exponent.numerator) / exponent.denominator)}"
            if exact
            else f"{symbol}^({exponent})"
        )

    above = "*".join(power(symbol, exponent) for symbol, exponent in parts.items() if exponent > 0)
    below = "".join(
        "/" + power(symbol, -exponent) for symbol, exponent in parts.items() if exponent < 0
    )
    return (above or "1") + below


# -- text and numbers to SI ------------------------------------------------------------------------
def to_si(value: Any, unit: str, name: str) -> float:
    """A value as a number in SI.

    Parameters
    ----------
    value : float or str or pint.Quantity
        A bare number is in the declared unit already. Text holds number and unit: ``"0.4 mm"``,
        ``"14 kN/m"``, ``"900 rpm"``; it has at most 100 characters.
    unit : str
        The declared unit (coherent SI), ``"1"`` for a plain number, ``""`` if not known: text is
        then taken to SI base units, except frequencies, which need a declaration.
    name : str
        What the value is for; used in the messages.

    Returns
    -------
    float
        The finite number in the declared unit, correctly rounded.

    Raises
    ------
    UnitError
        If the unit is missing, unknown, of another dimension, or has several meanings.
    ParameterError
        If the value isn't a finite real number.
    """
    if hasattr(value, "magnitude") and hasattr(value, "units"):  # a Quantity of pint
        value = f"{value.magnitude} {value.units}"
    number = _convert(value, unit, name) if isinstance(value, str) else _real(value, unit, name)
    if not math.isfinite(number):
        raise ParameterError(f"{name} = {shown(value)} is not a finite number.")
    return number


def _real(value: Any, unit: str, name: str) -> float:
    """A number of Python, of NumPy, or in an array without axes, as a double; infinite if it is too
    large for one.
    """
    # NumPy's dates and spans of time would turn into numbers of ticks
    kind = getattr(getattr(value, "dtype", None), "kind", "f")
    plain = isinstance(value, numbers.Real | Decimal) or getattr(value, "shape", None) == ()
    if plain and kind in "fiu" and not isinstance(value, bool):
        try:
            return float(value)
        except OverflowError:
            return math.inf
        except ValueError:  # a decimal that signals that it is none
            return math.nan
    raise ParameterError(
        f"{name} = {shown(value)} is not a number. Write a number in SI, or text "
        f"with a unit, such as {_example(unit)!r}."
    )


def _convert(text: str, unit: str, name: str) -> float:
    """Text to the number in the declared unit."""
    number, given = _split(text, name)
    if given is None:
        if unit not in ("", "1"):
            raise UnitError(
                f"{name} = {shown(text)} has no unit; it is measured in {unit}. Write "
                f"{shown(f'{text.strip()} {unit}')}, or the bare "
                f"number {text.strip()} if it is in {unit} already."
            )
        return _double(number, text, name)
    dimension, angle = _without_angle(given)
    if unit == "":
        if set(dimension) == {"s"}:
            raise UnitError(
                f"{name} = {shown(text)}, but the unit of {name} isn't known, and a frequency in "
                f"Hz and an angular one in rad/s are "
                f"different numbers. Declare it: units={{{name!r}: 'Hz'}} or 'rad/s'; or give the "
                f"bare number that the equation uses."
            )
        _refuse_doubtful(given, number, text, name)
        return _double(given.convert(number, Unit({"Hz": given.turns})), text, name)
    own = _parsed(unit)
    own_dimension, own_angle = _without_angle(own)
    if dimension != own_dimension:
        _refuse_doubtful(given, number, text, name)
        expected = "a plain number" if unit == "1" else f"measured in {unit}"
        raise UnitError(
            f"{name} = {shown(text)} has the wrong unit: {name} is {expected}. Write "
            f"it like {_example(unit)!r}."
        )
    if angle != own_angle and set(dimension) <= {"s"}:
        raise UnitError(
            f"{name} = {shown(text)} can't be told apart: {name} is "
            f"{f'measured in {unit}' if unit != '1' else 'a plain number'}, and an "
            f"angle (rad, turns, Hz = turns per second) isn't a plain number here. Say Hz, rpm, "
            f"rad/s or rad where you mean it, or give "
            f"the bare number{f' in {unit}' if unit != '1' else ''}."
        )
    return _double(given.convert(number, own), text, name)


def _double(number: Decimal, text: str, name: str) -> float:
    """The number as a double; neither overflow nor underflow goes unsaid."""
    double = float(number)
    if math.isinf(double) or (number and not double):
        raise UnitError(
            f"{name} = {shown(text)} is too {'large' if double else 'small'} for a "
            f"number of the computer."
        )
    return double


def _split(text: str, name: str) -> tuple[Decimal, Unit | None]:
    """Number and unit of a text value; None where no unit is written."""
    match = _NUMBER.fullmatch(text.replace("\N{MINUS SIGN}", "-")) if len(text) <= LONGEST else None
    if match is None or match["unit"].startswith(","):
        hint = " Write a decimal point, not a comma." if re.match(r"\s*[+-]?\d+,\d", text) else ""
        raise UnitError(
            f"{name} = {shown(text)} can't be read as a number and a unit, such as "
            f"'0.4 mm' or '1.4e4 N/m'.{hint}"
        )
    if len((match["tens"] or "").lstrip("0")) > 4:
        raise UnitError(
            f"{name} = {shown(text)} has an exponent beyond the numbers of the computer."
        )
    number, unit = Decimal(match["number"]), match["unit"].strip()
    if not unit:
        return number, None
    try:
        return number, _parsed(unit)
    except UnitError as error:
        raise UnitError(
            f"{name} = {shown(text)}: the unit {shown(unit)} can't be read: {error}. Write it like "
            f"mm, N/m, kN/mm, N*s/m, kg*m^2, Hz, rpm "
            "or rad/s."
        ) from None


@functools.lru_cache(maxsize=1024)
def _parsed(unit: str) -> Unit:
    return Unit() if unit == "1" else read_unit(unit)


def _refuse_doubtful(unit: Unit, number: Decimal, text: str, name: str) -> None:
    """Raise if a symbol of the unit has several meanings."""
    for symbol in unit.doubtful:
        raise UnitError(f"{name} = {shown(text)}: {symbol!r} {DOUBTFUL[symbol].format(number)}.")


def _without_angle(unit: Unit) -> tuple[dict[str, Fraction], Fraction]:
    """Exponents of the base units but the angle; that of the angle."""
    dimension = unit.dimension
    angle = dimension.pop("rad", Fraction(0))
    return dimension, angle


# -- SI to text ------------------------------------------------------------------------------------
def from_si(value: float, unit: str, digits: int | None = 6) -> str:
    """A number in SI as people write it: ``0.0004, "m"`` gives ``"0.4 mm"``, ``14000.0, "N/m"``
    gives ``"14 kN/m"``.

    Parameters
    ----------
    value : float
        Number in the unit.
    unit : str
        Coherent SI unit; ``""`` and ``"1"`` give the bare number.
    digits : int or None
        Significant digits; None keeps all, so that :func:`to_si` returns the same double.
    """
    if not math.isfinite(value):
        return f"{value} {unit}".strip()
    exact = Decimal(repr(float(value)))
    if digits is not None:
        exact = Decimal(f"{exact:.{digits - 1}e}")
    head = _HEAD.match(unit)
    exponent = 0
    if head and exact:
        # 1200 m, not 1.2 km: lengths and times of vibrations are short
        highest = 0 if head[0] in ("m", "s") else 9
        lift = 2 if unit == "m" else 0  # 0.4 mm, not 400 µm: the field writes gaps in mm
        exponent = min(3 * ((exact.adjusted() + lift) // 3), highest)
        if unit == "m" and exact.adjusted() in (-2, -1):  # and 20 mm, as pictures do
            exponent = -3
        # 3e-19 J and 2e15 N, not 3e-7 pJ and 2e6 GN
        if exponent < min(_PREFIXES) or exact.adjusted() - exponent >= 6:
            exponent = 0
    text = _plain(exact.scaleb(-exponent))
    return text if unit in ("", "1") else f"{text} {_PREFIXES[exponent]}{unit}"


def _plain(number: Decimal) -> str:
    """A decimal without needless zeros, in scientific notation outside 1e-4 ... 1e6."""
    number = number.normalize()
    if number == 0:
        return "0"
    if -5 < number.adjusted() < 6:
        return f"{number:f}"
    mantissa, exponent = f"{number:e}".split("e")
    return f"{mantissa}e{int(exponent)}"


def _example(unit: str) -> str:
    """A well-formed value in a unit, for messages."""
    return {
        "": "0.4 mm",
        "1": "0.03",
        "m": "0.4 mm",
        "N/m": "14 kN/m",
        "Hz": "15 Hz",
        "rad/s": "94.2 rad/s",
    }.get(unit, f"3 {unit}")


def titled(heading: str, unit: str) -> str:
    """A heading with its unit, such as ``x [m]``."""
    return f"{heading} [{unit}]" if unit not in ("", "1") else heading
