"""States at given times: the flow's own precision, in the user's order, by every method."""

import math

import numpy as np
import pytest

import saltus as sl
from conformance.systems import lab
from saltus.errors import ParameterError, UnitError
from saltus.flow import engine
from saltus.flow.request import Schedule

SEED = 6701


@sl.system(states="x v", forced_at="frequency")
def driven(t, x, v, *, force=1.0, frequency=0.7, damping=0.1):
    """A linear oscillator under a harmonic force."""
    return v, force * sl.cos(2 * sl.pi * frequency * t) - damping * v - x


def closed(t, t_start=0.0, frequency=0.7):
    """Its state at times, from (1, 0) at t_start: the answer to the drive, and what fades."""
    t, turn = np.asarray(t), 2 * math.pi * frequency
    own = complex(-0.05, math.sqrt(1 - 0.05**2))
    steady = 1.0 / (1 - turn**2 + 0.1j * turn)
    begin = steady * np.exp(1j * turn * t_start)
    left = np.array([1.0 - begin.real, -(1j * turn * begin).real])
    # Re(a e^(own t)) with the value and the rate that are left
    a = complex(left[0], (own.real * left[0] - left[1]) / own.imag)
    fades, wave = a * np.exp(own * (t - t_start)), steady * np.exp(1j * turn * t)
    return np.stack([(fades + wave).real, (own * fades + 1j * turn * wave).real], axis=-1)


def states(run):
    return np.stack([run.x.values, run.v.values], axis=-1)


@pytest.mark.parametrize("t_start", [0.0, 2.3, -1.1])
@pytest.mark.parametrize("length", [{}, {"t_end": 40.0}, {"periods": 60}])
def test_states_are_those_of_the_closed_form_in_the_order_of_the_times(t_start, length):
    times = t_start + np.random.default_rng(SEED).uniform(0.0, 30.0, 200)
    run = sl.simulate(driven, (1.0, 0.0), at=times, t_start=t_start, progress=False, **length)
    np.testing.assert_array_equal(run.time, times)
    np.testing.assert_allclose(run.period, (times - t_start) * 0.7, rtol=1e-14, atol=1e-14)
    np.testing.assert_allclose(states(run), closed(times, t_start), rtol=0, atol=1e-13)


@pytest.mark.parametrize(
    "method", [sl.ODE45(1e-10, 1e-12), sl.RK4(1e-3), sl.ODE15s(1e-10, 1e-12), None]
)
def test_every_method_gives_them(method):
    times = [3.0, 0.0, 1.0 / 3.0, 3.0, 7.0]
    run = sl.simulate(driven, (1.0, 0.0), at=times, method=method, progress=False)
    np.testing.assert_allclose(states(run), closed(times), rtol=0, atol=1e-6)
    np.testing.assert_array_equal(run.x[0], run.x[3])
    np.testing.assert_array_equal(run.x[-1], run.end_x)


def test_trajectories_with_forcing_periods_of_their_own_share_the_times():
    frequencies = [0.7, 0.7, 0.31, 1.9, 0.7]
    times = np.array([5.0, 2.5, 0.1, 9.99])
    run = sl.simulate(
        driven, (1.0, 0.0), at=times, values={"frequency": frequencies}, progress=False
    )
    assert run.x.dims == ("trajectory", "time")
    assert "period" not in run
    for one, frequency in zip(states(run), frequencies, strict=True):
        np.testing.assert_allclose(one, closed(times, 0.0, frequency), rtol=0, atol=1e-13)


def test_a_time_at_an_end_is_taken_however_it_rounds():
    random = np.random.default_rng(SEED)
    for period, length in random.uniform(0.001, 3.0, (200, 2)):
        times = np.sort(np.append(random.uniform(0, length, 20), length))
        schedule = Schedule.at(times, period)
        count, due = schedule.count, schedule.fraction * period
        assert (schedule.fraction < 1.0).all()
        end = max(length - math.floor(length / period) * period, 0.0)
        assert count[-1] == math.floor(length / period)
        assert due[-1] <= end  # the flow ends there
        np.testing.assert_allclose(count * period + due, times, rtol=1e-15, atol=5e-16)
    for count in (1, 3, 7, 10, 49):
        ends = np.arange(count + 1) / 0.7
        run = sl.simulate(driven, (1.0, 0.0), at=ends, periods=count, progress=False)
        assert np.isfinite(run.x).all()
        exact = sl.stroboscope(driven, (1.0, 0.0), periods=count, progress=False)
        np.testing.assert_allclose(run.x, exact.x.squeeze(), rtol=0, atol=2e-15)


def test_units_and_one_time():
    run = sl.simulate(lab, (0.0, 2.0), at=["0.3 s", 0.1, "250 ms"], progress=False)
    np.testing.assert_allclose(run.x, [0.6, 0.2, 0.5], rtol=1e-15)
    assert sl.simulate(lab, (0.0, 2.0), at="100 ms", progress=False).x.shape == (1,)


def test_contacts_are_those_of_the_run_and_keep_is_about_them():
    rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    some = sl.simulate(rig, ("1 mm", 0), periods=10, at=[0.1, 0.05], progress=False)
    all_ = sl.simulate(rig, ("1 mm", 0), periods=10, progress=False)
    np.testing.assert_array_equal(some.contact_time, all_.contact_time)
    late = sl.simulate(rig, ("1 mm", 0), periods=10, at=[0.1], keep=2, progress=False)
    kept = all_.contact_time.values > 8 / 17
    np.testing.assert_array_equal(late.contact_time, all_.contact_time.values[kept])


def test_an_interrupted_run_has_the_times_that_it_has_reached(monkeypatch):
    def interrupt(share):
        raise KeyboardInterrupt

    monkeypatch.setattr(engine, "SLICE", 200)
    times = np.random.default_rng(SEED).permutation(np.linspace(0.0, 2000.0, 1000))
    ask = {"at": times, "threads": 1}
    whole = sl.simulate(driven, (1.0, 0.0), progress=False, **ask)
    with pytest.raises(sl.Interrupted) as caught:
        sl.simulate(driven, (1.0, 0.0), progress=interrupt, **ask)
    part = caught.value.partial
    assert 0 < part.sizes["time"] < 1000
    reached = np.isin(times, part.time)
    np.testing.assert_array_equal(part.time, times[reached])
    np.testing.assert_array_equal(part.x, whole.x.values[reached])


@pytest.mark.parametrize(
    ("at", "more", "says"),
    [
        ([], {}, "at is empty"),
        ([1.0, math.nan], {}, r"at\[1\] isn't a finite time"),
        ([1.0, math.inf], {}, r"at\[1\] isn't a finite time"),
        ([1.0, 2.0], {"t_end": 1.5}, "2 s lies beyond the end at 1.5 s"),
        ([1.0, -2.0], {}, "-2 s lies before the start"),
        ([0.0], {}, "isn't after the start"),
        ([[1.0]], {}, "times in a row"),
        ({"x": 1}, {}, "times in a row"),
        (True, {}, "times in a row"),
        (np.array(["2026-01-01"], "M8[s]"), {}, "times in a row"),
        (range(10**12), {}, "1000000000000 times each are more than fits"),
        ([1.0], {"samples": 3}, "only one of them"),
        ([1.0, 2.0], {"periods": 3, "values": {"frequency": [1.0, 2.0]}}, "of trajectory 1"),
    ],
)
def test_what_is_no_time_is_refused_with_advice(at, more, says):
    with pytest.raises(ParameterError, match=says):
        sl.simulate(driven, (1.0, 0.0), at=at, progress=False, **more)


def test_units_are_asked_for():
    with pytest.raises(UnitError, match="no unit"):
        sl.simulate(driven, (1.0, 0.0), at="3", progress=False)
    with pytest.raises(UnitError):
        sl.simulate(driven, (1.0, 0.0), at=["3 mm"], progress=False)


def test_settled_refuses_whole_periods_that_are_not_in_a_row():
    run = sl.simulate(driven, (1.0, 0.0), at=np.array([0, 2, 4, 6]) / 0.7, progress=False)
    with pytest.raises(ParameterError, match="at="):
        sl.settled(run)


def test_a_picture_draws_them_in_time():
    run = sl.simulate(driven, (1.0, 0.0), at=[3.0, 1.0, 2.0], progress=False)
    (line,) = sl.plot.history(run).lines
    np.testing.assert_allclose(line.get_xdata(), [1.0, 2.0, 3.0])
    x = line.get_ydata() / line.get_ydata()[0]
    np.testing.assert_allclose(x, run.x.values[[1, 2, 0]] / run.x.values[1])
