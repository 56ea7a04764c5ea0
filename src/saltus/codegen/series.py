"""Equations as linear combinations of series: the form in which Taylor recurrences are cheapest.

A field such as ``(drive - contact)/mass - 2*zeta*wn*v - wn**2*x - cubic/mass*x**3`` is flattened to
``sum(coefficient * series)``: the coefficients depend on parameters and mode only and are worked
out once per step at most, the series (states, products, elementary functions) carry the Taylor
coefficients. Piecewise laws whose pieces are finite everywhere dissolve into mode-dependent
coefficients; pieces that may be undefined on the other side (roots, logarithms, quotients) stay a
selection of series.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from saltus.codegen.clocks import Clocks
from saltus.language import expression as ex
from saltus.language.expression import Expr

#: Kinds of series whose value is finite wherever their operands are.
_TOTAL = ("state", "time", "since", "product", "sin", "cos", "atan", "tanh", "linear")
#: Most branches into which a factor is pushed: those of a product of pieces multiply.
_MOST_BRANCHES = 64


@dataclass(frozen=True, eq=False)
class Series:
    """One series.

    Attributes
    ----------
    kind : str
        ``state``, ``time``, ``since`` (time since the reference of a clock's polynomial),
        ``linear``, ``product``, ``quotient``, ``power``, ``select``, or an elementary function.
    operands : tuple of Series
        Its arguments.
    payload : object
        Name of a state, row of a reference, exponent (Expr) of a power, condition of a select,
        :class:`Linear` of a linear series.
    """

    kind: str
    operands: tuple[Series, ...] = ()
    payload: object = None

    @property
    def total(self) -> bool:
        """True if the series is finite wherever the states are."""
        return self.kind in _TOTAL and all(s.total for s in self.operands)


@dataclass
class Linear:
    """``offset + sum(terms[s] * s)``; coefficients are expressions of parameters and mode bits
    only.
    """

    offset: Expr
    terms: dict[Series, Expr] = field(default_factory=dict)


def is_constant(coefficient: Expr, value: float) -> bool:
    """True if a coefficient is the literal ``value``."""
    return coefficient.op == "const" and coefficient.payload == value


def _scale(factor: Expr, c: Expr, by_division: bool = False) -> Expr:
    """``c * factor`` (or ``c / factor``), pushed into the branches of a mode selection so that
    nothing is divided at run time; with many branches the product is kept.
    """
    pushed = _branches(c) * (1 if by_division else _branches(factor)) <= _MOST_BRANCHES
    return _scaled_branches(factor, c, by_division, pushed, {})


def _scaled_branches(
    factor: Expr, c: Expr, by_division: bool, pushed: bool, memo: dict[tuple[Expr, Expr], Expr]
) -> Expr:
    if (factor, c) in memo:
        return memo[factor, c]

    def scaled(factor: Expr, c: Expr) -> Expr:
        return _scaled_branches(factor, c, by_division, pushed, memo)

    if c.op == "select" and pushed:
        made = ex.select(c.payload, *(scaled(factor, branch) for branch in c.args))
    elif c.op == "neg":
        made = ex.neg(scaled(factor, c.args[0]))
    elif factor.op == "select" and pushed and not by_division:
        made = ex.select(factor.payload, *(scaled(branch, c) for branch in factor.args))
    else:
        made = ex.div(c, factor) if by_division else ex.mul(c, factor)
    memo[factor, c] = made
    return made


def _branches(c: Expr) -> int:
    """Number of different branches of a coefficient, counted until they are too many."""
    seen, stack, count = {c}, [c], 0
    while stack and count <= _MOST_BRANCHES:
        top = stack.pop()
        count += top.op not in ("select", "neg")
        for below in top.args if top.op in ("select", "neg") else ():
            if below not in seen:
                seen.add(below)
                stack.append(below)
    return count


def _may_hide(series: Series) -> bool:
    if series.kind in ("state", "time", "since", "linear"):
        return False
    if series.kind == "product":
        return _degree_in_time(series) > 8
    return not (series.kind in ("sin", "cos") and _of_time(series.operands[0]))


def _degree_in_time(series: Series) -> int:
    """Power of time in a product."""
    if series.kind == "product":
        return sum(_degree_in_time(s) for s in series.operands)
    return int(_of_time(series))


def _of_time(series: Series) -> bool:
    """True if a series is time, or a linear form of time only."""
    return series.kind in ("time", "since") or (
        series.kind == "linear" and all(s.kind in ("time", "since") for s in series.operands)
    )


class SeriesBuilder:
    """Turns expressions into :class:`Linear` forms over shared series; ``clocks`` numbers the
    switches, remainders and tables in them.
    """

    def __init__(self, clocks: Clocks | None = None) -> None:
        self._clocks = clocks
        self._known: dict[tuple[Any, ...], Series] = {}
        self._forms: dict[Expr, Linear] = {}

    def form(self, node: Expr) -> Linear:
        """The linear form of an expression."""
        for step in ex.walk(node, conditions=False):
            if step not in self._forms:
                self._forms[step] = self._flatten(step)
        return self._forms[node]

    def series(self, node: Expr) -> Series:
        """The expression as one series."""
        return self._as_series(self.form(node))

    def row_of_side(self, relation: ex.Relation) -> int:
        """Row in which the clocks hold the side of a switch."""
        assert self._clocks is not None
        return self._clocks.row_of_side(relation)

    def may_hide(self) -> bool:
        """True if a series can be negligible where it is expanded and large within the step, so
        that its coefficients don't show it.

        ``tanh`` and ``exp`` far from their bend, a high power of time: all but sums and products of
        states and harmonics of time.
        """
        return any(_may_hide(series) for series in self._known.values())

    # -- one node ----------------------------------------------------------------------------------
    def _flatten(self, node: Expr) -> Linear:
        if not ex.depends_on(node, ("state", "time")):
            return Linear(node)
        forms = [self._forms[a] for a in node.args]
        match node.op:
            case "state" | "time":
                return self._unit(self._make(node.op, (), node.payload))
            case "add":
                return self._combine(forms[0], forms[1], ex.add)
            case "sub":
                return self._combine(forms[0], forms[1], ex.sub)
            case "neg":
                return self._scaled(ex.constant(-1.0), forms[0])
            case "mul":
                return self._product(*forms)
            case "div":
                return self._quotient(*forms)
            case "pow":
                return self._power(forms[0], node.args[1])
            case "select":
                return self._selection(node.payload, *forms)
            case "mod" | "table":
                return self._polynomial(node)
        return self._unit(self._make(node.op, (self._as_series(forms[0]),)))

    def _polynomial(self, node: Expr) -> Linear:
        """The present piece of a remainder or a table: the coefficients in its clock, times powers
        of the time since its reference.
        """
        assert self._clocks is not None
        offset, *rest = (Expr("held", (), row) for row in self._clocks.rows_of_coefficients(node))
        since = self._make("since", (), self._clocks.row_of_reference(node))
        return Linear(
            offset,
            {
                self._multiply_out(since, k): coefficient
                for k, coefficient in enumerate(rest, start=1)
            },
        )

    def _make(self, kind: str, operands: tuple[Series, ...], payload: object = None) -> Series:
        key = (kind, payload, tuple(map(id, operands)))
        return self._known.setdefault(key, Series(kind, operands, payload))

    @staticmethod
    def _unit(series: Series) -> Linear:
        return Linear(ex.constant(0.0), {series: ex.constant(1.0)})

    def _as_series(self, form: Linear) -> Series:
        if len(form.terms) == 1 and is_constant(form.offset, 0.0):
            ((series, coefficient),) = form.terms.items()
            if is_constant(coefficient, 1.0):
                return series
        key = ("linear", form.offset, tuple((id(s), c) for s, c in form.terms.items()))
        return self._known.setdefault(key, Series("linear", tuple(form.terms), form))

    @staticmethod
    def _combine(a: Linear, b: Linear, op: Callable[[Expr, Expr], Expr]) -> Linear:
        zero = ex.constant(0.0)
        terms = dict(a.terms)
        for series, coefficient in b.terms.items():
            terms[series] = op(terms.get(series, zero), coefficient)
        return Linear(
            op(a.offset, b.offset), {s: c for s, c in terms.items() if not is_constant(c, 0.0)}
        )

    @staticmethod
    def _scaled(factor: Expr, form: Linear, by_division: bool = False) -> Linear:
        if is_constant(factor, -1.0):
            return Linear(ex.neg(form.offset), {s: ex.neg(c) for s, c in form.terms.items()})
        return Linear(
            _scale(factor, form.offset, by_division),
            {s: _scale(factor, c, by_division) for s, c in form.terms.items()},
        )

    def _split_factor(self, form: Linear) -> tuple[Expr, Series]:
        """A form as coefficient times series, the coefficient pulled out if there is
        only one term.
        """
        if len(form.terms) == 1 and is_constant(form.offset, 0.0):
            ((series, coefficient),) = form.terms.items()
            return coefficient, series
        return ex.constant(1.0), self._as_series(form)

    def _product(self, a: Linear, b: Linear) -> Linear:
        if not a.terms:
            return self._scaled(a.offset, b)
        if not b.terms:
            return self._scaled(b.offset, a)
        (ca, sa), (cb, sb) = self._split_factor(a), self._split_factor(b)
        return self._scaled(_scale(ca, cb), self._unit(self._make("product", (sa, sb))))

    def _quotient(self, a: Linear, b: Linear) -> Linear:
        if not b.terms:
            return self._scaled(b.offset, a, by_division=True)
        cb, sb = self._split_factor(b)
        if a.terms:
            ca, sa = self._split_factor(a)
            quotient = self._unit(self._make("quotient", (sa, sb)))
        else:
            ca, quotient = a.offset, self._unit(self._make("power", (sb,), ex.constant(-1.0)))
        return self._scaled(cb, self._scaled(ca, quotient), by_division=True)

    def _power(self, base: Linear, exponent: Expr) -> Linear:
        coefficient, series = self._split_factor(base)
        if (
            exponent.op == "const"
            and exponent.payload == int(exponent.payload)
            and 0 < exponent.payload <= 64
        ):
            return self._scaled(
                self._whole_power(coefficient, exponent.payload),
                self._unit(self._multiply_out(series, int(exponent.payload))),
            )
        if not is_constant(coefficient, 1.0):
            series = self._as_series(base)
        if is_constant(exponent, 0.5):
            return self._unit(self._make("sqrt", (series,)))
        return self._unit(self._make("power", (series,), exponent))

    @staticmethod
    def _whole_power(coefficient: Expr, exponent: float) -> Expr:
        return coefficient if is_constant(coefficient, 1.0) else ex.power(coefficient, exponent)

    def _multiply_out(self, series: Series, exponent: int) -> Series:
        if exponent == 1:
            return series
        half = self._multiply_out(series, exponent // 2)
        square = self._make("product", (half, half))
        return self._make("product", (series, square)) if exponent % 2 else square

    def _selection(self, condition: ex.Condition, a: Linear, b: Linear) -> Linear:
        if all(s.total for s in (*a.terms, *b.terms)):
            zero = ex.constant(0.0)
            terms = {
                s: ex.select(condition, a.terms.get(s, zero), b.terms.get(s, zero))
                for s in {**a.terms, **b.terms}
            }
            return Linear(ex.select(condition, a.offset, b.offset), terms)
        return self._unit(self._make("select", (self._as_series(a), self._as_series(b)), condition))
