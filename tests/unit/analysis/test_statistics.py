"""Means of correlated series: errors with known values, and whether the intervals hold the mean as
often as they say.
"""

import math

import numpy as np
import pytest

from saltus.analysis.statistics import LEAST, batch_means


def autoregressive(factor, count, length, seed=0):
    """x_i = factor x_(i-1) + noise of variance 1: the mean of n has the standard error 1 / (1 -
    factor) / sqrt(n).
    """
    noise = np.random.default_rng(seed).standard_normal((count, length + 1000))
    series = np.zeros_like(noise)
    for i in range(1, series.shape[1]):
        series[:, i] = factor * series[:, i - 1] + noise[:, i]
    return series[:, 1000:]


@pytest.mark.parametrize(("factor", "low"), [(0.0, 0.92), (0.5, 0.92), (0.9, 0.90), (-0.5, 0.92)])
def test_errors_of_correlated_series(factor, low):
    """Of 95 % intervals at least so many hold the mean; with 500 series 92 % is 3 standard
    deviations below.
    """
    means = batch_means(autoregressive(factor, 500, 4000), np.array([4000]))
    exact = 1 / (1 - factor) / math.sqrt(4000)
    assert means.error.mean() == pytest.approx(exact, rel=0.06)
    assert (np.abs(means.mean) <= means.half_width).mean() >= low


def test_errors_that_ignore_the_correlation_would_be_too_small():
    """What the test above can see: batches of one value claim less than half."""
    series = autoregressive(0.9, 50, 4000)
    naive = series.std(axis=1, ddof=1) / math.sqrt(4000)
    assert batch_means(series, np.array([4000])).error.mean() > 3 * naive.mean()


def test_every_length_is_that_of_a_shorter_series():
    series = autoregressive(0.5, 3, 1000)
    all_of_them = batch_means(series, np.array([100, 640, 1000]))
    for j, end in enumerate((100, 640, 1000)):
        alone = batch_means(series[:, :end], np.array([end]))
        np.testing.assert_allclose(all_of_them.mean[:, j], series[:, :end].mean(axis=1), rtol=1e-12)
        np.testing.assert_allclose(all_of_them.error[:, j], alone.error[:, 0], rtol=1e-9)
        np.testing.assert_array_equal(all_of_them.batches[:, j], alone.batches[:, 0])


def test_a_large_constant_is_no_trouble_and_too_few_values_have_no_error():
    means = batch_means(1e9 + autoregressive(0.0, 200, 100), np.array([LEAST - 1, 100]))
    assert np.isnan(means.error[:, 0]).all()
    assert np.isnan(means.half_width[:, 0]).all()
    assert (means.batches[:, 0] == 0).all()
    assert math.sqrt(np.mean(means.error[:, 1] ** 2)) == pytest.approx(0.1, rel=0.05)
    constant = batch_means(np.full(64, 3.5), np.array([64]))
    assert (constant.mean.item(), constant.error.item()) == (3.5, 0.0)
    assert np.isnan(batch_means(np.full(64, np.nan), np.array([64])).mean.item())
