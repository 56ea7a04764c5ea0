"""Means, largest values and turning points of sums of waves, against closed forms and dense
samples.
"""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from saltus.flow.wave_turns import extremes, least_turns, turns
from saltus.flow.waves import WaveLegs, deviations, harmonics, means


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
    assert (beyond >= -1e-15 * np.abs(seen).max()).all()  # ends, by sums in another order
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
    np.testing.assert_allclose(least_turns(one, np.array([0])), [2.5], atol=1e-13)


@pytest.mark.parametrize("waves", [3, 6, 13])
def test_extremes_are_those_of_turning_points_and_ends(waves):
    one = legs(np.random.default_rng(8), waves, 4)
    every = np.arange(4)
    leg, row, time = turns(one, np.arange(3))
    at = one.values(leg, time)[np.arange(len(row)), row]
    ends = [one.values(every, end) for end in (0.0 * one.length, one.length)]
    for quantity, (low, high) in enumerate(extremes(one)[:, 0].T):
        values = np.concatenate([at[row == quantity], *(end[:, quantity] for end in ends)])
        assert low == pytest.approx(values.min(), abs=1e-12)
        assert high == pytest.approx(values.max(), abs=1e-12)
    assert least_turns(one, np.arange(3)) == pytest.approx(np.abs(at).min(), abs=1e-12)


@pytest.mark.nojit
def test_a_few_waves_without_the_compiler():
    """cos(5 t) + 0.5 e^{-t} cos(11 t + 1): slope and bend of every turn, and no turn is missed."""
    one = one_state(
        np.array([5j, -1 + 11j, 0.0]), np.array([[1.0, 0.5, 0.0]], complex),
        np.array([[1.0, np.exp(1j), 1.0]]), np.zeros(1), np.array([2.0]),
    )  # fmt: skip
    _, _, when = turns(one, np.array([0]))
    t = np.linspace(0.0, 2.0, 20_001)

    def slope(t):
        wave = (-1 + 11j) * np.exp((-1 + 11j) * t + 1j)
        return -5 * np.sin(5 * t) + 0.5 * wave.real

    signs = np.sign(slope(t))
    seen = t[1:][signs[1:] * signs[:-1] < 0]
    assert len(seen) == 3
    np.testing.assert_allclose(np.sort(when), seen, atol=1.1e-4)
    np.testing.assert_allclose(slope(when), 0.0, atol=1e-12)
    values = np.append(one.values(np.zeros(len(when), int), when)[:, 0], [1 + 0.5 * np.cos(1.0)])
    low, high = extremes(one)[:, 0, 0]
    assert low == pytest.approx(values.min(), abs=1e-14)
    assert high == pytest.approx(values.max(), abs=1e-14)
    assert least_turns(one, np.array([0]))[0] == pytest.approx(np.abs(values[:-1]).min(), abs=1e-14)


@pytest.mark.parametrize(
    "row",
    [
        pytest.param([0.0, 0.0, 0.0, 0.0], marks=pytest.mark.nojit),
        pytest.param([0.0, 1.0, 0.0, 0.0], marks=pytest.mark.nojit),
        [0.0, 0.0, 0.1 + 0.2, -0.3],
    ],
)
def test_what_doesnt_move_turns_nowhere(row):
    """A gap that nothing moves, and waves that cancel to rounding: at once."""
    rates = np.array([-1 + 300j, 0.0, 200j, 200j])
    one = one_state(
        rates, np.array([row], complex), np.ones((1, 4), complex), np.zeros(1), np.ones(1)
    )
    leg, *_ = turns(one, np.array([0]))
    assert len(leg) == 0
    assert least_turns(one, np.array([0])) == [np.inf]
    np.testing.assert_allclose(extremes(one)[:, 0, 0], row[1], atol=1e-15)


def test_turning_points_of_a_motion_are_all_there_however_many():
    """cos(900 t) over a second: 286 of them, more than there is room for at first."""
    one = one_state(
        np.array([900j, 0.0]), np.ones((1, 2), complex), np.array([[1.0, 0.0]]), np.zeros(1),
        np.ones(1),
    )  # fmt: skip
    *_, when = turns(one, np.array([0]))
    np.testing.assert_allclose(np.sort(when), np.arange(1, 287) * np.pi / 900, atol=1e-13)


@pytest.mark.parametrize("share", [1e-6, 1e-12])
def test_waves_that_cancel_but_for_a_share_turn_as_that_does(share):
    rates, rows = np.array([0.0, 1000j, 1000j]), np.array([[0.0, 1.0 + share, -1.0]], complex)
    one = one_state(rates, rows, np.ones((1, 3), complex), np.zeros(1), np.full(1, 0.1))
    *_, when = turns(one, np.array([0]))
    np.testing.assert_allclose(np.sort(when), np.arange(1, 32) * np.pi / 1000, atol=2e-7)
    np.testing.assert_allclose(extremes(one).ravel(), [-share, share], atol=1e-15)


@pytest.mark.nojit
def test_a_turn_where_a_leg_is_halved_is_found_once():
    """e^{-t} - e^{-2t}, whose slope is 0 to the bit at ln 2, halfway."""
    one = one_state(
        np.array([-1.0, -2.0], complex), np.array([[1.0, -1.0]], complex),
        np.ones((1, 2), complex), np.zeros(1), np.array([2 * np.log(2.0)]),
    )  # fmt: skip
    *_, when = turns(one, np.array([0]))
    assert when.tolist() == [np.log(2.0)]
    assert least_turns(one, np.array([0])) == [0.25]


def test_a_gap_that_touches_its_boundary_has_a_least_turn_of_rounding():
    """1 + cos(t) at pi, among gaps that come less near."""
    one = one_state(
        np.array([1j, 0.0]), np.array([[1.0, 1.5], [1.0, 1.0], [1.0, -1.2]], complex),
        np.ones((1, 2), complex), np.zeros(1), np.array([6.0]),
    )  # fmt: skip
    assert least_turns(one, np.arange(3))[0] < 1e-15
    assert least_turns(one, np.array([0, 2]))[0] == pytest.approx(0.5, rel=1e-14)


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
    row = np.arange(3)
    least = np.min([least_turns(one, row) for one in each], axis=0)
    np.testing.assert_allclose(least_turns(whole, row), least, rtol=1e-12)


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


def numbers(one):
    """All that is found of motions, each [M, ..]."""
    mean, rate = means(one), np.full(one.motions, 3.0)
    found = (mean, deviations(one, mean), harmonics(one, rate), *extremes(one))
    return [*found, least_turns(one, np.arange(3))]


def test_motions_of_different_numbers_of_waves_together():
    rng = np.random.default_rng(21)
    each = [legs(rng, waves, count) for waves, count in ((5, 40), (7, 3), (4, 90), (6, 1))]
    alone = zip(*(numbers(one) for one in each), strict=True)
    for together, apart in zip(numbers(WaveLegs.joined(each)), alone, strict=True):
        np.testing.assert_allclose(together, np.concatenate(apart), rtol=1e-13, atol=1e-15)


def test_numbers_of_a_motion_dont_depend_on_those_beside_it():
    """To the bit."""
    rng = np.random.default_rng(22)
    first, one, last = (legs(rng, 5, count) for count in (7, 100, 200))
    whole = WaveLegs.joined([first, one, last])
    for together, alone in zip(numbers(whole), numbers(one), strict=True):
        np.testing.assert_array_equal(together[1], alone[0])


def of_every_speed(rng):
    """WaveLegs of up to 46 waves over four decades of rates, some of which don't oscillate; in half
    of them two waves cancel but for a share.
    """
    waves, top, legs = int(rng.integers(1, 45)), rng.uniform(0.5, 4.0), int(rng.integers(1, 4))
    omega, ratio = 10 ** rng.uniform(-1, top, waves), 10 ** rng.uniform(-4, 0.5, waves)
    turning = np.sqrt(np.maximum(1.0 - ratio**2, 0.0))
    rates = np.append(omega * (1j * turning - ratio * (rng.random(waves) > 0.2)), 0.0)
    rows, amplitudes = (
        rng.normal(size=(count, waves + 1)) + 1j * rng.normal(size=(count, waves + 1))
        for count in (3, legs)
    )
    amplitudes /= np.maximum(np.abs(rates), 1.0) ** rng.uniform(0.0, 1.5)
    amplitudes[:, -1], rows[:, -1] = 1.0, rows[:, -1].real
    if rng.random() < 0.5:
        twin, share = rng.integers(waves), 10 ** rng.uniform(-14.0, 0.0)
        rates, amplitudes = (np.insert(one, 0, one[..., twin], -1) for one in (rates, amplitudes))
        rows = np.insert(rows, 0, (share - 1.0) * rows[:, twin], 1)
    length = rng.uniform(0.01, 1.0, legs) * min(1.0, 300.0 / 10**top) * rng.choice([1, 10])
    return one_state(rates, rows, amplitudes, np.cumsum(length) - length, length)


@pytest.mark.parametrize(
    "seed",
    [*range(4), pytest.param(time.time_ns() % 2**32, marks=pytest.mark.nightly, id="clock")],
)
def test_no_turn_and_no_extreme_of_waves_of_every_speed_is_missed(seed):
    """Beside dense samples; each turn found is one."""
    rng = np.random.default_rng(seed)
    for _ in range(2 if seed < 4 else 100):
        one = of_every_speed(rng)
        leg, row, when = turns(one, np.arange(3))
        low, high = extremes(one)[:, 0]
        size = (np.abs(one.amplitudes).max(axis=0) * np.abs(one.rows[0])).sum(axis=1)
        steep = np.abs(one.amplitudes * one.rates).max(axis=0) @ np.abs(one.rows[0]).T
        moving = replace(one, rows=one.rows * one.rates[:, None])
        slopes = moving.values(leg, when)[np.arange(len(row)), row]
        assert (np.abs(slopes) < 1e-11 * steep[row]).all()
        for i, length in enumerate(one.length):
            shares = np.append(np.linspace(0.0, 1.0, 30_001), np.geomspace(1e-9, 1.0, 2000))
            at = one.values(np.full(len(shares), i), length * np.sort(shares))
            assert (low <= at.min(axis=0) + 1e-13 * size).all(), seed
            assert (high >= at.max(axis=0) - 1e-13 * size).all(), seed
            for r, steps in enumerate(np.diff(at, axis=0).T):
                ways = np.sign(steps[np.abs(steps) > 1e-13 * size[r]])
                seen = (ways[1:] != ways[:-1]).sum()
                assert ((leg == i) & (row == r)).sum() >= seen, seed
