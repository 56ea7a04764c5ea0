"""Functions of traced values and of plain numbers."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from saltus.errors import TraceError
from saltus.language import abs, atan, cos, exp, log, max, min, pi, piecewise, sin, sqrt, tan, tanh
from saltus.language import expression as ex
from saltus.language.evaluate import evaluate

X, V, P = ex.state("x"), ex.state("v"), ex.parameter("p")
numbers = st.floats(-10, 10)


@pytest.mark.parametrize("function", [sqrt, exp, log, sin, cos, tan, atan, tanh])
def test_numbers_give_numbers_and_symbols_nodes(function):
    assert function(0.7) == getattr(math, function.__name__)(0.7)
    assert type(function(0.7)) is float
    assert function(X).op == function.__name__
    assert evaluate([function(X)], states={"x": 0.7})[0] == pytest.approx(function(0.7), rel=1e-15)


def test_pi():
    assert pi == math.pi


@given(a=numbers, b=numbers, c=numbers)
def test_extremes_and_absolute_value(a, b, c):
    values = {"x": a, "v": b}
    assert min(a, b, c) == sorted((a, b, c))[0]
    assert max(a, b, c) == sorted((a, b, c))[2]
    assert evaluate([min(X, V, c), max(X, V, c), abs(X)], states=values) == [
        min(a, b, c),
        max(a, b, c),
        abs(a),
    ]


def test_extremes_of_one_or_equal_values():
    assert min(X) is X
    assert max(X, X) is X
    assert repr(max(2, 3, X)) == repr(max(3, X))
    assert min(4) == 4


def test_absolute_value_of_parameters_is_no_guard():
    assert "select" not in {node.op for node in ex.walk(abs(P))}
    assert evaluate([abs(P)], values={"p": -3.5})[0] == 3.5


@given(x=numbers)
def test_piecewise_on_numbers_and_symbols_agree(x):
    def law(x):
        return piecewise(
            (2 * (x + 1), x < -1), (3 * (x - 2), (x > 2) & ~(x > 5)), (-x, x > 5), otherwise=0
        )

    def on_numbers(x):
        return piecewise(
            (2 * (x + 1), x < -1), (3 * (x - 2), x > 2 and not x > 5), (-x, x > 5), otherwise=0
        )

    value = on_numbers(x)
    assert type(value) is float
    assert evaluate([law(X)], states={"x": x})[0] == value


def test_plain_conditions_are_decided_at_once():
    assert piecewise((X, True), (V, X > 0), otherwise=0) is X
    assert piecewise((X, False), (V, np.bool_(True)), otherwise=0) is V
    assert piecewise(otherwise=2) == 2.0


@pytest.mark.parametrize(
    ("pieces", "teaches"),
    [
        ([X], "is a pair"),
        ([(X, X > 0, 1)], "is a pair"),
        ([(X > 0, X)], "begins with its value"),
        ([(X, 1)], "must be a comparison"),
        ([(X, X)], "must be a comparison"),
    ],
)
def test_errors_teach(pieces, teaches):
    with pytest.raises(TraceError, match=teaches):
        piecewise(*pieces, otherwise=0)
