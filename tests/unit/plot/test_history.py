"""A time history shows every contact of its window, changes colour exactly there, and names its
units.
"""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.colors import to_hex

import saltus as sl
from saltus.errors import ParameterError
from saltus.plot import OKABE_ITO, history, phase, regions, style

from .conftest import GAPS, PERIOD, rig_run

COLORS = {"upper contact": "vermillion", "free": "green", "lower contact": "blue"}


def line(ax, label):
    return next(one for one in ax.lines if one.get_label() == label)


def contacts(run, begin, end):
    t = run["contact_time"].values / PERIOD
    return run.isel(contact=np.flatnonzero((t >= begin) & (t <= end)))


def ends(ax, label):
    """Both ends of every piece of one colour, shape (end, 2)."""
    xy = np.array(line(ax, label).get_data()).T
    gaps = np.flatnonzero(np.isnan(xy[:, 0]))
    first, last = np.concatenate([[0], gaps + 1]), np.concatenate([gaps - 1, [len(xy) - 1]])
    return np.concatenate([xy[first], xy[last]])


@pytest.mark.parametrize(
    ("periods", "begin", "end"),
    [(None, 0, 40), (5, 35, 40), (2.5, 37.5, 40), ((10, 12.25), 10, 12.25)],
)
def test_every_contact_of_the_window_is_marked(run, periods, begin, end):
    ax = history(run, periods=periods)
    inside = contacts(run, begin, end)
    t, x = line(ax, "contact").get_data()
    assert inside.sizes["contact"] >= 5
    assert np.array_equal(t, inside["contact_time"].values)
    assert np.array_equal(x, inside["contact_x"].values * 1e3)
    assert np.allclose(ax.get_xlim(), np.array([begin, end]) * PERIOD, rtol=1e-12)


def test_colours_change_exactly_at_the_boundaries(run):
    ax = history(run, periods=5)
    for label, allowed in {
        "upper contact": [0.4],
        "free": [0.0, 0.4],
        "lower contact": [0.0],
    }.items():
        inner = [x for t, x in ends(ax, label) if ax.get_xlim()[0] < t < ax.get_xlim()[1]]
        assert len(inner) > 4
        assert set(inner) <= set(allowed), label
    assert np.nanmin(line(ax, "upper contact").get_ydata()) == 0.4
    assert np.nanmax(line(ax, "lower contact").get_ydata()) == 0.0
    assert (np.nanmin(line(ax, "free").get_ydata()), np.nanmax(line(ax, "free").get_ydata())) == (
        0.0,
        0.4,
    )


def test_pieces_join_without_a_hole(run):
    """Each contact in the window is the end of one piece and the beginning of the next."""
    ax = history(run, periods=5)
    times = np.sort(np.concatenate([ends(ax, label)[:, 0] for label in COLORS]))[1:-1]
    assert np.array_equal(times, np.repeat(contacts(run, 35, 40)["contact_time"].values, 2))


def test_no_sample_is_lost(run):
    ax = history(run, periods=5)
    drawn = np.unique(np.concatenate([line(ax, label).get_ydata() for label in COLORS]))
    assert np.isin(run["x"].values[3500:] * 1e3, drawn).all()


def test_colours_are_those_of_the_palette(run):
    ax = history(run)
    assert {label: to_hex(line(ax, label).get_color()) for label in COLORS} == {
        k: OKABE_ITO[v].lower() for k, v in COLORS.items()
    }


def test_a_run_that_stopped_early_ends_there():
    stopped = rig_run(periods=10, status="sliding")
    late = stopped["time"].values > 2.5 * stopped["time"].values[-1] / 10
    stopped = stopped.assign({name: stopped[name].where(~late) for name in ("x", "v")}).assign(
        end_time=0.2
    )
    last = stopped["time"].values[~late][-1]
    assert history(stopped).get_xlim()[1] == pytest.approx(last)
    assert phase(stopped).texts[-1].get_text() == "status: sliding, stopped at 0.2 s"
    assert history(stopped, periods=1).get_xlim() == pytest.approx((last - PERIOD, last))
    at_once = stopped.assign(
        {name: stopped[name].where(stopped["time"] == 0) for name in ("x", "v")}
    )
    for ax in (history(at_once), history(at_once, periods=5), phase(at_once)):
        assert ax.texts[0].get_text() == "It stopped where it began: there is no motion to draw."


def test_axes_have_units_and_gap_lines(run):
    ax = history(run, periods=3)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("time [s]", "x [mm]")
    dashed = [
        one.get_ydata()[0] for one in ax.lines if one.get_linestyle() == "--" or one.is_dashed()
    ]
    assert dashed == [gap * 1e3 for gap in GAPS]
    assert [text.get_text() for text in ax.texts] == ["lower gap\n0 mm", "upper gap\n0.4 mm"]


def test_periods_stand_at_the_top(run):
    ax = history(run, periods=4)
    ax.figure.canvas.draw()
    (top,) = ax.child_axes
    assert np.allclose(top.get_xlim(), (36, 40))
    assert [label.get_text() for label in top.get_xticklabels()] == [
        "36 T",
        "37 T",
        "38 T",
        "39 T",
        "40 T",
    ]
    assert not history(run, time="s").child_axes


def test_time_in_periods(run):
    ax = history(run, periods=4, time="T")
    assert ax.get_xlabel() == "time [T]"
    assert np.allclose(ax.get_xlim(), (36, 40))
    assert np.allclose(
        line(ax, "contact").get_xdata(), contacts(run, 36, 40)["contact_time"].values / PERIOD
    )


def test_another_state_keeps_the_colours_of_the_guarded_one(run):
    ax = history(run, state="v", periods=5)
    assert ax.get_ylabel() == "v [mm/s]"
    inside = contacts(run, 35, 40)
    assert np.array_equal(line(ax, "contact").get_ydata(), inside["contact_v"].values * 1e3)
    inner = {round(v, 9) for t, v in ends(ax, "free") if ax.get_xlim()[0] < t < ax.get_xlim()[1]}
    assert inner <= {round(v, 9) for v in inside["contact_v"].values * 1e3}
    assert not ax.texts


def test_units_can_be_chosen(run):
    ax = history(run, units={"x": "µm"})
    assert ax.get_ylabel() == "x [µm]"
    assert np.nanmin(line(ax, "upper contact").get_ydata()) == pytest.approx(400)
    with pytest.raises(ParameterError, match=r"can't be shown in 'inch'.*mm"):
        history(run, units={"x": "inch"})


def test_grazes_have_markers_of_their_own():
    run = rig_run(
        periods=3, kinds=["graze", "graze_unresolved", "graze"], status="graze_unresolved"
    )
    ax = history(run)
    graze, open_ = line(ax, "graze"), line(ax, "unresolved graze")
    assert (len(graze.get_xdata()), len(open_.get_xdata())) == (2, 1)
    assert len(line(ax, "contact").get_xdata()) == run.sizes["contact"] - 3
    assert graze.get_marker() != line(ax, "contact").get_marker()
    assert open_.get_markerfacecolor() == "white"
    assert any("graze_unresolved" in text.get_text() for text in ax.texts)


def test_an_early_stop_is_told():
    ax = history(rig_run(periods=2, status="budget_events"))
    assert any("budget_events, stopped at 0.133333 s" in text.get_text() for text in ax.texts)


def test_a_batch_becomes_a_stack_of_panels(batch):
    axes = history(batch, periods=3)
    assert axes.shape == (4,)
    for k, ax in enumerate(axes):
        one = batch.isel(contact=np.flatnonzero(batch["contact_trajectory"].values == k))
        assert len(line(ax, "contact").get_xdata()) == contacts(one, 17, 20).sizes["contact"]
    assert sum(ax.get_legend() is not None for ax in axes) == 1


def test_one_of_a_batch_into_given_axes(batch):
    _, grid = plt.subplots(2, 2)
    assert history(batch, 2, ax=grid[0, 0]) is grid[0, 0]
    alone = rig_run((0.4e-3,), periods=20)
    assert np.array_equal(line(grid[0, 0], "contact").get_xdata(), alone["contact_time"].values)
    assert len(history(batch, [0, 3], ax=grid[1])) == 2
    selected = batch.sel(trajectory=2)
    assert np.array_equal(
        line(history(selected), "contact").get_xdata(), alone["contact_time"].values
    )


def test_a_run_without_forcing(run):
    free = run.drop_vars("period").sel(time=slice(0.5, 0.54))
    ax = history(free)
    assert not ax.child_axes
    t = run["contact_time"].values
    inside = (t >= free["time"].values[0]) & (t <= free["time"].values[-1])
    assert len(line(ax, "contact").get_xdata()) == inside.sum() > 0
    with pytest.raises(ParameterError, match=r"isn't forced.*sel\(time="):
        history(free, periods=3)


def test_missing_samples_leave_a_hole(run):
    broken = run.copy(deep=True)
    broken["x"][{"time": slice(3600, None)}] = np.nan
    ax = history(broken, periods=5)
    assert np.isfinite(ax.get_ylim()).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"trajectory": 7}, "there is no trajectory 7; this run has 0 to 3"),
        ({"state": "z"}, "no state 'z'"),
        ({"periods": 0}, "number of last periods"),
        ({"periods": (5, 3)}, "begin and end"),
        ({"periods": (30, 40)}, "outside this run, which holds periods 0 to 20"),
        ({"periods": "all"}, "number of last periods"),
        ({"units": {"X": "mm"}}, "no state 'X'. Known: x, v"),
        ({"time": "ms"}, "Known: 'both', 's', 'T'"),
        ({"ax": "here"}, "Give matplotlib Axes"),
        ({"trajectory": []}, "1 to 8 trajectories"),
    ],
)
def test_errors_teach(batch, arguments, message):
    with pytest.raises(ParameterError, match=message):
        history(batch, **arguments)


def test_axes_must_fit_the_trajectories(batch):
    _, ax = plt.subplots()
    with pytest.raises(ParameterError, match="4 trajectories need 4 Axes, not 1"):
        history(batch, ax=ax)


@pytest.mark.parametrize("thing", [None, {"x": [1.0]}, np.zeros(3)])
def test_only_runs_are_drawn(thing):
    with pytest.raises(ParameterError, match=r"takes the Dataset that sl\.simulate returns"):
        history(thing)


def test_stroboscopic_points_have_no_history(points):
    with pytest.raises(ParameterError, match=r"from sl\.stroboscope"):
        history(points)


def test_figures_of_its_own_have_the_style_and_leave_no_trace(run):
    before = plt.rcParams.copy()
    ax = history(run, periods=2)
    assert not ax.spines["right"].get_visible()
    assert not ax.get_legend().get_frame_on()
    assert plt.rcParams == before
    with style():
        assert plt.rcParams["axes.spines.right"] is False


def test_where_a_contact_is_held_the_line_says_so():
    """At rest on a stop, and stuck: a colour of their own, a marker for each impact."""

    @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
    def stop(t, x, v, *, gap=0.2, w=0.3):
        push = sl.cos(w * t) - 0.1 * v - x
        return v, push, sl.impact(x < gap, v, restitution=0.6)

    @sl.system(states="x v")
    def belt(t, x, v, *, speed=0.2):
        return v, -x - sl.friction(v - speed, slip=0.5, stick=1.0)

    for run, words in (
        (sl.simulate(stop, (0.2, 0.0), periods=1, samples=50), {"gap at rest", "free", "impact"}),
        (sl.simulate(belt, (0.0, 0.0), t_end=10.0, samples=50), {"speed held", "free"}),
    ):
        axes = sl.plot.history(run)
        axes = np.ravel(axes)[0]
        legend = axes.get_legend() or axes.figure.legends[0]
        assert words <= {text.get_text() for text in legend.get_texts()}


def test_a_state_that_jumps_does_so_upright():
    """Both sides of every impact lie one above the other, in a history and in a phase portrait,
    also of a run that starts anywhere in the period.
    """
    chatter = sl.models.impact_oscillator("chatter")
    run = sl.simulate(chatter, (0.2, 0.0), t_start=4.0, t_end=40.0, time_errors="local")
    struck = run["contact_kind"].values == "impact"
    t, v = run["contact_time"].values[struck], run["contact_v"].values[struck]
    assert t[-1] > 39.0
    late, of_speed = history(run, state="v"), phase(run)
    for ax, place in ((late, t), (of_speed, np.full(t.size, 0.2))):
        (free,) = (one.get_xydata() for one in ax.lines if one.get_label() == "free")
        at = np.flatnonzero(np.isin(free[:, 1], v) & (np.abs(free[:, 1]) > 1e-3))
        assert len(at) > 10
        assert free[at, 0].tolist() == free[at - 1, 0].tolist()
        assert set(free[at, 0]) <= set(place)
        assert free[at, 1].tolist() == (-0.6 * free[at - 1, 1]).tolist()


def chain_with_stops(**contacts):
    """Eight masses by five modes, a stop on both sides of the last and one above the fourth."""
    stiffness = 4e4 * np.eye(8) - 2e4 * (np.eye(8, k=1) + np.eye(8, k=-1))
    return sl.structure(
        0.1 * np.eye(8), stiffness, damping_ratio=0.02, modes=5, frequency="24 Hz",
        contacts=[
            sl.Contact("x8", stiffness="200 kN/m", gap="0.4 mm", side="both", name="left"),
            sl.Contact("x4", stiffness="100 kN/m", gap="0.4 mm", name="right", **contacts),
        ],
        forces=[sl.Force("x2", "20 N")],
    )  # fmt: skip


@pytest.mark.parametrize("side", ["upper", "lower"])
def test_contacts_of_a_structure_touch_in_the_words_of_its_user(side):
    """The legend says what touches, on whichever side, and stays within the figure."""
    run = sl.simulate(chain_with_stops(side=side), periods=4)
    for picture in (history, phase):
        axes = picture(run)
        axes.figure.canvas.draw()
        shown = axes.get_legend()
        words = [text.get_text() for text in shown.get_texts()]
        assert words[:3] == ["free", "1 contact", "2 contacts"]
        assert len(words) == len(set(words))
        assert shown.get_window_extent().width <= axes.figure.bbox.width
    until = run["time"].values[np.flatnonzero(np.diff(run["mode"].values))[1]]
    few = run.isel(time=run["time"].values <= until, contact=run["contact_time"].values <= until)
    words = {region.label for region in regions.find(few, ["q1"]).regions}
    touched = {f"{guard} touches" for guard in few["contact_guard"].values.astype(str)}
    assert "free" in words
    assert words & touched
    assert all("above" not in word and "below" not in word for word in words)


def test_more_contacts_than_can_be_told_apart_are_counted(run):
    """A legend of one line says how many; grazes keep their marks."""
    many = sl.simulate(
        sl.models.delangre("b", force="4 N", frequency="15 Hz"), (1e-3, 0), periods=60
    )
    count = many.sizes["contact"]
    assert count > 120
    words = [text.get_text() for text in history(many).get_legend().get_texts()]
    assert f"{count} contacts, too many to mark" in words
    assert "contact" in [text.get_text() for text in history(run).get_legend().get_texts()]


def test_a_quantity_given_as_trajectory_is_named():
    run = sl.simulate(sl.models.delangre("b"), (0.0, 0.0), periods=1, progress=False)
    with pytest.raises(ParameterError, match="Write state='x' in a history"):
        history(run, "x")
