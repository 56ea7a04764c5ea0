"""Sines and cosines of lanes, and the phase of a harmonic after many periods, against mpmath."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from mpmath import mp, mpf

from compiled import compiled
from saltus.codegen.interface import ARRAY
from saltus.codegen.module import jit_disabled
from saltus.kernels.lanes import load, store
from saltus.kernels.trigonometry import LARGEST_ANGLE, sincos, turned

LANES = 4
JIT = not jit_disabled()


ONE_ROW = """
def one_row(angles, sines, cosines):
    s, c = sincos(load(angles, 0, LANES))
    store(sines, 0, s)
    store(cosines, 0, c)
"""


@cache
def _one_row():
    """Sine and cosine of one row of lanes: compiled as in an equation, or plain with
    the JIT off.
    """
    if JIT:
        return compiled(ONE_ROW, (ARRAY,) * 3, LANES)
    names = dict(sincos=sincos, load=load, store=store, LANES=LANES)
    exec(ONE_ROW, names)
    return names["one_row"]


def _sincos_rows(angles, sines, cosines):
    for row in range(angles.shape[0]):
        _one_row()(angles[row : row + 1], sines[row : row + 1], cosines[row : row + 1])


def in_ulps(values, exact):
    """Errors in units in the last place of the exact values."""
    return np.array(
        [float(abs(mpf(float(v)) - e)) for v, e in zip(values, exact, strict=True)]
    ) / np.spacing(np.abs(np.array(exact, float)))


def errors(angles):
    """Largest error of sine and cosine in ulp."""
    angles = np.ascontiguousarray(np.resize(angles, (-(-len(angles) // LANES), LANES)), float)
    sines, cosines = np.empty_like(angles), np.empty_like(angles)
    _sincos_rows(angles, sines, cosines)
    with mp.workdps(60):
        exact = [mpf(float(a)) for a in angles.ravel()]
        return (
            np.max(in_ulps(sines.ravel(), [mp.sin(a) for a in exact])),
            np.max(in_ulps(cosines.ravel(), [mp.cos(a) for a in exact])),
        )


SPREADS = {
    "one turn": lambda rng: rng.uniform(-math.pi, math.pi, 2000),
    "ten turns": lambda rng: rng.uniform(-62.0, 62.0, 1000),
    "many turns": lambda rng: rng.uniform(-LARGEST_ANGLE, LARGEST_ANGLE, 1000),
    "more turns than the reduction takes": lambda rng: rng.uniform(LARGEST_ANGLE, 1e15, 200),
    "small": lambda rng: 10.0 ** rng.uniform(-300, -1, 500) * rng.choice([-1, 1], 500),
}


NEEDS_FMA = pytest.mark.skipif(
    not JIT, reason="the reduction needs a fused multiply-add, which NumPy lacks"
)
#: Half an ulp of the polynomial, half of the reduced angle's rounding, half of the result's.
ALLOWED = 1.5


@NEEDS_FMA
@pytest.mark.parametrize("spread", SPREADS)
def test_sine_and_cosine_to_about_an_ulp(spread):
    assert np.max(errors(SPREADS[spread](np.random.default_rng(3)))) < ALLOWED


@NEEDS_FMA
@pytest.mark.parametrize("turns", [1, 2, 3, 7, 1000, 4_000_001])
def test_next_to_quarter_turns(turns):
    """Where sine or cosine nearly vanishes the reduction must hold all digits."""
    close = turns * math.pi / 2
    angles = [
        np.nextafter(close, 0),
        close,
        np.nextafter(close, math.inf),
        close + 1e-7 * close,
        -close,
    ]
    assert np.max(errors(angles)) < ALLOWED


@pytest.mark.nojit
def test_sine_and_cosine_without_the_compiler():
    angles = np.random.default_rng(3).uniform(-62.0, 62.0, (250, LANES))
    sines, cosines = np.empty_like(angles), np.empty_like(angles)
    _sincos_rows(angles, sines, cosines)
    assert np.max(np.abs(sines - np.sin(angles))) < 64 * np.spacing(1.0)
    assert np.max(np.abs(cosines - np.cos(angles))) < 64 * np.spacing(1.0)


@pytest.mark.nojit
def test_zeros_and_what_is_no_number():
    angles = np.array([[0.0, -0.0, math.nan, math.inf]])
    sines, cosines = np.empty_like(angles), np.empty_like(angles)
    with np.errstate(invalid="ignore"):
        _sincos_rows(angles, sines, cosines)
    assert sines[0, :2].tolist() == [0.0, 0.0]
    assert cosines[0, :2].tolist() == [1.0, 1.0]
    assert np.isnan(sines[0, 2:]).all()
    assert np.isnan(cosines[0, 2:]).all()


@pytest.mark.nojit
def test_a_lane_beyond_the_reduction_does_not_change_its_neighbours():
    beside, alone = np.array([[0.3, 1e12, -2.0, 40.0]]), np.array([[0.3, 0.3, -2.0, 40.0]])
    found = [np.empty((1, LANES)) for _ in range(4)]
    _sincos_rows(beside, found[0], found[1])
    _sincos_rows(alone, found[2], found[3])
    for a, b in ((found[0], found[2]), (found[1], found[3])):
        assert a[0, [0, 2, 3]].tolist() == b[0, [0, 2, 3]].tolist()


# -- phases ----------------------------------------------------------------------------------------


def exact_phase(rate, period, count):
    """rate * period * count modulo a turn, in [-pi, pi]."""
    with mp.workdps(60):
        turns = mpf(rate) * mpf(period) * count / (2 * mp.pi)
        return float((turns - mp.nint(turns)) * 2 * mp.pi)


@pytest.mark.nojit
@pytest.mark.parametrize("count", [1, 17, 1000, 123_457, 1_000_000])
@pytest.mark.parametrize("rate", [1.0, 17.3, 94.2477796, 3000.123, 1e-3])
def test_phase_of_a_harmonic_that_does_not_fit_the_period(rate, count):
    for period in (1 / 17, 0.1428571, 2.5):
        difference = turned(rate, period, count) - exact_phase(rate, period, count)
        assert (
            abs(difference - 2 * math.pi * round(difference / (2 * math.pi)))
            < 1e-13 + 1e-15 * count**0.5
        )


@pytest.mark.nojit
@pytest.mark.parametrize("frequency", [17.0, 15.0, 7.0, 4000.0, 1 / 3, 0.1, 14.75, math.pi])
@pytest.mark.parametrize("harmonic", [1, 2, 3, 10])
def test_phase_of_a_harmonic_of_the_forcing_is_zero_for_ever(frequency, harmonic):
    """f and 1/f are rounded: 1e6 periods would add up to 1e-9 of a turn."""
    assert turned(harmonic * 2 * math.pi * frequency, 1 / frequency, 1_000_000) == 0.0
    assert turned(harmonic * (2 * math.pi * frequency), 1 / frequency, 1) == 0.0


@pytest.mark.nojit
def test_a_harmonic_that_nearly_fits_is_not_taken_for_one():
    """One part in 1e12 off: 6e-6 rad after 1e6 periods."""
    rate = 2 * math.pi * 17.0 * (1 + 1e-12)
    assert abs(turned(rate, 1 / 17.0, 1_000_000) - exact_phase(rate, 1 / 17.0, 1_000_000)) < 1e-13
    assert exact_phase(rate, 1 / 17.0, 1_000_000) > 6e-6
