"""Rule 9: time is a count of periods and a phase. Nothing drifts over a million periods, or far
from the origin of time.
"""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest

import saltus as sl
from conformance.systems import walls

#: For one trajectory: other lanes would be empty.
ALONE = sl.Taylor(lanes=2)
LINEAR = sl.models.delangre("b", cubic=0.0, lower_gap=1.0, upper_gap=1.0, frequency=17.0)


def _steady(frequency):
    """Complex amplitude of the steady displacement of LINEAR at a forcing frequency [m]."""
    w, wn = 2 * math.pi * frequency, 10 * math.pi
    return 4 * (1 - 18 / w**2) / 3 / complex(wn**2 - w**2, 2 * 0.03 * wn * w)


@pytest.mark.slow
def test_phase_after_a_million_periods():
    """1e6 periods at 17 Hz: phase error below 1e-9 rad (it is below 1e-14), and at 3 other
    frequencies in the same batch.
    """
    frequency = np.array([17.0, 7.1, 23.0, 29.99])
    rest, method = {"x": np.zeros(4), "v": np.zeros(4)}, sl.Taylor(lanes=4)
    run = sl.stroboscope(
        LINEAR, rest, 1_000_000, keep=1, values={"frequency": frequency}, method=method
    )
    assert run.period.values.tolist() == [1_000_000]
    for i, f in enumerate(frequency):
        exact = _steady(f)
        w = 2 * math.pi * f
        phase = cmath.phase(complex(float(run.x[i, 0]), -float(run.v[i, 0]) / w) / exact)
        assert abs(phase) < 1e-13
        assert abs(complex(float(run.x[i, 0]), -float(run.v[i, 0]) / w) / exact) == pytest.approx(
            1, abs=1e-13
        )


def test_phase_at_a_time_that_is_no_whole_period():
    """t_end = 1000.0123 s at 17 Hz, kept as 17000 periods and a phase."""
    run = sl.simulate(LINEAR, (0.0, 0.0), t_end=1000.0123, keep=1, samples=1)
    exact = _steady(17.0) * cmath.exp(2j * math.pi * 17 * 0.0123)
    assert float(run.end_time) == 1000.0123
    assert (
        abs(float(run.end_x) - exact.real)
        < 2 * math.pi * 17 * math.ulp(1000.0) * abs(exact) + 1e-18
    )


@pytest.mark.parametrize("begin", [1e6, 1e6 + 1 / 15, -1e6, 999_999.6])
def test_large_absolute_time(begin):
    """From t0 = 1e6 s, a whole number of periods: the same contacts relative to t0, to 1e-9 s, and
    the same end.
    """
    rig = sl.models.delangre("b")
    here = sl.simulate(rig, (1e-3, 0.0), periods=20)
    there = sl.simulate(rig, (1e-3, 0.0), periods=20, t_start=begin)
    assert here.contact_guard.values.tolist() == there.contact_guard.values.tolist()
    assert np.abs(there.contact_time.values - begin - here.contact_time.values).max() < 1e-9
    assert float(abs(there.end_x - here.end_x)) < 1e-9 * 0.2
    assert str(there.status.values) == "ok"
    assert int(there.mode_violations) == 0


def test_large_absolute_time_that_is_no_whole_period():
    """The phase is that of the absolute time: from t0 = 1e6 + 0.0123 s at 15 Hz the drive begins at
    phase 2 pi 15 0.0123.
    """
    linear = LINEAR.with_values(frequency=15.0)
    run = sl.simulate(linear, (0.0, 0.0), t_start=1e6 + 0.0123, t_end=1e6 + 0.0123 + 60.0, keep=1)
    exact = _steady(15.0) * cmath.exp(2j * math.pi * 15 * (0.0123 + 60.0))
    assert abs(float(run.end_x) - exact.real) < 2 * math.pi * 15 * math.ulp(1e6) * abs(exact) * 4


def test_moving_boundary_far_from_the_origin_of_time():
    """x = 0.3 meets 0.5 cos(2 pi t): event times relative to t_start = 1e6 are those of t_start =
    0, to an ulp of 1e6 s.
    """
    here, there = (
        sl.simulate(walls, (0.3, 0.0), periods=5, t_start=begin, samples=10) for begin in (0.0, 1e6)
    )
    exact = np.arccos(0.6) / (2 * np.pi)
    wanted = np.sort(np.concatenate([np.arange(5) + exact, np.arange(1, 6) - exact]))
    worst = [
        float(np.abs(run.contact_time.values - begin - wanted).max())
        for run, begin in ((here, 0.0), (there, 1e6))
    ]
    assert worst[0] < 4e-15
    assert worst[1] < 2e-10


def test_samples_lie_at_their_phase_forever():
    """The last period of 10^5 is sampled at k/8 of it exactly where the first would be: the steady
    motion repeats to rounding.
    """
    run = sl.simulate(LINEAR, (0.0, 0.0), periods=100_000, keep=1, samples=8, method=ALONE)
    exact = [(_steady(17.0) * cmath.exp(2j * math.pi * k / 8)).real for k in range(9)]
    assert run.x.values == pytest.approx(exact, abs=1e-17)
    assert run.period.values[[0, -1]].tolist() == [99_999.0, 100_000.0]


def test_long_run_with_contacts_is_exactly_periodic_in_its_phase():
    """A stable periodic orbit of the rig after 2000 and after 100 000 periods: the same state to
    rounding.
    """
    rig = sl.models.delangre("a", frequency=16.0)
    early, late = (
        sl.stroboscope(rig, (5e-3, 0.0), n, keep=1, method=ALONE) for n in (2_000, 100_000)
    )
    assert float(abs(early.x - late.x.values).max()) < 1e-15
    assert float(abs(early.v - late.v.values).max()) < 1e-13


def _two_speeds(t, x, *, early=1.0, late=0.0, instant=0.3):
    """Speed 2 beyond a level, 1 before it; the level itself is another one from an instant on."""
    level = sl.where(t < instant, early, late)
    return sl.piecewise((2.0, x > level), otherwise=1.0)


@pytest.mark.parametrize(
    ("early", "late", "contacts", "end"),
    [(1.0, 0.0, [0.3], 1.7), (0.0, 1.0, [0.3, 0.7], 1.6), (0.0, 0.1, [], 2.0)],
)
def test_a_boundary_that_jumps_over_the_state_at_a_break_of_time(early, late, contacts, end):
    """At t = 0.3 the level jumps: over x = 0.3 from above, over x = 0.6 from below (which is met
    again at 1), or short of x = 0.6.
    """
    jumping = sl.system(states="x")(_two_speeds).with_values(early=early, late=late)
    run = sl.simulate(jumping, (0.0,), t_end=1.0, samples=10, method=sl.Taylor(lanes=2))
    assert run.contact_time.values == pytest.approx(contacts, abs=1e-15)
    assert float(run.end_x) == pytest.approx(end, abs=1e-15)
    assert str(run.status.values) == "ok"
