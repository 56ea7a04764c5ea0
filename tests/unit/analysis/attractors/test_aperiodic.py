"""Motions that never repeat: exponents with known values, what is one attractor and
what is none.
"""

import math

import numpy as np
import pytest

from function_maps import FunctionMap
from saltus.analysis.attractors.aperiodic import (
    SampledMotion,
    growth_rates,
    kind_of_growth,
    kinds_of,
    merge,
)
from saltus.analysis.attractors.find_attractors import find_attractors
from saltus.analysis.attractors.recurrence import recurrence
from saltus.analysis.basins.labels import complete, settle
from saltus.analysis.solve.tolerances import ROUND

GOLDEN = math.pi * (math.sqrt(5) - 1)


def largest_exponents(map_, start, scale):
    """Exponents [per iterate] and their standard errors."""
    _, blocks = growth_rates(map_, start, scale)
    return blocks.mean(axis=0), blocks.std(axis=0, ddof=1) / np.sqrt(len(blocks))


def logistic(r: float) -> FunctionMap:
    """x -> r x (1 - x)."""
    return FunctionMap(lambda z: r * z * (1 - z), "x", lambda z: (r * (1 - 2 * z))[:, :, None])


def henon(a: float, b: float = 0.3) -> FunctionMap:
    """(x, y) -> (1 - a x^2 + y, b x)."""

    def derivative(z):
        one = np.ones(len(z))
        return np.stack(
            [np.stack([-2 * a * z[:, 0], one], axis=1), np.stack([b * one, 0 * one], axis=1)],
            axis=1,
        )

    return FunctionMap(
        lambda z: np.stack([1 - a * z[:, 0] ** 2 + z[:, 1], b * z[:, 0]], axis=1), "x y", derivative
    )


def henons(first: float, second: float, b: float = 0.3) -> FunctionMap:
    """Two maps of Hénon, side by side: a chaotic attractor of 2.5 dimensions in four."""

    def image(z):
        return np.stack(
            [
                1 - first * z[:, 0] ** 2 + z[:, 1],
                b * z[:, 0],
                1 - second * z[:, 2] ** 2 + z[:, 3],
                b * z[:, 2],
            ],
            axis=1,
        )

    def derivative(z):
        rate = np.zeros((len(z), 4, 4))
        rate[:, 0, 0], rate[:, 2, 2] = -2 * first * z[:, 0], -2 * second * z[:, 2]
        rate[:, [0, 2], [1, 3]], rate[:, [1, 3], [0, 2]] = 1.0, b
        return rate

    return FunctionMap(image, "x y u w", derivative)


def circle(contraction: float, angle: float = GOLDEN) -> FunctionMap:
    """The plane turned by an angle, its radius r -> r**contraction: the unit circle attracts, the
    motion on it is a rigid rotation.
    """
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])

    def image(z):
        return (z @ turn.T) * (z**2).sum(axis=1)[:, None] ** (0.5 * (contraction - 1))

    def derivative(z):
        square = (z**2).sum(axis=1)[:, None, None]
        return square ** (0.5 * (contraction - 1)) * (
            turn @ (np.eye(2) + (contraction - 1) * z[:, :, None] * z[:, None, :] / square)
        )

    return FunctionMap(image, "x y", derivative)


def kinds(found) -> list[str]:
    return [*("periodic" for _ in found.orbits), *(one.kind for one in found.sampled)]


def drawn(low, high, count=60, seed=1) -> np.ndarray:
    low, high = np.atleast_1d(low), np.atleast_1d(high)
    return low + (high - low) * np.random.default_rng(seed).random((count, len(low)))


# -- exponents -------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("map_", "low", "high", "expected"),
    [
        (logistic(4.0), 0.1, 0.9, math.log(2)),
        # Sprott, Chaos and Time-Series Analysis (2003), appendix A
        (henon(1.4), (-0.1, -0.1), (0.1, 0.1), 0.41922),
    ],
    ids=["logistic", "henon"],
)
def test_exponents_of_chaotic_maps_and_their_errors(map_, low, high, expected):
    """24 of them: their mean is right, and their scatter is no larger than they say (at r = 4 it
    averages out much sooner).
    """
    start = map_.launch(drawn(low, high, 24), 200).advance(200)[:, -1]
    exponents, errors = largest_exponents(map_, start, np.ones(start.shape[1]))
    assert abs(exponents.mean() - expected) < 4 * errors.mean() / math.sqrt(24)
    assert exponents.std() < 2.0 * errors.mean()
    assert errors.max() < 0.05


def test_the_exponent_of_a_rigid_rotation_is_zero():
    exponents, _ = largest_exponents(circle(0.5), drawn((0.5, 0.5), (1, 1), 8), np.ones(2))
    assert np.abs(exponents).max() < 1e-6


@pytest.mark.parametrize("unit", [1.0, 1e-3])
def test_exponents_do_not_depend_on_units(unit):
    """The logistic map with x measured in another unit, and that as its scale."""
    r = 3.9
    map_ = FunctionMap(
        lambda z: r * z * (1 - z / unit), "x", lambda z: (r * (1 - 2 * z / unit))[:, :, None]
    )
    exponent, _ = largest_exponents(map_, np.array([[0.3 * unit]]), np.array([unit]))
    plain, _ = largest_exponents(logistic(r), np.array([[0.3]]), np.array([1.0]))
    assert exponent[0] == pytest.approx(plain[0], abs=0.1)  # chaos: rounding differs


# -- types -----------------------------------------------------------------------------------------
def test_henon_is_chaotic_and_what_runs_away_is_told():
    map_, scale, start = henon(1.4), np.array([2.5, 0.8]), drawn((-1.4, -0.3), (1.4, 0.3), 200)
    with np.errstate(all="ignore"):
        found, label, _ = find_attractors(map_, start, scale, 1000)
        result = settle(map_, start, found, 1000)
    assert kinds(found) == ["chaotic"]
    one = found.sampled[0]
    assert abs(one.exponent - 0.41922) < 4 * one.exponent_error
    away = ~np.isfinite(map_.launch(start, 1000).advance(1000)).all(axis=(1, 2))
    assert 0 < away.sum() < 100
    np.testing.assert_array_equal(label, np.where(away, -1, 0))
    with np.errstate(all="ignore"):
        again, label, settled = find_attractors(map_, start, scale, 1000, found, kept=True)
        longer = find_attractors(map_, start, scale, 1000, found)[2]
    assert again.sampled == found.sampled
    np.testing.assert_array_equal(label, np.where(away, -1, 0))
    assert set(settled[~away].tolist()) == {ROUND}
    assert (longer == -1).all()
    np.testing.assert_array_equal(result.label, np.where(away, -1, 0))


@pytest.mark.parametrize(
    ("r", "period"),
    [(0.5, 1), (2.8, 1), (3.2, 2), (3.5, 4), (3.55, 8), (3.566, 16), (3.83, 3), (3.74, 5)],
    ids=lambda value: f"{value}",
)
def test_periods_of_the_logistic_map(r, period):
    with np.errstate(all="ignore"):
        found, label, _ = find_attractors(logistic(r), drawn(0.05, 0.95), np.array([1.0]), 2000)
    assert [orbit.period for orbit in found.orbits] == [period]
    assert kinds(found) == ["periodic"]
    assert (label == 0).all()


@pytest.mark.parametrize("r", [3.001, 2.999])
def test_slow_attractors_near_a_period_doubling_are_settled_to(r):
    """Multipliers 0.998 and -0.999: a residue of 1 falls to 1e-6 in 14 000 iterates at worst."""
    found, label, _ = find_attractors(logistic(r), drawn(0.05, 0.95), np.array([1.0]), 20_000)
    assert [orbit.period for orbit in found.orbits] == [2 if r > 3 else 1]
    assert kinds(found) == ["periodic"]
    assert (label == 0).all()


@pytest.mark.parametrize("r", [3.58, 3.6, 3.678, 3.9, 4.0])
def test_chaotic_logistic_maps(r):
    found, label, _ = find_attractors(logistic(r), drawn(0.05, 0.95), np.array([1.0]), 500)
    assert kinds(found) == ["chaotic"]
    assert (label == 0).all()


@pytest.mark.parametrize("r", [3.8284, 3.57361, 3.57723, 3.85185])
def test_a_weakly_chaotic_attractor_is_one(r):
    """The logistic map has one attractor. Exponents (2e4 iterates) are 0.06 to 0.13; their errors
    are large, that makes no second type.
    """
    found, label, _ = find_attractors(logistic(r), drawn(0.05, 0.95, 24), np.array([1.0]), 1000)
    assert len(found) == 1
    assert kinds(found) == ["chaotic"]
    assert (label == label[0]).all()


@pytest.mark.parametrize("contraction", [0.5, 0.9, 0.99, 0.995])
def test_a_rotation_is_quasi_periodic_however_slowly_it_attracts(contraction):
    found, label, _ = find_attractors(
        circle(contraction), drawn((-2, -2), (2, 2), 30), np.array([4.0, 4.0]), 4000
    )
    assert kinds(found) == ["quasi_periodic"]
    assert (label == 0).all()
    assert abs(found.sampled[0].exponent) < 1e-2
    assert np.linalg.norm(found.sampled[0].points, axis=1) == pytest.approx(np.ones(4096), abs=1e-6)


@pytest.mark.parametrize("parts", [4, 7])
def test_a_rotation_by_a_part_of_a_turn_has_no_attractor_that_is_chaotic(parts):
    """Every point of the circle is on an orbit of its own, with the multiplier 1: nothing attracts,
    nothing is chaotic.
    """
    found, _, _ = find_attractors(
        circle(0.5, 2 * math.pi / parts), drawn((-2, -2), (2, 2), 30), np.array([4.0, 4.0]), 1000
    )
    assert "chaotic" not in kinds(found)


def test_a_conservative_rotation_with_shear_is_not_chaotic():
    """Turned the faster the larger the radius: directions grow like time, not like its exponential.
    No attractor at all.
    """

    def image(z):
        angle = 1.0 + (z**2).sum(axis=1)
        return np.stack(
            [
                z[:, 0] * np.cos(angle) - z[:, 1] * np.sin(angle),
                z[:, 0] * np.sin(angle) + z[:, 1] * np.cos(angle),
            ],
            axis=1,
        )

    def derivative(z):
        angle = 1.0 + (z**2).sum(axis=1)
        turn = np.stack(
            [
                np.stack([np.cos(angle), -np.sin(angle)], axis=1),
                np.stack([np.sin(angle), np.cos(angle)], axis=1),
            ],
            axis=1,
        )
        w = image(z)
        return turn + 2 * np.stack([-w[:, 1], w[:, 0]], axis=1)[:, :, None] * z[:, None, :]

    found, _, _ = find_attractors(
        FunctionMap(image, "x y", derivative),
        drawn((0.5, 0.5), (1, 1), 8),
        np.array([2.0, 2.0]),
        500,
    )
    assert "chaotic" not in kinds(found)


@pytest.mark.parametrize(("map_", "place"), [(logistic(4.0), [0.0]), (logistic(3.2), [0.0])])
def test_a_trajectory_that_stays_on_an_unstable_point_is_on_no_attractor(map_, place):
    """x = 0 is mapped to itself exactly, with multiplier r > 1."""
    found, label, _ = find_attractors(map_, np.array([place]), np.array([1.0]), 500)
    assert kinds(found) == []
    assert label.tolist() == [-1]
    start = np.concatenate([[place], drawn(0.05, 0.95)])
    both, label, _ = find_attractors(map_, start, np.array([1.0]), 500)
    assert len(both) == 1
    assert label[0] == -1
    result = settle(map_, start, both, 500)
    both = complete(map_, result, both, np.array([1.0]), 500)
    assert len(both) == 1
    assert result.label[0] == -2  # unconverged


def test_a_chaotic_saddle_is_not_an_attractor():
    """r = 3.83: the chaotic set beside the 3-cycle holds trajectories for a while, all leave it."""
    with np.errstate(all="ignore"):
        found, label, _ = find_attractors(
            logistic(3.83), drawn(0.05, 0.95, 500), np.array([1.0]), 128
        )
    assert kinds(found) == ["periodic"]
    assert (label == 0).all()


# -- boxes -----------------------------------------------------------------------------------------
def sampled(points, kind="chaotic") -> SampledMotion:
    return SampledMotion(kind, 0.1, 0.01, np.asarray(points, float), np.ones(np.shape(points)[1]))


def test_a_chaotic_attractor_of_four_states_is_one():
    found = find_attractors(
        henons(1.4, 1.35), drawn([-0.3] * 4, [0.3] * 4, 12), np.array([2.5, 0.75, 2.5, 0.75]), 2000
    )[0]
    # however many starts lead there: 4096 points in boxes of 1/64 would be another set for each
    assert kinds(found) == ["chaotic"]


def test_shares_of_boxes():
    line = sampled(np.stack([np.linspace(0, 1, 4096), np.zeros(4096)], axis=1))
    on, off = np.array([[0.5, 0.001]] * 3), np.array([[0.5, 0.4]] * 3)
    lost = np.array([[0.5, 0.0], [np.nan, np.nan], [1e300, 0.0]])
    assert line.share(np.stack([on, off, lost])) == pytest.approx([1.0, 0.0, 1 / 3])


def ring() -> np.ndarray:
    t = np.linspace(0, 2 * np.pi, 4096, endpoint=False)
    return np.stack([np.cos(t), np.sin(t)], axis=1)


def test_one_attractor_seen_twice_is_kept_once_and_twins_are_kept():
    assert len(merge([sampled(ring() + 2), sampled(ring()[::-1] + 2)])) == 1
    assert len(merge([sampled(ring() + 2), sampled(-ring() - 2)])) == 2


def test_one_set_has_one_type():
    assert len(merge([sampled(ring(), "chaotic"), sampled(ring(), "quasi_periodic")])) == 1


# -- recurrence ------------------------------------------------------------------------------------
@pytest.mark.parametrize("n", [1, 2, 3, 12, 24, 63, 64])
def test_recurrence_finds_the_smallest_period(n):
    rng = np.random.default_rng(n)
    cycle = rng.random((n, 2))
    points = np.stack([cycle[np.arange(128) % n]] * 2)
    points[1] += 1e-5 * 0.99 ** np.arange(128)[:, None]
    period, mismatch = recurrence(points, np.ones(2))
    assert period.tolist() == [n, n]
    assert mismatch[0] == 0.0
    assert mismatch[1] < 1e-5


def test_what_has_left_the_numbers_never_recurs():
    points = np.zeros((1, 128, 2))
    points[0, 100:] = np.nan
    assert recurrence(points, np.ones(2))[1][0] == np.inf


class Fluctuating:
    """A motion on which deviations grow by random factors, mean and deviation of their logarithm
    given [per block].
    """

    def __init__(self, mean: float, deviation: float) -> None:
        self.mean, self.deviation, self.random, self.asked = (
            mean,
            deviation,
            np.random.default_rng(7),
            0,
        )

    def rows(self, which):
        return self

    def tangent(self, state, count, direction):
        self.asked += 1
        return state, direction * np.exp(self.random.normal(self.mean, self.deviation, len(state)))[
            :, None, None
        ]


def test_weak_growth_that_fluctuates_is_measured_until_it_is_no_zero():
    """0.025 an iterate, 3.8 standard errors from zero after one measurement: chaos that was taken
    for a torus.
    """
    weak = Fluctuating(8 * 0.025, 8 * 0.08)
    first = growth_rates(Fluctuating(8 * 0.025, 8 * 0.08), np.zeros((1, 2)), np.ones(2))[1]
    assert kind_of_growth(first) is None
    _, [kind] = kinds_of(weak, np.zeros((1, 2)), np.ones((1, 2)), [[0]])
    assert kind is not None
    assert kind[0] == "chaotic"
    assert abs(kind[1] - 0.025) < 4 * kind[2]
    assert weak.asked > 192


def test_growth_that_ends_late_is_no_torus():
    """0.02 an iterate in the first half of a measurement, nothing in the second: growth along a
    torus is bounded from the beginning on.
    """
    noise = np.random.default_rng(3).normal(0, 0.05, (144, 1))
    grows = np.repeat([0.02, 0.0], 72)[:, None]
    assert kind_of_growth(noise - noise.mean() + grows) is None
    assert kind_of_growth(noise - noise.mean())[0] == "quasi_periodic"


def test_what_is_told_at_once_is_not_measured_again():
    for mean, name in ((8 * 0.3, "chaotic"), (0.0, "quasi_periodic")):
        motion = Fluctuating(mean, 1e-3)
        assert kinds_of(motion, np.zeros((1, 2)), np.ones((1, 2)), [[0]])[1][0][0] == name
        assert motion.asked == 192
