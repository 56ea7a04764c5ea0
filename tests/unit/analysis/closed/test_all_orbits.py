"""The search for all periodic orbits, on maps whose orbits are known in number, place or
multipliers.
"""

import numpy as np
import pytest

from function_maps import FunctionMap
from saltus.analysis.closed.all_orbits import all_orbits, multipliers_of
from saltus.analysis.closed.orbit_table import outside, stability_of
from saltus.analysis.closed.shooting import close
from saltus.analysis.solve.newton import newton

LOGISTIC = FunctionMap(lambda x: 4 * x * (1 - x), "x", lambda x: (4 - 8 * x)[:, :, None])
HENON = FunctionMap(
    lambda x: np.stack([1 - 1.4 * x[:, 0] ** 2 + x[:, 1], 0.3 * x[:, 0]], axis=1),
    "x y",
    lambda x: np.stack(
        [
            np.stack([-2.8 * x[:, 0], np.ones(len(x))], axis=1),
            np.tile([0.3, 0.0], (len(x), 1)),
        ],
        axis=1,
    ),
)


@pytest.fixture(scope="module")
def logistic():
    start = np.random.default_rng(1).random((300, 1))
    return all_orbits(LOGISTIC, start, 6, np.ones(1))


@pytest.fixture(scope="module")
def henon():
    start = np.random.default_rng(1).uniform([-1.5, -0.5], [1.5, 0.5], (300, 2))
    return all_orbits(HENON, start, 7, np.array([2.6, 0.8]))


def test_the_logistic_map_at_4_has_2_to_the_n_points_of_period_n(logistic):
    """It is conjugate to doubling an angle: sin^2(pi j / (2^n +- 1)) are all its points."""
    for n in range(1, 7):
        points = [x for one in logistic.motions if n % one.period == 0 for x in one.points[:, 0]]
        exact = [np.sin(np.pi * j / (2**n - 1)) ** 2 for j in range(2 ** (n - 1))]
        exact += [np.sin(np.pi * j / (2**n + 1)) ** 2 for j in range(1, 2 ** (n - 1) + 1)]
        assert np.sort(points) == pytest.approx(np.sort(exact), abs=1e-12)


def test_their_multipliers_are_2_to_the_n(logistic):
    """But for the fixed point at the end of the interval, whose multiplier is 4."""
    for one in logistic.motions:
        n = one.period
        exact = 4.0 if one.points[0, 0] < 1e-9 else 2.0**n
        assert abs(one.multipliers[0]) == pytest.approx(exact, rel=1e-10)


def test_the_henon_map_has_the_cycles_that_are_known(henon):
    """Biham & Wenzel, Phys. Rev. Lett. 63 (1989) 819, and the fixed point off the attractor."""
    counts = np.bincount([one.period for one in henon.motions], minlength=8)[1:]
    assert counts.tolist() == [2, 1, 0, 1, 0, 2, 4]


def test_areas_shrink_by_the_determinant_of_the_map(henon):
    for one in henon.motions:
        assert np.prod(one.multipliers).real == pytest.approx((-0.3) ** one.period, rel=1e-12)


def test_every_orbit_is_there_once_and_has_its_least_period(henon):
    for i, one in enumerate(henon.motions):
        image = one.points
        for m in range(1, one.period):
            image = HENON.launch(image, 1).advance(1)[:, 0]
            assert np.abs(image - one.points).max() > 1e-3, m
        others = [x.points for x in henon.motions[i + 1 :] if x.period == one.period]
        assert all(np.abs(one.points[0] - x).max(axis=1).min() > 1e-4 for x in others)


def test_starts_that_converged_are_those_that_orbits_count(henon):
    assert sum(henon.found) == sum(search.converged for search in henon.searches)
    for search in henon.searches:
        assert search.unseen == search.found_once / search.converged
    assert all(search.exhausted for search in henon.searches)


def test_with_one_start_nothing_is_claimed():
    found = all_orbits(LOGISTIC, np.array([[0.3]]), 1, np.ones(1))
    assert found.searches[0].unseen == 1.0
    assert found.searches[0].found_once == 1


def test_deflation_never_returns_a_known_orbit(henon):
    start = np.random.default_rng(2).uniform([-1.5, -0.5], [1.5, 0.5], (200, 1, 2))
    first = henon.motions[0].points.reshape(1, 2)
    _, found = close(henon.guess(start), first)
    assert len(found)
    assert np.abs(found.points[:, 0] - first).max(axis=1).min() > 0.1
    assert not len(close(henon.guess(start), henon.known(1))[1])


def test_deflation_finds_what_the_starts_do_not_lead_to():
    """x^3 - x from about 1 leads to 1 only; once that is deflated, to 0; then to neither."""

    def equations(x, _):
        return x**3 - x, (3 * x**2 - 1)[:, :, None]

    start, known = np.linspace(0.7, 1.3, 13)[:, None], np.zeros((0, 1))
    zeros = newton(equations, start, np.ones((13, 1)), damped=True)
    assert zeros.found.all()
    assert zeros.z == pytest.approx(np.ones((13, 1)), abs=1e-12)
    for _ in range(3):
        zeros = newton(equations, start, np.ones((13, 1)), damped=True, known=known)
        x, found = zeros.z, zeros.found
        assert not np.isin(np.round(x[found], 6), np.round(known, 6)).any()
        known = np.concatenate([known, x[found][:1]])
    assert np.sort(known[:, 0]) == pytest.approx([0, 1], abs=1e-12)


def test_damping_converges_where_the_plain_step_runs_away():
    """Newton's method on atan diverges from beyond 1.39."""
    zeros = newton(
        lambda x, _: (np.arctan(x), (100 / (1 + x**2))[:, :, None]),
        np.array([[10.0], [-50.0]]),
        np.full((2, 1), 100.0),
        damped=True,
    )
    assert zeros.found.all()
    assert np.abs(zeros.z).max() < 1e-12


def test_small_multipliers_survive_large_ones():
    """Of a product of 12 matrices with determinant 1/2, rounding leaves of the eigenvalues 1e-30
    nothing.
    """
    turn = np.array([[1.0, 0.3], [0.7, 1.0]])
    one = turn @ np.diag([300.0, 1 / 600.0]) @ np.linalg.inv(turn)
    found = multipliers_of(np.array([one] * 12))
    assert found.real == pytest.approx([300.0**12, 600.0**-12], rel=1e-10, abs=0)


@pytest.mark.parametrize(
    ("multipliers", "word", "count"),
    [
        ([0.5, 0.2], "stable node", 0),
        ([0.5 + 0.1j, 0.5 - 0.1j], "stable focus", 0),
        ([2.0, 0.3], "saddle", 1),
        ([-2.0, -0.3], "inverse saddle", 1),
        ([-3.0, -2.0, 0.1], "saddle", 2),
        ([3.0, 2.0], "unstable node", 2),
        ([2j, -2j], "unstable focus", 2),
        ([1.0, 0.3], "marginal", 1),
    ],
)
def test_words_for_stability(multipliers, word, count):
    multipliers = np.array(multipliers, complex)
    assert stability_of(multipliers) == word
    assert outside(multipliers) == count
