"""Nodes, folding, and what an equation may not do with them."""

import copy
import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from saltus.errors import TraceError
from saltus.language import expression as ex

X, V, P = ex.state("x"), ex.state("v"), ex.parameter("p")


def test_the_same_operation_on_the_same_operands_is_one_object():
    assert X * P + 1 is X * P + 1
    assert X * P is not P * X
    assert copy.deepcopy(X * P) is X * P
    assert ex.select(ex.Bit(0), X, P) is ex.select(ex.Bit(0), X, P)


@pytest.mark.parametrize(
    ("folded", "expected"),
    [
        (X + 0, X), (0 + X, X), (X - 0, X), (0 - X, -X), (0 - (-X), X), (X * 1, X), (1 * X, X),
        (X / 1, X), (X**1, X), (+X, X),
        (X * 0, ex.constant(0)), (X**0, ex.constant(1)), (X - X, ex.constant(0)),
        (0 / X, ex.constant(0)),
        (ex.constant(2) ** 3, ex.constant(8)), (abs(ex.constant(-2)), ex.constant(2)),
        (ex.elementary("cos", 0), ex.constant(1)),
        (ex.select(ex.Bit(0), X, X), X), (np.float64(2) * X, 2 * X), (X * np.float64(2), X * 2),
    ],
)  # fmt: skip
def test_only_constants_and_neutral_elements_are_folded(folded, expected):
    assert folded is expected


def test_a_power_that_varies_is_an_exponential():
    assert 2**X is ex.elementary("exp", X * ex.elementary("log", 2))
    assert (X**P).op == "pow"


@pytest.mark.parametrize(
    ("what", "teaches"),
    [
        (lambda: X == P, "measure zero"),
        (lambda: bool(X), "in place of `if`"),
        (lambda: float(X), "sl.cos"),
        (lambda: math.cos(X), "sl.cos"),
        (lambda: list(X), "iterated"),
        (lambda: 1 if X > P else 0, "as a Python truth value"),
        (lambda: 0 < X < 1, "as a Python truth value"),
        (lambda: min(X, 0), "sl.min and sl.max"),
        (lambda: (X > 0) & True, "must be a comparison"),
        (lambda: (X > 0) + X, "comparison was used as a number"),
        (lambda: X / 0, "divides by the constant zero"),
        (lambda: X + math.nan, "must be finite"),
        (lambda: X + math.inf, "must be finite"),
        (lambda: ex.constant(10.0) ** 400, "must be finite"),
        (lambda: ex.constant(0) ** -1, "must be finite"),
        (lambda: ex.constant(-1) ** 0.5, "not real"),
        (lambda: ex.elementary("log", -1), "not a finite real number"),
        (lambda: ex.elementary("exp", 1000), "not a finite real number"),
        (lambda: X + "0.4 mm", "write SI numbers"),
        (lambda: X + "0.4", "write SI numbers"),
        (lambda: X + None, "neither a number"),
        (lambda: X + np.array([1.0, 2.0]), "an array"),
    ],
)
def test_errors_teach(what, teaches):
    with pytest.raises(TraceError, match=teaches):
        what()


def test_threads_share_their_nodes():
    def trace(_):
        return [ex.state(f"shared{i}") * ex.parameter("p") + i for i in range(200)]

    with ThreadPoolExecutor(8) as pool:
        results = list(pool.map(trace, range(8)))
    assert all(a is b for result in results for a, b in zip(result, results[0], strict=True))


def test_deep_sums_do_not_overflow_the_stack():
    total = X
    for i in range(5000):
        total = total + i * V
    assert sum(1 for _ in ex.walk(total)) > 5000
    assert ex.depends_on(total, ("state",))
    assert len(repr(total)) < 1000
