"""Drives with breaks that repeat with the forcing: exact fixed points, no drift, and a tangent that
time's own breaks don't touch.
"""

import mpmath
import numpy as np
import pytest

import saltus as sl
from saltus.errors import TraceError
from saltus.flow.maps import Stroboscope

METHOD = sl.Taylor(lanes=2)
F = 0.7
POINTS = np.array([0.0, 0.2, 0.45, 0.8, 1.0])
VALUES = np.array([1.0, 3.0, -1.0, 0.5, 1.0])


@sl.system(states="x v", forced_at="frequency")
def beaten(
    t, x, v, *, stiffness=9.0, damping=0.4, square=0.0, pulses=0.0, record=0.0, share=0.3, gap=10.0,
    stop=0.0, frequency=F
):  # fmt: skip
    """An oscillator under a square wave, pulses, or a record that is one period long; a stop far
    away.
    """
    cycles = frequency * t
    push = square * sl.where(sl.sin(2 * sl.pi * cycles) > 0, 1, -1) + pulses * sl.where(
        sl.mod(t, 1 / frequency) < share / frequency, 1, 0
    )
    push += record * sl.table(cycles, POINTS, VALUES, outside="periodic")
    return v, push - stiffness * x - damping * v - sl.where(x > gap, stop * (x - gap), 0)


def arc(duration, value, rate=0):
    """(A, b) of the affine map over an arc whose drive is a line."""
    a = mpmath.matrix([[0, 1, 0, 0], [-9, -mpmath.mpf(0.4), 1, 0], [0, 0, 0, 1], [0, 0, 0, 0]])
    e = mpmath.expm(a * duration)
    return e[:2, :2], e[:2, 2] * value + e[:2, 3] * rate


def fixed_point(arcs):
    """State at whole periods to which the forced oscillator settles."""
    a, b = mpmath.eye(2), mpmath.zeros(2, 1)
    for one, shift in arcs:
        a, b = one * a, one * b + shift
    return np.array([float(z) for z in mpmath.lu_solve(mpmath.eye(2) - a, b)])


def settled_states():
    with mpmath.workdps(30):
        period = 1 / mpmath.mpf(F)
        lines = zip(POINTS[:-1], POINTS[1:], VALUES[:-1], VALUES[1:], strict=True)
        record = [
            arc(
                period * (mpmath.mpf(q) - p),
                mpmath.mpf(a),
                (mpmath.mpf(b) - a) / (mpmath.mpf(q) - p) / period,
            )
            for p, q, a, b in lines
        ]
        share = mpmath.mpf(0.3)
        return {
            "square": fixed_point([arc(period / 2, 1), arc(period / 2, -1)]),
            "pulses": fixed_point([arc(period * share, 1), arc(period * (1 - share), 0)]),
            "record": fixed_point(record),
        }


@pytest.mark.parametrize("name", ["square", "pulses", "record"])
@pytest.mark.slow
def test_the_fixed_point_is_exact_and_stays_for_100_000_periods(name):
    exact = settled_states()[name]
    run = sl.stroboscope(
        beaten.with_values(**{name: 1.0}), exact, periods=100_000, keep=5, method=METHOD
    )
    assert np.abs(run.x.values - exact[0]).max() < 1e-13
    assert np.abs(run.v.values - exact[1]).max() < 1e-12
    assert run.grazes_unresolved.item() == 0


def test_a_break_is_no_contact_and_the_tangent_does_not_see_it():
    """Of a linear system all multipliers are those of the equation without a drive: exp(-damping
    T/2 +- i w T).
    """
    system = beaten.with_values(square=1.0, pulses=0.5, record=2.0)
    strobe = Stroboscope(system, METHOD)
    _, matrix = strobe.tangent(np.array([[0.3, -0.2]]), 3)
    with mpmath.workdps(30):
        exact = np.array((arc(1 / mpmath.mpf(F), 0)[0] ** 3).tolist(), dtype=float)
    assert np.allclose(matrix[0], exact, rtol=0, atol=3e-14)
    run = sl.simulate(system, (0.3, -0.2), periods=3, samples=4, method=METHOD)
    assert run.sizes["contact"] == 0


def test_one_lane_one_life_across_breaks_and_pauses():
    """Cut into calls of one period each, or run at once: the same bits."""
    system = beaten.with_values(square=1.0, pulses=0.5, record=2.0)
    start = np.array([[0.3, -0.2], [0.0, 0.0], [1.0, 1.0]])
    strobe = Stroboscope(system, METHOD)
    at_once = strobe.launch(start, 7)
    piecemeal = strobe.launch(start, 7)
    points = at_once.advance(7)
    parts = np.concatenate([piecemeal.advance(1) for _ in range(7)], axis=1)
    assert np.array_equal(points, parts)


def test_inputs_that_do_not_repeat_with_the_forcing_are_refused():
    with pytest.raises(TraceError, match="doesn't repeat after the forcing period"):

        @sl.system(states="x", forced_at="frequency")
        def once(t, x, *, frequency=F):
            return sl.where(t < 0.2, 1, 0) - x

    with pytest.raises(TraceError, match="doesn't repeat after the forcing period"):

        @sl.system(states="x", forced_at="frequency")
        def long(t, x, *, frequency=F):
            return sl.table(t, [0, 1, 2], [0, 1, 0], outside="periodic") - x
