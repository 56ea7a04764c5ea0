"""Functions made of others: against mpmath at 50 digits on and near their special points, values
and derivatives.
"""

import math

import mpmath
import numpy as np
import pytest

import saltus as sl
from saltus.errors import TraceError, UnusedParameterWarning
from saltus.language import expression as ex
from saltus.language.derivatives import differentiate
from saltus.language.evaluate import evaluate
from saltus.system.modes import field

X, Y = ex.state("x"), ex.state("y")
EPS = 2.0**-52
NEAR_ZERO = [1e-300, 1e-20, 1e-8, 1e-3, 0.1, 0.7]
WIDE = [0.0, *NEAR_ZERO, *(-x for x in NEAR_ZERO), 1.0, -1.0, 3.0, -3.0, 20.0, -20.0, 300.0]
WITHIN_ONE = [
    0.0,
    *NEAR_ZERO,
    *(-x for x in NEAR_ZERO),
    1 - 1e-3,
    1 - 1e-9,
    1 - EPS,
    -1 + 1e-3,
    -1 + 1e-9,
    -1 + EPS,
]


def ulps(value, exact):
    """Distance in units of the last place of the exact value."""
    return (
        float(abs(mpmath.mpf(float(value)) - exact) / max(abs(exact), mpmath.mpf(2) ** -1000)) / EPS
    )


@pytest.mark.parametrize(
    ("function", "exact", "derivative", "points"),
    [
        (sl.sinh, mpmath.sinh, mpmath.cosh, WIDE),
        (sl.cosh, mpmath.cosh, None, WIDE),
        (sl.asin, mpmath.asin, lambda x: 1 / mpmath.sqrt((1 - x) * (1 + x)), WITHIN_ONE),
        (sl.acos, mpmath.acos, lambda x: -1 / mpmath.sqrt((1 - x) * (1 + x)), WITHIN_ONE),
    ],
)
def test_functions_of_one_value(function, exact, derivative, points):
    traced = function(X)
    rate = differentiate(traced, X)
    with mpmath.workdps(50):
        for x in points:
            value, slope = evaluate([traced, rate], states={"x": x})
            bound = 4 + abs(x)  # of exp(x), half an ulp of x is half of |x| ulp
            assert ulps(value, exact(mpmath.mpf(x))) < bound, x
            assert ulps(function(x), exact(mpmath.mpf(x))) < bound, x
            if derivative is not None:
                assert ulps(slope, derivative(mpmath.mpf(x))) < 10 + abs(x), x


def test_inverse_functions_at_their_ends():
    assert evaluate([sl.asin(X), sl.acos(X)], states={"x": 1.0}) == [math.pi / 2, 0.0]
    assert evaluate([sl.asin(X), sl.acos(X)], states={"x": -1.0}) == [-math.pi / 2, math.pi]


SIDES = [0.0, 1e-300, 1e-9, 0.3, 1.0, 1e6]


def test_angle_and_distance_of_a_point():
    angle, distance = sl.atan2(Y, X), sl.hypot(Y, X)
    rates = [differentiate(angle, Y), differentiate(angle, X)]
    with mpmath.workdps(50):
        for y in (*SIDES[1:], *(-s for s in SIDES[1:])):
            for x in (*SIDES, *(-s for s in SIDES[1:])):
                if max(abs(x), abs(y)) < 1e-200:
                    continue  # their squares underflow
                (value,) = evaluate([angle], states={"x": x, "y": y})
                assert ulps(value, mpmath.atan2(y, x)) < 4, (y, x)
                by_y, by_x = evaluate(rates, states={"x": x, "y": y})
                r2 = mpmath.mpf(x) ** 2 + mpmath.mpf(y) ** 2
                size = 1 / mpmath.sqrt(r2)
                assert abs(by_y - x / r2) < 8 * EPS * size, (y, x)
                assert abs(by_x + y / r2) < 8 * EPS * size, (y, x)
                (value,) = evaluate([distance], states={"x": x, "y": y})
                assert ulps(value, mpmath.sqrt(r2)) < 2, (y, x)


@pytest.mark.parametrize("x", [-2.0, 0.0, 3.0])
@pytest.mark.parametrize("y", [-1.0, 0.5])
def test_angle_with_one_plain_side(x, y):
    assert evaluate([sl.atan2(Y, x)], states={"y": y})[0] == pytest.approx(
        math.atan2(y, x), rel=4 * EPS
    )
    assert evaluate([sl.atan2(y, X)], states={"x": x})[0] == pytest.approx(
        math.atan2(y, x), rel=4 * EPS
    )
    assert sl.atan2(y, x) == math.atan2(y, x)


@pytest.mark.parametrize("x", [-2.0, -1e-300, 1e-300, 0.7, 5.0])
def test_switches(x):
    traced = [sl.sign(X), sl.heaviside(X), sl.where(X > 0, 2 * X, -X), sl.clip(X, -1, 0.5)]
    plain = [sl.sign(x), sl.heaviside(x), sl.where(x > 0, 2 * x, -x), sl.clip(x, -1, 0.5)]
    assert (
        evaluate(traced, states={"x": x})
        == plain
        == [np.sign(x), np.heaviside(x, 0.5), 2 * x if x > 0 else -x, np.clip(x, -1, 0.5)]
    )
    assert (sl.sign(0), sl.heaviside(0), sl.heaviside(0, 1), sl.hypot(3, 4)) == (0, 0.5, 1, 5)


# -- NumPy's functions are those of saltus ---------------------------------------------------------
ONE = [
    "sin",
    "cos",
    "tan",
    "exp",
    "log",
    "sqrt",
    "arctan",
    "arcsin",
    "arccos",
    "sinh",
    "cosh",
    "tanh",
    "abs",
    "sign",
    "square",
    "radians",
]


@pytest.mark.parametrize("name", ONE)
def test_numpy_on_a_traced_value(name):
    function = getattr(np, name)
    assert evaluate([function(X)], states={"x": 0.3})[0] == pytest.approx(
        function(0.3), rel=8 * EPS
    )


@pytest.mark.parametrize(
    "name",
    [
        "arctan2",
        "hypot",
        "maximum",
        "minimum",
        "heaviside",
        "add",
        "subtract",
        "multiply",
        "divide",
    ],
)
def test_numpy_on_two_values(name):
    function = getattr(np, name)
    assert evaluate([function(X, 0.5)], states={"x": 0.3})[0] == pytest.approx(
        function(0.3, 0.5), rel=8 * EPS
    )
    assert evaluate([function(X, Y)], states={"x": 0.3, "y": -2.0})[0] == pytest.approx(
        function(0.3, -2.0), rel=8 * EPS
    )


def test_numpy_scalars_on_the_left():
    two = np.float64(2.0)
    assert [two * X, two - X, two / X, two**X] == [2.0 * X, 2.0 - X, 2.0 / X, 2.0**X]
    assert repr((two > X).gap) == repr((X < 2.0).gap)


# -- what can't be traced teaches ------------------------------------------------------------------
@pytest.mark.parametrize(
    ("mistake", "teaches"),
    [
        (lambda x: np.floor(x), "np.floor on a traced value"),
        (lambda x: np.log10(x), r"sl.log\(x\)/math.log\(10\)"),
        (lambda x: math.cos(x), "Write sl.cos in place of math.cos"),
        (lambda x: np.interp(x, [0, 1], [0, 1]), "np.interp"),
        (lambda x: x % 1, "sl.mod of x: a remainder"),
        (lambda x: 7 // x, "the whole part 7 // x|the whole part x // 7"),
        (lambda x: x(ex.TIME - 0.1), "There are no delays"),
        (lambda x: sl.arctan2(x, 1), r"saltus has no 'arctan2'. Write sl.atan2\(y, x\)"),
        (lambda x: sl.restitution(x), r"sl.impact\(x < gap, v, restitution=0.8\)"),
        (
            lambda x: sl.impact(x),
            r"sl.impact\(x < gap, v, restitution=0.8\), after",
        ),
        (lambda x: sl.interp1d([0, 1], [0, 1])(x), r"Write sl.table\(x, points, values\)"),
        (lambda x: x ^ 2, r"a power is written x\*\*2"),
        (lambda x: -xx, r"'xx' is no state, no parameter.*Did you mean 'x'\?$"),  # noqa: F821
        (lambda x: sl.sine(x), r"Did you mean 'sin'\?$"),
        (lambda x: sl.piecewise((x, x > 1)), "needs otherwise="),
        (lambda x: 1.0 if x > 1 else 0.0, r"Write the branches as sl\.piecewise"),
    ],
)
def test_mistakes(mistake, teaches):
    with pytest.raises(TraceError, match=teaches) as told:
        sl.system(states="x")(lambda t, x: mistake(x))
    assert "?." not in str(told.value)
    assert ".." not in str(told.value).replace("...", "")


def test_a_parameter_that_nothing_uses_is_named():
    with pytest.warns(
        UnusedParameterWarning, match="forgetful: gap is declared but the equations don't use it"
    ):

        @sl.system(states="x")
        def forgetful(t, x, *, k=1.0, gap=0.1):
            return -k * x

    with pytest.warns(UnusedParameterWarning, match="gap, m are declared"):
        sl.system(states="x", name="worse")(lambda t, x, *, k=1.0, gap=0.1, m=1.0: -k * x)


def test_the_forcing_frequency_is_used_by_the_period():
    sl.system(states="x", forced_at="f")(lambda t, x, *, f=1.0: -x)


def test_measured_numbers_bring_their_own_units():
    """The coefficients of a table are numbers in an equation, but not plain ones: nothing is asked
    of its unit.
    """

    @sl.system(states="x v", units={"x": "m", "v": "m/s"})
    def law(t, x, v, *, mass="2 kg", force="3 N", period="0.5 s"):
        drive = force * sl.where(sl.mod(t, period) < 0.1, 1, 0)
        return v, (
            drive
            + sl.table(t, [0, 1], [0, 1])
            - sl.table(x, [-1, 0, 1], [-3, 0, 4], "spline", outside="extend")
        ) / mass

    assert [guard.name for guard in law.guards] == ["x = 0"]


@pytest.mark.parametrize("kind", ["linear", "pchip", "spline"])
@pytest.mark.parametrize("outside", ["hold", "extend"])
def test_a_table_in_a_state_is_the_same_curve_in_pieces(kind, outside):
    points, values = [-1.0, -0.2, 0.5, 0.9, 2.0], [0.3, 0.4, 1.0, -2.0, 0.7]
    law = sl.system(states="x")(lambda t, x: -sl.table(x, points, values, kind, outside=outside))
    x = np.linspace(-2, 3, 301)
    by_guards = field(law, 0.0, [x])[0]
    assert np.allclose(
        by_guards,
        [-sl.table(float(one), points, values, kind, outside=outside) for one in x],
        rtol=0,
        atol=1e-14,
    )
    assert [guard.boundary.payload for guard in law.guards] == (
        points if outside == "hold" else points[1:-1]
    )


@pytest.mark.parametrize(
    ("make", "teaches"),
    [
        (
            lambda t, x: sl.table(x, np.arange(40.0), np.random.default_rng(1).normal(size=40)),
            "has 40 knots.*32 at most",
        ),
        (lambda t, x: sl.table(x, [0, 1], [0, 0], outside="periodic"), "is for tables in time"),
        (lambda t, x: sl.table(t * t, [0, 1], [0, 0]), "write a state, or rate"),
        (lambda t, x: sl.table(t, [0, 1, 1], [0, 0, 0]), r"points\[2\] = 1 follows 1"),
        (lambda t, x: sl.table(t, [0, 1], [0, math.nan]), r"values\[1\] is not a finite number"),
        (lambda t, x: sl.table(t, [0, 1], [0, 1, 2]), "one length"),
        (lambda t, x: sl.table(t, [0, 1], ["a", "b"]), "must be numbers"),
        (lambda t, x: sl.table(t, [0, 1], [0, 1], outside="periodic"), "same first and last value"),
        (lambda t, x: sl.table(t, [0, 1], [0, 1], "splin"), "Did you mean 'spline'"),
        (lambda t, x: sl.table(t, [0, 1], [0, 1], outside="zero"), "outside='zero'"),
        (lambda t, x: sl.table(t, [0, 1], [0, 1], name="a b"), "is no name"),
        (lambda t, x: sl.mod(x, 2.0), "sl.mod of x"),
        (lambda t, x: sl.mod(t, x), "the cycle of sl.mod"),
        (lambda t, x: sl.mod(t, 0), "is zero"),
        (lambda t, x: sl.where(sl.exp(t) > 2, 1, 0), "can't be solved for"),
        (lambda t, x: sl.where(sl.table(t, [0, 1], [0, 1]) > 0.5, 1, 0), "can't be solved for"),
    ],
)
def test_inputs_that_are_refused(make, teaches):
    with pytest.raises(TraceError, match=teaches):
        sl.system(states="x")(lambda t, x: make(t, x) - x)
