"""Dimensions of an equation, checked while it is traced: terms of a sum or comparison have one
unit, and rates that of their state per second.

Numbers written into an equation are in SI and may have any unit. Alone in a sum, a comparison or a
piece they take the unit of the other terms (``x > 1e-3``). A product with one has no known unit
(``-4000*x``), except with the numbers of formulas (2, 1/2, 2 pi). Unknown units are not checked.
Angles count as plain numbers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction

from saltus.errors import UnitError
from saltus.language.expression import Expr, walk
from saltus.language.operations import ELEMENTARY
from saltus.language.text import PI_MULTIPLES
from saltus.sentences import Dialect
from saltus.units import dimension, unit_text

#: Exponents of m, kg, s, A and K.
Dimension = dict[str, Fraction]

_PLAIN: Dimension = {}


def _way_out(say: Dialect) -> str:
    return f"{say.system(check_units=False)} leaves units unchecked."


class _Number(dict[str, Fraction]):
    """A number written into the equation: it fits into any sum."""

    def __init__(self, plain: bool) -> None:
        super().__init__()
        self.plain = plain


class DimensionCheck:
    """Follows the dimension of every expression that is made while it observes.

    Parameters
    ----------
    states : sequence of str
        Names of the states.
    units : mapping of str to str
        Unit of each state and parameter; ``""`` where it isn't known. The time is in seconds if a
        state has a dimension: a system whose states are all plain numbers has a plain time as well.
    """

    def __init__(self, states: Sequence[str], units: Mapping[str, str]) -> None:
        self._units = {name: dimension(unit) if unit else None for name, unit in units.items()}
        self._states = tuple(states)
        self._time = {"s": Fraction(1)} if any(self._units[name] for name in states) else None
        self._known: dict[Expr, Dimension | None] = {}

    def __call__(self, node: Expr) -> None:
        """Note the dimension of a new node; the observer of
        :func:`saltus.language.expression.observed`.

        Raises
        ------
        UnitError
            If its operands don't fit together.
        """
        if node not in self._known:
            self._known[node] = self._of(node)

    def leave_open(self, node: Expr) -> None:
        """Check nothing about a node: its unit isn't known."""
        self._known[node] = None

    def check_rates(self, rates: Sequence[Expr]) -> None:
        """Raise a UnitError unless each rate is in the unit of its state per second, where both are
        known.
        """
        for name, rate in zip(self._states, rates, strict=True):
            own, found = self._units[name], self._dimension(rate)
            if own is None or self._time is None or found is None or isinstance(found, _Number):
                continue
            wanted = _product(own, self._time, -1)
            if found != wanted:
                term = _first_term(rate)
                raise UnitError(
                    f"d{name}/dt is a rate in {unit_text(wanted)}, but {_brief(term)} is "
                    f"{_in(found)}: "
                    f"{_missing(found, wanted)}. ",
                    _way_out,
                )

    def check_plain(self, node: Expr, what: str) -> None:
        """Raise a UnitError unless a node is a plain number, or of no known unit."""
        self._check_is(node, _PLAIN, what)

    def check_alike(self, node: Expr, other: Expr, what: str) -> None:
        """Raise a UnitError unless two nodes have one unit, where both are known."""
        self._check_is(node, self._dimension(other), what)

    def check_rate_of(self, node: Expr, other: Expr, what: str) -> None:
        """Raise a UnitError unless a node is in the unit of another per second, where both are
        known.
        """
        found = self._dimension(other)
        if found is not None and not isinstance(found, _Number) and self._time is not None:
            self._check_is(node, _product(found, self._time, -1), what)

    def _check_is(self, node: Expr, wanted: Dimension | None, what: str) -> None:
        found = self._dimension(node)
        if wanted is None or found is None or found == wanted:
            return
        if isinstance(wanted, _Number) or isinstance(found, _Number):
            return
        raise UnitError(
            f"{what} is to be {_in(wanted)}, but {_brief(node)} is {_in(found)}. ",
            _way_out,
        )

    def unit(self, node: Expr) -> str:
        """Coherent SI unit of a node, ``""`` if it isn't known, or may be that of an angle."""
        found = self._dimension(node)
        return (
            ""
            if found is None or isinstance(found, _Number) or not found.keys() - {"s"}
            else unit_text(found)
        )

    def declared(self, node: Expr) -> str:
        """The unit as from :meth:`unit`, but ``"1"`` for a node known to be a plain number."""
        return "1" if self._dimension(node) == _PLAIN else self.unit(node)

    # -- one node ----------------------------------------------------------------------------------
    def _dimension(self, node: Expr) -> Dimension | None:
        self(node)
        return self._known[node]

    def _of(self, node: Expr) -> Dimension | None:
        """The dimension of a node, None if it isn't known."""
        args = [self._dimension(arg) for arg in node.args]
        match node.op:
            case "const":
                return _Number(_is_plain(node.payload))
            case "param" | "state":
                return self._units.get(node.payload)
            case "time":
                return self._time
            case "table":
                return dimension(node.payload.unit) if node.payload.unit else None
            case "neg":
                return args[0]
            case "add" | "sub" | "select" | "mod":
                return self._alike(node, args[0], args[1])
            case "mul" | "div":
                return _joined(args[0], args[1], -1 if node.op == "div" else 1)
            case "pow":
                return self._power(node, args[0], args[1])
            case "sqrt":
                return (
                    args[0]
                    if not args[0]
                    else {base: exponent / 2 for base, exponent in args[0].items()}
                )
            case op if op in ELEMENTARY:
                return self._plain(node, args[0])
        return None

    def _alike(self, node: Expr, a: Dimension | None, b: Dimension | None) -> Dimension | None:
        """The dimension of a sum, a difference (also that of a comparison), or two pieces."""
        if a is None or b is None:
            return None
        if isinstance(a, _Number) and isinstance(b, _Number):
            return _Number(a.plain and b.plain)
        if isinstance(a, _Number) or isinstance(b, _Number):
            return b if isinstance(a, _Number) else a
        if a == b:
            return a
        left, right = _first_term(node.args[0]), _first_term(node.args[1])
        what = "are pieces of one value" if node.op == "select" else "are added or compared"
        second = b.get("kg", 0) > a.get("kg", 0)
        missing = _missing(b, a, " in the second") if second else _missing(a, b, " in the first")
        raise UnitError(
            f"{_brief(left)} [{unit_text(a)}] and {_brief(right)} [{unit_text(b)}] {what}, which "
            f"needs one unit: {missing}. ",
            _way_out,
        )

    def _power(
        self, node: Expr, base: Dimension | None, exponent: Dimension | None
    ) -> Dimension | None:
        """The dimension of a power, whose exponent must be a plain number."""
        self._plain(node, exponent, "as the exponent of")
        if base is None or isinstance(base, _Number) or not base:
            return base
        power = node.args[1]
        if power.op != "const":
            return None
        times = Fraction(power.payload).limit_denominator(1000)
        return {symbol: exponent * times for symbol, exponent in base.items()}

    def _plain(self, node: Expr, argument: Dimension | None, where: str = "in") -> Dimension | None:
        """The dimension of a function of a plain number or an angle."""
        inner = node.args[-1]
        if argument and any(
            abs(number) != 1 and abs(number) not in PI_MULTIPLES for number in _factors(inner)
        ):
            return None  # cos(3*t): the number is a frequency
        if argument:
            raise UnitError(
                f"{_brief(inner)} is in {unit_text(argument)}, but stands {where} {_brief(node)}, "
                f"which takes a plain number or an "
                "angle. ",
                _way_out,
            )
        return None if argument is None else _PLAIN


def _joined(a: Dimension | None, b: Dimension | None, sign: int) -> Dimension | None:
    """The dimension of a product or a quotient."""
    if a is None or b is None:
        return None
    numbers = [each for each in (a, b) if isinstance(each, _Number)]
    if len(numbers) == 2:
        return _Number(all(number.plain for number in numbers))
    return _product(a, b, sign) if all(number.plain for number in numbers) else None


def _product(a: Dimension, b: Dimension, power: int) -> Dimension:
    total = {
        base: a.get(base, Fraction(0)) + power * b.get(base, Fraction(0)) for base in {**a, **b}
    }
    return {base: exponent for base, exponent in total.items() if exponent}


def _is_plain(number: float) -> bool:
    """True if a number is one that formulas are made of: a small multiple of 1, 1/2, 1/3 or 1/6, or
    one of pi.
    """
    size = abs(number)
    return size in PI_MULTIPLES or (size < 10 and abs(6 * size - round(6 * size)) < 1e-12)


def units_of(
    states: Sequence[str], units: Mapping[str, str], rates: Sequence[Expr], formulas: Sequence[Expr]
) -> list[str]:
    """Coherent SI unit of each formula of a system's states and parameters, ``""`` where it isn't
    known.

    None is known of a system whose own equations don't have one unit in a sum: it was traced with
    ``check_units=False``.
    """
    check = DimensionCheck(states, units)
    try:
        for node in walk(*rates):
            check(node)
        check.check_rates(rates)
    except UnitError:
        return [""] * len(formulas)
    return [_unit(check, formula) for formula in formulas]


def _unit(check: DimensionCheck, formula: Expr) -> str:
    try:
        for node in walk(formula):
            check(node)
    except UnitError:
        return ""
    return check.unit(formula)


# -- words -----------------------------------------------------------------------------------------
def _first_term(node: Expr) -> Expr:
    """The first summand of a sum."""
    while node.op in ("add", "sub"):
        node = node.args[0] if node.args[0].op != "const" else node.args[1]
    return node


def _brief(node: Expr) -> str:
    text = repr(node)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _in(exponents: Dimension) -> str:
    return f"in {unit_text(exponents)}" if exponents else "a plain number"


def _missing(found: Dimension, wanted: Dimension, where: str = "") -> str:
    """The factor by which two dimensions differ, in words."""
    factor = _product(found, wanted, -1)
    if factor == {"kg": Fraction(1)}:
        return f"a division by a mass is missing{where}"
    upside_down = sum(factor.values()) < 0
    shown = {base: -exponent for base, exponent in factor.items()} if upside_down else factor
    return f"they differ by a factor in {unit_text(shown)}"


def _factors(node: Expr) -> list[float]:
    """The numbers that multiply a term."""
    found, stack = [], [node]
    while stack:
        node = stack.pop()
        if node.op == "const":
            found.append(node.payload)
        elif node.op in ("mul", "div", "neg"):
            stack.extend(node.args)
    return found
