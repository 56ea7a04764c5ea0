"""Truncated vibrations of structures in phase quadrature, against scipy's root of the equations in
the matrices, sampled in time.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import root

import saltus as sl
from saltus.errors import ParameterError

MASS = np.diag([1.0, 1.5, 0.8])
STIFFNESS = np.array([[30.0, -12.0, 0.0], [-12.0, 25.0, -8.0], [0.0, -8.0, 15.0]])
DAMPING = 0.02 * STIFFNESS + 0.05 * MASS
HARMONICS, PEAK = 5, 0.4
#: Samples of a period: the kinks between them are off by aliasing of some 1e-7.
SAMPLES = 2**13


def chain(modes):
    return sl.structure(
        MASS, STIFFNESS, DAMPING, names=["a", "b", "c"], frequency="0.5 Hz", name="chain",
        modes=modes, sensors={f"at {one}": one for one in "abc"}, forces=[sl.Force("a", "1 N")],
        contacts=[sl.Contact("c", stiffness="40 N/m", gap="0.1 m"),
                  sl.Contact("b", stiffness="20 N/m", gap="0.15 m", side="both")],
    )  # fmt: skip


def balance(amplitudes, angular, force):
    """Residual of the equations by each harmonic, complex128[3, H + 1]."""
    order = np.arange(HARMONICS + 1) * angular
    seen = np.zeros((3, SAMPLES // 2 + 1), complex)
    seen[:, : HARMONICS + 1] = amplitudes * SAMPLES / 2
    seen[:, 0] *= 2
    _, b, c = motion = np.fft.irfft(seen, SAMPLES)
    stops = [0 * b, 20 * (np.maximum(b - 0.15, 0) + np.minimum(b + 0.15, 0))]
    stops.append(40 * np.maximum(c - 0.1, 0))
    found = np.fft.rfft(stops)[:, : HARMONICS + 1] * 2 / SAMPLES
    found[:, 0] /= 2
    found[0, 1] -= force
    dynamic = STIFFNESS - (order**2)[:, None, None] * MASS + 1j * order[:, None, None] * DAMPING
    return found + np.einsum("kij,jk->ik", dynamic, amplitudes), motion


def told(found, outputs):
    last = found.isel(point=-1)
    harmonics = last.point_harmonic_real + 1j * last.point_harmonic_imag
    return (
        harmonics.sel(output=outputs).values, 2 * np.pi * float(last.point_frequency),
        float(last.point_force),
    )  # fmt: skip


def test_a_structure_in_quadrature_by_scipy():
    amplitudes, angular, force = told(
        sl.backbone(chain(None), (0.1, PEAK), state="b", phase="quadrature", progress=False,
                    by=sl.HarmonicBalance(HARMONICS)), ["a", "b", "c"],
    )  # fmt: skip
    size = 3 * (HARMONICS + 1)

    def defining(u):
        mine = u[:size].reshape(3, -1).astype(complex)
        mine[:, 1:] += 1j * u[size:-2].reshape(3, -1)
        off, motion = balance(mine, *u[-2:])
        ends = [mine[1, 1].real, np.abs(motion[1]).max() - PEAK]
        return np.concatenate([off.real.ravel(), off.imag[:, 1:].ravel(), ends])

    known = np.concatenate(
        [amplitudes.real.ravel(), amplitudes.imag[:, 1:].ravel(), [angular, force]]
    )
    other = root(defining, known * (1 + 1e-2 * np.cos(np.arange(len(known)))), tol=1e-12)
    assert other.success
    assert np.abs(other.x - known).max() < 1e-6


def test_a_reduced_structure_in_quadrature():
    """All modes are kept, so the sensors fulfil the equations in the matrices."""
    found = sl.backbone(
        chain(3), (0.1, PEAK), state="q2", mode=2, phase="quadrature", progress=False,
        by=sl.HarmonicBalance(HARMONICS),
    )  # fmt: skip
    off, motion = balance(*told(found, ["at a", "at b", "at c"]))
    assert motion[2].max() > 0.15  # it touches
    assert np.abs(off).max() < 1e-6
    (own,), _, _ = told(found, ["q2"])
    assert abs(own[1].real) < 1e-13 * abs(own[1])


def test_a_mode_that_damping_keeps_from_quadrature():
    """The displacement at the drive isn't in quadrature anywhere near the second mode: the next
    such frequency is that of the third.
    """
    with pytest.raises(ParameterError, match="near mode 2 of chain brings a into quadrature"):
        sl.backbone(chain(None), (0.1, PEAK), mode=2, phase="quadrature", progress=False)
