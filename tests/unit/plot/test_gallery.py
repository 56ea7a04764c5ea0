"""Gallery: a row for each attractor, named in its title, with the hue of the map."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import saltus as sl
from saltus.errors import ParameterError
from saltus.plot import gallery, palette
from saltus.plot.gallery import title_of

from .maps_data import attractors, basins_map


@pytest.fixture(scope="module")
def known(batch):
    """Attractors for the four trajectories of the batch: two that repeat, two that don't."""
    x, v = (batch[name].values[:, 1000::100] for name in "xv")
    return attractors(
        [x[0, -3:], x[1], x[2], x[3, -1:]], [v[0, -3:], v[1], v[2], v[3, -1:]], period=[3, 0, 0, 1],
        contacts=[8, 2.4, 2.1, 2],
        fraction=[0.123, 0.5, 0.377, 0.0],
        attractor_peak=("attractor", [0.912e-3, 1e-3, 1e-3, 2e-3], {"units": "m"}),
    )  # fmt: skip


def rows(figure):
    return np.array(figure.axes, dtype=object).reshape(-1, 3)


def test_titles(known):
    assert title_of(known, 0) == (
        "3T, 8 contacts, multipliers |µ| = 0.53, peak 0.912 mm, 12.3 % of the starts"
    )
    assert title_of(known, 1) == (
        "chaotic, 2.4 contacts per T, exponent 12.3 ± 0.3 1/s, peak 1 mm, 50.0 % of the starts"
    )
    bare = known.drop_vars(
        ["attractor_fraction", "attractor_multiplier_real", "attractor_peak", "attractor_exponent"]
    )
    assert [title_of(bare, key) for key in (0, 2)] == [
        "3T, 8 contacts",
        "chaotic, 2.1 contacts per T",
    ]
    both = known.assign(attractor_multiplier_imag=known["attractor_multiplier_imag"] * [1, 0.5])
    assert "|µ| = 0.53, 0.265," in title_of(both, 0)


def test_a_row_for_each_attractor(known, batch):
    figure = gallery(known, batch)
    assert [row[0].get_title(loc="left") for row in rows(figure)] == [
        title_of(known, key) for key in range(4)
    ]
    assert [tuple(np.round(row[0].get_xlim(), 6)) for row in rows(figure)] == [
        (17, 20),
        (8, 20),
        (8, 20),
        (18, 20),
    ]
    assert [one.get_xlabel() for one in rows(figure)[-1]] == ["time [T]", "x [mm]", "x [mm]"]
    named = [one.get_text() for one in figure.legends[0].get_texts()]
    assert {"free", "contact", "Poincaré points", "other attractors"} <= set(named)
    assert len(named) == len(set(named))
    # names of gaps there would meet the title of the row
    assert not any(one.child_axes for one in rows(figure)[:, 1])


def test_poincare_points_have_the_hue_of_the_map_and_stay_inside(known, batch):
    for key, row in enumerate(rows(gallery(known, batch))):
        lines = {one.get_gid(): one for one in row[2].lines}
        mine = lines[f"attractor {key}"]
        assert np.allclose(mine.get_markerfacecolor(), palette.hues(4)[key])
        assert len(mine.get_xdata()) == [3, 11, 11, 1][key]
        assert len(lines["others"].get_xdata()) == 26 - len(mine.get_xdata())
        (left, right), (low, high) = row[2].get_xlim(), row[2].get_ylim()
        assert left < mine.get_xdata().min() <= mine.get_xdata().max() < right
        assert low < mine.get_ydata().min() <= mine.get_ydata().max() < high


def test_some_attractors_in_another_order(known, batch):
    figure = gallery(known, batch, [2, 0])
    assert [row[0].get_title(loc="left")[:7] for row in rows(figure)] == ["chaotic", "3T, 8 c"]
    turned = rows(gallery(known, batch, order=[3]))
    assert turned[0, 0].get_title(loc="left").startswith("T")
    mine = next(one for one in turned[0, 2].lines if one.get_gid() == "attractor 3")
    assert np.allclose(mine.get_markerfacecolor(), palette.hues(1)[0])


def test_a_single_trajectory_and_a_whole_map(run, known):
    one = basins_map(np.zeros((3, 3), dtype=int), known=known.isel(attractor=[0]))
    assert len(gallery(one, run).axes) == 3


def test_without_stroboscopic_points_two_columns_remain(known, batch):
    assert len(gallery(known.drop_vars("attractor_v"), batch).axes) == 8


@pytest.mark.parametrize(
    ("which", "message"),
    [
        ("map", "plot.gallery takes what sl.basins, sl.attractors or sl.basin_fractions"),
        ("runs", r"plot\.gallery\(runs=\) takes what sl\.simulate returns"),
        ("points", "takes what sl.simulate returns"),
        (
            "few",
            r"runs holds 2 trajectories, none for attractor 2 of 4.*trajectory i starts on "
            r"attractor i",
        ),
        ("id", "no attractor 7. Known: 0, 1, 2, 3"),
        ("none", "shows 1 to 20 attractors, not 0. Nothing settled"),
    ],
)
def test_errors_teach(known, batch, points, which, message):
    arguments = {
        "map": (batch, batch),
        "runs": (known, known),
        "points": (known, points),
        "few": (known, batch.isel(trajectory=[0, 1])),
        "id": (known, batch, [7]),
        "none": (known.isel(attractor=[]), batch),
    }[which]
    with pytest.raises(ParameterError, match=message):
        gallery(*arguments)
    assert not plt.get_fignums()


def test_an_equilibrium_is_a_flat_line_and_twins_are_told_apart():
    """What is left of the motion is rounding; drawn to the height of the picture it looked like an
    oscillation.
    """

    @sl.system(states="x v", units={"x": "m", "v": "m/s"})
    def saddle(t, x, v, *, rate="100 1/s^2", damping="3 1/s"):
        return v, rate * (sl.sign(x) * sl.min(sl.abs(x), 1e-3) * 2 - x) - damping * v

    starts = {"x": [1.9e-3, -1.9e-3], "v": 0.0}
    found = sl.attractors(saddle, starts, every=0.3, progress=False)
    assert found.attractor_type.values.tolist() == ["equilibrium"] * 2
    runs = sl.simulate(
        saddle,
        {name: found[f"attractor_{name}"].values[:, 0] for name in "xv"},
        t_end=3.0,
        progress=False,
    )
    runs["x"][:] += 1e-18 * np.sin(np.arange(runs.sizes["time"]))
    figure = gallery(found, runs)
    for row, place in zip(rows(figure), (-2.0, 2.0), strict=True):
        low, high = row[0].get_ylim()
        assert low < place < high
        assert high - low > 0.1
        assert f"x = {place:g} mm".replace("-", "\N{MINUS SIGN}") in row[0].get_title(loc="left")
        assert row[1].texts[0].get_text().startswith("At rest at")
