"""Pictures of steady responses: every response in its place and colour, whatever part of a Dataset
is drawn.
"""

import io

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import same_color, to_rgb

import saltus as sl
from saltus.errors import ParameterError
from saltus.plot import (
    bifurcation_diagram,
    frequency_response,
    motion_colors,
    palette,
    response_points,
    type_map,
)
from saltus.results import Guards, ResultFileError

from .responses_data import cascade, kinds_map, resonance, responses


def texts(ax):
    return [one.get_text() for one in ax.get_legend().get_texts()]


def layer(ax, gid):
    """x and y of what is drawn under a name."""
    (line,) = [one for one in ax.lines if one.get_gid() == gid]
    return np.asarray(line.get_xdata(), dtype=float), np.asarray(line.get_ydata(), dtype=float)


def all_points(ax, start="kind"):
    lines = [one for one in ax.lines if str(one.get_gid()).startswith(start)]
    return np.sort_complex(
        np.concatenate([one.get_xdata() + 1j * one.get_ydata() for one in lines])
    )


@pytest.fixture(scope="module")
def peak():
    return resonance()


@pytest.fixture(scope="module")
def diagram():
    return cascade(200, keep=40)


# -- kinds -----------------------------------------------------------------------------------------
def test_a_kind_has_one_colour_whatever_else_is_there():
    assert motion_colors.codes(
        ["periodic", "periodic", "chaotic", "quasi_periodic", "periodic"], [1, 3, 0, 0, 24]
    ).tolist() == [1, 3, motion_colors.CHAOTIC, motion_colors.QUASI_PERIODIC, motion_colors.LONG]
    a, b = frequency_response(resonance()), bifurcation_diagram(cascade(200, keep=40))
    for code in ("kind 1", "kind 3", f"kind {motion_colors.CHAOTIC}"):
        first, second = (
            next(one for one in ax.lines if one.get_gid() == code).get_markerfacecolor()
            for ax in (a, b)
        )
        assert same_color(first, second)


@pytest.mark.parametrize("dots", [True, False])
def test_kinds_are_far_apart(dots):
    lab = palette.oklab(
        np.array([motion_colors.color(code, dots) for code in range(1, motion_colors.CHAOTIC + 1)])
    )
    far = np.linalg.norm(lab[:, None] - lab[None], axis=-1)[~np.eye(len(lab), dtype=bool)]
    assert far.min() > 0.06  # one just noticeable difference is about 0.02


def test_long_periods_are_named():
    periods = np.array([1, 24, 36])
    assert motion_colors.label(motion_colors.LONG, periods) == "24T, 36T"
    assert (
        motion_colors.label(motion_colors.LONG, np.arange(40))
        == f"{motion_colors.OWN_HUES + 1}T to 39T"
    )
    assert [
        motion_colors.label(code, periods)
        for code in (1, 2, motion_colors.QUASI_PERIODIC, motion_colors.CHAOTIC)
    ] == [
        "T",
        "2T",
        "quasi-periodic",
        "chaotic",
    ]


# -- frequency response ----------------------------------------------------------------------------
def test_every_response_is_drawn_once(peak):
    ax = frequency_response(peak)
    expected = np.sort_complex(
        peak["response_frequency"].values + 1e3j * peak["response_rms"].values
    )
    assert np.allclose(all_points(ax), expected)
    assert texts(ax) == ["T", "3T", "24T", "chaotic", "fold", "period doubling", "graze"]
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("frequency [Hz]", "rms of x [mm]")
    assert ax.get_ylim()[0] == 0


def test_lines_join_neighbours_on_a_branch_only(peak):
    x, y = layer(frequency_response(peak), "branches 1")
    pieces = np.split(y, np.flatnonzero(np.isnan(x)))
    steps = [np.nanmax(np.abs(np.diff(piece)), initial=0) for piece in pieces]
    assert len(pieces) == 3  # below the chaotic band, above it, and the upper branch
    assert max(steps) < 0.3  # [mm]; the branches lie 0.4 mm apart


@pytest.mark.parametrize(("low", "high"), [(-180, 180), (-170, 5), (88, 93), (-62, -20)])
def test_phases_have_ticks_wherever_they_lie(peak, low, high):
    phases = np.deg2rad(np.linspace(low, high, peak.sizes["response"]))
    with_phase = peak.drop_dims("output", errors="ignore").assign_coords(output=["x"])
    with_phase = with_phase.assign(
        output_phase=(("response", "output"), phases[:, None]), output_units=("output", ["m"])
    )
    ax = frequency_response(with_phase, quantity="phase")
    seen = [tick for tick in ax.get_yticks() if ax.get_ylim()[0] <= tick <= ax.get_ylim()[1]]
    assert len(seen) >= 3
    assert (low, high) != (-180, 180) or {-180, -90, 0, 90, 180} <= set(seen)


def test_narrow_phases_have_round_ticks(peak):
    phases = np.deg2rad(np.linspace(-178, -174, peak.sizes["response"]))
    with_phase = peak.drop_dims("output", errors="ignore").assign_coords(output=["x"])
    with_phase = with_phase.assign(
        output_phase=(("response", "output"), phases[:, None]), output_units=("output", ["m"])
    )
    ax = frequency_response(with_phase, quantity="phase")
    assert ax.get_ylabel() == "phase of x [deg]"
    assert np.allclose(ax.get_yticks() % 0.5, 0)


def test_a_transmissibility_is_drawn_of_responses_on_branches():
    rig = sl.models.delangre("b", force="4 N", frequency="15 Hz")
    found = sl.frequency_response(rig, ("14 Hz", "15 Hz", 3), progress=False)
    assert "point_branch" in found
    ax = frequency_response(sl.transmissibility(found, "x", "v"), quantity="transmissibility")
    assert all_points(ax).size == found.sizes["response"]
    assert any(str(one.get_gid()).startswith("branches") for one in ax.lines)


def test_measured_phases_are_angles(peak):
    phases = np.zeros((peak.sizes["response"], 1))
    with_phase = peak.drop_dims("output", errors="ignore").assign_coords(output=["x"])
    with_phase = with_phase.assign(
        output_phase=(("response", "output"), phases), output_units=("output", ["m"])
    )
    measured = xr.Dataset(
        {"frequency": ("i", [16.0], {"units": "Hz"}), "amplitude": ("i", [30.0], {"units": "deg"})}
    )
    ax = frequency_response(with_phase, quantity="phase", measured=measured)
    assert layer(ax, "measured")[1] == pytest.approx(30.0)


def test_peaks_instead(peak):
    ax = frequency_response(peak, quantity="peak")
    assert np.allclose(all_points(ax).imag.max(), 1e3 * peak["response_peak"].values.max())
    assert ax.get_ylabel() == "peak |x| [mm]"


@pytest.mark.parametrize("part", [{"frequency": slice(14, 17)}, {"frequency": [16.0, 20.0]}])
def test_a_part_is_drawn_alone(peak, part):
    ax = frequency_response(peak.sel(part))
    left = peak.sel(part)["frequency"].values
    assert np.isin(all_points(ax).real, left).all()
    assert all_points(ax).size == np.isin(peak["response_frequency"].values, left).sum()


def test_one_start_is_drawn_alone(peak):
    ax = frequency_response(peak.isel(start=[0]))
    assert all_points(ax).size == (peak["response_of"].values[:, 0] >= 0).sum()


def test_a_response_that_no_start_leads_to_stays(peak):
    share = np.where(peak["response_period"].values == 24, 0.0, 0.5)
    ds = peak.assign(response_share=("response", share)).isel(start=[0])
    ds["response_of"] = ds["response_of"].where(
        ~np.isin(ds["response_of"], np.flatnonzero(share == 0)), -2
    )
    assert "24T" in texts(frequency_response(ds))


def test_several_are_drawn_over_each_other(peak):
    ax = frequency_response({"exact": peak, "ode45": resonance(shift=0.5)})
    assert texts(ax)[:2] == ["exact", "ode45"]
    assert layer(ax, "dataset exact")[0].size == peak.sizes["response"]
    first, second = (
        next(one for one in ax.lines if one.get_gid() == f"dataset {name}")
        for name in ("exact", "ode45")
    )
    assert first.get_marker() != second.get_marker()
    assert not same_color(first.get_markeredgecolor(), second.get_markeredgecolor())


def test_events_are_marked_on_the_axis(peak):
    ax = frequency_response(peak)
    assert layer(ax, "event fold")[0].tolist() == [15.0, 19.0]
    assert not [
        one
        for one in frequency_response(peak, events=False).lines
        if str(one.get_gid()).startswith("event")
    ]
    part = frequency_response(peak.sel(frequency=slice(14, 17)))
    assert layer(part, "event fold")[0].tolist() == [15.0]
    assert "graze" not in texts(part)


# -- measured points -------------------------------------------------------------------------------
def test_measured_points_from_a_file_are_converted(peak, tmp_path):
    file = tmp_path / "points.csv"
    file.write_text(
        "# from the shaker\namplitude [um], note, frequency [rad/s]\n1500,a,100\n2000,b,120\n\n",
        encoding="utf-8",
    )
    x, y = layer(frequency_response(peak, measured=file), "measured")
    assert np.allclose(x, np.array([100, 120]) / (2 * np.pi))
    assert np.allclose(y, [1.5, 2.0])


def test_measured_points_from_a_dataset(peak):
    points = xr.Dataset(
        {"frequency": ("i", [16.0], {"units": "Hz"}), "amplitude": ("i", [1.7], {"units": "mm"})}
    )
    ax = frequency_response(peak, measured=points)
    assert [float(one[0]) for one in layer(ax, "measured")] == pytest.approx([16.0, 1.7])
    assert "measured" in texts(ax)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty. Its first line names the columns: frequency"),
        (
            "frequency,amplitude [mm]\n1,2\n",
            r"'frequency' has no unit.*frequency \[Hz\], amplitude \[mm\]",
        ),
        (
            "freqency [Hz],amplitude [mm]\n1,2\n",
            r"no column 'frequency'\. The first line must be like frequency \[Hz\]",
        ),
        (
            "frequency [Hz],amplitude [mm]\n1,two\n",
            "line 2: what stands in the column 'amplitude' is no finite number",
        ),
        (
            "frequency [Hz],amplitude [mm]\n1\n",
            "line 2: what stands in the column 'amplitude' is no finite number",
        ),
        (
            "frequency [Hz],amplitude [kg]\n1,2\n",
            r"column 'amplitude' has the wrong unit in its header\. Write amplitude \[mm\]",
        ),
    ],
)
def test_measured_files_are_refused_with_a_reason(peak, tmp_path, text, message):
    (tmp_path / "points.csv").write_text(text, encoding="utf-8")
    with pytest.raises(ResultFileError, match=message):
        frequency_response(peak, measured=tmp_path / "points.csv")


def test_a_measured_file_that_is_not_there(peak, tmp_path):
    with pytest.raises(OSError, match=r"nowhere\.csv can't be read"):
        frequency_response(peak, measured=tmp_path / "nowhere.csv")


def test_measured_datasets_need_units(peak):
    points = xr.Dataset({"frequency": ("i", [16.0]), "amplitude": ("i", [1.7], {"units": "mm"})})
    with pytest.raises(ParameterError, match="frequency has no attribute units"):
        frequency_response(peak, measured=points)
    with pytest.raises(ParameterError, match="has no 'amplitude'"):
        frequency_response(peak, measured=points[["frequency"]])


# -- bifurcation diagram ---------------------------------------------------------------------------
def test_every_sample_is_drawn(diagram):
    ax = bifurcation_diagram(diagram)
    there = np.isfinite(diagram["sample_x"].values)
    x = np.broadcast_to(diagram["response_contact_stiffness"].values[:, None], there.shape)[there]
    assert np.allclose(
        all_points(ax), np.sort_complex(x + 1e3j * diagram["sample_x"].values[there])
    )
    assert (ax.get_xlabel(), ax.get_ylabel()) == (
        "contact stiffness [N/m]",
        "x at turning points [mm]",
    )


def test_the_axis_is_logarithmic_as_the_grid_is(diagram):
    assert bifurcation_diagram(diagram).get_xscale() == "log"
    assert bifurcation_diagram(resonance()).get_xscale() == "linear"


@pytest.mark.parametrize(
    ("values", "log"),
    [(np.geomspace(1, 1e6, 50), True), (np.geomspace(1, 2, 9), True),
        (np.linspace(1, 1e6, 50), False), (np.array([1.0, 10.0]), False),
     (np.linspace(-1, 1, 5), False), (np.linspace(1e6, 1e6 + 0.1, 5), False),
     (np.geomspace(1, 1e6, 50)[[0, 3, 4, 20]], False)],
)  # fmt: skip
def test_grids_even_in_their_logarithms(values, log):
    assert response_points.is_log(values) is log


def test_without_samples_whole_periods_are_drawn():
    ax = bifurcation_diagram(resonance())
    assert ax.get_ylabel() == "x at the Poincaré points [mm]"
    assert layer(ax, "kind 3")[0].size % 3 == 0


def test_gaps_are_dashed_and_named(diagram):
    ax = bifurcation_diagram(diagram)
    assert [one.get_text() for one in ax.texts] == [
        "lower gap\n\N{MINUS SIGN}0.2 mm",
        "upper gap\n0.4 mm",
    ]


def test_a_gap_that_the_parameter_moves_is_a_curve():
    values = np.linspace(1e-3, 2e-3, 5)
    rows = [(i, 0, "periodic", 1, 1e-3, [0.5e-3]) for i in range(5)]
    guards = Guards(("stop",), ("x",), values[None])
    ax = bifurcation_diagram(responses(values, rows, axis="gap", guards=guards))
    x, y = layer(ax, "gap")
    assert not ax.texts  # the gap is above the picture
    beside = bifurcation_diagram(
        responses(
            values, [(*row[:5], [4e-3 * row[0] / 4]) for row in rows], axis="gap", guards=guards
        )
    )
    assert [one.get_text() for one in beside.texts] == ["stop"]
    assert np.allclose(x, y)
    assert np.allclose(y, 1e3 * values)


def test_the_other_state(diagram):
    assert bifurcation_diagram(diagram, state="v").get_ylabel() == "v at turning points [m/s]"
    with pytest.raises(ParameterError, match="no state 'vv'"):
        bifurcation_diagram(diagram, state="vv")


@pytest.mark.slow
def test_thousands_of_responses_are_few_marks_and_small_in_vector_files():
    ax = bifurcation_diagram(cascade(3000, keep=100))
    assert len(ax.get_children()) < 2 * len(bifurcation_diagram(cascade(30)).get_children())
    file = io.BytesIO()
    ax.figure.savefig(file, format="pdf")
    assert file.tell() < 2e6


# -- map -------------------------------------------------------------------------------------------
@pytest.mark.parametrize("log", [True, False])
def test_every_cell_has_the_colour_of_its_kind(log):
    ds = kinds_map(log=log)
    ax = type_map(ds)
    image = (ax.collections[0] if log else ax.images[0]).get_array()
    cells = np.asarray(image).reshape(30, 40, -1)[..., :3].swapaxes(0, 1) / 255
    for i, j in ((20, 10), (35, 25), (10, 3)):
        code = int(
            motion_colors.codes([ds["type"].values[i, j, 0]], [ds["period"].values[i, j, 0]])[0]
        )
        assert np.allclose(cells[i, j], motion_colors.color(code, dots=False), atol=1 / 255)
    assert np.allclose(cells[0, 0], to_rgb("white"))
    assert ax.get_yscale() == ("log" if log else "linear")
    assert ax.get_title(loc="left") == "x = 0.32 mm, v = 0 m/s"
    assert (ax.get_xlabel(), ax.get_ylabel()) == (
        "frequency [Hz]",
        "contact stiffness [N/m]" if log else "contact stiffness [MN/m]",
    )


def test_shares_add_up():
    shares = [float(text.split(", ")[-1].strip("<> %")) for text in texts(type_map(kinds_map()))]
    assert sum(shares) == pytest.approx(100, abs=1)
    assert "escaped, 0.8 %" in texts(type_map(kinds_map()))


# -- what is refused -------------------------------------------------------------------------------
@pytest.mark.parametrize("draw", [frequency_response, bifurcation_diagram])
def test_two_parameters_want_a_choice(draw):
    with pytest.raises(
        ParameterError,
        match=r"frequency and contact_stiffness: choose one value, such as "
        r"ds.isel\(contact_stiffness=0\)",
    ):
        draw(kinds_map())
    ax = draw(kinds_map().isel(contact_stiffness=12))
    assert all_points(ax).size == 40


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: type_map(resonance()), "two parameters, this Dataset has frequency"),
        (lambda: type_map(kinds_map(), start=3), "no start 3"),
        (lambda: frequency_response({}), "nothing to draw"),
        (
            lambda: frequency_response({str(i): resonance(5) for i in range(9)}),
            "8 Datasets apart, not 9",
        ),
        (
            lambda: frequency_response({"a": resonance(5), "b": cascade(5, keep=5)}),
            "over contact_stiffness, frequency",
        ),
        (lambda: frequency_response(resonance(5), quantity="size"), "Known: rms, peak"),
        (lambda: frequency_response(resonance(5).drop_vars("response_rms")), "no output 'x'"),
        (lambda: frequency_response(xr.Dataset()), "saltus_result"),
        (lambda: bifurcation_diagram(3), "not an int"),
    ],
)
def test_what_does_not_fit_is_refused(call, message):
    with pytest.raises(ParameterError, match=message):
        call()


def test_nothing_found_is_an_empty_picture():
    ax = frequency_response(responses(np.array([1.0, 2.0, 3.0]), []))
    assert not all_points_or_none(ax)
    bifurcation_diagram(responses(np.array([1.0, 2.0, 3.0]), []))


def all_points_or_none(ax):
    return [one for one in ax.lines if str(one.get_gid()).startswith("kind")]


def test_axes_of_the_caller_are_used(peak):
    _, ax = plt.subplots()
    assert frequency_response(peak, ax=ax) is ax


def test_a_title_stands_above_the_marks_of_events_and_every_mark_is_its_own():
    for axes in (frequency_response(resonance()), bifurcation_diagram(cascade())):
        marks = [line for line in axes.lines if str(line.get_gid()).startswith("event ")]
        assert marks
        axes.set_title("a title", loc="left")
        axes.figure.canvas.draw()
        title = axes._left_title.get_window_extent()
        assert all(line.get_window_extent().y1 < title.y0 for line in marks)
    looks = [marker for _, marker in response_points.MARKS.values()]
    assert len(set(looks)) == len(looks)
    assert not set(looks) & set(response_points.MARKERS[:1])  # the first of several Datasets


def test_unstable_branches_are_drawn_with_the_responses():
    rig = sl.models.delangre("b", force="4 N")
    start = {"x": ["0 mm", "5 mm"], "v": 0}
    for found, draw in (
        (
            sl.frequency_response(rig, ["12.5 Hz", "13 Hz"], start, unstable=True, progress=False),
            sl.plot.frequency_response,
        ),
        (
            sl.bifurcation_diagram(
                rig, {"frequency": [12.5, 13.0]}, start, unstable=True, progress=False
            ),
            sl.plot.bifurcation_diagram,
        ),
        (
            sl.branches(rig, {"frequency": (12.0, 14.0)}, start, at=1, progress=False),
            sl.plot.branches,
        ),
    ):
        ax = draw(found)
        assert any((line.get_gid() or "").startswith("stable") for line in ax.lines)


def test_lines_of_stable_orbits_end_where_stability_does():
    """At the bifurcation, not at the next orbit that happens to have been computed."""
    rig = sl.models.delangre("c", force="4 N", frequency="17 Hz")
    found = sl.branches(rig, {"contact_stiffness": (7.5e3, 9e3)}, at=1, switch=(), progress=False)
    (doubled,) = found.event_contact_stiffness.values[found.event_kind.values == "period_doubling"]
    lines = {line.get_gid(): line for line in sl.plot.branches(found).lines}
    solid = next(line for gid, line in lines.items() if (gid or "").startswith("stable"))
    dashed = next(line for gid, line in lines.items() if (gid or "").startswith("unstable"))
    assert np.nanmax(solid.get_xdata()) == pytest.approx(doubled / 1e3)
    assert np.nanmin(dashed.get_xdata()) == pytest.approx(doubled / 1e3)
    axes = sl.plot.branches(found, quantity="frequency")
    assert axes.get_ylabel() == "frequency [Hz]"
    heights = np.concatenate([line.get_ydata() for line in axes.lines if line.get_gid()])
    assert heights[np.isfinite(heights)] == pytest.approx(17.0)


@pytest.mark.slow
def test_a_branch_without_bound_does_not_flatten_the_picture():
    """The cycles of the wing grow to thousands of radians towards 13.5002 m/s."""
    wing = sl.models.aeroelastic()
    start = {"plunge": 0, "pitch": "2 deg", "plunge_rate": 0, "pitch_rate": 0}
    found = sl.bifurcation_diagram(wing, {"airspeed": ("9 m/s", "14 m/s", 3)}, start)
    assert "points" in found.branch_end.values
    assert found.point_output_peak.sel(output="pitch").max() > 100
    largest = found.output_peak.sel(output="pitch").values.max()
    for axes in (
        frequency_response(found, quantity="maximum", output="pitch"),
        bifurcation_diagram(found, state="pitch"),
    ):
        assert largest < axes.get_ylim()[1] < 2 * largest
    assert "1 end of branches that go on, after 1000 points" in sl.describe(found)


def test_an_empty_picture_says_why():
    @sl.system(states="x v", forced_at="f", units={"f": "Hz"})
    def away(t, x, v, *, f=1.0, k=3.0):
        stop = sl.piecewise((0.1 * (x - 1), x > 1), otherwise=0)
        return v, k * x + sl.cos(2 * sl.pi * f * t) - stop

    said = "no response at any of 3 values:\n3 escaped"
    found = sl.bifurcation_diagram(away, {"k": (2.0, 4.0, 3)})
    assert said in [text.get_text() for text in bifurcation_diagram(found).texts]
    found = sl.frequency_response(away, (0.5, 2.0, 3))
    assert said in [text.get_text() for text in frequency_response(found).texts]


def test_marks_of_events_that_lie_close_stand_above_each_other(peak):
    """Three folds within a hair: three rows, no mark on another."""
    close = peak.assign(event_frequency=("event", np.array([15.0, 15.01, 15.02, 19.0])))
    axes = frequency_response(close)
    axes.figure.canvas.draw()
    marks = np.concatenate(
        [
            line.get_transform().transform(line.get_xydata())
            for line in axes.lines
            if str(line.get_gid()).startswith("event ")
        ]
    )
    apart = np.linalg.norm(marks[:, None] - marks, axis=2)[np.triu_indices(len(marks), 1)]
    assert len(marks) == peak.sizes["event"] > 1
    assert (apart >= 4.5 * axes.figure.dpi / 72).all()


def test_small_responses_are_read_on_a_logarithmic_axis(peak):
    axes = frequency_response(peak, log=True)
    assert axes.get_yscale() == "log"
    assert frequency_response(peak).get_yscale() == "linear"
    with pytest.raises(ParameterError, match="log=True with quantity='mean', which has a sign"):
        frequency_response(peak, log=True, quantity="mean")


def test_ends_beyond_which_no_orbit_was_found_are_marked():
    rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    ds = sl.frequency_response(rig, ["17 Hz", "17.2 Hz"], progress=False)
    assert not [one for one in sl.plot.frequency_response(ds).lines if one.get_gid() == "lost ends"]
    ds["branch_end"][0] = "lost"
    ax = sl.plot.frequency_response(ds, quantity="peak")
    (mark,) = [one for one in ax.lines if one.get_gid() == "lost ends"]
    last = np.flatnonzero(ds.point_branch.values == 0)[-1]
    np.testing.assert_allclose(mark.get_xdata(), ds.point_frequency.values[[last]])
    assert "no orbit found beyond" in [one.get_text() for one in ax.get_legend().get_texts()]
