"""Agreement of two maps: both in the same hues, and where they differ."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.text import Text

from saltus.errors import ParameterError
from saltus.plot import agreement, palette

from .maps_data import agreement_map, basins_map

A = np.array([[0, 0, 2], [2, -2, 2]])
B = np.array([[0, 2, 2], [2, 0, -1]])


def pixels(ax):
    return np.asarray(ax.images[0].get_array()).swapaxes(0, 1)


def texts(ax):
    return [one.get_text() for one in ax.get_legend().get_texts()]


def test_maps_are_named_by_their_methods_where_these_differ():
    ds = agreement_map(A, B).assign_attrs(
        method_a="ODE45",
        method_options_a='{"rtol": 1e-4, "atol": 1e-7, "events": "ignore"}',
        method_b="Taylor",
    )
    titles = [one.get_title(loc="left").replace("\n", " ") for one in agreement(ds)]
    assert titles[:2] == ["ode45, rtol 0.0001, atol 1e-07, contacts not located", "exact"]


def test_three_panels():
    panels = agreement(agreement_map(A, B))
    assert [one.get_title(loc="left") for one in panels] == ["map a", "map b", "75.0 % agree"]
    assert texts(panels[2]) == ["agree, 3", "differ, 1", "not settled in one of them, 2"]
    assert texts(panels[0]) == ["T, in both", "3T, in both", "escaped", "not settled"]
    assert [one.get_xlabel() for one in panels] == ["x [mm]"] * 3
    assert panels[0].get_ylabel() == "v [m/s]"


def test_an_attractor_has_the_same_hue_in_both_maps_and_in_plot_basins():
    first, second, _ = agreement(agreement_map(A, B))
    hue = np.round(255 * palette.hues(3)).astype(int)
    assert np.array_equal(pixels(first)[A == 2], np.broadcast_to(hue[2], (3, 3)))
    assert np.array_equal(pixels(second)[B == 2], np.broadcast_to(hue[2], (3, 3)))


def test_each_value_has_its_own_colour():
    ds = agreement_map(A, B)
    cells = pixels(agreement(ds)[2])
    kinds = [np.unique(cells[ds["agreement"].values == value], axis=0) for value in (1, 0, -1)]
    assert [len(one) for one in kinds] == [1, 1, 1]
    assert len(np.unique(np.concatenate(kinds), axis=0)) == 3


def test_one_axes_shows_where_they_differ():
    _, ax = plt.subplots()
    assert agreement(agreement_map(A, B), ax) is ax
    assert len(ax.images) == 1
    assert "75.0 % agree" in (ax.get_title(), ax.get_title(loc="left"))
    _, three = plt.subplots(1, 3)
    assert agreement(agreement_map(A, B), three)[1] is three[1]


def test_names_of_the_maps_and_of_the_attractors():
    ds = agreement_map(A, B).assign_attrs(name_a="saltus", name_b="ode45")
    panels = agreement(ds)
    assert [one.get_title(loc="left") for one in panels[:2]] == ["saltus", "ode45"]
    assert texts(panels[0])[:2] == ["T, in both", "3T, in both"]


def test_shares_at_the_ends_of_the_scale():
    same = np.zeros((40, 60), dtype=int)
    other = same.copy()
    other[0, 0] = 1
    titles = [
        agreement(agreement_map(*both))[2].get_title(loc="left")
        for both in [(same, same), (same, other), (same - 2, same)]
    ]
    assert titles == ["100 % agree", "> 99.9 % agree", "nothing settles in both"]


def test_many_attractors_are_not_named():
    many = np.arange(12).reshape(3, 4)
    assert agreement(agreement_map(many, many))[0].get_legend() is None


def test_errors_teach():
    ds = agreement_map(A, B)
    with pytest.raises(ParameterError, match=r"Draw it with plot\.basins"):
        agreement(basins_map(A))
    with pytest.raises(ParameterError, match="misses basin_b"):
        agreement(ds.drop_vars("basin_b"))
    for ax in ("here", plt.subplots(1, 2)[1]):
        with pytest.raises(ParameterError, match="Give one Axes, or three"):
            agreement(ds, ax)


def test_long_names_of_maps_stay_above_their_maps():
    ds = agreement_map(np.zeros((3, 3), dtype=int), np.zeros((3, 3), dtype=int)).assign_attrs(
        name_b="ode45, rtol 0.001, atol 1e-05, step 0.001, contacts not located"
    )
    panels = agreement(ds)
    panels[0].figure.canvas.draw()
    title = next(
        text
        for text in panels[1].findobj(Text)
        if " ".join(text.get_text().split()) == ds.attrs["name_b"]
    )
    assert title.get_window_extent().x1 < panels[2].get_window_extent().x0
