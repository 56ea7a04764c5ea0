"""Fixed steps that are too long: refused where they don't see the forcing, and no success where
only their errors grow.
"""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from saltus.errors import ParameterError, SaltusWarning

rig = sl.models.delangre("a", force="4 N", frequency="8 Hz")


@sl.system(states="x v")
def oscillator(t, x, v, *, k=100.0, c=0.1):
    return v, -k * x - c * v


@sl.system(states="x v")
def stop(t, x, v, *, k=1e6, gap=1.0):
    return v, -x - sl.piecewise((k * (x - gap), x > gap), otherwise=0)


@sl.system(states="x")
def growing(t, x, *, rate=1.0):
    return rate * x


@pytest.mark.parametrize(
    "verb",
    [
        lambda method: sl.simulate(rig, periods=30, method=method),
        lambda method: sl.simulate(rig, t_end=0.5, method=method),
        lambda method: sl.stroboscope(rig, (0, 0), 3, method=method),
        lambda method: sl.attractors(rig, (0, 0), method=method),
        lambda method: sl.frequency_response(rig, [5.0, 8.0], method=method),
        lambda method: sl.lyapunov(rig, (0, 0), flow=method),
        lambda method: sl.simulate(rig, periods=1, values={"frequency": [1, 8]}, method=method),
    ],
)
@pytest.mark.parametrize("step", [1.0, 0.125, "12.6 ms"])
def test_steps_beyond_a_tenth_of_the_forcing_period_are_refused(verb, step):
    with pytest.raises(
        ParameterError, match=r"forcing's period of 0\.125 s.*at most RK4\(0\.0125\)"
    ):
        verb(sl.RK4(step))


def test_a_tenth_of_the_forcing_period_is_taken():
    assert sl.simulate(rig, periods=30, method=sl.RK4(1 / 80)).status.item() == "ok"


@pytest.mark.parametrize("step", [0.285, 0.3, 0.885, 1.0])
def test_growth_of_an_unstable_step_is_no_success(step):
    """The method multiplies an oscillation by |1 + z + z^2/2 + z^3/6 + z^4/24| a step, z = i w h:
    more than one from w h = 2 sqrt 2 on.
    """
    z = step * np.roots([1.0, 0.1, 100.0])[0]
    factor = abs(np.polyval([1 / 24, 1 / 6, 1 / 2, 1, 1], z))
    count = int(np.ceil(np.log(1e8) / np.log(factor)))
    with pytest.warns(SaltusWarning, match="nonfinite.*Errors of steps that are too long grow"):
        run = sl.simulate(oscillator, (1.0, 0.0), t_end=count * step, method=sl.RK4(step))
    assert run.status.item() == "nonfinite"
    assert run.steps.item() == count


def test_each_trajectory_by_itself():
    """Of two masses only the stiff one's steps are too long."""
    with pytest.warns(SaltusWarning, match="1 of 2 trajectories: nonfinite"):
        run = sl.simulate(
            oscillator, (1.0, 0.0), t_end=50, values={"k": [1.0, 100.0]}, method=sl.RK4(0.5)
        )
    assert run.status.values.tolist() == ["ok", "nonfinite"]


def test_growth_in_contact_is_no_success():
    """w h = 10 beyond the stop, where the step isn't cut at it."""
    with pytest.warns(SaltusWarning, match="nonfinite"):
        run = sl.simulate(stop, (0.0, 2.0), t_end=200, samples=10, method=sl.RK4(0.01, "ignore"))
    assert run.status.item() == "nonfinite"


def test_a_motion_that_does_grow_ends_well():
    run = sl.simulate(growing, (1.0,), t_end=40, method=sl.RK4(0.01))
    assert run.status.item() == "ok"
    assert run.end_x.item() == pytest.approx(np.exp(40.0), rel=1e-6)


def test_large_numbers_that_stay_end_well():
    run = sl.simulate(oscillator, (1e9, 0.0), t_end=40, method=sl.RK4(0.01))
    assert run.status.item() == "ok"
