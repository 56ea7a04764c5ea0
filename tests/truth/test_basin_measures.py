"""Trust measures of basin maps against closed forms, and against published values of two systems
that can be computed anew.
"""

import math

import numpy as np
import pytest
import xarray as xr

from saltus.analysis.basins.uncertainty import (
    basin_entropy,
    fractions,
    measure,
    uncertain_share,
    uncertainty_exponent,
)
from saltus.errors import ParameterError
from saltus.intervals import smallest_seen, wilson


def split(n: int, place: int) -> np.ndarray:
    """A straight boundary before row ``place``."""
    return np.repeat((np.arange(n) >= place).astype(int)[:, None], n, axis=1)


def noise(n: int, share: float = 0.5, seed: int = 1) -> np.ndarray:
    """Every cell draws one of two labels by itself."""
    return (np.random.default_rng(seed).random((n, n)) < share).astype(int)


def two_label_entropy(p: float) -> float:
    return -sum(q * math.log(q) for q in (p, 1 - p) if q > 0)


# -- shares ----------------------------------------------------------------------------------------
def test_wilson_solves_its_own_equation():
    """The ends p of the score interval are where |k/N - p| = z sqrt(p(1-p)/N)."""
    for count, cells in ((1, 10), (5, 10), (37, 1000), (999, 1000)):
        for end in wilson(count, cells):
            assert abs(count / cells - end) == pytest.approx(
                1.959963984540054 * math.sqrt(end * (1 - end) / cells), rel=1e-12
            )


def test_wilson_has_a_width_where_nothing_or_all_was_seen():
    z2 = 1.959963984540054**2
    assert np.array(wilson(0, 20)) == pytest.approx([0.0, z2 / (20 + z2)], abs=1e-15)
    assert np.array(wilson(20, 20)) == pytest.approx([20 / (20 + z2), 1.0], abs=1e-15)
    assert np.isnan(wilson(0, 0)).all()


def test_wilson_covers_the_true_share():
    """Of 4000 random samples of 50 with p = 0.1 about 95 % hold it (exact binomial coverage:
    0.9703).
    """
    counts = np.random.default_rng(2).binomial(50, 0.1, 4000)
    low, high = wilson(counts, 50)
    pmf = np.array([math.comb(50, k) * 0.1**k * 0.9 ** (50 - k) for k in range(51)])
    ends = np.stack(wilson(np.arange(51), 50))
    exact = pmf[(ends[0] <= 0.1) & (ends[1] >= 0.1)].sum()
    assert exact == pytest.approx(0.9703, abs=1e-4)
    assert ((low <= 0.1) & (high >= 0.1)).mean() == pytest.approx(
        exact, abs=4 * math.sqrt(exact * (1 - exact) / 4000)
    )


def test_fractions_count_what_was_computed():
    labels = np.array([[0, 0, 1], [-1, -2, -4]])
    share, low, high = fractions(labels, 3)
    assert share.tolist() == [2 / 5, 1 / 5, 0.0]
    np.testing.assert_array_equal([low, high], wilson(np.array([2, 1, 0]), 5))
    assert np.isnan(fractions(np.full((2, 2), -4), 2)).all()
    with pytest.raises(ParameterError, match="Give m=2"):
        fractions(labels, 1)


def test_the_smallest_basin_is_missed_in_one_of_twenty():
    """(1 - 3/N)^N is just below 5 %."""
    for cells in (100, 10_000, 1_000_000):
        missed = (1 - smallest_seen(cells)) ** cells
        assert 0.047 < missed < 0.05
    assert smallest_seen(2) == smallest_seen(0) == 1.0


# -- closed forms of the entropies -----------------------------------------------------------------
def test_one_label_has_no_entropy_and_no_boundary():
    entropy, boundary = basin_entropy(np.full((50, 50), 3))
    assert entropy == 0.0
    assert math.isnan(boundary)
    assert np.isnan(uncertainty_exponent(np.full((128, 128), 3))).all()


def test_a_straight_boundary_has_entropies_by_hand():
    """100 x 100 cells, boundary 2 rows into a row of boxes: one box row of 20 has shares 2/5 and
    3/5.
    """
    entropy, boundary = basin_entropy(split(100, 52))
    assert boundary == pytest.approx(two_label_entropy(0.4), rel=1e-14)
    assert entropy == pytest.approx(two_label_entropy(0.4) / 20, rel=1e-14)
    on_the_seam = basin_entropy(split(100, 50))
    assert on_the_seam[0] == 0.0
    assert math.isnan(on_the_seam[1])


def test_cells_left_over_are_dropped():
    labels = np.zeros((12, 13), dtype=int)
    labels[10:] = 1
    labels[:, 10:] = 2
    assert basin_entropy(labels)[0] == 0.0
    assert np.isnan(basin_entropy(np.zeros((4, 9), dtype=int))).all()


def test_every_code_is_a_class():
    labels = np.array([[0, 1], [-1, -2]])
    assert basin_entropy(labels, box=2) == pytest.approx((math.log(4), math.log(4)), rel=1e-15)
    with pytest.raises(ParameterError, match="box=1"):
        basin_entropy(labels, box=0)


def test_cells_beyond_a_stop_count_nowhere():
    """Half of the grid is a wall: there is no boundary along it, and what lies before it counts."""
    walled = np.full((100, 100), 3)
    walled[:52] = -3
    assert basin_entropy(walled)[0] == 0.0
    assert math.isnan(basin_entropy(walled)[1])
    assert uncertain_share(walled, 1) == 0.0
    beside = np.where(walled < 0, -4, noise(100, 0.5))
    free = beside >= 0
    entropy, _ = basin_entropy(beside)
    assert entropy == pytest.approx(basin_entropy(beside[55:])[0], rel=0.02)
    assert uncertain_share(beside, 2) == pytest.approx(15 / 16, abs=0.02)
    assert free.mean() == 0.48


@pytest.mark.parametrize("p", [0.5, 0.2])
def test_noise_has_the_entropy_of_the_binomial_sum(p):
    """A box of 25 cells holds k of one label with the binomial probability; its entropy is that of
    k/25.
    """
    pmf = np.array([math.comb(25, k) * p**k * (1 - p) ** (25 - k) for k in range(26)])
    entropies = np.array([two_label_entropy(k / 25) for k in range(26)])
    mean = pmf @ entropies
    scatter = math.sqrt(pmf @ (entropies - mean) ** 2 / 120**2)
    entropy, boundary = basin_entropy(noise(600, p))
    assert entropy == pytest.approx(mean, abs=4 * scatter)
    assert boundary == pytest.approx(mean / (1 - pmf[0] - pmf[25]), abs=4 * scatter)
    if p == 0.5:  # the correction for the finite box, -1/(2 * 25) to first order
        assert math.log(2) - mean == pytest.approx(1 / 50, rel=0.05)


# -- closed forms of the exponent ------------------------------------------------------------------
@pytest.mark.parametrize("distance", [1, 3, 8])
def test_the_edges_are_mirrors(distance):
    labels = noise(24, 0.3)[:, :17]
    wide = np.pad(labels, distance, mode="symmetric")
    inside = slice(distance, -distance)
    other = [
        np.roll(wide, step, axis)[inside, inside] != labels
        for axis in (0, 1)
        for step in (-distance, distance)
    ]
    assert uncertain_share(labels, distance) == np.any(other, axis=0).mean()


@pytest.mark.parametrize("place", [64, 99, 16])
@pytest.mark.parametrize("turned", [False, True])
def test_a_straight_boundary_has_the_exponent_1(place, turned):
    labels = split(128, place)
    labels = labels.T if turned else labels
    assert [uncertain_share(labels, d) for d in (1, 2, 8)] == [2 * d / 128 for d in (1, 2, 8)]
    alpha, error, dimension = uncertainty_exponent(labels)
    assert alpha == pytest.approx(1.0, abs=1e-14)
    assert error == pytest.approx(0.0, abs=1e-14)
    assert dimension == pytest.approx(1.0, abs=1e-14)


def test_a_circle_has_the_exponent_1():
    x, y = np.meshgrid(*2 * [np.arange(512) - 255.5])
    alpha, error, _ = uncertainty_exponent((np.hypot(x, y) < 150).astype(int))
    assert alpha == pytest.approx(1.0, abs=0.02)
    assert error < 0.01


@pytest.mark.parametrize("p", [0.5, 0.2])
def test_noise_has_the_exponent_0(p):
    """Every distance sees the same share: 1 - p^5 - (1-p)^5 of the cells differ from
    a neighbour.
    """
    labels = noise(512, p)
    assert uncertain_share(labels, 8) == pytest.approx(1 - p**5 - (1 - p) ** 5, abs=0.005)
    alpha, _, dimension = uncertainty_exponent(labels)
    assert alpha == pytest.approx(0.0, abs=0.004)
    assert dimension == 2.0 - alpha


def gap_generation(levels: int) -> np.ndarray:
    """3^levels points: in which step of the middle-third construction each is removed, ``levels``
    if it never is.
    """
    place, generation = np.arange(3**levels), np.full(3**levels, levels)
    for step in range(levels):
        digit = place // 3 ** (levels - 1 - step) % 3
        generation = np.where((digit == 1) & (generation == levels), step, generation)
    return generation


def test_a_cantor_set_of_boundaries_has_its_codimension():
    """Labels alternate with the generation of the gap, so the boundary is the Cantor set: alpha = 1
    - ln 2/ln 3 = 0.369.

    The set repeats by factors of 3 and the distances go by factors of 2, so f winds about its power
    law; the bound is for that.
    """
    labels = np.repeat(gap_generation(7)[:, None] % 2, 3**7, axis=1)
    alpha, error, dimension = uncertainty_exponent(labels)
    assert alpha == pytest.approx(1 - math.log(2) / math.log(3), abs=0.02)
    assert dimension == pytest.approx(1 + math.log(2) / math.log(3), abs=0.02)
    assert 0 < error < 0.03


def test_the_exponent_needs_three_distances():
    assert np.isfinite(uncertainty_exponent(split(64, 30))).all()
    assert np.isnan(uncertainty_exponent(split(63, 30))).all()


# -- a map with published values -------------------------------------------------------------------
def fractal_map(theta: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Which of the fixed points theta = 0 and pi each start of the map of McDonald et al. (1985)
    goes to: 0, 1; -2 for neither.

    theta' = theta + 1.32 sin 2 theta - 0.90 sin 4 theta - x sin theta mod 2 pi, x' = -0.3 cos
    theta. Both points attract: |1 + 2.64 - 3.6| = 0.04 -+ 0.3 along theta.
    """
    theta, x = (values.copy() for values in np.meshgrid(theta, x, indexing="ij"))
    for _ in range(300):
        sine = np.sin(theta)
        cosine = np.cos(theta)
        double = 2 * sine * cosine
        theta, x = (
            theta + 1.32 * double - 1.80 * double * (1 - 2 * sine**2) - x * sine,
            -0.3 * cosine,
        )
    near = np.abs(np.sin(theta)) < 1e-6
    return np.where(near, (np.cos(theta) < 0).astype(int), -2)


@pytest.fixture(scope="module")
def fine() -> np.ndarray:
    """512 x 512 cell centres over half a turn; the map is even in theta."""
    cells = (np.arange(512) + 0.5) / 512
    return fractal_map(np.pi * cells, cells - 0.5)


@pytest.mark.slow
def test_the_fractal_map_shares_its_plane_equally(fine):
    """(theta, x) -> (pi - theta, -x) exchanges the two fixed points, so the shares are 1/2 each,
    cell by cell.
    """
    share, _, _ = fractions(fine, 2)
    settled = (fine >= 0) & (fine[::-1, ::-1] >= 0)
    assert settled.mean() > 0.9999
    # rounding decides a few cells on the fractal
    assert (fine + fine[::-1, ::-1] == 1)[settled].mean() > 0.999
    assert share == pytest.approx([0.5, 0.5], abs=1e-3)


def test_the_fractal_map_has_the_published_exponent(fine):
    """Grebogi, McDonald, Ott & Yorke, Phys. Lett. A 99 (1983) 415 and Physica D 17 (1985) 125:
    alpha = 0.2, D = 1.8.
    """
    alpha, error, dimension = uncertainty_exponent(fine)
    assert alpha == pytest.approx(0.2, abs=0.02)
    assert dimension == pytest.approx(1.8, abs=0.02)
    assert error < 0.01


def test_the_fractal_map_has_the_entropies_of_the_grebogi_map():
    """0.4031 and 0.6027 on 300 x 300 points over a full turn, ends included, boxes of 6 x 6.

    The grid and the box are those of the tests of Attractors.jl, whose bounds are 0.40 to 0.42 and
    0.60 to 0.61. In boxes of 5 x 5 the same map has 0.385 and 0.597: the entropy is a number of a
    grid, not of a system.
    """
    labels = fractal_map(np.linspace(0, 2 * np.pi, 300), np.linspace(-0.5, 0.5, 300))
    assert basin_entropy(labels, box=6) == pytest.approx((0.4031, 0.6027), abs=1e-3)
    assert basin_entropy(labels, box=5) == pytest.approx((0.385, 0.597), abs=2e-3)


# -- a flow with a smooth boundary -----------------------------------------------------------------
def double_well(n: int, reach: float) -> np.ndarray:
    """Which well of x'' + 0.25 x' - x + x^3 = 0 each of n x n starts falls into: 0 at x = -1, 1 at
    x = 1.

    Classical RK4, 300 steps of 0.1. By then every start has lost the energy to cross x = 0
    (checked), so the well is decided.
    """
    axis = reach * (2 * np.arange(n) + 1 - n) / n
    x, v = (values.copy() for values in np.meshgrid(axis, axis, indexing="ij"))

    def rate(x, v):
        return v, x * (1 - x * x) - 0.25 * v

    h = 0.1
    for _ in range(300):
        k1 = rate(x, v)
        k2 = rate(x + h / 2 * k1[0], v + h / 2 * k1[1])
        k3 = rate(x + h / 2 * k2[0], v + h / 2 * k2[1])
        k4 = rate(x + h * k3[0], v + h * k3[1])
        x, v = (
            y + h / 6 * (a + 2 * b + 2 * c + d)
            for y, a, b, c, d in zip((x, v), k1, k2, k3, k4, strict=True)
        )
    assert (v**2 / 2 - x**2 / 2 + x**4 / 4 < -0.2).all()
    return (x > 0).astype(int)


@pytest.fixture(scope="module")
def wells() -> np.ndarray:
    return double_well(256, 2.0)


def test_the_double_well_is_shared_by_symmetry(wells):
    """(x, v) -> (-x, -v) exchanges the wells: the map is its own negative under a half turn."""
    np.testing.assert_array_equal(wells[::-1, ::-1], 1 - wells)
    assert fractions(wells, 2)[0].tolist() == [0.5, 0.5]


@pytest.mark.slow
def test_the_double_well_has_a_smooth_boundary(wells):
    """One branch of the boundary crosses the inner square. The outer one holds windings, whose
    strips the largest distances don't resolve: there alpha comes out low and rises with the grid.
    """
    inner = uncertainty_exponent(double_well(256, 1.0))
    assert inner == pytest.approx((1.0, 0.0, 1.0), abs=1e-3)
    coarse, fine = uncertainty_exponent(wells), uncertainty_exponent(double_well(512, 2.0))
    assert coarse[0] == pytest.approx(1.0, abs=0.07)
    assert coarse[0] < fine[0] < 1.0
    assert coarse[2] == 2.0 - coarse[0]
    assert 1 + math.log2(uncertain_share(wells, 1) / uncertain_share(wells, 2)) == pytest.approx(
        0.0, abs=0.01
    )
    assert basin_entropy(wells)[1] < math.log(2)


# -- a map of basins -------------------------------------------------------------------------------
def test_measure_gathers_all_of_them(wells):
    labels = wells.copy()
    labels[0, :3] = -1, -2, -4
    grazes = np.zeros(labels.shape, dtype=np.int16)
    grazes[5, :4] = 0, 1, 2, 300
    ds = xr.Dataset(
        {"basin": (("x", "v"), labels), "grazes_unresolved": (("x", "v"), grazes),
            "status": (("x", "v"), labels),
         "attractor_type": ("attractor", ["periodic"] * 2)},
         attrs={"saltus_result": "basins", "states": "x v"},
    )  # fmt: skip
    numbers = measure(ds)
    assert list(numbers) == [
        "smallest_basin_seen", "basin_entropy", "boundary_basin_entropy", "uncertainty_exponent",
        "uncertainty_exponent_error",
        "boundary_dimension", "unresolved_cells", "unsettled_cells"]  # fmt: skip
    assert tuple(numbers.values())[1:6] == (*basin_entropy(labels), *uncertainty_exponent(labels))
    assert numbers["smallest_basin_seen"] == 3 / (256**2 - 1)
    assert numbers["unresolved_cells"] == 3
    assert numbers["unsettled_cells"] == 3
    assert all(type(value) in (int, float) for value in numbers.values())
    with pytest.raises(ParameterError, match="not a dict"):
        measure(numbers)
