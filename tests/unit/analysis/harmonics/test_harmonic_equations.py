"""The equations of harmonic balance against the describing function, closed integrals, differences,
and the energy of a period.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.harmonics import series as fourier
from saltus.analysis.harmonics.equations import HarmonicOrbits

STOP = sl.models.soft_stop()
with open(Path(__file__).parents[3] / "reference/backbones_hbm.csv") as table:
    KNOWN = {row["id"]: float(row["value"]) for row in csv.DictReader(table)}


def equations(system, harmonics, name="frequency", periods=1):
    found = HarmonicOrbits(system, (name,), harmonics, periods, np.ones((1, 1)))
    found.scale = np.ones((1, found.width))
    return found


def closed(orbits, z, steps=30):
    """The motion that Newton's method leads to, the parameter kept."""
    for _ in range(steps):
        residual, derivative = orbits.evaluate(z[None], np.zeros(1, int))
        step = np.linalg.solve(derivative[0][:, :-1], -residual[0])
        z = z + np.append(step, 0.0)
        if np.abs(step).max() < 1e-14:
            return z
    raise AssertionError("Newton's method didn't converge")


@pytest.fixture(scope="module")
def by_harmonics():
    """The contact orbit of the soft stop at 1.5 rad/s by several numbers of harmonics, each from
    the one before.
    """
    found, last = {}, np.array([0.0, 1.5, 0.0])
    for harmonics in (1, 3, 5, 9, 15, 31, 63):
        orbits = equations(STOP, harmonics)
        z = closed(orbits, np.append(fourier.resized(last, harmonics), 1.5))
        found[harmonics], last = (orbits, z), z[:-1]
    return found


def largest(z):
    turns = fourier.zeros(fourier.derivative(z[:-1]))
    return (fourier.basis(turns, fourier.harmonics_of(len(z) - 1)) @ z[:-1]).max()


@pytest.mark.parametrize(("row", "count"), [("H20", 1), ("H22", 5), ("H24", 15)])
def test_largest_displacement_of_the_soft_stop(by_harmonics, row, count):
    # the last digit given of H22 and H24 is the thirteenth
    assert largest(by_harmonics[count][1]) == pytest.approx(KNOWN[row], rel=0, abs=1e-13)


def test_distance_from_the_exact_orbit(by_harmonics):
    exact = 1.5410677550307348  # R04e of branches_soft_stop.csv
    off = {count: largest(z) - exact for count, (_, z) in by_harmonics.items()}
    known = {1: -5.8e-2, 3: -9.6e-3, 5: 2.2e-3, 9: -2.5e-4, 15: 5.4e-5, 31: 4.2e-6, 63: 2.0e-8}
    for count, value in known.items():
        assert off[count] == pytest.approx(value, rel=0.03)


def test_symmetric_systems_have_odd_harmonics_only(by_harmonics):
    for count, (_, z) in by_harmonics.items():
        assert np.abs(fourier.to_complex(z[:-1])[::2]).max() < 1e-14, count


@pytest.mark.parametrize("system", [
    STOP,
    sl.models.den_hartog(),
    sl.models.delangre("b", force="4 N", frequency="13 Hz"),
    sl.models.two_masses(),
], ids=lambda one: one.name)  # fmt: skip
def test_derivatives_are_those_of_differences(system):
    random = np.random.default_rng(17)
    gap = 1.0 if system.name != "delangre" else 1e-3
    for name in [*list(system.values)[:3], system.forced_at]:
        orbits = equations(system, 5, name)
        z = np.append(random.normal(size=orbits.size) * gap, system.values[name])
        unit = np.append(np.full(orbits.size, gap), abs(system.values[name]) or 1.0)
        orbits.scale, step = unit[None], 1e-6
        beside = np.array(
            [z + sign * step * unit * one for one in np.eye(len(z)) for sign in (1, -1)]
        )
        residual = orbits.evaluate(beside, np.zeros(len(beside), int))[0]
        slopes = (residual[::2] - residual[1::2]).T / (2 * step)
        derivative = orbits.evaluate(z[None], np.zeros(1, int))[1][0]
        assert np.abs(derivative - slopes).max() < 1e-7 * max(1.0, np.abs(derivative).max()), name


@pytest.mark.nojit
def test_linear_systems_are_exact_for_any_number_of_harmonics():
    far = STOP.with_values(gap=100.0)
    for count in (1, 6):
        orbits = equations(far, count)
        z = closed(orbits, np.append(np.zeros(orbits.size), 1.5))
        amplitude = 1.0 / (1 - 1.5**2 + 0.1j * 1.5)
        assert abs(fourier.to_complex(z[:-1])[1] - amplitude) < 1e-15
        assert np.abs(np.delete(fourier.to_complex(z[:-1]), 1)).max() < 1e-15


def test_energy_of_a_period_balances(by_harmonics):
    for count, (_, z) in by_harmonics.items():
        amplitudes = fourier.to_complex(z[:-1])
        order, rate = np.arange(count + 1), z[-1]
        velocity = 1j * order * rate * amplitudes
        supplied = 0.5 * velocity[1].real  # mean power of cos(rate*t)
        lost = 0.1 * 0.5 * (np.abs(velocity) ** 2).sum()  # the stops give back what they take
        assert supplied == pytest.approx(lost, rel=3e-14)


def describing_function(amplitude, gap):
    """First harmonic of a dead zone over its amplitude."""
    edge = gap / amplitude
    return (np.arccos(edge) - edge * np.sqrt(1 - edge**2)) * 2 / np.pi


def test_one_harmonic_is_the_describing_function(by_harmonics):
    _, z = by_harmonics[1]
    a = abs(fourier.to_complex(z[:-1])[1])
    stiffness = 1 - z[-1] ** 2 + 9 * describing_function(a, 1.0)
    assert np.hypot(stiffness, 0.1 * z[-1]) * a == pytest.approx(1.0, rel=1e-14)


@pytest.mark.nojit
@pytest.mark.parametrize("power", [0.25, 1.5, 2.0])
def test_powers_of_a_depth_are_integrated_to_rounding(power):
    """Against mpmath's quadrature of the first harmonic of a Hertz contact, and of a root whose
    slope isn't bounded.
    """
    from mpmath import acos, cos, mp, mpf, quad, sin

    @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
    def hertz(t, x, v, *, gap=0.4, w=1.0):
        force = sl.piecewise((2.0 * (x - gap) ** power, x > gap), otherwise=0)
        return v, sl.cos(w * t) - force

    orbits, mp.dps = equations(hertz, 1, "w"), 30
    found = orbits.forces.coefficients(
        np.array([[0.1, 1.0, 0.0]]), np.array([2 * np.pi]), 1.0, np.zeros(1)
    )
    force, slope = (one / (2 * np.pi) for one in (found.values[0], found.by_signals[0, :, 0, 0]))
    edge = acos(mpf("0.3"))

    def depth(a):
        return max(cos(a) - mpf("0.3"), mpf(0)) ** mpf(power)

    def bent(s):  # of angles edge - s^4, where it is smooth; the depth without cancellation
        near = 2 * sin(edge - s**4 / 2) * sin(s**4 / 2)
        return 4 * s**3 * near ** mpf(power - 1) if s else mpf(0)

    mean = quad(depth, [0, edge]) / mp.pi
    first = 2 * quad(lambda a: depth(a) * cos(a), [0, edge]) / mp.pi
    by_mean = -2 * power * quad(bent, [0, edge ** mpf(0.25)]) / mp.pi
    assert force[0] == pytest.approx(float(-2 * mean), abs=4e-14)
    assert force[1] == pytest.approx(float(1 - 2 * first), abs=1e-13)
    # the depths of the nearest nodes, some 1e-12, are known to the rounding of angles
    assert slope[0] == pytest.approx(float(by_mean), rel=4e-4 if power < 1 else 1e-12)


@sl.system(states="x y v w", forced_at="f", units={"f": "rad/s"})
def jumping(
    t, x, y, v, w, *, c=0.1, gap=0.3, between=0.4, K=5.0, d=0.2, F=1.0, f=1.0, P=0.1, G=0.2
):
    """A damped stop, whose force jumps, a clearance between two masses, a Hertz stop, a cubic."""
    stop = sl.freeplay(x, stiffness=K, upper_gap=gap, damping=d, velocity=v)
    push = sl.freeplay(y - x, stiffness=K, gap=between)
    push = push + sl.hertz(y - G, stiffness=3.0, exponent=1.5)
    ahead = F * sl.cos(f * t) - c * v - x - 2 * (x - y) - stop + push - 0.1 * x**3
    return v, w, ahead, P * sl.sin(2 * f * t) - c * w - y - 2 * (y - x) - push


def test_derivatives_of_random_forces_that_jump():
    random = np.random.default_rng(90210)
    for _ in range(8):
        values = {name: value * random.uniform(0.3, 2.0) for name, value in jumping.values.items()}
        name = str(random.choice(list(values)))
        system, harmonics = jumping.with_values(**values), int(random.integers(2, 9))
        orbits = equations(system, harmonics, name, int(random.integers(1, 3)))
        falls = np.tile(np.maximum(np.r_[0, 1 : harmonics + 1, 1 : harmonics + 1], 1), 2)
        z = np.append(random.normal(size=orbits.size) * 0.5 / falls, values[name])
        step = 1e-6
        beside = np.array([z + sign * step * one for one in np.eye(len(z)) for sign in (1, -1)])
        residual = orbits.evaluate(beside, np.zeros(len(beside), int))[0]
        slopes = (residual[::2] - residual[1::2]).T / (2 * step)
        derivative = orbits.evaluate(z[None], np.zeros(1, int))[1][0]
        assert np.abs(derivative - slopes).max() < 3e-7 * max(1.0, np.abs(derivative).max()), name
