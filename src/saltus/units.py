"""Units at the edge: text such as ``"0.4 mm"`` becomes a number in SI here, and nowhere below.

A declared unit is a product of coherent SI units (``"m"``, ``"N/m^3"``, ``"Hz"``, ``"rad/s"``, ``"1"``), so that a bare number always means
SI. The angle is kept as a dimension of its own where it decides between a frequency [Hz] and an angular frequency [rad/s]: ``"94.2 rad/s"``
given to a parameter in Hz is divided by 2 pi, and a bare rate in 1/s, which could mean either, is refused.

pint is imported when the first text arrives, not before. Its arithmetic runs on decimals: ``"0.4 mm"`` is the double nearest to 0.0004,
``"900 rpm"`` is 15 Hz exactly.
"""

from __future__ import annotations

import functools
import math
import numbers
import re
from collections.abc import Mapping
from decimal import Decimal
from typing import Any

from saltus.errors import ParameterError, UnitError

#: Symbols that a declared unit may be made of: the coherent SI units, whose conversion factors are all 1.
COHERENT = ("m", "kg", "s", "rad", "Hz", "N", "Pa", "J", "W", "K", "A", "V", "C", "F", "H", "T", "Wb", "ohm")

_LONG_NAMES = {
    "meter": "m", "kilogram": "kg", "second": "s", "radian": "rad", "hertz": "Hz", "newton": "N", "pascal": "Pa", "joule": "J", "watt": "W",
    "kelvin": "K", "ampere": "A", "volt": "V", "coulomb": "C", "farad": "F", "henry": "H", "tesla": "T", "weber": "Wb", "ohm": "ohm",
}  # fmt: skip
_TEXT = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*((?:1/|[^\d\s.,]).*?)?\s*", re.DOTALL)
_DECLARED = re.compile(r"(?:1|[A-Za-z]+)(?:(?:\^|\*\*)-?\d)?(?:[*/ ](?:1|[A-Za-z]+)(?:(?:\^|\*\*)-?\d)?)*")
_HEAD = re.compile(r"(?:m|s|Hz|N|Pa|J|W|V|A)(?=$|[*/])")
_PREFIXES = {-9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}


# -- declared units ------------------------------------------------------------------------------------------------------------
def check_declared(unit: str, name: str) -> str:
    """A declared unit, checked: a product of coherent SI units.

    Parameters
    ----------
    unit : str
        Such as ``"N/m"``, ``"kg*m^2"``, ``"1"`` (a plain number) or ``""`` (not known).
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
        raise UnitError(f"the unit of {name!r} is {unit!r}; write it as text, such as 'N/m'.")
    unit = re.sub(r"\s*([*/])\s*", r"\1", unit.strip())
    unit = "1" if unit == "dimensionless" else unit
    if not unit:
        return unit
    strange = [symbol for symbol in re.findall(r"[^\W\d]+|[µΩ%°]", unit) if symbol not in COHERENT]
    if strange:
        raise UnitError(
            f"{name!r} is declared in {unit!r}, but {strange[0]!r} isn't a coherent SI unit. Numbers inside equations are in SI: declare "
            f"it by {', '.join(COHERENT[:8])}, ..., and give values as text, such as '0.4 mm', which is converted."
        )
    if not _DECLARED.fullmatch(unit):
        raise UnitError(f"the unit {unit!r} of {name!r} can't be read. Write it like 'N/m', 'N*s/m', 'kg*m^2/s^2' or '1'.")
    return unit


def coherent_unit(text: str, name: str) -> str:
    """The coherent SI unit in which a text value is kept: ``"14 kN/m"`` gives ``"N/m"``, ``"0.4 mm"`` gives ``"m"``, ``"900 rpm"``
    gives ``"rad/s"``.

    Raises
    ------
    UnitError
        If the text can't be read.
    """
    number, unit = _split(text, name)
    if not unit:
        return "1"
    registry = _registry()
    parts: dict[str, int | float] = {}
    for symbol, exponent in _read(unit, text, name, number).unit_items():
        bare = registry.parse_unit_name(symbol)[0][1]
        known = _LONG_NAMES.get(bare if bare != "gram" else "kilogram")
        roots = {known: 1} if known else {
            _LONG_NAMES[root]: power for root, power in registry.Quantity(1, symbol).to_base_units().unit_items() if root in _LONG_NAMES
        }  # fmt: skip
        for root, power in roots.items():
            parts[root] = parts.get(root, 0) + int(power * exponent)
    return _join(parts)


def _join(parts: Mapping[str, int | float]) -> str:
    """A unit written from exponents: ``{"N": 1, "m": -3}`` gives ``"N/m^3"``."""

    def power(symbol: str, exponent: int | float) -> str:
        return symbol if exponent == 1 else f"{symbol}^{exponent}"

    above = "*".join(power(symbol, exponent) for symbol, exponent in parts.items() if exponent > 0)
    below = "".join("/" + power(symbol, -exponent) for symbol, exponent in parts.items() if exponent < 0)
    return (above or "1") + below


# -- text and numbers to SI ----------------------------------------------------------------------------------------------------
def to_si(value: Any, unit: str, name: str) -> float:
    """A value as a number in SI.

    Parameters
    ----------
    value : float or str or pint.Quantity
        A bare number is in the declared unit already. Text holds number and unit: ``"0.4 mm"``, ``"14 kN/m"``, ``"900 rpm"``.
    unit : str
        The declared unit (coherent SI), ``"1"`` for a plain number, ``""`` if not known: text is then taken to SI base units, except
        frequencies, which need a declaration.
    name : str
        What the value is for; used in the messages.

    Returns
    -------
    float
        The finite number in the declared unit, correctly rounded.

    Raises
    ------
    UnitError
        If the unit is missing, unknown, of another dimension, or may mean Hz as well as rad/s.
    ParameterError
        If the value isn't a finite real number.
    """
    if hasattr(value, "magnitude") and hasattr(value, "units"):
        value = f"{value.magnitude} {value.units}"
    if isinstance(value, str):
        number = _convert(value, unit, name)
    elif isinstance(value, bool) or not (isinstance(value, numbers.Real | Decimal) or getattr(value, "shape", None) == ()):
        raise ParameterError(f"{name} = {value!r} is not a number. Write a number in SI, or text with a unit, such as {_example(unit)!r}.")
    else:
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
    if not math.isfinite(number):
        raise ParameterError(f"{name} = {value!r} is not a finite number.")
    return number


def _convert(text: str, unit: str, name: str) -> float:
    """Text to the number in the declared unit."""
    number, given = _split(text, name)
    if not given:
        if unit not in ("", "1"):
            raise UnitError(
                f"{name} = {text!r} has no unit; it is measured in {unit}. Write {f'{text.strip()} {unit}'!r}, or the bare number "
                f"{text.strip()} if it is in {unit} already."
            )
        return float(number)
    factor, dimension, angle, turns = _root(_read(given, text, name, number))
    if unit == "":
        if set(dimension) == {"second"}:
            raise UnitError(
                f"{name} = {text!r}, but the unit of {name} isn't known, and a frequency in Hz and an angular one in rad/s are different "
                f"numbers. Declare it: units={{{name!r}: 'Hz'}} or 'rad/s'; or give the bare number that the equation uses."
            )
        return float(factor * Decimal(1000) ** -int(dimension.get("gram", 0)))
    own_factor, own_dimension, own_angle, own_turns = _root(_registry().Quantity(Decimal(1), "dimensionless" if unit == "1" else unit))
    if dimension != own_dimension:
        expected = "a plain number" if unit == "1" else f"measured in {unit}"
        raise UnitError(f"{name} = {text!r} has the wrong unit: {name} is {expected}. Write it like {_example(unit)!r}.")
    if angle != own_angle and set(dimension) <= {"second"}:
        raise UnitError(
            f"{name} = {text!r} can't be told apart: {name} is {f'measured in {unit}' if unit != '1' else 'a plain number'}, and an angle "
            f"(rad, turns, Hz = turns per second) isn't a plain number here. Say Hz, rpm, rad/s or rad where you mean it, or give the bare "
            f"number{f' in {unit}' if unit != '1' else ''}."
        )
    if turns != own_turns:
        factor *= _turn() ** (turns - own_turns)
    return float(factor / own_factor)


def _split(text: str, name: str) -> tuple[Decimal, str]:
    """Number and unit of a text value."""
    match = _TEXT.fullmatch(text.replace("\N{MINUS SIGN}", "-"))
    if match is None:
        hint = " Write a decimal point, not a comma." if re.match(r"\s*[+-]?\d+,\d", text) else ""
        raise UnitError(f"{name} = {text!r} can't be read as a number and a unit, such as '0.4 mm' or '1.4e4 N/m'.{hint}")
    return Decimal(match[1]), match[2] or ""


def _read(unit: str, text: str, name: str, number: Decimal) -> Any:
    """A pint quantity, or a UnitError that teaches."""
    registry = _registry()
    try:
        return registry.Quantity(number, registry.parse_units(unit))
    except Exception as error:  # pint raises a dozen types, tokenize's among them, for text that it can't read
        raise UnitError(
            f"{name} = {text!r}: the unit {unit!r} can't be read ({error}). Write it like mm, N/m, kN/mm, N*s/m, kg*m^2, Hz, rpm or rad/s."
        ) from None


def _root(quantity: Any) -> tuple[Decimal, dict[str, Any], int, int]:
    """Value in root units but for turns, exponents of the root units without the angle, exponent of the angle, turns (2 pi) to multiply.

    A hertz is one turn a second.
    """
    root = quantity.to_root_units()
    dimension = dict(root.unit_items())
    turns = int(sum(exponent for symbol, exponent in quantity.unit_items() if symbol.endswith("hertz")))
    return root.magnitude, dimension, int(dimension.pop("radian", 0)) + turns, turns


@functools.cache
def _registry() -> Any:
    """The private pint registry, on decimals."""
    import pint

    return pint.UnitRegistry(non_int_type=Decimal)


@functools.cache
def _turn() -> Decimal:
    """One turn in radians."""
    return _registry().Quantity(Decimal(1), "turn").to_root_units().magnitude


# -- SI to text ----------------------------------------------------------------------------------------------------------------
def from_si(value: float, unit: str, digits: int | None = 6) -> str:
    """A number in SI as people write it: ``0.0004, "m"`` gives ``"0.4 mm"``, ``14000.0, "N/m"`` gives ``"14 kN/m"``.

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
        highest = 0 if head[0] in ("m", "s") else 9  # 1200 m, not 1.2 km: lengths and times of vibrations are short
        lift = 2 if unit == "m" else 0  # 0.4 mm, not 400 µm: the field writes gaps in mm
        exponent = min(max(3 * ((exact.adjusted() + lift) // 3), -9), highest)
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
    return {"": "0.4 mm", "1": "0.03", "m": "0.4 mm", "N/m": "14 kN/m", "Hz": "15 Hz", "rad/s": "94.2 rad/s"}.get(unit, f"3 {unit}")
