"""Expressions that are never negative, as they are written."""

import pytest

import saltus as sl
from saltus.contact.signs import never_negative_if


def conditions(slip):
    """What must not be negative for a force of friction ``slip(x, v, a, b)`` never to be: the texts
    of expressions of the parameters a and b.
    """

    @sl.system(states="x v")
    def one(t, x, v, *, a=1.0, b=1.0):
        return a * v, b - sl.friction(v, slip=slip(x, v, a, b))

    (level,) = (level for guard in one.guards if guard.law for level in guard.law.levels)
    found = never_negative_if(level, one.guards)
    return None if found is None else sorted(map(repr, found))


@pytest.mark.parametrize(
    ("slip", "needed"),
    [
        (lambda x, v, a, b: a * sl.max(x, 0.0), ["a"]),
        (lambda x, v, a, b: sl.max(b - x * x, 0.0), []),
        (lambda x, v, a, b: a * b * sl.piecewise((x - 1.0, x > 1.0), otherwise=0.0), ["a*b"]),
        (lambda x, v, a, b: sl.piecewise((2.0 - 2.0 * x, ~(x > 1.0)), otherwise=a), ["a"]),
        (lambda x, v, a, b: sl.piecewise((x, (x > 0) & (v > 1)), otherwise=1.0), []),
        (lambda x, v, a, b: sl.piecewise((x, (x > 0) | (v > 1)), otherwise=1.0), None),
        (lambda x, v, a, b: sl.piecewise((x, x < 0), otherwise=1.0), None),
        (lambda x, v, a, b: a / (1.0 + b * abs(v)), ["a", "b"]),
        (lambda x, v, a, b: a + (b - a) * sl.exp(-abs(v)), ["a", "b - a"]),
        (lambda x, v, a, b: 1.0 + x * x + v**4 + sl.sqrt(1.0 + x), []),
        (lambda x, v, a, b: 1.0 + v**3, None),
        (lambda x, v, a, b: a - b * x, None),
        (lambda x, v, a, b: 1.0 - sl.exp(x), None),
        (lambda x, v, a, b: a + sl.cos(x), None),
    ],
)
def test_what_must_not_be_negative(slip, needed):
    assert conditions(slip) == needed
