"""One system with every function in it, compiled: both methods against mpmath's solution."""

from __future__ import annotations

import numpy as np
import pytest
from mpmath import mp, mpf

import saltus as sl


def rates(m, t, x, v, a):
    """Every function once, smooth for x > -2; beyond that another piece, in which these roots are
    undefined.
    """
    turn = m.tanh(v) - a * m.atan(x) + 0.2 * m.sin(x * v) + 0.1 * m.exp(-x * x) * m.cos(2.0 * t)
    push = (
        0.1 * m.log(1.0 + x * x)
        - 0.2 * v / m.sqrt(1.0 + v * v)
        + 0.05 * m.tan(x / 3.0)
        + 0.1 * (1.0 + x * x) ** -0.7
    )
    return turn, push - x + 0.02 * x**3 + 0.1 * m.sin(t * t) + 0.05 * (2.0 + v) ** a


@pytest.fixture(scope="module")
def everything():
    @sl.system(states="x v")
    def everything(t, x, v, *, a=0.3):
        turn, push = rates(sl, t, x, v, a)
        return turn, push + sl.piecewise(
            (sl.sqrt(x + 2.0) / 10, x > -2), otherwise=(x + 2.0) * sl.log(-2.0 - x)
        )

    return everything


STARTS = np.array([[0.5, 0.0], [-1.0, 0.6], [1.4, -1.2]])
PARAMETERS = np.array([0.3, 0.1, 0.7])
END = 0.25  # twice as long takes mpmath twice as long, and no other function comes into it


@pytest.fixture(scope="module")
def exact():
    found = []
    with mp.workdps(22):
        for start, a in zip(STARTS, PARAMETERS, strict=True):

            def field(t, y, a=mpf(float(a))):  # noqa: B008
                turn, push = rates(mp, t, *y, a)
                return [turn, push + mp.sqrt(y[0] + 2) / 10]

            found.append(
                [
                    float(y)
                    for y in mp.odefun(
                        field, 0, [mpf(float(y)) for y in start], tol=mpf(10) ** -18
                    )(END)
                ]
            )
    return np.array(found)


def ends(system, method):
    run = sl.simulate(system, STARTS, t_end=END, values={"a": PARAMETERS}, samples=1, method=method)
    assert set(run.status.values) == {"ok"}
    assert run.sizes["contact"] == 0
    return np.stack([run.end_x.values, run.end_v.values], axis=1)


def test_taylor_with_every_function(everything, exact):
    assert np.max(np.abs(ends(everything, sl.Taylor(tolerance=2.0**-52)) - exact)) < 1e-14


def test_ode45_with_every_function(everything, exact):
    assert np.max(np.abs(ends(everything, sl.ODE45(1e-11, 1e-13)) - exact)) < 1e-10
