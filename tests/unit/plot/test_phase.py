"""A phase portrait: settled part, colours by region, Poincare points at whole periods."""

from itertools import pairwise

import matplotlib.pyplot as plt
import numpy as np
import pytest

import saltus as sl
from saltus.errors import ParameterError
from saltus.plot import phase
from saltus.units import from_si

from .conftest import GAPS, rig_run
from .test_history import COLORS, ends

POINCARE = "Poincaré points"


def line(ax, label):
    """A line by the beginning of its label: the periods shown may follow."""
    return next(one for one in ax.lines if str(one.get_label()).startswith(label))


def test_poincare_points_are_the_states_at_whole_periods(run):
    ax = phase(run, periods=7)
    x, v = line(ax, POINCARE).get_data()
    whole = run.isel(time=slice(3300, None, 100))
    assert np.array_equal(x, whole["x"].values * 1e3)
    assert np.array_equal(v, whole["v"].values * 1e3)
    assert not [
        one for one in phase(run, poincare=False).lines if str(one.get_label()).startswith(POINCARE)
    ]


def test_the_last_30_percent_are_shown(run):
    assert len(line(phase(run), POINCARE).get_xdata()) == 12 + 1
    short = rig_run(periods=2)
    assert len(line(phase(short), POINCARE).get_xdata()) == 1 + 1


def test_colours_change_exactly_at_the_boundaries(run):
    ax = phase(run, periods=5)
    begin, end = run.isel(time=3500), run.isel(time=-1)
    loose = {float(one["x"]) * 1e3 for one in (begin, end)}
    for label, allowed in {
        "upper contact": {0.4},
        "free": {0.0, 0.4},
        "lower contact": {0.0},
    }.items():
        assert set(ends(ax, label)[:, 0]) <= allowed | loose


def test_axes_have_units_and_gap_lines(run):
    ax = phase(run)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x [mm]", "v [mm/s]")
    assert [one.get_xdata()[0] for one in ax.lines if one.is_dashed()] == [
        gap * 1e3 for gap in GAPS
    ]
    assert {text.get_text() for text in ax.get_legend().get_texts()} == {
        *COLORS,
        f"{POINCARE}, 28 T to 40 T",
    }


def test_states_can_be_turned(run):
    ax = phase(run, states=("v", "x"))
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("v [mm/s]", "x [mm]")
    assert [one.get_ydata()[0] for one in ax.lines if one.is_dashed()] == [
        gap * 1e3 for gap in GAPS
    ]


def test_a_batch_is_laid_over_one_another(batch):
    ax = phase(batch, periods=5)
    orbits = [one for one in ax.lines if one.get_label().startswith("from ")]
    starts = batch.x.isel({batch.x.dims[-1]: 0}).values
    assert [one.get_label() for one in orbits] == [f"from x = {from_si(x, 'm', 4)}" for x in starts]
    assert len({one.get_color() for one in orbits}) == 4
    dots = [one for one in ax.lines if one.get_marker() == "o"]
    assert [len(one.get_xdata()) for one in dots] == [6] * 4
    assert len([one for one in ax.lines if one.is_dashed()]) == 2


def test_one_of_a_batch_is_coloured_by_region(batch):
    _, ax = plt.subplots()
    assert phase(batch, 1, ax=ax) is ax
    assert {one.get_label() for one in ax.lines} >= set(COLORS)


def test_stroboscopic_points_alone(points):
    ax = phase(points, 1, periods=(10, 20))
    assert [len(one.get_xdata()) for one in ax.lines if one.get_marker() == "o"] == [11]
    assert np.array_equal(line(ax, POINCARE).get_xdata(), points["x"].values[1, 10:] * 1e3)
    assert len([one for one in phase(points).lines if one.get_marker() == "o"]) == 4


def test_many_points_become_pixels(points):
    many = rig_run(periods=2)
    assert not line(phase(many), POINCARE).get_rasterized()
    cloud = points.isel(period=np.zeros(600, dtype=int), trajectory=[0]).assign_coords(
        period=np.arange(600)
    )
    assert line(phase(cloud, 0, periods=(0, 600)), POINCARE).get_rasterized()


def test_colours_of_guards_that_bound_no_state(run):
    """A gap between two masses: the modes decide, named by what is met."""
    relative = run.copy(deep=True)
    relative["guard_state"] = ("guard", np.array(["", ""]))
    relative["guard_boundary"] = ("guard", np.full(2, np.nan))
    ax = phase(relative, periods=5)
    both = line(ax, "beyond upper gap")
    assert np.nanmin(both.get_xdata()) == 0.4
    assert np.nanmax(line(ax, "beyond lower gap").get_xdata()) == 0.0
    assert not [one for one in ax.lines if one.is_dashed()]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"states": "x"}, "Give two names"),
        ({"states": np.array(None)}, "Give two names"),
        ({"states": ("x", "w")}, "no state 'w'"),
        ({"units": {"V": "m/s"}}, "no state 'V'"),
        ({"trajectory": 9}, "no trajectory 9"),
        ({"ax": [1, 2]}, "Give matplotlib Axes"),
    ],
)
def test_errors_teach(batch, arguments, message):
    with pytest.raises(ParameterError, match=message):
        phase(batch, **arguments)


def test_too_many_to_tell_apart(batch):
    many = batch.isel(trajectory=np.zeros(9, dtype=int)).assign_coords(trajectory=np.arange(9))
    with pytest.raises(ParameterError, match=r"1 to 8 trajectories, not 9.*trajectory=\[0\]"):
        phase(many)


def test_only_results_are_drawn():
    with pytest.raises(ParameterError, match=r"sl\.simulate or sl\.stroboscope"):
        phase([1, 2])


def test_a_phase_portrait_shows_a_state_and_its_rate():
    """Of two masses the second state is another displacement."""

    @sl.system(states="a b va vb")
    def pair(t, a, b, va, vb, *, gap=0.5):
        return va, vb, -a, -4 * b - sl.max(b - gap, 0)

    run = sl.simulate(
        pair, {"a": [1.0, 2.0], "b": 1.0, "va": 0.0, "vb": 0.0}, t_end=5.0, progress=False
    )
    ax = phase(run, 0)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("a", "va")
    ax = phase(run, states=("a", "b"))
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("a", "b")
    ax.figure.canvas.draw()
    (name,) = ax.texts
    assert not name.get_window_extent().overlaps(ax.get_legend().get_window_extent())


def test_numbers_under_a_narrow_picture_do_not_touch():
    @sl.system(states="a w", units={"a": "rad", "w": "rad/s"})
    def shaft(t, a, w, *, stiffness="100 1/s^2"):
        return w, -stiffness * a

    ax = phase(sl.simulate(shaft, (7e-4, 0.0), t_end=5.0, progress=False))
    ax.figure.canvas.draw()
    boxes = [label.get_window_extent() for label in ax.get_xticklabels() if label.get_text()]
    assert all(a.x1 < b.x0 for a, b in pairwise(boxes))
