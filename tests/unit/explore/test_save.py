"""Saving: what was seen is done again by a study, a script, a picture and data."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import saltus as sl
from saltus.analysis.basins import growing, pipeline
from saltus.explore.cells import unpacked_cells
from saltus.explore.desk import Desk
from saltus.explore.frames import packed, unpacked
from saltus.explore.opening import opening_of
from saltus.explore.questions import QuestionError, question_of
from saltus.explore.save import View, script_text, study_text
from saltus.explore.studies import _opening
from saltus.study.ask import NoInputs, ask
from saltus.study.read import parse
from saltus.study.setting.setting import setting_of

RIG = sl.models.delangre("b", force="4 N", frequency="15 Hz")
BOX = {"x": (-5e-3, 5e-3), "v": (-1.0, 1.0)}
VALUES = {"force": 3.7, "upper_gap": 3.25e-4}
MOTION = {"start": [1e-3, 0.0], "values": VALUES, "periods": 5}
MAP = {"axes": {name: list(ends) for name, ends in BOX.items()}, "size": [16, 17], "values": VALUES}


@pytest.fixture(scope="module")
def opening():
    return opening_of(RIG, None, axes=BOX)


@pytest.fixture(scope="module")
def desk(opening):
    one = Desk(opening, 2)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pipeline, "SCOUTS", 64)
        patch.setattr(growing, "FEW_SCOUTS", 16)
        patch.setattr(pipeline, "CHECKED", 16)
        labels = np.zeros((16, 17))

        def take(head, arrays):
            if head["kind"] == "map-piece":
                cells = unpacked_cells(arrays, labels.shape[1])
                labels.ravel()[cells["cell"]] = cells["label"]

        one.answer(question_of("map", {"id": 1, **MAP}), take)
        one.labels = labels
        yield one


def file_of(desk, what, format, view, **more):
    found = []
    fields = {"id": 1, "what": what, "format": format, "view": view, **more}
    desk.answer(question_of("save", fields), lambda *one: found.append(unpacked(packed(*one))))
    ((head, arrays),) = found
    return head, arrays["file"].tobytes()


# -- studies ---------------------------------------------------------------------------------------
NUMBERS = st.floats(-1e3, 1e3).map(lambda x: x + 0.0)
RANGES = st.tuples(NUMBERS, NUMBERS).filter(lambda pair: pair[0] != pair[1]).map(sorted)


@settings(max_examples=25, deadline=None)
@given(
    force=NUMBERS, gap=st.floats(1e-6, 1.0), x=NUMBERS, v=NUMBERS, over_x=RANGES, over_v=RANGES,
    sizes=st.tuples(st.integers(2, 4000), st.integers(2, 4000)), periods=st.integers(1, 10**5),
    over=st.tuples(st.floats(0.1, 10.0), st.floats(11.0, 99.0)),
)  # fmt: skip
def test_a_study_of_a_view_opens_as_that_view(
    opening, force, gap, x, v, over_x, over_v, sizes, periods, over
):
    view = View(
        opening, RIG.with_values(force=force, upper_gap=gap), sl.Taylor(), {"x": x, "v": v},
        {"periods": periods}, {"x": (*over_x, sizes[0]), "v": (*over_v, sizes[1])}, {}, periods,
        ("frequency", *over), {"x": [x, 0.0], "v": [v, 1.0]},
    )  # fmt: skip
    study = parse(study_text(view, "what I saw"))
    again = _opening(study, setting_of(study, None, NoInputs()))
    assert again.system.values == view.system.values
    assert again.start == view.start
    assert again.axes == {"x": tuple(over_x), "v": tuple(over_v)}
    assert again.size == sizes
    assert again.view == {"map": {"periods": periods}, "motion": {"periods": periods}}
    assert again.responses["range"] == list(over)


def test_the_study_of_the_screen_gives_its_labels_and_motion(desk):
    head, data = file_of(desk, "study", "toml", {"motion": MOTION, "map": MAP}, name="my view")
    assert head["name"] == "my-view.toml"
    run, map_ = (answer.dataset for answer in ask(data.decode()))
    expected = sl.simulate(RIG.with_values(**VALUES), (1e-3, 0), periods=5)
    np.testing.assert_array_equal(run["x"].values, expected["x"].values)
    np.testing.assert_array_equal(run["contact_time"].values, expected["contact_time"].values)
    _, screen = np.unique(desk.labels, return_inverse=True)
    _, again = np.unique(map_["basin"].values, return_inverse=True)
    pairs = set(zip(screen.ravel().tolist(), again.ravel().tolist(), strict=True))
    assert len(pairs) == len(np.unique(screen)) == len(np.unique(again))  # the same, renamed


def test_the_study_and_the_script_of_a_comparison_run_both_methods(tmp_path, monkeypatch):
    monkeypatch.setattr(pipeline, "SCOUTS", 16)
    monkeypatch.chdir(tmp_path)
    rig = sl.models.delangre("a", force="1.5 N", frequency="10 Hz")
    other = sl.ODE45(1e-4, 1e-7)
    view = View(
        opening_of(rig), rig, sl.Taylor(), axes={"x": (-5e-3, 5e-3, 6), "v": (-1.0, 1.0, 6)},
        at={}, against=other,
    )  # fmt: skip
    maps = [sl.basins(rig, x=(-5e-3, 5e-3, 6), v=(-1, 1, 6), method=m) for m in (None, other)]
    expected = sl.compare(*maps)["agreement"].values
    *_, agreement = [one.dataset for one in ask(study_text(view, "both"))]
    np.testing.assert_array_equal(agreement["agreement"].values, expected)
    exec(compile(script_text(view), "seen.py", "exec"), names := {})
    np.testing.assert_array_equal(names["both"]["agreement"].values, expected)


def test_a_system_of_ones_own_says_how_it_is_run():
    own = sl.system(states="x v")(lambda t, x, v, *, k=1.0, c=0.2: (v, -k * x - c * v))
    view = View(opening_of(own), own, sl.Taylor(), {"x": 0.5, "v": 0.0}, {"t_end": 2.0})
    text = study_text(view, "mine")
    assert text.startswith("# saltus run mine.toml --system FILE.py:")
    (answer,) = ask(text, own=own)
    assert answer.dataset["time"].values[-1] == 2.0


# -- scripts ---------------------------------------------------------------------------------------
@pytest.mark.parametrize("own", [False, True])
def test_the_script_runs_and_finds_the_same(opening, tmp_path, own, monkeypatch, capsys):
    system = RIG.with_values(force=3.7123456789)
    if own:
        system = replace(system, name="mine")
    view = View(
        opening, system, sl.Taylor(), {"x": 1e-3, "v": 0.0}, {"periods": 3},
        {"x": (-1e-3, 1e-3, 2), "v": (-0.1, 0.1, 2)}, {}, 400,
    )  # fmt: skip
    text = script_text(view)
    assert ("from_dict" in text) == own
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(pipeline, "SCOUTS", 16)
    names = {}
    exec(compile(text, "seen.py", "exec"), names)
    run = sl.simulate(system, (1e-3, 0.0), periods=3)
    found = sl.basins(system, x=(-1e-3, 1e-3, 2), v=(-0.1, 0.1, 2), periods=400)
    assert names["run"].attrs["result_hash"] == run.attrs["result_hash"]
    np.testing.assert_array_equal(names["found"]["basin"].values, found["basin"].values)
    assert {file.name for file in tmp_path.iterdir()} == {"motion.png", "map.png"}
    assert sl.describe(run) in capsys.readouterr().out


# -- pictures and data -----------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("part", "format", "begins"),
    [("motion", "svg", b"<?xml"), ("map", "png", b"\x89PNG"), ("map", "pdf", b"%PDF")],
)
def test_pictures_are_those_of_plot(desk, part, format, begins):
    view = {"motion": MOTION, "map": MAP}
    head, data = file_of(desk, "picture", format, view, parts=[part])
    assert data.startswith(begins)
    assert head["name"] == f"delangre.{format}"
    assert len(data) > 5000


def test_data_are_read_back(desk, tmp_path):
    head, data = file_of(desk, "data", "nc", {"motion": MOTION}, parts=["motion"])
    (tmp_path / head["name"]).write_bytes(data)
    expected = sl.simulate(RIG.with_values(**VALUES), (1e-3, 0), periods=5)
    assert sl.load(tmp_path / head["name"]).identical(expected)
    head, data = file_of(desk, "data", "mat", {"motion": MOTION, "map": MAP})
    assert head["name"].endswith(".zip")
    assert data.startswith(b"PK")


@pytest.mark.parametrize(
    ("fields", "field"),
    [
        ({"what": "study", "format": "nc", "view": {}}, "format"),
        ({"what": "data", "format": "nc", "view": {}}, "parts"),
        ({"what": "data", "format": "nc", "view": {"motion": 3}}, "view"),
        ({"what": "study", "format": "toml", "view": {"motion": {}}}, "start"),
        ({"what": "data", "format": "nc", "view": {"map": {**MAP, "size": [20, 20]}}}, "parts"),
    ],
)
def test_what_cannot_be_saved_is_said(desk, fields, field):
    with pytest.raises(QuestionError) as refused:
        file_of(desk, **fields)
    assert refused.value.field == field
