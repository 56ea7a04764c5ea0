"""Numbers from expressions."""

import numpy as np

from saltus.language import expression as ex
from saltus.language.evaluate import evaluate

X = ex.state("x")


def test_conditions():
    a, b = X > 0, X > 1
    cases = {-1.0: (0, 0, 1), 0.5: (0, 1, 0), 2.0: (1, 1, 0)}
    for x, expected in cases.items():
        found = evaluate(
            [ex.select(condition, 1, 0) for condition in (a & b, a | b, ~a)], states={"x": x}
        )
        assert tuple(found) == expected


def test_undefined_values_come_without_a_warning():
    assert np.isnan(evaluate([ex.elementary("log", X)], states={"x": -1.0})[0])
    assert np.isinf(evaluate([1 / X], states={"x": 0.0})[0])
