"""Map of basins: which start goes where, in colours that everybody tells apart, with a legend that
explains itself.
"""

import io

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import to_rgb

from saltus.errors import ParameterError
from saltus.plot import basins, palette
from saltus.plot.basins import _apart as apart_ticks
from saltus.plot.unsettled import UNSETTLED

from .maps_data import attractors, basins_map

#: Viénot, Brettel and Mollon, Color Res. Appl. 24, 243 (1999): another model of colour blindness
#: than the one that the palette uses.
_LMS = np.array(
    [[17.8824, 43.5161, 4.11935], [3.45565, 27.1554, 3.86714], [0.0299566, 0.184309, 1.46709]]
)
_SEEN = {
    "protanopia": np.array([[0, 2.02344, -2.52581], [0, 1, 0], [0, 0, 1]]),
    "deuteranopia": np.array([[1, 0, 0], [0.494207, 0, 1.24827], [0, 0, 1]]),
}


def texts(ax):
    return [one.get_text() for one in ax.get_legend().get_texts()]


def pixels(ax):
    """Colours of the cells, shape (A, B, 3)."""
    return np.asarray(ax.images[0].get_array()).swapaxes(0, 1)


def spots(ax):
    return {one.get_gid(): one for one in ax.lines if str(one.get_gid()).startswith("attractor")}


def apart(lab):
    far = np.linalg.norm(lab[:, None] - lab[None], axis=-1)
    return far[~np.eye(len(lab), dtype=bool)].min()


# -- palette ---------------------------------------------------------------------------------------
def linear(rgb):
    return np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)


@pytest.mark.parametrize(("count", "least"), [(2, 0.2), (4, 0.14), (8, 0.075), (20, 0.04)])
@pytest.mark.parametrize("eyes", ["all cones", *_SEEN])
def test_hues_are_distinct_for_colour_blind_readers(count, least, eyes):
    rgb = palette.hues(count)
    assert np.all((rgb >= 0) & (rgb <= 1))
    if eyes != "all cones":
        seen = linear(rgb) @ (np.linalg.inv(_LMS) @ _SEEN[eyes] @ _LMS).T
        rgb = palette.srgb(palette._lab(np.clip(seen, 0, 1)))
    assert apart(palette.oklab(rgb)) > least  # one just noticeable difference is about 0.02


def test_more_attractors_leave_the_first_hues_as_they_are():
    assert np.array_equal(palette.hues(3), palette.hues(20)[:3])
    assert palette.hues(0).shape == (0, 3)


def test_oklab_of_known_colours():
    """White, and the primary red as Ottosson's page gives it."""
    assert np.allclose(
        palette.oklab(np.array([[1.0, 1, 1], [1, 0, 0]])),
        [[1, 0, 0], [0.62796, 0.22486, 0.12585]],
        atol=2e-4,
    )
    back = palette.srgb(palette.oklab(np.array([0.3, 0.6, 0.05])))
    assert np.allclose(back, [0.3, 0.6, 0.05], atol=1e-6)


def test_shades_darken_steadily_and_stay_apart_from_near_black():
    ramp = palette.oklab(palette.shades(palette.hues(20), 65))
    assert np.all(np.diff(ramp[..., 0], axis=1) < 0)
    assert np.allclose(palette.shades(palette.hues(20), 65)[:, 32], palette.hues(20), atol=1e-6)
    black = palette.oklab(np.array([to_rgb(UNSETTLED[code].color) for code in (-1, -2, -3)]))
    assert np.linalg.norm(ramp[:, -1, None] - black, axis=-1).min() > 0.02
    assert apart(black) > 0.05


# -- cells -----------------------------------------------------------------------------------------
def test_every_cell_has_the_hue_of_its_attractor():
    basin = np.array([[0, 1, 2], [2, 1, -1]])
    cells = pixels(basins(basins_map(basin), shade=False))
    wanted = np.round(255 * np.vstack([palette.hues(3), to_rgb(UNSETTLED[-1].color)])).astype(int)
    assert np.array_equal(cells, wanted[basin])


def test_order_gives_the_hues_and_the_legend():
    ds = basins_map(np.array([[0, 1], [2, 2]]))
    ax = basins(ds, shade=False, order=[2, 0])
    assert np.array_equal(
        pixels(ax)[[1, 0, 0], [0, 0, 1]], np.round(255 * palette.hues(3)).astype(int)
    )
    assert [text.split(",")[0] for text in texts(ax)[:3]] == ["3T", "T", "2T"]
    assert [text.split(",")[0] for text in texts(basins(ds))[:3]] == ["T", "2T", "3T"]


def test_cells_are_centred_on_the_starts():
    ax = basins(basins_map(np.zeros((11, 5), dtype=int)))
    assert np.allclose(ax.images[0].get_extent(), [-5.5, 5.5, -0.625, 0.625])
    assert np.allclose([*ax.get_xlim(), *ax.get_ylim()], [-5.5, 5.5, -0.625, 0.625])
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x [mm]", "v [m/s]")
    assert ax.images[0].get_rasterized()


def test_units_fit_the_map():
    ax = basins(
        basins_map(
            np.zeros((3, 3), dtype=int), x=np.linspace(0, 4e-5, 3), v=np.linspace(-0.01, 0.01, 3)
        )
    )
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x [µm]", "v [mm/s]")


def test_falling_starts_are_drawn_the_right_way_round():
    ds = basins_map(np.array([[0, 0], [1, 1]]), x=[-1e-3, 1e-3])
    up, down = (basins(one, shade=False) for one in (ds, ds.isel(x=[1, 0])))
    assert up.get_xlim() == down.get_xlim() == (-2.0, 2.0)
    assert down.images[0].get_extent()[:2] == [2.0, -2.0]
    assert np.array_equal(pixels(up)[::-1], pixels(down))


def test_uneven_starts_keep_their_places():
    ax = basins(basins_map(np.array([[0], [1], [0]]), x=[0.0, 1e-3, 3e-3], v=[0.1]))
    assert not ax.images
    corners = ax.collections[0].get_coordinates()[0, :, 0]
    assert np.allclose(corners, [-0.5, 0.5, 2.0, 4.0])


def test_slow_starts_are_darker_and_a_few_late_ones_do_not_set_the_scale():
    settle = np.tile([4, 12, 40, 120], (100, 1))
    settle[0, 0] = 100_000
    cells = palette.oklab(pixels(basins(basins_map(np.zeros((100, 4), dtype=int), settle))) / 255)[
        ..., 0
    ]
    assert np.all(np.diff(cells[1]) < 0)
    assert cells[0, 0] == cells[1, 3]
    even = np.diff(cells[1])
    # thrice as long looks about as much darker anywhere on the scale
    assert even.max() / even.min() > 0.3


def test_codes_and_holes():
    codes = np.array([[-1.0, -2.0, -3.0], [-4.0, np.nan, 0.0]])
    ds = basins_map(np.zeros((2, 3), dtype=int))
    ds["basin"] = (("x", "v"), codes)
    ax = basins(ds, shade=False)
    cells = pixels(ax)
    for code, at in {-1: (0, 0), -2: (0, 1), -3: (0, 2), -4: (1, 0)}.items():
        assert np.array_equal(cells[at], np.round(255 * np.array(to_rgb(UNSETTLED[code].color))))
    assert np.array_equal(cells[1, 0], cells[1, 1])
    assert texts(ax)[1:5] == [
        "escaped, 16.7 %",
        "not settled, 16.7 %",
        "failed, 16.7 %",
        "not computed, 33.3 %",
    ]


def test_nothing_settles():
    assert texts(basins(basins_map(np.full((4, 4), -2)))) == ["not settled, 100 %"]


def test_a_million_cells_are_as_few_marks_as_a_hundred():
    rng = np.random.default_rng(1)

    def drawn(size):
        cells = (size, size)
        return basins(basins_map(rng.integers(-2, 12, cells), rng.integers(1, 500, cells)))

    many = drawn(1000)
    assert len(many.images) == 1
    assert len(many.get_children()) <= len(drawn(10).get_children()) + 12  # more attractors met
    many.figure.savefig(io.BytesIO())


# -- attractors and legend -------------------------------------------------------------------------
def test_attractors_are_white_edged_points_of_their_hue():
    ax = basins(basins_map(np.array([[0, 1], [1, 1]])))
    assert set(spots(ax)) == {"attractor 0", "attractor 1"}
    one = spots(ax)["attractor 1"]
    assert np.allclose(one.get_xydata(), [[4.0, -0.1], [4.0, 0.1]])
    assert np.allclose(one.get_markerfacecolor(), palette.hues(2)[1])
    assert one.get_markeredgecolor() == "white"
    assert not basins(basins_map(np.array([[0, 1], [1, 1]])), points=False).lines


def test_legend_says_what_each_attractor_is():
    known = attractors(
        [[1e-3], [2e-3], [3e-3]],
        [[0.1], [0.1], [0.1]],
        [24, 0, 0],
        [60, 2.413, np.nan],
        kind=["periodic", "chaotic", "quasi_periodic"],
        fraction=[0.312, 0.6879, 0.0001],
    )
    ax = basins(basins_map(np.array([[0, 1], [1, 1]]), np.array([[1, 3], [9, 30]]), known=known))
    assert texts(ax) == [
        "24T, 60 contacts, 31.2 %", "chaotic, 2.41 contacts per T, 68.8 %",
        "quasi-periodic, < 0.1 %", "shade: periods to settle",
        "Poincaré points of the attractors",
    ]  # fmt: skip
    ax.figure.canvas.draw()
    assert ax.get_legend().get_window_extent().x0 > ax.get_window_extent().x1
    assert basins(basins_map(np.array([[0, 1], [1, 1]])), legend=False).get_legend() is None


def test_legend_says_how_far_a_noisy_attractor_scatters():
    known = attractors(
        [[1e-3], [2e-3]],
        [[0.1], [0.1]],
        [24, 5],
        [60, 14],
        kind=["noisy_periodic", "periodic"],
        fraction=[0.25, 0.75],
        attractor_scatter=("attractor", np.array([4.31e-6, np.nan]), {"units": "m"}),
    )
    ax = basins(basins_map(np.array([[0, 1], [1, 1]]), known=known))
    assert texts(ax)[:2] == [
        "noisy 24T, scatter 4.3 µm, 60 contacts, 25.0 %",
        "5T, 14 contacts, 75.0 %",
    ]


def test_scale_of_lightness_is_labelled_with_its_ends_and_middle():
    ax = basins(basins_map(np.zeros((2, 2), dtype=int), np.array([[0, 0], [3, 15]])))
    ax.figure.canvas.draw()
    numbers = [
        one.get_text() for one in ax.get_legend().findobj(plt.Text) if one.get_text().isdigit()
    ]
    assert list(dict.fromkeys(numbers)) == ["0", "3", "15"]
    same = basins(basins_map(np.zeros((2, 2), dtype=int), np.full((2, 2), 7)))
    assert "shade: periods to settle" not in texts(same)


def test_alike_attractors_are_told_apart_by_their_peaks():
    known = attractors([[1e-3], [-2e-3]], [[0.0], [0.0]], [1, 1], [1, 1], fraction=[0.5, 0.5])
    ax = basins(basins_map(np.array([[0, 1], [1, 0]]), known=known))
    assert texts(ax)[:2] == ["T, 1 contact, peak 1 mm, 50.0 %", "T, 1 contact, peak 2 mm, 50.0 %"]


def test_an_attractor_outside_the_map_is_said_to_be():
    known = attractors([[1e-3], [12e-3]], [[0.0], [0.0]], [1, 2], [1, 1], fraction=[0.5, 0.5])
    ax = basins(basins_map(np.array([[0, 1], [1, 0]]), known=known))
    assert texts(ax)[1] == "2T, 1 contact, 50.0 %, outside the map"
    assert ax.get_xlim()[1] < 11  # the map keeps its limits


def test_an_attractor_without_a_start_is_named_only_where_it_is_seen():
    known = attractors(
        [[0.0], [1e-3], [9e-3]],
        [[0.0]] * 3,
        period=[1, 2, 3],
        contacts=[0, 2, 4],
        fraction=[1.0, 0.0, 0.0],
    )
    named = texts(basins(basins_map(np.zeros((6, 6), int), known=known)))
    assert named[:2] == ["T, 0 contacts, 100 %", "2T, 2 contacts, no start"]
    assert named[-1] == "1 more that no start of the map leads to"


def test_the_title_says_where_the_other_states_start():
    ds = basins_map(np.zeros((6, 6), int))
    assert basins(ds).get_title(loc="left") == ""
    other = {"attractor_w": (("attractor", "phase"), ds["attractor_v"].values, {"units": "m/s"})}
    section = ds.assign(other).assign_attrs(at='{"w": 0.02, "q": 0.0}')
    assert basins(section).get_title(loc="left") == "w = 20 mm/s, q = 0"


@pytest.mark.parametrize(
    ("values", "shown"),
    [([1, 30, 900], [1, 30, 900]), ([1024, 1500, 1999], [1024, 1999]), ([3, 4], [3, 4])],
)
def test_numbers_of_the_ruler_do_not_touch(values, shown):
    places = np.linspace(0, 1, len(values)).tolist()
    assert [value for value, _ in apart_ticks(values, places, 6.9)] == shown


def test_axes_of_the_caller_are_used():
    _, ax = plt.subplots()
    assert basins(basins_map(np.zeros((3, 3), dtype=int)), ax=ax) is ax
    assert plt.get_fignums() == [ax.figure.number]


# -- errors ----------------------------------------------------------------------------------------
def test_the_wrong_dataset_is_told_what_to_give(run):
    good = basins_map(np.zeros((3, 3), dtype=int))
    for wrong, message in [
        ([1], r"plot.basins takes the Dataset that sl.basins returns, not a list"),
        (good["basin"], "give the whole Dataset"),
        (run, "Draw it with plot.history or plot.phase"),
        (xr.Dataset(), "from elsewhere"),
        (
            good.assign_attrs(saltus_result="agreement"),
            r"is from sl.compare\. Draw it with "
            r"plot.agreement",
        ),
        (good.assign_attrs(saltus_result="attractors"), "is from sl.attractors"),
        (good.drop_vars("periods_to_settle"), "misses periods_to_settle"),
        (good.isel(v=0), "a map needs two states"),
        (good.isel(v=[]), "holds no starts"),
    ]:
        with pytest.raises(ParameterError, match=message):
            basins(wrong)


@pytest.mark.parametrize(
    ("order", "message"), [([4], "no attractor 4. Known: 0"), ([0, 0], "occurs twice")]
)
def test_order_is_checked(order, message):
    with pytest.raises(ParameterError, match=message):
        basins(basins_map(np.zeros((3, 3), dtype=int)), order=order)
