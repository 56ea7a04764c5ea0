"""The ways into the explorer: Python, the command line, studies and their results."""

import http.client
import importlib
import json
import sys

import numpy as np
import pytest
from typer.testing import CliRunner
from websockets.sync.client import connect

import saltus as sl
from saltus.analysis.basins import growing, pipeline
from saltus.cli.commands import app
from saltus.errors import ParameterError, SaltusError
from saltus.explore import studies
from saltus.explore.cells import unpacked_cells
from saltus.explore.frames import packed, unpacked
from saltus.explore.questions import question_of
from saltus.study.read import parse

RIG = sl.models.delangre("b", force="4 N", frequency="15 Hz")
STUDY = """
[study]
name = "Small"
[system]
model = "delangre"
case = "b"
force = "4 N"
frequency = "15 Hz"
[simulate]
start = { x = "1 mm", v = "0 m/s" }
periods = 7
[basins]
axes.x = { first = "-5 mm", last = "5 mm", count = 16 }
axes.v = { first = "-1 m/s", last = "1 m/s", count = 17 }
[branches]
vary.frequency = ["15 Hz", "15.02 Hz"]
start = { x = "1 mm", v = "0 m/s" }
at = 1
"""


def one(desk, ask, **fields):
    found = []
    question = question_of(ask, {"id": 1, **fields})
    desk.answer(question, lambda *answer: found.append(unpacked(packed(*answer))))
    return found


# -- Python ----------------------------------------------------------------------------------------
def test_explore_returns_at_once_with_a_page_that_answers():
    page = sl.explore(RIG, browser=False)
    port = int(page.url.split(":")[2].split("/")[0])
    line = http.client.HTTPConnection("127.0.0.1", port)
    line.request("GET", "/")
    headers = line.getresponse().headers
    assert (
        "frame-ancestors http://localhost:* http://127.0.0.1:*"
        in headers["content-security-policy"]
    )
    assert page.view == {}
    with connect(f"ws://127.0.0.1:{port}/socket") as socket:
        token = page.url.partition("token=")[2]
        socket.send(json.dumps({"ask": "hello", "id": 0, "token": token, "wire": 2}))
        socket.recv()
        with pytest.raises(ParameterError, match="no page shows anything yet"):
            page.study()
        view = {"motion": {"start": ["1 mm", 0], "values": {"force": "3 N"}, "periods": 9}}
        socket.send(json.dumps({"ask": "show", "id": 1, "view": view}))
        socket.send(json.dumps({"ask": "about", "id": 2}))
        head, _ = unpacked(socket.recv())
        assert head["system"]["name"] == "delangre"
        assert page.view == view
        study = parse(page.study())
        assert study.system.values["force"] == "3 N"
        assert (study.simulate.start["x"], study.simulate.periods) == ("1 mm", 9)
    html = page._repr_html_()
    assert f'src="{page.url}' in html
    assert page.url in repr(page)
    page.close()
    with pytest.raises(ConnectionRefusedError):
        http.client.HTTPConnection("127.0.0.1", port).request("GET", "/")


@pytest.mark.parametrize("package", ["uvicorn", "starlette"])
def test_without_the_extra_it_says_what_to_install(monkeypatch, package):
    for name in [name for name in sys.modules if name.startswith(("starlette", "uvicorn"))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.delitem(sys.modules, "saltus.explore.server", raising=False)
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ParameterError, match=r"pip install 'saltus\[explore\]'"):
        sl.explore(RIG, browser=False)


def test_explore_wants_a_system():
    with pytest.raises(ParameterError):
        sl.explore(sl.models.delangre, browser=False)


# -- the command line ------------------------------------------------------------------------------
@pytest.fixture
def opened(monkeypatch):
    """What the command would open, without a server."""
    seen = []

    class Opened:
        url = "http://127.0.0.1:1/#token=x"

        def wait(self, until_closed):
            seen.append(until_closed)

    def opens(desk, models=None, browser=False, framed_by=()):
        seen.extend([desk, models, browser, list(framed_by)])
        return Opened()

    monkeypatch.setattr(importlib.import_module("saltus.explore"), "opened", opens)
    return seen


def run(*arguments):
    return CliRunner().invoke(app, ["explore", *arguments])


def test_a_model_with_its_values_opens(opened):
    done = run("delangre", "case=a", "force=3 N", "frequency=17", "--until-closed")
    assert (done.exit_code, done.output.strip()) == (0, "http://127.0.0.1:1/#token=x")
    desk, models, browser, framed_by, until_closed = opened
    expected = sl.models.delangre("a", force="3 N", frequency=17.0)
    assert desk.opening.system.values == expected.values
    assert (models, browser, framed_by, until_closed) == (None, True, [], True)


def test_without_a_name_the_page_chooses_a_model(opened):
    assert run("--no-browser").exit_code == 0
    desk, models, browser, *_ = opened
    assert one(desk, "about")[0][0]["system"] is None
    assert not browser
    ((head, _),) = one(models("thermostat"), "about")
    assert head["system"]["name"] == "thermostat"
    assert models("thermostat") is models("thermostat")
    with pytest.raises(SaltusError, match="Did you mean"):
        models("thermostats")


def test_a_file_of_ones_own_opens(opened, tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(
        "import saltus as sl\n\n@sl.system(states='x v')\n"
        "def rig(t, x, v, *, k=1.0):\n    return v, -k * x\n"
    )
    assert run(f"{file}:rig").exit_code == 0
    assert opened[0].opening.system.states == ("x", "v")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("delange",), "Did you mean"),
        (("delangre", "force"), "NAME=VALUE"),
        (("delangre", "force=3 m"), "wrong unit"),
        (("nothing.toml",), "nothing.toml"),
        (("nothing.py:rig",), "no Python file"),
    ],
)
def test_what_cannot_be_opened_is_said_before_a_page_opens(opened, arguments, words):
    done = run(*arguments)
    assert done.exit_code == 2
    assert words in " ".join(done.output.split())
    assert opened == []


# -- studies and results ---------------------------------------------------------------------------
def test_a_study_opens_with_its_values_axes_and_start(opened, tmp_path):
    (tmp_path / "small.toml").write_text(STUDY)
    assert run(str(tmp_path / "small.toml")).exit_code == 0
    ((head, _),) = one(opened[0], "about")
    assert head["axes"] == {"x": [-5e-3, 5e-3], "v": [-1.0, 1.0]}
    assert head["size"] == [16, 17]
    assert head["start"] == {"x": 1e-3, "v": 0.0}
    assert head["view"]["motion"] == {"periods": 7}
    assert head["panels"]["response"]["range"] == [15.0, 15.02]


def test_finished_results_are_there_at_once(tmp_path, monkeypatch):
    monkeypatch.setattr(pipeline, "SCOUTS", 64)
    monkeypatch.setattr(pipeline, "CHECKED", 16)
    out = tmp_path / "out"
    out.mkdir()
    (out / "study.toml").write_text(STUDY)
    box = {"x": ("-5 mm", "5 mm", 16), "v": ("-1 m/s", "1 m/s", 17)}
    sl.save(sl.basins(RIG, **box), out / "basins.nc")
    curves = sl.branches(RIG, {"frequency": (15.0, 15.02)}, {"x": 1e-3, "v": 0.0}, at=1)
    sl.save(curves, out / "branches-of-periodic-orbits.nc")
    desk = studies.desk_of_results(out)
    monkeypatch.setattr(growing, "grow", None)  # nothing is computed
    ((about, _),) = one(desk, "about")
    axes = {name: list(ends) for name, ends in about["axes"].items()}
    *pieces, (end, _) = one(desk, "map", axes=axes, size=about["size"])
    shown = np.full((16, 17), -100)
    for head, arrays in pieces:
        if head["kind"] == "map-piece":
            cells = unpacked_cells(arrays, shown.shape[1])
            shown.ravel()[cells["cell"]] = cells["label"]
    ds = sl.load(out / "basins.nc")
    np.testing.assert_array_equal(shown, ds["basin"].values)
    assert end["flip_rate"] == ds.attrs["flip_rate"]
    assert [row["period"] for row in end["attractors"]] == ds["attractor_period"].values.tolist()
    panel = about["panels"]["response"]
    answers = one(desk, "responses", parameter=panel["parameter"], range=panel["range"])
    ((head, arrays),) = answers
    np.testing.assert_array_equal(arrays["point_parameter"], curves["point_frequency"].values)
    settled = one(desk, "settle", start=[1e-3, 0.0])[0][0]
    assert settled["attractor"]["key"] in {row["key"] for row in end["attractors"]}


def test_a_damaged_result_is_refused(tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "study.toml").write_text(STUDY)
    (folder / "basins.nc").write_bytes(b"\x89HDF\r\n\x1a\nnothing")
    with pytest.raises(SaltusError, match=r"basins\.nc"):
        studies.desk_of_results(folder)
    with pytest.raises(SaltusError, match=r"study\.toml"):
        studies.desk_of_results(tmp_path)
