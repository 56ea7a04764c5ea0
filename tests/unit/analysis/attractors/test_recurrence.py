"""Orbits that are longer than those that are closed are told from tori, and from slow ways to
shorter ones, by points of maps in closed form.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.attractors.find_responses import SettledMotions, _leave_open
from saltus.analysis.attractors.recurrence import late_periods
from saltus.flow.maps import Stroboscope
from saltus.results.dataset.kinds import Kind

GOLDEN = 2 * math.pi * (3 - math.sqrt(5)) / 2


def turned(angle: float, left: float = 0.0, turn: float = 1.0, size: float = 1.0) -> np.ndarray:
    """A turn of the unit circle, and a way that dies out: the share that is left after an iterate,
    the angle of one, the size at first; float64[1, 1024, 2].
    """
    k = np.arange(1024)
    point = np.exp(1j * angle * k) + size * left**k * np.exp(1j * turn * k)
    return np.stack([point.real, point.imag], axis=1)[None]


@pytest.mark.parametrize(
    ("points", "period"),
    [
        (turned(2 * math.pi * 30 / 97), 97),
        (turned(2 * math.pi * 30 / 97, 0.99), 97),
        (turned(2 * math.pi * 7 / 500, 0.97), 500),
        (turned(2 * math.pi * 30 / 64), 0),  # this one is closed
        (turned(2 * math.pi * 30 / 521), 0),  # this one is too long
        (turned(GOLDEN), 0),
        (turned(2 * math.pi * 30 / 97 + 1e-6), 0),  # a torus beside an orbit
        (turned(2 * math.pi * 30 / 97 + 1e-6, 0.98), 0),
        (turned(0.0, 0.997, 2 * math.pi * 30 / 97, 2e-3), 0),  # a slow way to a fixed point
        (  # another one, along two pairs of directions
            np.concatenate(
                [turned(0.0, 0.999, 2 * math.pi * k / 97, 2e-3) for k in (30, 42)], axis=2
            ),
            0,
        ),
        (turned(2 * math.pi / 3, 0.997, GOLDEN, 2e-3), 0),
    ],
)  # fmt: skip
def test_a_long_orbit_is_told_from_a_torus_and_from_a_slow_way_to_a_short_one(points, period):
    assert late_periods(points, np.ones((1, points.shape[2]))).tolist() == [period]


def test_chaos_has_no_long_period():
    points = np.empty((1, 1024, 1))
    points[0, 0] = 0.3
    for k in range(1023):
        points[0, k + 1] = 3.9 * points[0, k] * (1 - points[0, k])
    assert late_periods(points, np.ones((1, 1))).tolist() == [0]


@pytest.mark.parametrize(("period", "kind"), [(64, "UNCONVERGED"), (101, "LONG_PERIODIC")])
@pytest.mark.parametrize("exponents", [{}, {0: ("not_repeating", 0.0, 1.0)}])
def test_what_is_open_at_last_is_asked_whether_it_repeats_late(period, kind, exponents):
    @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
    def ring(t, x, v, *, w=1.0, rate=1 / 101):
        growth = 1 - x**2 - v**2
        return growth * x - rate * w * v, growth * v + rate * w * x + 0 * sl.cos(w * t)

    result = SettledMotions.empty(1, 2)
    result.end[:], result.scale[:] = (0.0, 1.0), 2.0
    map_ = Stroboscope(ring.with_values(rate=1 / period), sl.Taylor(), threads=1)
    _leave_open(map_, np.array([0]), exponents, result)
    assert Kind(result.kind[0]).name == kind
    assert result.orbits.period[0] == (period if kind == "LONG_PERIODIC" else 0)
