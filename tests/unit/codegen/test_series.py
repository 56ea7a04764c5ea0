"""Flattening of equations: what becomes a coefficient, what a series, what disappears."""

from __future__ import annotations

import pytest

from saltus.codegen.series import SeriesBuilder, is_constant
from saltus.language import expression as ex
from saltus.language.evaluate import evaluate

pytestmark = pytest.mark.nojit
x, v, t = ex.state("x"), ex.state("v"), ex.TIME
a, b = ex.parameter("a"), ex.parameter("b")
SIDE = ex.Bit(0)


def terms(node):
    """A form as (offset, {state or kind of series: coefficient}), numbers for a = 2, b = 3."""
    form = SeriesBuilder().form(node)
    offset, *coefficients = evaluate(
        [form.offset, *form.terms.values()], values={"a": 2.0, "b": 3.0}
    )
    return offset, dict(
        zip(
            (s.payload if s.kind == "state" else s.kind for s in form.terms),
            coefficients,
            strict=True,
        )
    )


@pytest.mark.parametrize(
    ("node", "offset", "coefficients"),
    [
        (a * x + b * x + 7.0, 7, {"x": 5}),
        (x - v + 2.0 * t, 0, {"x": 1, "v": -1, "time": 2}),
        (a * (x - b), -6, {"x": 2}),
        ((x + v) - x, 0, {"v": 1}),
        (-(x / a), 0, {"x": -0.5}),
        ((a * x) * (b * x), 0, {"product": 6}),
        ((a * x) ** 3, 0, {"product": 8}),
        (a * x**2 - a * x**2, 0, {}),
        (a**2 + ex.elementary("sqrt", b), 4 + 3**0.5, {}),
        (b / x, 0, {"power": 3}),
        ((a * x) / (b * v), 0, {"quotient": 2 / 3}),
        (x**0.5, 0, {"sqrt": 1}),
        (x**a, 0, {"power": 1}),
    ],
)
def test_linear_forms(node, offset, coefficients):
    assert terms(node) == (offset, coefficients)


def test_pieces_that_are_finite_everywhere_become_coefficients():
    form = SeriesBuilder().form(ex.select(SIDE, a * (x - b), v * v))
    assert form.offset.op == "select"
    assert {s.kind: c.op for s, c in form.terms.items()} == {"state": "select", "product": "select"}


@pytest.mark.parametrize(
    "risky",
    [
        ex.elementary("sqrt", x),
        ex.elementary("log", x),
        1.0 / x,
        x / v,
        x**1.5,
        ex.elementary("exp", x),
    ],
)
def test_pieces_that_may_be_undefined_stay_a_selection_of_series(risky):
    form = SeriesBuilder().form(ex.select(SIDE, risky, a * x))
    assert [s.kind for s in form.terms] == ["select"]
    assert is_constant(form.offset, 0.0)


def test_a_division_is_pushed_into_the_branches():
    """(select(a, b) x) / c: the quotients a/c and b/c are worked out once per trajectory, not at
    every step.
    """
    form = SeriesBuilder().form((ex.select(SIDE, a, b) * x) / ex.parameter("c"))
    (coefficient,) = form.terms.values()
    assert coefficient.op == "select"
    assert [branch.op for branch in coefficient.args] == ["div", "div"]


def test_equal_series_are_one_series():
    builder = SeriesBuilder()
    square, again = builder.form(x * x), builder.form(3.0 * (x**2))
    assert list(square.terms) == list(again.terms)
    (fourth,) = builder.form(x**4).terms
    assert set(fourth.operands) == set(square.terms)  # x^4 is the square of the square


def test_a_function_of_parameters_only_is_a_coefficient():
    assert not SeriesBuilder().form(ex.elementary("sin", a) * b).terms
