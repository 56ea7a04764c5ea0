"""Taylor coefficients from generated code, for every function that an equation may hold, against
mpmath's derivatives.

The generated text runs here as plain Python on NumPy lanes, each lane with a start, a time and
parameters of its own. The truth knows nothing of recurrences: coefficient k of f(t, y(t)) is
mpmath's numerical derivative of f along the polynomial of the coefficients before.
"""

from __future__ import annotations

import numpy as np
import pytest
from mpmath import mp, mpf
from numpy.polynomial.polynomial import polyval

import saltus as sl
from saltus.codegen.taylor_head import taylor_head
from saltus.contact.guards import is_hold
from saltus.kernels import lanes as lane_operations
from saltus.kernels import trigonometry
from saltus.system import System
from saltus.system.tangent import tangent_system

pytestmark = [
    pytest.mark.nojit,
    # most of the equations below use none of a and b, or one
    pytest.mark.filterwarnings("ignore::saltus.errors.UnusedParameterWarning"),
]
LANES, ORDER = 4, 10
EPS = 2.0**-52
TAU, BASE = 0, 1
CLOCK_ROWS = 8


class SaltusFunctions:
    """What an equation calls while it is traced."""

    sqrt, exp, log, sin, cos, tan, atan, tanh = (
        sl.sqrt,
        sl.exp,
        sl.log,
        sl.sin,
        sl.cos,
        sl.tan,
        sl.atan,
        sl.tanh,
    )
    abs, min, max, piecewise = sl.abs, sl.min, sl.max, sl.piecewise


class ExactFunctions:
    """The same in mpmath; pieces are picked by the values given to them."""

    sqrt, exp, log, sin, cos, tan, atan, tanh = (
        mp.sqrt,
        mp.exp,
        mp.log,
        mp.sin,
        mp.cos,
        mp.tan,
        mp.atan,
        mp.tanh,
    )
    abs, min, max = abs, min, max

    @staticmethod
    def piecewise(*pieces, otherwise):
        return next((value for value, holds in pieces if holds), otherwise)


def generated(system: System, order: int = ORDER) -> dict:
    """The head of a Taylor module, run as plain Python."""
    names = {
        name: getattr(lane_operations, name)
        for name in dir(lane_operations)
        if not name.startswith("_")
    }
    names |= {
        "kernel": lambda f: f,
        "inner": lambda f: f,
        "sincos": trigonometry.sincos,
        "turned": trigonometry.turned,
    }
    exec("import math\nimport numpy as np\n" + taylor_head(system, order, LANES).text, names)
    return names


def lane_jets(system: System, states, times, values, order=ORDER, period=1.0):
    """Everything in the work rows, (rows, LANES). ``states`` (D, LANES), ``times`` (LANES,),
    ``values`` one row for each lane.
    """
    head = generated(system, order)
    clock, work = np.zeros((CLOCK_ROWS, LANES)), np.zeros((head["ROWS"], LANES))
    constants = np.zeros((max(head["NCONST"], 1), LANES))
    guards = head["NGUARDS"]
    # behind the guards: nothing is set aside
    side = -np.ones((max(guards + head["NSINGULAR"], 1), LANES))
    for lane in range(LANES):
        count = int(times[lane] // period)
        clock[TAU, lane], clock[BASE, lane] = times[lane] - count * period, count * period
        head["constants"](values[lane], constants, lane)
        head["turns"](values[lane], 0.0, period, count, lane, clock)
        gaps = -np.ones(6 * max(guards, 1))  # no contact is held
        head["gaps"](times[lane], states[:, lane], values[lane], np.zeros(0), gaps)
        side[:guards, lane] = np.where(gaps < 0, -1.0, 1.0)[:guards]
        side[[i for i in range(guards) if is_hold(system.guards[i])], lane] = -1.0
    with np.errstate(all="ignore"):  # pieces that are undefined on the other side
        head["jets"](np.array(states, float), side, constants, clock, work)
    return head, work


def derivative(field, series, time, i, k):
    """Coefficient k of rate i along the polynomials known so far."""

    def rate(s):
        return field(time + s, *[polyval(s, c) for c in series])[i]

    return mp.taylor(rate, 0, k)[k]


def exact_jets(field, state, time, order=ORDER):
    """Taylor coefficients of y' = field(t, y): lists of mpf, one for each state."""
    with mp.workdps(60):
        series = [[mpf(float(y))] for y in state]
        for k in range(order):
            rates = [derivative(field, series, mpf(float(time)), i, k) for i in range(len(series))]
            for c, rate in zip(series, rates, strict=True):
                c.append(mp.re(rate) / (k + 1))
        return series


def assert_same(found, exact, condition=200.0):
    """Coefficients agree to rounding, each on the scale of the series on its circle of convergence
    (root test).
    """
    exact = np.array([float(c) for c in exact])
    tail = np.abs(exact[1:]) ** (1.0 / np.arange(1, exact.size))
    weights = np.max(tail, initial=1e-3) ** -np.arange(exact.size)
    error = np.abs(found - exact) * weights
    assert np.all(np.isfinite(found))
    assert np.max(error) < condition * EPS * max(1.0, np.max(np.abs(exact) * weights)), (
        found,
        exact,
    )


# x' = f(t, x; a, b): every function alone, inside sums and products, of states, of time, of
# parameters.
ONE_STATE = {
    "sum": lambda m, t, x, a, b: a * x - x * t + b - 3.0 * t,
    "time": lambda m, t, x, a, b: t * t * t + a,
    "product": lambda m, t, x, a, b: (a * x) * (b * x) - x * t * x,
    "negative": lambda m, t, x, a, b: -(a * x + t) * (-x),
    "division": lambda m, t, x, a, b: x / (t + 3.0) + (x * t) / (x + 4.0) + x / a,
    "inverse": lambda m, t, x, a, b: b / x + 1.0 / (2.0 * x + t) + a / (b * x),
    "square": lambda m, t, x, a, b: x**2 - (a * x) ** 2,
    "cube": lambda m, t, x, a, b: (x + t) ** 3 / 8 + (2.0 * x) ** 3 / 64,
    "seventh power": lambda m, t, x, a, b: (0.5 * x) ** 7 - (0.3 * x + 0.1) ** 6,
    "negative power": lambda m, t, x, a, b: x**-2 + (x + t) ** -3,
    "real power": lambda m, t, x, a, b: x**1.5 - (1.0 + x * x) ** -0.3 + (a * x) ** 2.5 / 9,
    "half power": lambda m, t, x, a, b: x**0.5 + (a * x) ** 0.5,
    "power by a parameter": lambda m, t, x, a, b: x**a + (b * x + 1.0) ** -a + a**b,
    "power by the state": lambda m, t, x, a, b: a**x + x ** (t / 4),
    "sqrt": lambda m, t, x, a, b: m.sqrt(x) + m.sqrt(1.0 + x * x) + m.sqrt(a) * m.sqrt(t + 2.0),
    "exp": lambda m, t, x, a, b: m.exp(-a * t) + m.exp(0.5 * x - t) + m.exp(b),
    "log": lambda m, t, x, a, b: m.log(x) + m.log(1.0 + x * x) + m.log(t + 3.0) + m.log(a),
    "sin and cos of states": lambda m, t, x, a, b: m.sin(a * x) * m.cos(x) + m.sin(x * t),
    "forcing": lambda m, t, x, a,
    b: a * m.cos(2.0 * m.atan(1.0) * 4 * t) + x * m.sin(b * t + 0.3) - m.cos(t),
    "sine of a power of time": lambda m, t, x, a, b: m.sin(t * t) + m.cos(a * t * t + t),
    "tan": lambda m, t, x, a, b: m.tan(x / 4) + m.tan(0.2 * t) + m.tan(a / 9),
    "atan": lambda m, t, x, a, b: m.atan(3.0 * x) + m.atan(t) * m.atan(b),
    "tanh": lambda m, t, x, a, b: m.tanh(a * x) + m.tanh(x - t) + m.tanh(b),
    "nested": lambda m, t, x, a,
    b: m.exp(m.sin(a * t)) * m.sqrt(1.0 + m.atan(x) ** 2) + m.log(2.0 + m.cos(x)),
    "abs": lambda m, t, x, a, b: m.abs(x - 1.5) + a * m.abs(m.sin(x)),
    "min and max": lambda m, t, x, a, b: m.min(x * x, 3.0, a + t) - m.max(m.exp(-x), b * x),
    "linear pieces": lambda m, t, x, a,
    b: m.piecewise((a * (x - 1.5), x > 1.5), (b * (x - 0.7), x < 0.7), otherwise=t) - x,
    "root or logarithm": lambda m, t, x, a, b: m.piecewise(
        (m.sqrt(m.abs(x - 1.5)), x > 1.5),
        otherwise=(1.5 - x) * m.log(m.abs(1.5 - x)) + x ** (a - 0.1)
    ),
}  # fmt: skip


def traced(equation):
    """The system x' = equation."""

    @sl.system(states="x", name="one")
    def one(t, x, *, a=1.3, b=0.6):
        return equation(SaltusFunctions, t, x, a, b)

    return one


STATES = np.array([[0.4, 1.1, 1.9, 2.6]])
TIMES = np.array([0.0, 0.35, 1.6, 7.25])
VALUES = np.array([[1.3, 0.6], [0.7, 1.7], [2.1, 0.25], [1.0, 0.9]])


@pytest.mark.parametrize("name", ONE_STATE)
def test_jets(name):
    equation = ONE_STATE[name]
    _, work = lane_jets(traced(equation), STATES, TIMES, VALUES)
    for lane in range(LANES):
        a, b = map(mpf, VALUES[lane])
        (exact,) = exact_jets(
            lambda t, x, a=a, b=b: (equation(ExactFunctions, t, x, a, b),),
            STATES[:, lane],
            TIMES[lane],
        )
        assert_same(work[: ORDER + 1, lane], exact)


def test_pieces_that_are_undefined_on_the_other_side_do_not_leak():
    """sqrt(x - 1.5) and (1.5 - x) log(1.5 - x), written without abs: each lane reads its own piece;
    the other one is NaN there.
    """

    @sl.system(states="x")
    def torn(t, x, *, edge=1.5):
        return sl.piecewise((sl.sqrt(x - edge), x > edge), otherwise=sl.log(edge - x) * (edge - x))

    _, work = lane_jets(torn, STATES, TIMES, np.full((LANES, 1), 1.5))
    for lane in range(LANES):
        beyond = STATES[0, lane] > 1.5

        def field(t, x, beyond=beyond):
            return (mp.sqrt(x - 1.5) if beyond else mp.log(1.5 - x) * (1.5 - x),)

        (exact,) = exact_jets(field, STATES[:, lane], TIMES[lane])
        assert_same(work[: ORDER + 1, lane], exact)


def test_jets_of_the_rig_in_every_mode():
    rig = sl.models.delangre("b", frequency=7.0)
    order = 20
    states = np.array([[-0.4e-3, 0.2e-3, 0.5e-3, 3e-3], [0.02, -0.03, 0.1, -0.7]])
    times = np.array([0.0, 0.01, 1.6, 13.9])
    values = np.tile(list(rig.values.values()), (LANES, 1))
    p = {name: mpf(value) for name, value in rig.values.items()}
    _, work = lane_jets(rig, states, times, values, order, period=rig.period())
    for lane in range(LANES):
        outside = states[0, lane] < 0 or states[0, lane] > 0.4e-3
        side = np.sign(states[0, lane]) if outside else 0

        def field(t, x, v, mode=side):
            wn, w = 2 * mp.pi * p["natural_frequency"], 2 * mp.pi * p["frequency"]
            contact = (
                0
                if mode == 0
                else p["contact_stiffness"]
                * (x + p["lower_gap"] if mode < 0 else x - p["upper_gap"])
            )
            drive = p["force"] * (1 - 18 / w**2) * mp.cos(w * t)
            return v, (drive - contact) / p["mass"] - 2 * p[
                "damping_ratio"
            ] * wn * v - wn**2 * x - p["cubic"] / p["mass"] * x**3

        exact = exact_jets(field, states[:, lane], times[lane], order)
        # the phase of the drive is exact whole periods plus a remainder; the remainder of 13.9 s is
        # known to an ulp of 13.9
        for i in range(2):
            assert_same(
                work[i * (order + 1) : (i + 1) * (order + 1), lane], exact[i], condition=2000.0
            )


def test_gaps_their_series_and_their_size():
    """A gap that is no state minus boundary gets a series of its own, its value and the size of its
    terms.
    """

    @sl.system(states="x v")
    def band(t, x, v, *, edge=0.3, slope=0.5):
        reach = x * v - slope * sl.sin(t) - edge
        return v, -x - sl.piecewise((reach, reach > 0), (edge * 2 - x, x < -edge), otherwise=0)

    states = np.array([[0.4, -0.5, 1.9, 0.1], [1.0, -0.2, 0.3, 2.0]])
    values = np.tile([0.3, 0.5], (LANES, 1))
    head, work = lane_jets(band, states, TIMES, values)
    order = [guard.state for guard in band.guards]
    free, on_state = order.index(None), order.index("x")
    assert head["GUARD_ROW"][on_state] == 0  # shares the rows of x
    assert head["SNAP_STATE"] == tuple(0 if state == "x" else -1 for state in order)
    for lane in range(LANES):
        x, v = states[:, lane]
        outer, reach = x < -0.3, x * v - 0.5 * np.sin(TIMES[lane]) - 0.3

        def field(t, x, v, inside=reach > 0, outer=outer):
            gap = x * v - mp.mpf(0.5) * mp.sin(t) - mpf(0.3)
            return v, -x - (gap if inside else mpf(0.3) * 2 - x if outer else 0)

        series = exact_jets(field, states[:, lane], TIMES[lane])
        start = head["GUARD_ROW"][free]

        def gap(s, series=series, time=TIMES[lane]):
            x, v = (polyval(s, c) for c in series)
            return x * v - mpf(0.5) * mp.sin(mpf(float(time)) + s) - mpf(0.3)

        with mp.workdps(60):
            exact = mp.taylor(gap, 0, ORDER)
        assert_same(work[start : start + ORDER + 1, lane], exact)
        assert work[head["GAP_ROW"] + free, lane] == work[start, lane]
        assert work[head["GAP_ROW"] + on_state, lane] * head["GUARD_SIGN"][on_state] == x - (-0.3)
        size = np.abs(x * v) + 0.5 * np.abs(np.sin(TIMES[lane])) + 0.3
        assert np.isclose(work[head["SCALE_ROW"] + free, lane], size, rtol=1e-14)


def test_lanes_do_not_mix():
    """Each lane alone gives the digits it gives beside others."""
    system = traced(ONE_STATE["nested"])
    _, together = lane_jets(system, STATES, TIMES, VALUES)
    for lane in range(LANES):
        _, alone = lane_jets(
            system, STATES[:, [lane] * LANES], TIMES[[lane] * LANES], VALUES[[lane] * LANES]
        )
        assert np.array_equal(alone[:, 0], together[:, lane])


def test_the_columns_of_a_tangent():
    """One text serves both columns of Y: its coefficients are those of dY/dt = J Y, with J
    differentiated by hand.
    """

    @sl.system(states="x v")
    def swing(t, x, v, *, a=0.7):
        return v, sl.cos(2.0 * t) - a * x**3 - sl.tanh(v) + x * v

    a, time, start = 0.7, 0.3, [0.4, -0.6, 1.1, 0.2, -0.3, 0.9]

    def field(t, x, v, xx, xv, vx, vv):
        by_x, by_v = -3 * mpf(a) * x**2 + v, x - 1 + mp.tanh(v) ** 2
        return (
            v,
            mp.cos(2 * t) - mpf(a) * x**3 - mp.tanh(v) + x * v,
            vx,
            vv,
            by_x * xx + by_v * vx,
            by_x * xv + by_v * vv,
        )

    head, work = lane_jets(
        tangent_system(swing),
        np.tile(np.array(start)[:, None], LANES),
        np.full(LANES, time),
        [np.array([a])] * LANES,
    )
    assert "def jets_of_column(" in taylor_head(tangent_system(swing), ORDER, LANES).functions
    for i, exact in enumerate(exact_jets(field, start, time)):
        assert_same(work[i * (ORDER + 1) : (i + 1) * (ORDER + 1), LANES - 1], exact)
    assert head["ROWS"] == len(work)
