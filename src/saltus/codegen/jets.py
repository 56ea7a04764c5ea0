"""Taylor recurrences as straight-line lane code.

For a system in linear form (:mod:`saltus.codegen.series`) this writes the assignments that compute
the normalised Taylor coefficients ``y_k = y^(k)(t)/k!`` of every state up to a given order, of
every gap, and the few values that the crossing of contacts needs. Coefficients are produced on
demand, so nothing is computed that nothing uses. Sums put the newest coefficient last: a
convolution then adds one fused multiply-add to the critical path, not its whole length.

Recurrences: Moore, Interval Analysis (1966); Jorba & Zou, Experimental Mathematics 14 (2005),
section 2; Griewank & Walther, Evaluating Derivatives (2008), table 13.2.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from fractions import Fraction
from typing import Any

from saltus.codegen.columns import LaneCode
from saltus.codegen.scalar import condition_code
from saltus.codegen.series import Linear, Series, SeriesBuilder, is_constant
from saltus.language import expression as ex
from saltus.language.expression import Expr

MASK_WORDS = ("&", "|", "~")
#: Terms beyond this one are so small, within a step, that the rounding of 1/k doesn't matter.
LAST_EXACT_DIVISOR = 12
#: Consecutive operations in a sine.
SINE = 12


#: Operations whose coefficients differ from step to step.
MOVING = ("select", "held")


def held(row: int) -> str:
    """Code for a row of the clocks' data."""
    return f"load(clock, CLOCK_ROW + {row}, LANES)"


class Constants:
    """Parameter-only values, computed once per trajectory: each gets a row of the table ``c``, the
    first of which are for other use.
    """

    def __init__(self, first: int = 0) -> None:
        self.rows: dict[Expr, int] = {}
        self._first = first

    def __len__(self) -> int:
        return self._first + len(self.rows)

    def index(self, node: Expr) -> int:
        """Row of a parameter-only expression."""
        return self.rows.setdefault(node, len(self))


def _number(coefficient: Expr) -> float:
    """The value of a literal coefficient, else NaN."""
    return float(coefficient.payload) if coefficient.op == "const" else math.nan


class JetCode:
    """Emits lane code for the Taylor coefficients of a system.

    Parameters
    ----------
    rows : dict
        Names of the states, and the row of ``y`` that holds each.
    fields : tuple of Linear
        Their right-hand sides in linear form.
    builder : SeriesBuilder
        The builder that made them.
    constants : Constants
        Receives the parameter-only coefficients.
    shared : int, optional
        Number of states that all columns of a tangent share; the others are one column. Default:
        all.
    """

    def __init__(
        self,
        rows: dict[str, int],
        fields: tuple[Linear, ...],
        builder: SeriesBuilder,
        constants: Constants,
        shared: int | None = None,
    ) -> None:
        self.lines = LaneCode()
        # (angular frequency, phase offset) of sines and cosines of time: row
        self.harmonics: dict[tuple[Expr, Expr], int] = {}
        self._fields, self._builder, self._shared = (
            fields,
            builder,
            len(rows) if shared is None else shared,
        )
        self._rows, self._index = list(rows.values()), {name: i for i, name in enumerate(rows)}
        self._constants = constants
        self._memo: dict[tuple[Any, ...], str | None] = {}
        self._coefficients: dict[Expr, str] = {}
        self._masks: dict[ex.Condition, str] = {}
        self._depth: dict[str, int] = {}
        self._count = 0

    # -- names -------------------------------------------------------------------------------------
    def _assign(self, code: str, of_column: bool = False) -> str:
        name = f"s{self._count}"
        self._count += 1
        self.lines.assign(name, code, of_column)
        self._depth[name] = 1 + self._wait(code)
        return name

    def _wait(self, code: str) -> int:
        """Number of consecutive operations that must end before this code can begin."""
        return max((self._depth.get(name, 0) for name in re.findall(r"\bs\d+\b", code)), default=0)

    def coefficient(self, node: Expr) -> str:
        """Code for a coefficient: a literal, a row of ``c``, or an expression of those and mode
        masks.
        """
        if node.op == "const":
            return f"({node.payload!r})" if node.payload < 0 else repr(node.payload)
        if node not in self._coefficients:
            if node.op == "select":
                a, b = (self._as_lane(self.coefficient(x), x) for x in node.args)
                code = f"select({self._mask(node.payload)}, {a}, {b})"
            elif node.op == "held":
                code = held(node.payload)
            elif not ex.depends_on(node, MOVING):
                code = f"load(c, {self._constants.index(node)}, LANES)"
            else:
                code = self._coefficient_operation(node)
            self._coefficients[node] = self._assign(code)
        return self._coefficients[node]

    @staticmethod
    def _as_lane(code: str, node: Expr) -> str:
        return f"splat({code}, LANES)" if node.op == "const" else code

    def _coefficient_operation(self, node: Expr) -> str:
        a = [self.coefficient(x) for x in node.args]
        match node.op:
            case "add" | "sub" | "mul" | "div":
                return f"{a[0]} {dict(add='+', sub='-', mul='*', div='/')[node.op]} {a[1]}"
            case "neg":
                return f"-{a[0]}"
            case "pow":
                return f"libm_pow({a[0]}, {a[1]})"
            case "sqrt":
                return f"root({a[0]})"
        return f"libm_{node.op}({a[0]})"

    def _mask(self, condition: ex.Condition) -> str:
        if condition not in self._masks:
            if isinstance(condition, ex.Bit):
                code = f"load(side, {condition.guard}, LANES) > 0.0"
            elif isinstance(condition, ex.Relation):
                code = f"{held(self._builder.row_of_side(condition))} > 0.0"
            else:
                code = condition_code(
                    condition, lambda i: self._mask(ex.Bit(i)), self._mask, MASK_WORDS
                )
            self._masks[condition] = self._assign(code)
        return self._masks[condition]

    # -- sums --------------------------------------------------------------------------------------
    def _sum(
        self, products: list[tuple[str, str] | tuple[str]], start: str | None = None
    ) -> str | None:
        """``start + a*b + ...`` as a chain of fused multiply-adds, the latest value at its end."""
        total = start
        for factors in sorted(products, key=lambda factors: self._wait(" ".join(factors))):
            if len(factors) == 1:
                total = factors[0] if total is None else self._assign(f"{total} + {factors[0]}")
            elif total is None:
                total = self._assign(f"{factors[0]} * {factors[1]}")
            else:
                total = self._assign(f"fma({factors[0]}, {factors[1]}, {total})")
        return total

    def _times(self, value: str | None, number: float) -> str | None:
        if value is None or number == 1.0:
            return value
        return self._assign(f"{value} * {number!r}")

    def _over(self, value: str | None, k: int) -> str | None:
        """A value over k, rounded once. The rounding of 1/k alone would have the same sign in every
        step, and energy would drift with time.
        """
        rest = float(Fraction(1, k) - Fraction(1.0 / k))
        if value is None or rest == 0.0 or k > LAST_EXACT_DIVISOR:
            return self._times(value, 1.0 / k)
        return self._assign(f"fma({value}, {1.0 / k!r}, {value} * {rest!r})")

    def linear(self, form: Linear, k: int) -> str | None:
        """Coefficient k of a linear form; None if it is structurally zero."""
        total = (
            self.coefficient(form.offset) if k == 0 and not is_constant(form.offset, 0.0) else None
        )
        if total is not None and form.offset.op == "const":
            total = self._assign(f"splat({total}, LANES)")
        terms = [
            term
            for series, coefficient in form.terms.items()
            if (term := self._term(series, coefficient, k))
        ]
        for value, coefficient in sorted(terms, key=lambda term: self._wait(term[0])):
            if is_constant(coefficient, 1.0):
                total = value if total is None else self._assign(f"{total} + {value}")
            elif is_constant(coefficient, -1.0):
                total = self._assign(f"-{value}" if total is None else f"{total} - {value}")
            else:
                total = self._sum([(self.coefficient(coefficient), value)], total)
        return total

    def _term(self, series: Series, coefficient: Expr, k: int) -> tuple[str, Expr] | None:
        """Coefficient k of a series and its factor. A forcing's amplitude goes into its recurrence,
        once for all k.
        """
        frequency = (
            self._time_frequency(series.operands[0]) if series.kind in ("sin", "cos") else None
        )
        if frequency is not None and abs(_number(coefficient)) != 1.0:
            part = "sine" if series.kind == "sin" else "cosine"
            value = self._forcing(
                series.operands[0],
                frequency,
                k,
                part,
                self._as_lane(self.coefficient(coefficient), coefficient),
            )
            return value, ex.constant(1.0)
        plain = self.value(series, k)
        return None if plain is None else (plain, coefficient)

    # -- coefficients of series --------------------------------------------------------------------
    def named(self, name: str, k: int) -> str | None:
        """Coefficient k of the state of a name."""
        return self.state(self._index[name], k)

    def state(self, i: int, k: int) -> str | None:
        """Coefficient k of state i."""
        key = ("state", i, k)
        if key not in self._memo:
            if k == 0:
                self._memo[key] = self._assign(
                    f"load(y, {self._rows[i]}, LANES)", of_column=i >= self._shared
                )
            else:
                self._memo[key] = self._over(self.linear(self._fields[i], k - 1), k)
        return self._memo[key]

    def value(self, series: Series, k: int, part: str = "") -> str | None:
        """Coefficient k of a series (``part`` names a companion series that a recurrence carries
        along).
        """
        key = (series, k, part)
        if key not in self._memo:
            rule: Callable[..., str | None] = getattr(self, f"_{series.kind}")
            self._memo[key] = rule(series, k, part) if part else rule(series, k)
        return self._memo[key]

    def _derivative(self, series: Series, i: int) -> str | None:
        """``i * a_i``, the coefficients of the derivative."""
        key = (series, i, "derivative")
        if key not in self._memo:
            self._memo[key] = self._times(self.value(series, i), float(i))
        return self._memo[key]

    def _convolution(
        self,
        k: int,
        left: Callable[[int], str | None],
        right: Callable[[int], str | None],
        first: int,
        last: int,
    ) -> str | None:
        """``sum(left(i) * right(k - i) for i in first..last)``."""
        products = [(left(i), right(k - i)) for i in range(first, last + 1)]
        return self._sum([(a, b) for a, b in products if a is not None and b is not None])

    def _state(self, series: Series, k: int) -> str | None:
        return self.named(str(series.payload), k)

    def _time(self, _series: Series, k: int) -> str | None:
        if k == 0:
            return self._assign("load(clock, 0, LANES) + load(clock, 1, LANES)")
        return self._assign("splat(1.0, LANES)") if k == 1 else None

    def _since(self, series: Series, k: int) -> str | None:
        if k == 0:
            assert isinstance(series.payload, int)
            return self._assign(f"load(clock, 0, LANES) - {held(series.payload)}")
        return self._assign("splat(1.0, LANES)") if k == 1 else None

    def _linear(self, series: Series, k: int) -> str | None:
        form = series.payload
        assert isinstance(form, Linear)
        return self.linear(form, k)

    def _product(self, series: Series, k: int) -> str | None:
        a, b = series.operands
        if a is b:
            return self._square(a, k)
        return self._convolution(k, lambda i: self.value(a, i), lambda i: self.value(b, i), 0, k)

    def _square(self, a: Series, k: int) -> str | None:
        pairs = [(self.value(a, i), self.value(a, k - i)) for i in range((k - 1) // 2, 0, -1)]
        half = self._sum([(p, q) for p, q in pairs if p is not None and q is not None])
        total = None if half is None else self._assign(f"{half} + {half}")
        middle = self.value(a, k // 2) if k % 2 == 0 else None
        if middle is not None:
            total = self._sum([(middle, middle)], total)
        first, newest = self.value(a, 0), self.value(a, k)
        if k > 0 and first is not None and newest is not None:
            key = (a, 0, "doubled")
            if key not in self._memo:
                self._memo[key] = self._assign(f"{first} + {first}")
            total = self._sum([(str(self._memo[key]), newest)], total)
        return total

    def _inverse(self, a: Series, factor: float = 1.0) -> str:
        key = (a, 0, f"inverse{factor}")
        if key not in self._memo:
            self._memo[key] = self._assign(f"{1.0 / factor!r} / {self._zero(self.value(a, 0))}")
        return str(self._memo[key])

    def _zero(self, value: str | None) -> str:
        return "splat(0.0, LANES)" if value is None else value

    def _difference(self, a: str | None, b: str | None) -> str | None:
        if b is None:
            return a
        return self._assign(f"-{b}" if a is None else f"{a} - {b}")

    def _quotient(self, series: Series, k: int) -> str | None:
        a, b = series.operands
        if k == 0:
            return self._assign(f"{self._zero(self.value(a, 0))} / {self._zero(self.value(b, 0))}")
        known = self._convolution(
            k, lambda i: self.value(b, i), lambda i: self.value(series, i), 1, k
        )
        rest = self._difference(self.value(a, k), known)
        return None if rest is None else self._assign(f"{rest} * {self._inverse(b)}")

    def _power(self, series: Series, k: int) -> str | None:
        (a,) = series.operands
        exponent = series.payload
        assert isinstance(exponent, Expr)
        r = self.coefficient(exponent)
        if k == 0:
            if is_constant(exponent, -1.0):
                return self._inverse(a)
            return self._assign(f"libm_pow({self._zero(self.value(a, 0))}, {r})")
        products: list[tuple[str, str]] = []
        for j in range(k):
            x, p = self.value(a, k - j), self.value(series, j)
            if x is not None and p is not None:
                weight = (
                    repr(exponent.payload * (k - j) - j)
                    if exponent.op == "const"
                    else (f"({r} * {float(k - j)!r} - {float(j)!r})")
                )
                products.append((self._assign(f"{x} * {weight}"), p))
        total = self._times(self._sum(list(products)), 1.0 / k)
        return None if total is None else self._assign(f"{total} * {self._inverse(a)}")

    def _sqrt(self, series: Series, k: int) -> str | None:
        (a,) = series.operands
        if k == 0:
            return self._assign(f"root({self._zero(self.value(a, 0))})")
        known = (
            self._convolution(
                k, lambda i: self.value(series, i), lambda i: self.value(series, i), 1, k - 1
            )
            if k > 1
            else None
        )
        rest = self._difference(self.value(a, k), known)
        return None if rest is None else self._assign(f"{rest} * {self._inverse(series, 2.0)}")

    def _exp(self, series: Series, k: int) -> str | None:
        (a,) = series.operands
        if k == 0:
            return self._assign(f"libm_exp({self._zero(self.value(a, 0))})")
        total = self._convolution(
            k, lambda i: self._derivative(a, i), lambda i: self.value(series, i), 1, k
        )
        return self._times(total, 1.0 / k)

    def _log(self, series: Series, k: int) -> str | None:
        (a,) = series.operands
        if k == 0:
            return self._assign(f"libm_log({self._zero(self.value(a, 0))})")
        known = (
            None
            if k == 1
            else self._convolution(
                k, lambda i: self._derivative(series, i), lambda i: self.value(a, i), 1, k - 1
            )
        )
        rest = self._difference(self.value(a, k), self._times(known, 1.0 / k))
        return None if rest is None else self._assign(f"{rest} * {self._inverse(a)}")

    # -- sine and cosine ---------------------------------------------------------------------------
    def _sin(self, series: Series, k: int) -> str | None:
        return self._harmonic(series.operands[0], k, "sine")

    def _cos(self, series: Series, k: int) -> str | None:
        return self._harmonic(series.operands[0], k, "cosine")

    def _harmonic(self, a: Series, k: int, part: str) -> str | None:
        key = (a, k, part)
        if key not in self._memo:
            frequency = self._time_frequency(a)
            if k == 0:
                angle = self._assign_angle(a, frequency)
                names = f"s{self._count}", f"s{self._count + 1}"
                self._count += 2
                self.lines.assign(", ".join(names), f"sincos({angle})")
                self._depth |= dict.fromkeys(names, self._wait(angle) + SINE)
                self._memo[a, 0, "sine"], self._memo[a, 0, "cosine"] = names
            elif frequency is not None:
                return self._forcing(a, frequency, k, part)
            else:
                other, sign = ("cosine", 1.0) if part == "sine" else ("sine", -1.0)
                total = self._convolution(
                    k, lambda i: self._derivative(a, i), lambda i: self._harmonic(a, i, other), 1, k
                )
                self._memo[key] = self._times(total, sign / k)
        return self._memo[key]

    @staticmethod
    def _time_frequency(a: Series) -> tuple[Expr, Expr] | None:
        """(angular frequency, offset) if the argument is affine in time and nothing else."""
        if a.kind == "time":
            return ex.constant(1.0), ex.constant(0.0)
        if (
            a.kind == "linear"
            and isinstance(a.payload, Linear)
            and [s.kind for s in a.payload.terms] == ["time"]
        ):
            (rate,) = a.payload.terms.values()
            if not ex.depends_on(rate, MOVING) and not ex.depends_on(a.payload.offset, MOVING):
                return rate, a.payload.offset
        return None

    def _assign_angle(self, a: Series, frequency: tuple[Expr, Expr] | None) -> str:
        if frequency is None:
            return self._zero(self.value(a, 0))
        row = 2 + self.harmonics.setdefault(frequency, len(self.harmonics))
        return self._assign(
            f"fma({self._rate(frequency)}, load(clock, 0, LANES), load(clock, {row}, LANES))"
        )

    def _rate(self, frequency: tuple[Expr, Expr]) -> str:
        key = (frequency[0], 0, "rate")
        if key not in self._memo:
            rate = frequency[0]
            self._memo[key] = self._assign(self._as_lane(self.coefficient(rate), rate))
        return str(self._memo[key])

    def _forcing(
        self, a: Series, frequency: tuple[Expr, Expr], k: int, part: str, amplitude: str = ""
    ) -> str:
        """Coefficient of sin or cos(rate*t + offset), times an amplitude: two orders back times
        -rate^2/(k(k-1)).
        """
        key = (a, k, part, amplitude)
        if key not in self._memo:
            self._memo[key] = self._assign(self._forcing_code(a, frequency, k, part, amplitude))
        return str(self._memo[key])

    def _forcing_code(
        self, a: Series, frequency: tuple[Expr, Expr], k: int, part: str, amplitude: str
    ) -> str:
        if k == 0:
            return f"{amplitude} * {self._harmonic(a, 0, part)}"
        rate = self._rate(frequency)
        if k == 1:
            other = "cosine" if part == "sine" else "sine"
            first = (
                self._forcing(a, frequency, 0, other, amplitude)
                if amplitude
                else self._harmonic(a, 0, other)
            )
            return f"{rate} * {first}" if part == "sine" else f"-({rate} * {first})"
        squared = (frequency[0], 0, "squared")
        if squared not in self._memo:
            self._memo[squared] = self._assign(f"-({rate} * {rate})")
        share = (frequency[0], k, "share")
        if share not in self._memo:
            self._memo[share] = self._assign(f"{self._memo[squared]} * {1.0 / (k * (k - 1))!r}")
        before = (
            self._forcing(a, frequency, k - 2, part, amplitude)
            if amplitude or k > 2
            else self._harmonic(a, 0, part)
        )
        return f"{self._memo[share]} * {before}"

    # -- functions through their differential equations --------------------------------------------
    def _tan(self, series: Series, k: int, part: str = "") -> str | None:
        return self._tangent(series, k, part, "libm_tan", 1.0)

    def _tanh(self, series: Series, k: int, part: str = "") -> str | None:
        return self._tangent(series, k, part, "libm_tanh", -1.0)

    def _tangent(self, series: Series, k: int, part: str, function: str, sign: float) -> str | None:
        """y = tan a: y' = a' w with w = 1 + y^2; tanh: w = 1 - y^2."""
        (a,) = series.operands
        if part == "w":
            square = self._square_of(series, k)
            if k == 0:
                return self._assign(f"1.0 {'+' if sign > 0 else '-'} {square}")
            return self._times(square, sign)
        if k == 0:
            return self._assign(f"{function}({self._zero(self.value(a, 0))})")
        total = self._convolution(
            k, lambda i: self._derivative(a, i), lambda i: self.value(series, i, "w"), 1, k
        )
        return self._times(total, 1.0 / k)

    def _square_of(self, series: Series, k: int) -> str | None:
        return self._convolution(
            k, lambda i: self.value(series, i), lambda i: self.value(series, i), 0, k
        )

    def _atan(self, series: Series, k: int, part: str = "") -> str | None:
        """y = atan a: w y' = a' with w = 1 + a^2."""
        (a,) = series.operands
        if part == "w":
            square = self._square_of(a, k)
            return self._assign(f"1.0 + {self._zero(square)}") if k == 0 else square
        if k == 0:
            return self._assign(f"libm_atan({self._zero(self.value(a, 0))})")
        known = None
        if k > 1:
            known = self._convolution(
                k,
                lambda i: self._derivative(series, i),
                lambda i: self.value(series, i, "w"),
                1,
                k - 1,
            )
        rest = self._difference(self.value(a, k), self._times(known, 1.0 / k))
        key = (series, 0, "inverse w")
        if key not in self._memo:
            self._memo[key] = self._assign(f"1.0 / {self.value(series, 0, 'w')}")
        return None if rest is None else self._assign(f"{rest} * {self._memo[key]}")

    def _select(self, series: Series, k: int) -> str | None:
        a, b = (self._zero(self.value(s, k)) for s in series.operands)
        assert isinstance(series.payload, ex.Condition)
        return self._assign(f"select({self._mask(series.payload)}, {a}, {b})")

    # -- what the crossing of contacts needs -------------------------------------------------------
    def size(self, form: Linear) -> str:
        """``|offset| + sum |coefficient * value|``: the scale of the rounding error of a linear
        form.
        """
        total = self._assign(
            f"magnitude({self._as_lane(self.coefficient(form.offset), form.offset)})"
        )
        for series, coefficient in form.terms.items():
            product = self._terms_of(series)
            if not is_constant(coefficient, 1.0) and not is_constant(coefficient, -1.0):
                product = self._assign(f"{self.coefficient(coefficient)} * {product}")
            total = self._assign(f"{total} + magnitude({product})")
        return total

    def _terms_of(self, series: Series) -> str:
        """The value of a series, as a scale of its rounding error."""
        return self._zero(self.value(series, 0))

    def rounding(self, form: Linear) -> str:
        """Scale of the rounding error of a linear form with the errors of its arguments: the cosine
        of an angle next to pi/2 is as wrong as the angle.
        """
        total = self._assign(
            f"magnitude({self._as_lane(self.coefficient(form.offset), form.offset)})"
        )
        for series, coefficient in form.terms.items():
            part = self._rounding(series)
            if not is_constant(coefficient, 1.0) and not is_constant(coefficient, -1.0):
                part = f"magnitude({self.coefficient(coefficient)} * {part})"
            total = self._assign(f"{total} + {part}")
        return total

    def _rounding(self, series: Series) -> str:
        """The same scale for one series, to first order in the errors of its operands."""
        key = (series, 0, "rounding")
        if key not in self._memo:
            self._memo[key] = self._assign(self._rounding_code(series))
        return str(self._memo[key])

    def _rounding_code(self, series: Series) -> str:
        own = f"magnitude({self._terms_of(series)})"
        match series.kind:
            case "linear":
                assert isinstance(series.payload, Linear)
                return self.rounding(series.payload)
            case "select":
                assert isinstance(series.payload, ex.Condition)
                sizes = ", ".join(map(self._rounding, series.operands))
                return f"select({self._mask(series.payload)}, {sizes})"
            case "product":
                a, b = series.operands
                x, y = (f"magnitude({self._zero(self.value(s, 0))})" for s in (a, b))
                return f"{x} * {self._rounding(b)} + {y} * {self._rounding(a)}"
            case "sin" | "cos" if self._time_frequency(series.operands[0]) is None:
                angle = series.operands[0]
                other = self._harmonic(angle, 0, "cosine" if series.kind == "sin" else "sine")
                return f"{own} + {self._rounding(angle)} * magnitude({other})"
        return own

    def write(self, row: int, value: str | None, of_column: bool = False) -> None:
        """Store a coefficient to a row of ``work``."""
        self.lines.do(f"store(work, {row}, {self._zero(value)})", of_column)
