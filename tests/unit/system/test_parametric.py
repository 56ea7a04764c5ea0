"""Parameters as states: the tangent flow then holds the derivatives with respect to them."""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from saltus.errors import ParameterError
from saltus.flow.maps import Stroboscope
from saltus.system.parametric import parametric

RIG = sl.models.delangre("b", force="4 N", frequency="17.5 Hz")
#: A motion that meets both springs.
START = np.array([[1e-3, 0.1]])


def end(system, **values):
    """State after a period of the system's own."""
    return Stroboscope(system.with_values(**values), sl.Taylor()).run(START, 1).state[0]


def flow(system, names):
    """End and derivative of the parametric system over one of its periods."""
    made = parametric(system, names)
    own = [1.0 / system.values["frequency"]] if made.timed else []
    own += [system.values[name] for name in names if name != "frequency"]
    start = np.concatenate([START, [own]], axis=1)
    map_ = Stroboscope(made.system, sl.Taylor(), every=1.0 if made.timed else None)
    return map_.tangent(start, 1)


@pytest.mark.parametrize("name", ["contact_stiffness", "upper_gap", "force", "mass"])
def test_the_motion_is_the_systems_own_and_the_derivative_that_of_its_end(name):
    """Boundaries that move with the parameter included."""
    state, matrix = flow(RIG, (name,))
    np.testing.assert_allclose(state[0, :2], end(RIG), rtol=1e-12)
    value = RIG.values[name]
    step = 1e-5 * abs(value)
    expected = (end(RIG, **{name: value + step}) - end(RIG, **{name: value - step})) / (2 * step)
    np.testing.assert_allclose(matrix[0, :2, 2], expected, rtol=1e-6)
    np.testing.assert_array_equal(matrix[0, 2], [0.0, 0.0, 1.0])


def test_over_the_frequency_time_is_counted_in_periods():
    """The derivative is that of the state at the end of a period that moves with the frequency."""
    state, matrix = flow(RIG, ("frequency",))
    np.testing.assert_allclose(state[0, :2], end(RIG), rtol=1e-12)
    f = RIG.values["frequency"]
    step = 1e-5 * f
    by_frequency = (end(RIG, frequency=f + step) - end(RIG, frequency=f - step)) / (2 * step)
    np.testing.assert_allclose(matrix[0, :2, 2] * (-1 / f**2), by_frequency, rtol=1e-6)


def test_a_frequency_in_radians_gives_the_same_map():
    @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
    def turning(t, x, v, *, w=1.5, stiffness=2.0):
        return v, sl.cos(w * t) + 0.3 * sl.sin(2 * w * t) - 0.1 * v - stiffness * x

    made = parametric(turning, ("w",))
    period = 2 * np.pi / 1.5
    state, _ = Stroboscope(made.system, sl.Taylor(), every=1.0).tangent(
        np.array([[0.2, 0.1, period]]), 1
    )
    own = Stroboscope(turning, sl.Taylor()).run(np.array([[0.2, 0.1]]), 1).state
    np.testing.assert_allclose(state[0, :2], own[0], rtol=1e-12)


def test_a_contact_with_an_impact_keeps_its_law():
    stop = sl.models.impact_oscillator()
    made = parametric(stop, ("frequency", "restitution"))
    own = [float(stop.period()), stop.values["restitution"]]
    start = np.array([[0.0, 1.5]])
    state, _ = Stroboscope(made.system, sl.Taylor(), every=1.0).tangent(
        np.concatenate([start, [own]], axis=1), 1
    )
    expected = Stroboscope(stop, sl.Taylor()).run(start, 1, record=0)
    assert len(expected.contacts)
    np.testing.assert_allclose(state[0, :2], expected.state[0], rtol=1e-11)


def test_instants_of_a_switch_may_not_depend_on_what_is_followed():
    @sl.system(states="x", forced_at="frequency")
    def pulsed(t, x, *, frequency=1.0, duty=0.3):
        push = sl.piecewise((1.0, sl.mod(frequency * t, 1) < duty), otherwise=0.0)
        return push - x

    with pytest.raises(ParameterError, match="switches at times that depend on a parameter"):
        parametric(pulsed, ("duty",))
    assert parametric(pulsed, ("frequency",)).timed
