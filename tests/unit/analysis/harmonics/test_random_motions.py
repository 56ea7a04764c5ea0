"""The equations of harmonic balance along random motions, against the same forces in NumPy, sampled
in time, and differences.
"""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.harmonics import series as fourier
from saltus.analysis.harmonics.equations import HarmonicOrbits

#: Samples of a period; a force that jumps is off by one of them at each jump.
SAMPLES = 2**15


@sl.system(states="x y v w", forced_at="f", units={"f": "rad/s"})
def met(t, x, y, v, w, *, K=5.0, gap=0.3, r=0.6, slip=0.3, d=0.2, push=0.3, cubic=0.2, f=1.0):
    """A damped stop, a round hole, dry friction, a bent spring behind a gap, a push by two sides,
    a brake, a root of a depth.
    """
    bent = sl.piecewise((2 * x, x > 0), otherwise=0.5 * x)
    stop = sl.piecewise((K * (y - gap) + d * w, y > gap), otherwise=0)
    hole = sl.piecewise((K * (x**2 + y**2 - r**2), x**2 + y**2 > r**2), otherwise=0)
    late = sl.piecewise((K * (bent + gap), bent < -gap), otherwise=0)
    slow = sl.piecewise((d * x * v, x * v > -gap), otherwise=0)
    both = sl.piecewise((push, (x > gap) & (w > 0)), otherwise=0)
    root = sl.hertz(x - 0.5 * gap, stiffness=K, exponent=1.5)
    first = sl.cos(f * t) - 0.1 * v - x - (x - y) - hole * x - late - sl.friction(v, slip=slip)
    second = 0.4 * sl.sin(2 * f * t) - 0.1 * w - y - (y - x) - stop - hole * y
    return v, w, first - cubic * x**3 - root - slow, second - both


def rates(t, x, y, v, w, K, gap, r, slip, d, push, cubic, f):
    """The same forces in NumPy."""
    bent = np.where(x > 0, 2 * x, 0.5 * x)
    hole = K * np.maximum(x**2 + y**2 - r**2, 0)
    first = np.cos(f * t) - 0.1 * v - x - (x - y) - hole * x - slip * np.sign(v) - cubic * x**3
    first = first - K * np.minimum(bent + gap, 0) - K * np.maximum(x - 0.5 * gap, 0) ** 1.5
    first = first - np.where(x * v > -gap, d * x * v, 0)
    second = 0.4 * np.sin(2 * f * t) - 0.1 * w - y - (y - x) - hole * y
    second = second - np.where(y > gap, K * (y - gap) + d * w, 0)
    return first, second - np.where((x > gap) & (w > 0), push, 0)


@sl.system(states="x y v w", forced_at="f", units={"f": "rad/s"})
def surrounded(t, x, y, v, w, *, K=5.0, gap=0.3, r=0.6, c=0.2, f=1.0):
    """A round hole, a stop that moves, a product: no side depends on another one."""
    turn, third = sl.cos(f * t), sl.cos(3 * f * t)
    hole = sl.piecewise((K * (x**2 + y**2 - r**2), x**2 + y**2 > r**2), otherwise=0)
    stop = sl.piecewise((K * (x - c * third - gap), x - c * third > gap), otherwise=0)
    product = sl.piecewise((K * (x * y * turn + gap), x * y * turn < -gap), otherwise=0)
    return v, w, turn - 0.1 * v - x - hole * x - stop, -0.1 * w - 2 * y - hole * y - product


def rates_surrounded(t, x, y, v, w, K, gap, r, c, f):
    """The same forces in NumPy."""
    hole = K * np.maximum(x**2 + y**2 - r**2, 0)
    stop = K * np.maximum(x - c * np.cos(3 * f * t) - gap, 0)
    product = K * np.minimum(x * y * np.cos(f * t) + gap, 0)
    return np.cos(f * t) - 0.1 * v - x - hole * x - stop, -0.1 * w - 2 * y - hole * y - product


def sampled(rates, series, values, periods):
    """The residual ``X - L W``, as :class:`HarmonicOrbits` has it, from samples of the forces."""
    harmonics, rate = fourier.harmonics_of(series.shape[1]), values["f"] / periods
    angle = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
    here = fourier.basis(angle, harmonics)
    motion = here @ np.concatenate([series, rate * fourier.derivative(series)]).T
    forces = fourier.of_samples(np.array(rates(angle / rate, *motion.T, **values)), harmonics)
    turns = rate * np.r_[1, 1 : harmonics + 1, 1 : harmonics + 1]
    own = np.r_[0, np.ones(2 * harmonics)]
    return own * series + np.r_[-1, np.ones(2 * harmonics)] * forces / turns**2


@pytest.mark.nojit
@pytest.mark.parametrize(
    ("system", "rates", "compiled"), [(met, rates, False), (surrounded, rates_surrounded, True)]
)
def test_residuals_and_derivatives_along_random_motions(system, rates, compiled):
    random = np.random.default_rng(60221)
    for _ in range(3):
        values = {name: value * random.uniform(0.5, 1.5) for name, value in system.values.items()}
        harmonics, periods = int(random.integers(2, 6)), int(random.integers(1, 3))
        name = str(random.choice(["f", "gap", "K"]))
        orbits = HarmonicOrbits(
            system.with_values(**values), (name,), harmonics, periods, np.ones((1, 1))
        )
        assert orbits.forces.cut_in_kernel == compiled
        orbits.scale = np.ones((1, orbits.width))
        falls = np.maximum(np.r_[0, 1 : harmonics + 1, 1 : harmonics + 1], 1) ** 1.5
        series = 0.6 * random.normal(size=(2, 2 * harmonics + 1)) / falls
        z, way = np.append(series, values[name]), random.normal(size=orbits.width)
        ends = np.array([z, z + 1e-7 * way, z - 1e-7 * way])
        residual, derivative = orbits.evaluate(ends, np.zeros(3, int))
        instants = orbits.intervals(z).instants
        near = len(instants.angle) * 2 * np.pi / SAMPLES / (values["f"] / periods) ** 2
        assert len(instants.angle) > 3
        assert np.abs(residual[0] - sampled(rates, series, values, periods).ravel()).max() < near
        slope = (residual[1] - residual[2]) / 2e-7
        assert np.abs(derivative[0] @ way - slope).max() < 1e-5 * max(1, np.abs(slope).max())
