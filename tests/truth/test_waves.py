"""Means, largest values and turning points of sums of waves, against closed forms and dense
samples.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from saltus.flow import waves
from saltus.flow.waves import (
    WaveLegs,
    deviations,
    extremes,
    harmonics,
    least_turns,
    means,
    turns,
)


def legs(rng, waves, count):
    """WaveLegs of random waves, a constant among them, and one quantity of each sign."""
    rates = np.append(-rng.uniform(0, 3, waves) + 1j * 10 ** rng.uniform(0, 2.5, waves), 0.0)
    rows = rng.normal(size=(3, waves + 1)) + 1j * rng.normal(size=(3, waves + 1))
    rows[:, -1] = rows[:, -1].real
    sizes = 1 / np.append(np.abs(rates[:-1]), 1.0)
    amplitudes = sizes * (rng.normal(size=(count, waves + 1)) + 1j * rng.normal(size=(count, 1)))
    amplitudes[:, -1] = 1.0
    length = rng.uniform(0.2, 1.5, count)
    return one_state(rates, rows, amplitudes, np.cumsum(length) - length, length)


def one_state(rates, rows, amplitudes, begin, length):
    """WaveLegs of a single contact state."""
    state = np.zeros(len(length), np.int64)
    return WaveLegs(rates[None], rows[None], np.zeros(1, int), state, amplitudes, begin, length)


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
    np.testing.assert_allclose(means(one)[0], mean, atol=2e-5 * np.abs(mean).max())
    square = integral(lambda t, q: (q - mean) ** 2) / total
    np.testing.assert_allclose(deviations(one, means(one))[0], np.sqrt(square), rtol=2e-4)
    wave = integral(lambda t, q: q * np.exp(-3j * t)[:, None]) * 2 / total
    found = harmonics(one, np.array([3.0]))[0]
    np.testing.assert_allclose(found, wave, atol=2e-4 * np.abs(wave).max())
    seen = np.array(
        [np.min([q.min(axis=0) for _, q in dense], axis=0),
         np.max([q.max(axis=0) for _, q in dense], axis=0)]
    )  # fmt: skip
    beyond = (extremes(one)[:, 0] - seen) * [[-1.0], [1.0]]
    assert (beyond >= 0.0).all()
    assert (beyond < 1e-4 * np.abs(seen).max()).all()
    for leg, (t, q) in enumerate(dense):
        places, _, times = turns(one, np.array([0]))
        signs = np.sign(np.diff(q[:, 0]))
        seen = t[1:-1][signs[1:] != signs[:-1]]
        mine = np.sort(times[places == leg])
        assert len(mine) == len(seen)
        np.testing.assert_allclose(mine, seen, atol=2 * one.length[leg] / 40_000)


def test_a_cosine():
    """A cos(w t + phi) + c over whole periods."""
    w, phi = 7.0, 0.4
    one = one_state(
        np.array([1j * w, 0.0]), np.array([[3.0 + 0j, 0.5]]),
        np.array([[np.exp(1j * phi), 1.0]]), np.zeros(1), np.array([2 * np.pi / w]),
    )  # fmt: skip
    np.testing.assert_allclose(extremes(one)[:, 0], [[-2.5], [3.5]], atol=1e-13)
    assert means(one)[0, 0] == pytest.approx(0.5, abs=1e-14)
    assert deviations(one, means(one))[0, 0] == pytest.approx(3 / np.sqrt(2), abs=1e-13)
    found = harmonics(one, np.array([w]))
    np.testing.assert_allclose(found, [[3.0 * np.exp(1j * phi)]], atol=1e-13)
    *_, when = turns(one, np.array([0]))
    np.testing.assert_allclose(np.sort(when), (np.array([1, 2]) * np.pi - phi) / w, atol=1e-12)
    least = least_turns(one, np.array([0]), np.array([[1e-3]]))
    np.testing.assert_allclose(least, [[2.5]], atol=1e-13)


@pytest.mark.parametrize("together", [0, 10**9])
def test_many_quantities_together_or_one_by_one(together, monkeypatch):
    """Extremes are the same, and as large as any that a turning point or an end has."""
    monkeypatch.setattr(waves, "FEW", together)
    one = legs(np.random.default_rng(8), 6, 4)
    every = np.arange(4)
    leg, row, time = turns(one, np.arange(3))
    at = [one.values(leg, time)[np.arange(len(row)), row]]
    ends = [one.values(every, end) for end in (0.0 * one.length, one.length)]
    for quantity, (low, high) in enumerate(extremes(one)[:, 0].T):
        values = np.concatenate([at[0][row == quantity], *(end[:, quantity] for end in ends)])
        assert low == pytest.approx(values.min(), abs=1e-12)
        assert high == pytest.approx(values.max(), abs=1e-12)


def test_legs_of_several_contact_states_are_those_of_each():
    rng = np.random.default_rng(11)
    each = [legs(rng, 5, count) for count in (4, 1, 7)]
    total = sum(one.length.sum() for one in each)
    state = np.repeat(np.arange(3), [len(one.length) for one in each])
    parts = (
        np.concatenate([getattr(one, name) for one in each])
        for name in ("rates", "rows", "amplitudes", "begin", "length")
    )
    rates, rows, *others = parts
    whole = WaveLegs(rates, rows, np.zeros(3, int), state, *others)
    shares = [one.length.sum() / total for one in each]
    mean = sum(share * means(one) for share, one in zip(shares, each, strict=True))
    np.testing.assert_allclose(means(whole), mean, rtol=1e-13)
    rate = np.array([3.0])
    wave = sum(share * harmonics(one, rate) for share, one in zip(shares, each, strict=True))
    np.testing.assert_allclose(harmonics(whole, rate), wave, rtol=1e-13)
    square = sum(
        share * deviations(one, mean) ** 2 for share, one in zip(shares, each, strict=True)
    )
    np.testing.assert_allclose(deviations(whole, mean), np.sqrt(square), rtol=1e-12)
    every = np.array([extremes(one) for one in each])
    found = np.array([every[:, 0].min(axis=0), every[:, 1].max(axis=0)])
    np.testing.assert_allclose(extremes(whole), found, rtol=1e-13)
    row, near = np.arange(3), np.full((1, 3), 1e-3)
    least = np.min([least_turns(one, row, near) for one in each], axis=0)
    np.testing.assert_allclose(least_turns(whole, row, near), least, rtol=1e-12)


def test_a_wave_that_dies_out_at_once():
    """e^{-a t} cos(w t) has its least value at its first turn: w t = pi - atan(a/w)."""
    a, w = 4000.0, 3000.0
    one = one_state(
        np.array([-a + 1j * w, 0.0]), np.ones((1, 2), complex), np.array([[1.0, 0.0]]),
        np.zeros(1), np.ones(1),
    )  # fmt: skip
    time = (np.pi - np.arctan(a / w)) / w
    least = np.exp(-a * time) * np.cos(w * time)
    np.testing.assert_allclose(extremes(one)[:, 0, 0], [least, 1.0], rtol=1e-12)


def test_mean_squares_of_waves_of_every_speed():
    """Products whose rates add up to nothing, or to much: against Gauss's rule on each leg."""
    rng = np.random.default_rng(3)
    one = legs(rng, 4, 40)
    rates = np.array([-1e-8 + 2j, 2.0000001j, 3000j, -500 + 40j, 0.0])
    one = replace(one, rates=rates[None], length=10 ** rng.uniform(-4, 0, 40))
    nodes, weights = np.polynomial.legendre.leggauss(20)
    places = (np.arange(400)[:, None] + 0.5 * (nodes + 1.0)).ravel() / 400
    total = np.zeros(3)
    for leg, length in enumerate(one.length):
        q = one.values(np.full(len(places), leg), length * places)
        total += length / 800 * np.tile(weights, 400) @ (q - 0.25) ** 2
    found = deviations(one, np.full((1, 3), 0.25))[0]
    np.testing.assert_allclose(found, np.sqrt(total / one.length.sum()), rtol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_largest_values_are_the_same_whether_many_are_looked_at_together(monkeypatch, seed):
    one, found = legs(np.random.default_rng(seed), 5, 40), []
    for few in (0, 4, 10**9):
        monkeypatch.setattr(waves, "FEW", 0)
        monkeypatch.setattr(waves, "FEW_OF_EACH", few)
        found.append(extremes(one))
    for other in found[1:]:
        np.testing.assert_allclose(other, found[0], rtol=0, atol=1e-13 * np.abs(found[0]).max())


def numbers(one):
    """All that is found of motions, each [M, 3]."""
    mean, rate, near = means(one), np.full(one.motions, 3.0), np.full((one.motions, 3), 1e-3)
    found = (mean, deviations(one, mean), harmonics(one, rate), *extremes(one))
    return [*found, least_turns(one, np.arange(3), near)]


def test_motions_of_different_numbers_of_waves_together():
    rng = np.random.default_rng(21)
    each = [legs(rng, waves, count) for waves, count in ((5, 40), (7, 3), (4, 90), (6, 1))]
    alone = zip(*(numbers(one) for one in each), strict=True)
    for together, apart in zip(numbers(WaveLegs.joined(each)), alone, strict=True):
        np.testing.assert_allclose(together, np.concatenate(apart), rtol=1e-13, atol=1e-15)


@pytest.mark.parametrize("few", [0, 128, 1024])
def test_numbers_of_a_motion_dont_depend_on_those_beside_it(monkeypatch, few):
    """To the bit, also where its legs are looked at part by part."""
    monkeypatch.setattr(waves, "HELD", 64 * 3 * 30)
    monkeypatch.setattr(waves, "FEW", few)
    monkeypatch.setattr(waves, "FEW_OF_EACH", few and 1)
    rng = np.random.default_rng(22)
    first, one, last = (legs(rng, 5, count) for count in (7, 100, 200))
    whole = WaveLegs.joined([first, one, last])
    for together, alone in zip(numbers(whole), numbers(one), strict=True):
        np.testing.assert_array_equal(together[1], alone[0])


def test_intervals_of_a_motion_are_halved_as_if_it_were_alone(monkeypatch):
    """A short motion is looked at one quantity after the other, also beside a long one."""
    monkeypatch.setattr(waves, "FEW", 64)
    monkeypatch.setattr(waves, "FEW_OF_EACH", 1)
    rng = np.random.default_rng(23)
    short, long = (legs(rng, 5, count) for count in (7, 100))

    def all_are(leg, row, value, room):
        return np.ones_like(value, dtype=bool)

    def opened(one):
        every = np.arange(len(one.length))
        return waves._open(one, every, np.zeros((2, one.motions, 3)), all_are)

    leg, row, middle, half = opened(WaveLegs.joined([short, long]))
    for together, alone in zip((leg, row, middle, half), opened(short), strict=True):
        np.testing.assert_array_equal(together[leg < 7], alone)
    assert (half[leg < 7] == 0.5 * short.length[leg[leg < 7]]).all()
    assert (half[leg >= 7] < 0.5 * long.length[leg[leg >= 7] - 7]).all()
