"""Truncated Fourier series: their zeros are those of the polynomial on the unit circle."""

from __future__ import annotations

import numpy as np
import pytest

from saltus.analysis.harmonics import series as fourier

pytestmark = pytest.mark.nojit


def polynomial_zeros(series):
    """Number of zeros by the eigenvalues of the companion matrix of z^H times the series."""
    c = fourier.to_complex(series)
    roots = np.roots(np.concatenate([c[:0:-1], [2 * c[0].real], np.conj(c[1:])]))
    return np.count_nonzero(np.abs(np.abs(roots) - 1.0) < 1e-9)


@pytest.mark.parametrize("harmonics", [1, 4, 15])
def test_all_zeros_are_found(harmonics):
    random = np.random.default_rng(20261126)
    order = np.maximum(np.r_[0:1, 1 : harmonics + 1, 1 : harmonics + 1], 1)
    for _ in range(60):
        series = random.normal(size=2 * harmonics + 1) / order ** random.uniform(0.0, 3.0)
        found = fourier.zeros(series)
        assert len(found) == polynomial_zeros(series)
        size = np.abs(series).sum()
        assert np.abs(fourier.basis(found, harmonics) @ series).max(initial=0.0) < 4e-15 * size


def test_zeros_that_nearly_touch():
    for apart in (1e-3, 1e-6):  # of 1 - cos(angle) - apart^2/2, near to zero on both sides
        series = np.array([1.0 - apart**2 / 2, -1.0, 0.0])
        found = fourier.zeros(series)
        assert len(found) == 2
        angle = np.arccos(1.0 - apart**2 / 2)
        assert np.allclose(np.sort(found), [angle, 2 * np.pi - angle], rtol=0, atol=1e-10)
    assert not len(fourier.zeros(np.array([1.0 + 1e-12, -1.0, 0.0])))


def test_derivatives_and_shifts():
    random = np.random.default_rng(7)
    series = random.normal(size=(2, 9))
    angle = random.uniform(0, 7, 5)
    here, step = fourier.basis(angle, 4), 1e-5
    beside = fourier.basis(angle + step, 4) - fourier.basis(angle - step, 4)
    slope = fourier.derivative(series) @ here.T
    assert np.allclose(slope, series @ beside.T / (2 * step), atol=1e-8)
    later = fourier.shifted(series, 0.3) @ here.T
    assert np.allclose(later, series @ fourier.basis(angle + 0.3, 4).T, atol=1e-14)
    even = 2 * np.pi * np.arange(11) / 11
    assert np.allclose(fourier.of_samples(series @ fourier.basis(even, 4).T, 4), series, atol=1e-14)
