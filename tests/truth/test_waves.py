"""Means, largest values and turning points of sums of waves, against closed forms and dense
samples.
"""

from __future__ import annotations

import numpy as np
import pytest

from saltus.flow.waves import WaveLegs, deviations, harmonics, largest, least_turn, means, turns


def legs(rng, waves, count):
    """WaveLegs of random waves, a constant among them, and one quantity of each sign."""
    rates = np.append(-rng.uniform(0, 3, waves) + 1j * 10 ** rng.uniform(0, 2.5, waves), 0.0)
    rows = rng.normal(size=(3, waves + 1)) + 1j * rng.normal(size=(3, waves + 1))
    rows[:, -1] = rows[:, -1].real
    sizes = 1 / np.append(np.abs(rates[:-1]), 1.0)
    amplitudes = sizes * (rng.normal(size=(count, waves + 1)) + 1j * rng.normal(size=(count, 1)))
    amplitudes[:, -1] = 1.0
    length = rng.uniform(0.2, 1.5, count)
    return WaveLegs(rates, rows, amplitudes, np.cumsum(length) - length, length)


def sampled(one, number=40_001):
    """Times of a leg, and all quantities there."""
    at = np.linspace(0.0, 1.0, number)
    return [
        (one.length[leg] * at, one.values(np.full(number, leg), one.length[leg] * at))
        for leg in range(len(one.length))
    ]


@pytest.mark.parametrize("seed", range(6))
def test_sums_of_random_waves(seed):
    one = legs(np.random.default_rng(seed), 5, 3)
    dense = sampled(one)
    total = one.length.sum()

    def integral(of):
        return sum(
            np.trapezoid(of(t + b, q), t, axis=0)
            for (t, q), b in zip(dense, one.begin, strict=True)
        )

    mean = integral(lambda t, q: q) / total
    np.testing.assert_allclose(means([one]), mean, atol=2e-5 * np.abs(mean).max())
    square = integral(lambda t, q: (q - mean) ** 2) / total
    np.testing.assert_allclose(deviations([one], means([one])), np.sqrt(square), rtol=2e-4)
    wave = integral(lambda t, q: q * np.exp(-3j * t)[:, None]) * 2 / total
    np.testing.assert_allclose(harmonics([one], 3.0), wave, atol=2e-4 * np.abs(wave).max())
    top = np.max([q.max(axis=0) for _, q in dense], axis=0)
    found = largest([one])
    assert (found >= top).all()
    assert (found - top < 1e-4 * np.abs(top).max()).all()
    for leg, (t, q) in enumerate(dense):
        places, times = turns(one, 0)
        signs = np.sign(np.diff(q[:, 0]))
        seen = t[1:-1][signs[1:] != signs[:-1]]
        mine = np.sort(times[places == leg])
        assert len(mine) == len(seen)
        np.testing.assert_allclose(mine, seen, atol=2 * one.length[leg] / 40_000)


def test_a_cosine():
    """A cos(w t + phi) + c over whole periods."""
    w, phi = 7.0, 0.4
    one = WaveLegs(
        np.array([1j * w, 0.0]), np.array([[3.0 + 0j, 0.5]]),
        np.array([[np.exp(1j * phi), 1.0]]), np.zeros(1), np.array([2 * np.pi / w]),
    )  # fmt: skip
    assert largest([one])[0] == pytest.approx(3.5, abs=1e-13)
    assert means([one])[0] == pytest.approx(0.5, abs=1e-14)
    assert deviations([one], means([one]))[0] == pytest.approx(3 / np.sqrt(2), abs=1e-13)
    np.testing.assert_allclose(harmonics([one], w), [3.0 * np.exp(1j * phi)], atol=1e-13)
    _, when = turns(one, 0)
    np.testing.assert_allclose(np.sort(when), (np.array([1, 2]) * np.pi - phi) / w, atol=1e-12)
    assert least_turn([one], 0, 1e-3) == pytest.approx(2.5, abs=1e-13)
