"""Normal forms: which expressions are the same boundary."""

import pytest

from saltus.language import expression as ex
from saltus.language.canonical import Canonical, proportion

X, V, P, Q, T = ex.state("x"), ex.state("v"), ex.parameter("p"), ex.parameter("q"), ex.TIME
SIN = ex.elementary("sin", P * T)


@pytest.mark.parametrize(
    ("a", "b", "sign"),
    [
        (X - P, X - P, 1),
        (X - P, P - X, -1),
        (X - P, 2 * X - 2 * P, 1),
        (X - P, (P - X) / 3, -1),
        (X - P, 0.1 * X - P / 10, 1),
        (X - P - Q, X - (Q + P), 1),
        ((X - P) * (X + P), X**2 - P**2, 1),
        (X * V - P, V * X - P, 1),
        (X - SIN, X - ex.elementary("sin", T * P), 1),
        (X / P - 1, 1 - X * P**-1, -1),
        ((X + P) ** 3, X**3 + 3 * X**2 * P + 3 * X * P**2 + P**3, 1),
        (1 / (X + P), 1 / (P + X), 1),
        (X**P - 1, 2 * X**P - 2, 1),
        (ex.select(ex.Bit(0), X, -X) - P, P - ex.select(ex.Bit(0), X, -X), -1),
        (X - P, X + P, 0),
        (X - P, X - Q, 0),
        (X - P, P * X - P**2, 0),
        (X - P, X - P + 1e-9, 0),
        (ex.select(ex.Bit(0), X, -X), ex.select(ex.Bit(1), X, -X), 0),
        (X**13, X**13 * 2, 1),
    ],
)
def test_proportion(a, b, sign):
    canonical = Canonical()
    assert proportion(canonical.polynomial(a), canonical.polynomial(b)) == sign
    assert proportion(canonical.polynomial(b), canonical.polynomial(a)) == sign


def test_sums_that_cancel_are_empty_and_huge_products_stay_small():
    canonical = Canonical()
    assert canonical.polynomial((X + P) ** 2 - X**2 - 2 * X * P - P**2) == {}
    huge = (X + V + P + Q) ** 12 * (X + V + P + Q + T) ** 12
    assert len(canonical.polynomial(huge)) <= 200
    assert proportion(canonical.polynomial(huge), canonical.polynomial(-huge)) == -1


def test_what_a_value_depends_on():
    canonical = Canonical()

    def kinds(expression):
        return canonical.kinds(canonical.polynomial(expression))

    assert kinds(P + SIN) == {"param", "time"}
    assert kinds(X + P - X) == {"param"}
    assert kinds(ex.select(ex.Bit(0), P, 1.0)) == {"select", "param"}
