"""Two maps of basins side by side: who is who, and where they agree."""

import numpy as np
import pytest
import xarray as xr

import made_results
from saltus.analysis.basins.compare import compare
from saltus.analysis.basins.uncertainty import fractions
from saltus.errors import ParameterError
from saltus.intervals import wilson
from saltus.results import AttractorTable, describe, load, save

X, V = np.linspace(-5e-3, 5e-3, 4), np.linspace(-1.0, 1.0, 3)
#: Two orbits of period 1 and 2 and a chaotic motion: type, points, peak.
ONE = ("periodic", [[1e-3, 0.5]], 2e-3)
TWO = ("periodic", [[2e-3, 0.0], [-1e-3, 0.3]], 3e-3)
CHAOS = ("chaotic", [], 4e-3)
LABELS = np.array([[0, 0, 1], [0, 1, 1], [2, 2, 1], [2, -1, 2]])


def basins(
    motions=(ONE, TWO, CHAOS),
    labels=LABELS,
    axes=None,
    units=None,
    states=("x", "v"),
    parameters='{"gap": 1e-3}',
    **attrs,
):
    m = len(motions)
    table = AttractorTable(
        kind=[kind for kind, _, _ in motions], period=[len(points) for _, points, _ in motions],
        contacts=np.full(m, 2.0),
        itinerary=["0 1"] * m, peak=[peak for *_, peak in motions],
        rms=[peak / 2 for *_, peak in motions], margin=np.ones(m),
        multipliers=np.zeros((m, 2)), exponent=np.zeros(m), exponent_error=np.zeros(m),
        points=[np.array(points, dtype=float).reshape(-1, len(states)) for _, points, _ in motions],
        fractions=fractions(labels, m),
    )  # fmt: skip
    return made_results.basins(
        states=states, units=units or {"x": "m", "v": "m/s"}, axes=axes or {"x": X, "v": V},
        basin=labels,
        periods_to_settle=np.ones_like(labels), status=np.full(labels.shape, 2),
        status_meanings={2: "ok"},
        grazes_unresolved=np.zeros_like(labels), attractors=table, gap_unit="m",
        attrs={"system": "rig", "method": "taylor", "method_options": "{}",
            "parameters": parameters, "units": '{"gap": "m"}', **attrs},
    )  # fmt: skip


def renumbered(order, labels=LABELS):
    """The labels when attractor i is called order.index(i)."""
    return np.array(
        [order.index(label) if label >= 0 else label for label in labels.ravel()]
    ).reshape(labels.shape)


def moved(motion, by):
    kind, points, peak = motion
    return kind, [[x + by * 0.01, v] for x, v in points], peak + by * 0.01


def table(ds):
    return list(zip(ds["match_a"].values.tolist(), ds["match_b"].values.tolist(), strict=True))


# -- matching --------------------------------------------------------------------------------------
def test_a_map_agrees_with_itself():
    ds = compare(basins(), basins())
    assert table(ds) == [(0, 0), (1, 1), (2, 2)]
    assert ds["agreement"].values.tolist() == [[1, 1, 1], [1, 1, 1], [1, 1, 1], [1, -1, 1]]
    assert ds["match_orbit_distance"].values.tolist() == [0.0, 0.0, 0.0]
    assert ds["match_agreeing_cells"].values.tolist() == [3, 4, 4]
    assert ds.attrs["agreement"] == 1.0
    assert ds.attrs["settled_cells"] == 11


def test_another_numbering_changes_nothing():
    order = [2, 0, 1]
    other = basins([(ONE, TWO, CHAOS)[i] for i in order], renumbered(order))
    ds = compare(basins(), other)
    assert table(ds) == [(0, 1), (1, 2), (2, 0)]
    np.testing.assert_array_equal(ds["basin_b"], LABELS)
    assert ds.attrs["agreement"] == 1.0


def test_an_orbit_is_the_same_from_any_of_its_points_on():
    kind, points, peak = TWO
    ds = compare(basins(), basins((ONE, (kind, points[::-1], peak), CHAOS)))
    assert table(ds)[1] == (1, 1)
    assert ds["match_orbit_distance"].values[1] == 0.0


def test_the_distance_is_relative_to_the_axes():
    """0.02 mm of 10 mm, and 0.01 m/s of 2 m/s: the larger counts."""
    near = ("periodic", [[1.02e-3, 0.51]], 2e-3)
    ds = compare(basins(), basins((near, TWO, CHAOS)))
    assert ds["match_orbit_distance"].values[0] == pytest.approx(0.005, rel=1e-9)


def test_the_tolerance_decides():
    other = basins((moved(ONE, 0.02), TWO, CHAOS))
    assert table(compare(basins(), other, tolerance=0.021))[0] == (0, 0)
    assert table(compare(basins(), other, tolerance=0.019)) == [(0, -1), (1, 1), (2, 2), (-1, 0)]
    with pytest.raises(ParameterError, match="no distance"):
        compare(basins(), other, tolerance=float("nan"))


def test_a_response_shifted_in_phase_is_the_same_while_its_peak_is():
    kind, points, peak = ONE
    shifted = (kind, [[x + 0.05 * 0.01, v] for x, v in points], peak)
    far = (kind, [[x + 0.15 * 0.01, v] for x, v in points], peak)
    assert table(compare(basins(), basins((shifted, TWO, CHAOS)))) == [(0, 0), (1, 1), (2, 2)]
    assert table(compare(basins(), basins((far, TWO, CHAOS))))[0] == (0, -1)
    # its peak is another
    assert table(compare(basins(), basins((moved(ONE, 0.05), TWO, CHAOS))))[0] == (0, -1)


def test_a_tolerance_of_zero_takes_equal_orbits():
    assert table(compare(basins(), basins(), tolerance=0.0)) == [(0, 0), (1, 1), (2, 2)]


def test_period_and_type_come_before_distance():
    doubled = ("periodic", [*ONE[1], *ONE[1]], ONE[2])
    torus = ("quasi_periodic", *CHAOS[1:])
    ds = compare(basins(), basins((doubled, TWO, torus)))
    assert table(ds) == [(0, -1), (1, 1), (2, -1), (-1, 0), (-1, 2)]
    assert ds["match_type"].values.tolist() == [
        "periodic",
        "periodic",
        "chaotic",
        "periodic",
        "quasi_periodic",
    ]
    assert ds["match_period"].values.tolist() == [1, 2, 0, 2, 0]


def test_a_noisy_orbit_is_the_one_about_which_it_scatters():
    noisy = ("noisy_periodic", *TWO[1:])
    assert table(compare(basins(), basins((ONE, noisy, CHAOS)))) == [(0, 0), (1, 1), (2, 2)]
    longer = ("noisy_periodic", [*TWO[1], *TWO[1]], TWO[2])
    assert table(compare(basins(), basins((ONE, longer, CHAOS))))[1] == (1, -1)


def test_the_nearest_go_together_whatever_cells_they_share():
    """Two orbits of period 1 within the tolerance of both; the labels of b are exchanged, and that
    must show.
    """
    other = moved(ONE, 0.004)
    a = basins((ONE, other), np.where(LABELS > 1, 1, LABELS))
    b = basins((ONE, other), 1 - np.where(LABELS > 1, 1, np.abs(LABELS)))
    ds = compare(a, b)
    assert table(ds) == [(0, 0), (1, 1)]
    assert ds.attrs["agreement"] == 0.0


def test_the_assignment_is_the_best_one_not_the_first():
    """b holds one orbit near both of a; the nearer of a gets it."""
    a = basins((moved(ONE, 0.008), ONE), np.where(LABELS > 1, 1, LABELS))
    b = basins((moved(ONE, 0.001),), np.minimum(LABELS, 0))
    assert table(compare(a, b)) == [(0, -1), (1, 0)]


def test_chaotic_twins_are_told_apart_by_their_cells():
    """Mirror twins have equal peaks up to their scatter."""
    twins = (CHAOS, moved(CHAOS, 0.001))
    labels = np.where(LABELS > 1, 1, LABELS)
    flipped = np.where(labels >= 0, 1 - labels, labels)
    ds = compare(basins(twins, labels), basins(twins, flipped))
    assert table(ds) == [(0, 1), (1, 0)]
    assert ds.attrs["agreement"] == 1.0


def test_chaos_of_another_size_is_another_attractor():
    assert table(compare(basins(), basins((ONE, TWO, moved(CHAOS, 0.02)))))[2] == (2, -1)


def test_orbits_without_points_match_nothing():
    lost = ("periodic", [[np.nan, np.nan]], 2e-3)
    assert table(compare(basins(), basins((lost, TWO, CHAOS))))[0] == (0, -1)


# -- cells -----------------------------------------------------------------------------------------
def test_cells_that_differ_are_counted():
    labels = LABELS.copy()
    labels[0, 0], labels[1, 0], labels[3, 1] = 1, -2, 0
    ds = compare(basins(), basins(labels=labels))
    assert ds["agreement"].values.tolist() == [[0, 1, 1], [-1, 1, 1], [1, 1, 1], [1, -1, 1]]
    assert ds["match_agreeing_cells"].values.tolist() == [1, 4, 4]
    assert ds.attrs["agreement"] == 9 / 10
    assert (ds.attrs["agreement_low"], ds.attrs["agreement_high"]) == tuple(
        map(float, wilson(9, 10))
    )
    assert ds["match_fraction_a"].values.tolist() == [3 / 12, 4 / 12, 4 / 12]
    assert ds["match_fraction_b"].values.tolist() == [2 / 12, 5 / 12, 4 / 12]
    assert ds["basin_b"].values[1, 0] == -2


def test_what_only_one_map_has_disagrees():
    labels = LABELS.copy()
    labels[0] = 3
    extra = ("periodic", [[-3e-3, -0.5]], 5e-3)
    ds = compare(basins(), basins((extra, CHAOS, TWO, ONE), renumbered([3, 2, 1, 0], labels)))
    assert table(ds) == [(0, 3), (1, 2), (2, 1), (-1, 0)]
    np.testing.assert_array_equal(ds["basin_b"], labels)
    assert ds["agreement"].values[0].tolist() == [0, 0, 0]
    np.testing.assert_array_equal(ds["match_fraction_a"], [0.25, 4 / 12, 4 / 12, np.nan])
    np.testing.assert_array_equal(np.isnan(ds["match_orbit_distance"]), [False, False, False, True])


def test_maps_without_any_attractor():
    empty = basins((), np.full((4, 3), -2))
    ds = compare(empty, empty)
    assert table(ds) == []
    assert (ds["agreement"] == -1).all()
    assert np.isnan(ds.attrs["agreement"])
    assert table(compare(basins(), empty)) == [(0, -1), (1, -1), (2, -1)]
    assert table(compare(empty, basins())) == [(-1, 0), (-1, 1), (-1, 2)]


# -- the result ------------------------------------------------------------------------------------
def test_the_result_says_where_both_come_from():
    b = basins(parameters='{"gap": 2e-3, "force": 4}', method="ode45").assign_attrs(
        units='{"gap": "mm"}'
    )
    ds = compare(basins(parameters='{"gap": 1e-3, "force": 4}'), b)
    assert ds.attrs["saltus_result"] == "agreement"
    assert (ds.attrs["method_a"], ds.attrs["method_b"]) == ("taylor", "ode45")
    assert (ds.attrs["result_hash_a"], ds.attrs["result_hash_b"]) == (
        basins().attrs["result_hash"],
        b.attrs["result_hash"],
    )
    assert ds.attrs["parameters_b"] == '{"gap": 2e-3, "force": 4}'
    assert ds.attrs["parameters"] == '{"force": 4}'
    assert "units" not in ds.attrs
    assert ds["agreement"].attrs["flag_meanings"] == "not_settled differ agree"
    assert "rig: force = 4" in describe(ds)


def test_the_result_survives_a_file(tmp_path):
    ds = compare(basins(), basins())
    xr.testing.assert_identical(load(save(ds, tmp_path / "agreement.nc")), ds)


# -- states beyond the axes ------------------------------------------------------------------------
def test_a_state_that_is_no_axis_is_measured_by_its_points():
    def three(z):
        return basins(
            [("periodic", [[1e-3, 0.5, z]], 2e-3)], np.zeros((4, 3), int), states=("x", "v", "z")
        )

    ds = compare(three(100.0), three(99.5))
    assert ds["match_orbit_distance"].values.tolist() == pytest.approx([0.005])
    assert table(compare(three(100.0), three(80.0))) == [(0, -1), (-1, 0)]
    assert table(compare(three(0.0), three(0.0))) == [(0, 0)]


# -- grids that differ -----------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"axes": {"x": X[:3], "v": V}, "labels": LABELS[:3]}, "x has 4 and 3 cells"),
        (
            {"axes": {"x": X, "v": V + 0.1}},
            r"v runs from -1 to 1 and from -0\.90.* m/s, up to 0\.1 "
            r"apart",
        ),
        ({"axes": {"v": X, "x": V}}, "axes are x, v and v, x"),
        ({"units": {"x": "mm", "v": "m/s"}}, "x is in m and in mm"),
        (
            {
                "states": ("x", "v", "z"),
                "motions": [("periodic", [[1e-3, 0.5, 0.0]], 1.0)],
                "labels": 0 * LABELS,
            },
            "states are x, v and x, v, z",
        ),
    ],
)
def test_grids_that_differ_are_named(changes, message):
    with pytest.raises(
        ParameterError, match=f"aren't on one grid: .*{message}.*same states, ranges"
    ):
        compare(basins(), basins(**changes))


def test_rounding_of_the_grid_is_forgiven():
    assert compare(basins(), basins(axes={"x": X * (1 + 1e-15), "v": V})).attrs["agreement"] == 1.0


def test_only_maps_can_be_compared():
    with pytest.raises(ParameterError, match=r"this Dataset is from sl\.compare"):
        compare(basins(), compare(basins(), basins()))
