"""The pieces that clocks hold, against NumPy's evaluation of the same equation at random times; no
compiler needed.
"""

import math
from fractions import Fraction

import numpy as np
import pytest

import saltus as sl
from saltus.codegen import templates
from saltus.codegen.clocks import Clocks, table_data
from saltus.kernels.clocks_layout import C0, HELD, NUMBERS, ON, REF
from saltus.language.evaluate import evaluate

pytestmark = pytest.mark.filterwarnings("ignore::saltus.errors.UnusedParameterWarning")
POINTS, VALUES = [-1.0, 0.0, 0.3, 1.1, 2.0], [0.5, 2.0, -1.0, 0.25, 0.5]


def clocks_of(system):
    """The template's functions for a system, as plain Python; its numbers are in `n`, its tables in
    `data`.
    """
    clocks = Clocks(system)
    scope = {"math": math, "kernel": lambda f: f, "inner": lambda f: f, **clocks.constants()}
    exec(clocks.function() + templates.text("clocks"), scope)
    return clocks, scope


def drive_of(value):
    """A system with the traced drive `value(t, **parameters)` alone in its field."""

    @sl.system(states="x")
    def alone(t, x, *, rate=1.0, offset=0.0, cycle=0.7, level=0.2, factor=1.0):
        return value(t, rate, offset, cycle, level, factor) + 0 * (
            rate + offset + cycle + level + factor
        )

    return alone


def at(scope, clocks, system, t, base=0.0, known=None):
    """What the clocks hold at time base + t."""
    n = np.zeros((NUMBERS + 1) * len(clocks))
    h = np.zeros(HELD * len(clocks)) if known is None else known.copy()
    data = table_data(system)
    scope["place_clocks"](np.array(list(system.values.values())), base, 1.0, 0, n, data)
    following = scope["set_clocks"](t, base, n, data, known is not None, h)
    return h, following


SWITCHES = {
    "level": lambda t, rate, offset, cycle, level, factor: sl.where(
        rate * t + offset > level, 1, -1
    ),
    "sine": lambda t, rate, offset, cycle, level, factor: sl.where(
        factor * sl.sin(rate * t + offset) > level, 1, -1
    ),
    "cosine": lambda t, rate, offset, cycle, level, factor: sl.where(
        level < factor * sl.cos(rate * t + offset), 1, -1
    ),
    "pulse": lambda t, rate, offset, cycle, level, factor: sl.where(
        factor * sl.mod(rate * t + offset, cycle) > level, 1, -1
    ),
}
VALUE = {
    "mod": lambda t, rate, offset, cycle, level, factor: sl.mod(rate * t + offset, cycle),
    "hold": lambda t, rate, offset, cycle, level, factor: sl.table(
        rate * t + offset, POINTS, VALUES
    ),
    "extend": lambda t, rate, offset, cycle, level, factor: sl.table(
        rate * t + offset, POINTS, VALUES, "spline", outside="extend"
    ),
    "periodic": lambda t, rate, offset, cycle, level, factor: sl.table(
        rate * t + offset, POINTS, VALUES, "spline", outside="periodic"
    ),
    "pchip": lambda t, rate, offset, cycle, level, factor: sl.table(
        rate * t + offset, POINTS, VALUES, "pchip", outside="periodic"
    ),
}
RATES = [1.0, 2.5, -1.0, -0.37, 0.0]


def random_values(random):
    return dict(
        rate=random.choice(RATES), offset=random.uniform(-3, 3), cycle=random.uniform(0.3, 2),
        level=random.uniform(-1.2, 1.2),
        factor=random.choice([1.0, -1.0, 2.0]),
    )  # fmt: skip


@pytest.mark.parametrize("kind", [*SWITCHES, *VALUE])
def test_every_clock_holds_what_its_equation_says(kind):
    random = np.random.default_rng(7)
    value = {**SWITCHES, **VALUE}[kind]
    for _ in range(40):
        system = drive_of(value).with_values(**random_values(random))
        clocks, scope = clocks_of(system)
        assert len(clocks) == 1
        for t, base in zip(random.uniform(-6, 6, 12), [0.0, 0.0, 5.0, -4.0] * 3, strict=True):
            (exact,) = evaluate(system.field, t=base + t, values=system.values)
            h, following = at(scope, clocks, system, t, base)
            held = (
                h[ON] if kind in SWITCHES else sum(h[C0 + i] * (t - h[REF]) ** i for i in range(4))
            )
            assert held == pytest.approx(exact, rel=1e-11, abs=1e-11), (
                dict(system.values),
                t,
                base,
            )
            assert following > t
            again, _ = at(scope, clocks, system, t, base, known=h)
            assert np.array_equal(again, h)


@pytest.mark.parametrize("kind", [*SWITCHES, *VALUE])
def test_between_breaks_nothing_changes_and_no_break_is_missed(kind):
    random = np.random.default_rng(8)
    value = {**SWITCHES, **VALUE}[kind]
    for _ in range(10):
        system = drive_of(value).with_values(**random_values(random))
        clocks, scope = clocks_of(system)
        t, h = -4.0, None
        while t < 4.0:
            h, following = at(scope, clocks, system, t, known=h)
            end = min(following, 4.0)
            inside = t + (end - t) * random.uniform(0.001, 0.999, 5)
            exact = evaluate(system.field, t=inside, values=system.values)[0] * np.ones(5)
            held = (
                h[ON]
                if kind in SWITCHES
                else sum(h[C0 + i] * (inside - h[REF]) ** i for i in range(4))
            )
            assert np.allclose(held, exact, rtol=0, atol=1e-11), (dict(system.values), t)
            t = end


def test_break_k_is_at_k_cycles_by_formula():
    system = drive_of(VALUE["mod"]).with_values(cycle=0.1)
    clocks, scope = clocks_of(system)
    for k in [1, 7, 1000, 123_456_789]:
        _, following = at(scope, clocks, system, (k - 0.5) * 0.1)
        assert abs(Fraction(following) - k * Fraction(0.1)) <= 2 * Fraction(math.ulp(following))


def test_breaks_of_several_clocks_at_one_instant_are_one():
    def both(t, rate, offset, cycle, level, factor):
        return sl.where(t > 0.1 + 0.2, 1, 0) + sl.where(10 * t > 3, 1, 0)

    system = drive_of(both)
    clocks, scope = clocks_of(system)
    h, following = at(scope, clocks, system, 0.0)
    h, after = at(scope, clocks, system, following, known=h)
    assert after == math.inf
    assert h[ON] == h[HELD + ON] == 1.0
