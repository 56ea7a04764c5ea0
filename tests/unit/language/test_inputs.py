"""Square waves, saw-teeth, pulses and records against SciPy's and their definitions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy import signal
from scipy.interpolate import CubicSpline

import saltus as sl
from saltus.errors import TraceError, UnitError
from saltus.language.evaluate import evaluate
from saltus.language.expression import TIME, parameter

PHASES = np.linspace(-20, 20, 997)
TIMES, VALUES = [0.0, 10.0, 15.0, 30.0, 42.0], [0.0, 1.0, -2.0, 9.0, 3.0]


@pytest.mark.parametrize("share", [0.0, 0.3, 0.5, 1.0])
def test_as_scipy_gives_them(share):
    squares = [sl.square(float(phase), share) for phase in PHASES]
    teeth = [sl.sawtooth(float(phase), share) for phase in PHASES]
    assert np.array_equal(squares, signal.square(PHASES, share))
    assert np.allclose(teeth, signal.sawtooth(PHASES, share), rtol=0, atol=1e-15)


def test_traced_values_are_those_of_numbers():
    share = parameter("share")
    traced = [
        sl.square(TIME, share), sl.sawtooth(TIME, share), sl.pulse(TIME, share, start=0.5),
        sl.pulse(TIME, share, every=1.5, shape="triangle"),
        sl.pulse(TIME, share, start=0.1, shape="half_sine"),
    ]  # fmt: skip
    found = evaluate(traced, t=PHASES, values={"share": 0.4})
    plain = [
        lambda t: sl.square(t, 0.4), lambda t: sl.sawtooth(t, 0.4),
        lambda t: sl.pulse(t, 0.4, start=0.5),
        lambda t: sl.pulse(t, 0.4, every=1.5, shape="triangle"),
        lambda t: sl.pulse(t, 0.4, start=0.1, shape="half_sine"),
    ]  # fmt: skip
    for values, function in zip(found, plain, strict=True):
        assert np.allclose(values, [function(float(t)) for t in PHASES], rtol=0, atol=1e-14)


def test_pulses_by_their_definition():
    assert [sl.pulse(t, 2.0, start=1.0) for t in (0.9, 1.0, 2.9, 3.0)] == [0, 1, 1, 0]
    assert sl.pulse(1.5, 2.0, start=1.0, shape="triangle") == 0.5
    assert sl.pulse(2.0, 2.0, start=1.0, shape="triangle") == 1.0
    assert sl.pulse(1.5, 2.0, start=1.0, shape="half_sine") == pytest.approx(0.5**0.5)
    assert [sl.pulse(t, 0.2, every=1.0) for t in (-0.9, 0.1, 0.3, 5.1)] == [1, 1, 0, 1]


def test_a_record_is_a_spline_in_units():
    record = sl.recorded(TIMES, VALUES, "mm", time_unit="ms")
    t = np.linspace(0, 0.042, 50)
    spline = CubicSpline(np.array(TIMES) * 1e-3, np.array(VALUES) * 1e-3)
    assert np.allclose(record(t), spline(t), rtol=0, atol=1e-17)
    assert record(-1.0) == 0.0
    assert record.duration == pytest.approx(0.042)
    assert record.unit == "m"


def test_a_record_in_an_equation_is_checked_and_kept():
    road = sl.recorded(TIMES, VALUES, "mm", time_unit="ms", name="road")

    @sl.system(states="x v", units={"x": "m", "v": "m/s"})
    def wheel(t, x, v, *, mass="2 kg", stiffness="1 kN/m", late="1 ms"):
        return v, -stiffness * (x - road(t - late)) / mass

    again = type(wheel).from_dict(wheel.to_dict())
    assert again.fingerprint() == wheel.fingerprint()
    assert "road(t - late)" in repr(wheel)
    with pytest.raises(UnitError, match="road"):

        @sl.system(states="x v", units={"x": "m", "v": "m/s"})
        def wrong(t, x, v, *, mass="2 kg", stiffness="1 kN/m"):
            return v, -stiffness * (v - road(t)) / mass


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: sl.square(TIME, 1.5), "from 0 to 1"),
        (lambda: sl.sawtooth(TIME, "half"), "from 0 to 1"),
        (lambda: sl.pulse(TIME, 1.0, shape="sine"), "half_sine"),
        (lambda: sl.square(sl.system(states="x")(lambda t, x: x).field[0]), "a remainder is for"),
        (lambda: sl.recorded([0, 1], ["a", "b"]), "numbers"),
        (lambda: sl.recorded([0, 0], [1, 2]), "ascend"),
        (lambda: sl.recorded("base.csv"), r"loadtxt\('base.csv'"),
        (lambda: sl.recorded(Path("base.csv"), "mm"), r"loadtxt\('base.csv'"),
        (lambda: sl.recorded([0, 1]), "times and values"),
    ],
)
def test_refusals(call, words):
    with pytest.raises(TraceError, match=words):
        call()


def test_a_unit_of_times_is_one_of_a_time():
    with pytest.raises(UnitError, match="times"):
        sl.recorded([0, 1], [1, 2], time_unit="mm")
