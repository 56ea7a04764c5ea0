"""Pictures of sections, spectra, impacts and energies: what is drawn where, and what is refused."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import motions_data as data
import saltus as sl
from saltus.cli.draw import draw
from saltus.errors import ParameterError


@pytest.fixture(autouse=True)
def _closed():
    yield
    plt.close("all")


def points(axes):
    """Points of every marker layer, by label."""
    return {
        line.get_label(): np.stack(line.get_data(), axis=1)
        for line in axes.lines
        if line.get_marker() == "o"
    }


def test_a_section_shows_what_moves():
    axes = sl.plot.section(data.section())
    assert axes.get_xlabel() == "v [m/s]"
    assert axes.get_ylabel() == "phase of the forcing, t/T mod 1"  # x is the same at every crossing
    drawn = points(axes)
    assert set(drawn) == {"upwards", "downwards", "downwards, unresolved"}
    assert drawn["upwards"] == pytest.approx(np.array([[0.1, 0.0], [0.1 * np.cos(2), 0.2]]))
    assert "x = 0.3 mm" in axes.get_title(loc="left")


def test_a_section_of_what_one_wants():
    axes = sl.plot.section(data.section(2), x="time", y="x", units={"x": "mm"}, trajectory=[0, 1])
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time [s]", "x [mm]")
    assert {"trajectory 0", "trajectory 1"} <= set(points(axes))
    with pytest.raises(ParameterError, match="no 'y' to draw"):
        sl.plot.section(data.section(), x="y")


def test_lines_of_a_periodic_response_and_the_curve_of_another():
    axes = sl.plot.spectrum(data.spectrum())
    assert axes.get_yscale() == "log"
    assert axes.get_ylabel() == "amplitude of x [m]"
    assert len(axes.collections) == 1  # the stems
    # what lies below 1e-5 of the largest isn't shown
    assert points(axes)["_child1"][:, 0] == pytest.approx(np.arange(6.0))
    curve = sl.plot.spectrum(data.spectrum(window="hann"), state="v")
    assert not curve.collections
    with pytest.raises(ParameterError, match="no state 'y'"):
        sl.plot.spectrum(data.spectrum(), state="y")


def test_spectra_of_several_trajectories():
    axes = sl.plot.spectrum(data.spectrum(2, own=True), highest=3.0)
    assert axes.get_xlim()[1] == 3.0
    assert [text.get_text() for text in axes.get_legend().get_texts()] == [
        "trajectory 0",
        "trajectory 1",
    ]


def test_impacts_are_counted_by_guard():
    axes = sl.plot.impacts(data.impacts(2))
    assert {container.get_label() for container in axes.containers} == {"lower gap", "upper gap"}
    assert sum(bar.get_height() for bar in axes.patches) == 12
    assert axes.get_xlabel() == "speed at contact [m/s]"


def many_stops(count):
    """Impacts at so many stops with two sides each, one contact at each side."""
    ds = data.impacts()
    names = [f"stop_{i} {side}" for i in range(count) for side in ("upper", "lower")]
    places = np.arange(2 * count) % 2
    rows = ds.isel(guard=places, contact=np.zeros(2 * count, dtype=int))
    return rows.assign_coords(guard=names).assign(
        contact_guard=("contact", names),
        contact_speed=("contact", np.linspace(0.01, 0.29, 2 * count)),
        contact_peak_force=("contact", np.linspace(1.0, 2.0, 2 * count), {"units": "N"}),
    )


@pytest.mark.parametrize("count", [8, 20])
@pytest.mark.parametrize("picture", [sl.plot.impacts, sl.plot.contact_forces])
def test_of_many_stops_both_sides_have_one_name_and_the_legend_fits(picture, count):
    axes = picture(many_stops(count))
    named = axes.get_legend()
    assert [text.get_text() for text in named.get_texts()] == [f"stop {i}" for i in range(count)]
    colours = {tuple(np.ravel(one.get_facecolor())) for one in axes.patches}
    assert len(colours) in (0, count)
    figure = axes.get_figure()
    figure.canvas.draw()
    assert named.get_window_extent().height <= figure.bbox.height


def test_bars_of_many_stops_stand_on_each_other():
    ds = many_stops(8)
    axes = sl.plot.impacts(ds)
    tops = {}
    for bar in axes.patches:
        begin = round(bar.get_x(), 9)
        tops[begin] = max(tops.get(begin, 0.0), bar.get_y() + bar.get_height())
    assert list(tops.values()) == ds.speed_histogram.sum("guard").values.tolist()


def with_speeds(speeds):
    """Impacts at the lower gap with these speeds."""
    ds = data.impacts()
    rows = ds.isel(contact=np.zeros(len(speeds), dtype=int)).assign(
        contact_speed=("contact", np.asarray(speeds, dtype=float))
    )
    return rows.assign(speed_histogram=rows["speed_histogram"] * (len(speeds) > 0))


@pytest.mark.parametrize(
    ("speeds", "says"),
    [
        ([], "No contact in the observed time."),
        (
            [0.2, 0.1 * (1 + 1e-12), 0.1] * 4,
            "The speeds at contact repeat.\nlower gap: 12 contacts, at 0.1 m/s, 0.2 m/s",
        ),
        (np.linspace(0.1, 0.2, 12), None),
        ([0.1, 0.2], None),  # seen once each: nothing repeats
    ],
)
def test_contacts_that_make_no_histogram_are_told_in_words(speeds, says):
    axes = sl.plot.impacts(with_speeds(speeds))
    assert [text.get_text() for text in axes.texts] == ([says] if says else [])
    assert bool(axes.patches) == (says is None)


def test_what_holds_nothing_says_so_in_place_of_an_empty_frame():
    stopped = data.energy()
    stopped = stopped.assign(residual=stopped["residual"] * np.nan, status="sliding", end_time=0.1)
    empty = data.spectrum()
    empty = empty.assign(x_amplitude=empty["x_amplitude"] * np.nan)
    for axes, says in (
        (
            sl.plot.energy(stopped),
            "There is no balance: the motion stopped before the first interval had passed.",
        ),
        (sl.plot.spectrum(empty), "There is no spectrum: the motion stopped before its end."),
        (
            sl.plot.section(data.section().isel(crossing=[])),
            "Section x = 0.3 mm: no crossing in the observed time.",
        ),
    ):
        assert axes.texts[0].get_text() == says
        assert not axes.axison
    assert sl.plot.energy(stopped).texts[1].get_text() == "status: sliding, stopped at 0.1 s"


def test_energies_by_period_or_by_time():
    assert sl.plot.energy(data.energy()).get_xlabel() == "forcing periods"
    axes = sl.plot.energy(data.energy(2), trajectory=1)
    assert axes.get_ylabel() == "energy in an interval [mJ]"
    assert axes.lines[0].get_ydata() == pytest.approx(np.full(5, 3.0))
    assert sl.plot.energy(data.energy(along="time")).get_xlabel() == "time [s]"


@pytest.mark.parametrize("name", ["section", "spectrum", "impacts", "energy"])
def test_each_result_knows_its_picture(name, tmp_path):
    sl.save(getattr(data, name)(2), tmp_path / "result.nc")
    assert draw(tmp_path / "result.nc", None, 1, None).name == f"result-{name}.png"
    with pytest.raises(ParameterError, match="can't be drawn as history"):
        draw(tmp_path / "result.nc", "history", None, None)


def test_trajectories_are_named_by_what_varies():
    def varied(ds):
        return ds.assign_coords(gap=("trajectory", [1e-3, 2e-3], {"units": "m"})).assign_attrs(
            varied_parameters='["gap"]'
        )

    assert {"gap = 1 mm", "gap = 2 mm"} <= set(points(sl.plot.section(varied(data.section(2)))))
    legend = sl.plot.spectrum(varied(data.spectrum(2))).get_legend()
    assert [text.get_text() for text in legend.get_texts()] == ["gap = 1 mm", "gap = 2 mm"]


def test_words_stay_inside_their_picture():
    rig = sl.models.delangre("b", force="4 N", frequency="15 Hz")
    ds = sl.impact_statistics(
        rig, {"x": ["0.2 mm", "1 mm"], "v": 0.0}, periods=60, transient=300, progress=False
    )
    axes = sl.plot.impacts(ds)
    (words,) = axes.texts
    assert "The speeds at contact repeat." in words.get_text()
    axes.figure.canvas.draw()
    assert words.get_window_extent().x1 < axes.figure.bbox.x1
