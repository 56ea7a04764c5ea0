"""Several questions in one study: planned and checked together, kept one by one, computed again
only when something changed.
"""

from __future__ import annotations

import json

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import saltus as sl
from saltus.errors import SaltusError, StudyError
from saltus.flow import Interrupted
from saltus.results import load, save
from saltus.study.ask import questions_of
from saltus.study.read import parse
from saltus.study.run.copies import inputs_of
from saltus.study.run.running import Resources
from saltus.study.run.status import status_tables
from saltus.study.run.study import run_study
from saltus.study.setting.inputs import Inputs
from saltus.study.spec import Study

HEAD = """
[study]
name = "one of each"
[system]
model = "delangre"
case = "b"
force = "4 N"
"""
SIMULATE = '[simulate]\nstart = { x = "0 mm", v = "0 m/s" }\nperiods = 3\n'
RESPONSE = """
[frequency_response]
frequency = { first = "14 Hz", last = "14.1 Hz", count = 3 }
start = { x = ["0 mm", "1 mm"], v = "0 m/s" }
"""
DIAGRAMS = """
[[bifurcation_diagram]]
name = "soft"
vary.contact_stiffness = { first = "1e3 N/m", last = "1e5 N/m", count = 3, scale = "log" }
[[bifurcation_diagram]]
name = "A map"
vary.contact_stiffness = ["1e4 N/m", "2e4 N/m"]
vary.frequency = { first = "14 Hz", last = "16 Hz", count = 2 }
values = { force = "1.5 N" }
method = { name = "ODE45", rtol = 1e-6, atol = 1e-9 }
"""
STUDY = HEAD + SIMULATE + RESPONSE + DIAGRAMS


class Run:
    """A study that is run; keeps what it says."""

    def __init__(self, folder, text=STUDY, **options):
        folder.mkdir(exist_ok=True)
        self.folder, self.reports, self.said = folder, [], []
        resources = Resources(threads=1, shard=options.pop("shard", None))
        self.outcome = run_study(
            parse(text),
            text,
            folder,
            None,
            resources,
            self.reports.append,
            self.said.append,
            **({"pictures": False} | options),
        )

    @property
    def names(self):
        return [file.name for file in self.outcome.files]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A run that nothing disturbed, with pictures."""
    return Run(tmp_path_factory.mktemp("whole"), pictures=True)


@pytest.fixture
def copied(whole, tmp_path):
    """Its folder, to be changed."""
    import shutil

    return shutil.copytree(whole.folder, tmp_path / "copy")


def times(folder):
    return {file.name: file.stat().st_mtime_ns for file in folder.glob("*.nc")}


# -- what comes out --------------------------------------------------------------------------------
def test_every_question_is_answered(whole):
    assert whole.names == [
        "run.nc", "run.csv", "run.png",
        "frequency-response.nc", "frequency-response.csv", "frequency-response-responses.csv",
        "frequency-response.png",
        "soft.nc", "soft.csv", "soft-responses.csv", "soft.png",
        "a-map.nc", "a-map.csv", "a-map-responses.csv", "a-map.png", "a-map-sizes.png",
    ]  # fmt: skip
    assert all(file.stat().st_size > 50 for file in whole.outcome.files)
    titles = [table.title for table in whole.outcome.tables]
    assert [title for title in titles if not title.endswith(": bifurcations")] == [
        "one of each",
        "Frequency response",
        "soft",
        "A map",
    ]
    assert (whole.folder / "study.toml").read_text() == STUDY


def test_an_answer_is_what_the_analysis_returns(whole):
    import saltus as sl

    rig = sl.models.delangre("b", force="4 N")
    expected = sl.frequency_response(
        rig, ("14 Hz", "14.1 Hz", 3), {"x": [0.0, 1e-3], "v": 0.0}, threads=1, progress=False
    )
    assert (
        load(whole.folder / "frequency-response.nc").drop_attrs().identical(expected.drop_attrs())
    )


def test_values_and_methods_of_one_question(whole):
    ds = load(whole.folder / "a-map.nc")
    assert json.loads(ds.attrs["parameters"])["force"] == 1.5
    assert ds.attrs["method"] == "ODE45"
    assert json.loads(ds.attrs["method_options"])["rtol"] == 1e-6
    assert ds["contact_stiffness"].values.tolist() == [1e4, 2e4]
    other = load(whole.folder / "soft.nc")
    assert json.loads(other.attrs["parameters"])["force"] == 4.0
    assert other.attrs["method"] == "Taylor"
    assert other["contact_stiffness"].values == pytest.approx([1e3, 1e4, 1e5])


def test_tables_tell_branches_and_kinds(whole):
    tables = {table.title: table for table in whole.outcome.tables}
    branches = tables["Frequency response"]
    assert branches.columns[:5] == ("branch", "type", "values", "frequency from", "to")
    ds = load(whole.folder / "frequency-response.nc")
    assert sum(int(row[2]) for row in branches.rows) == ds.sizes["response"]
    assert tables["A map"].columns == ("type", "share", "contact stiffness", "frequency")
    assert sum(float(row[1].rstrip(" %")) for row in tables["A map"].rows) == pytest.approx(
        100, abs=0.1
    )


def test_csv_of_every_question_is_plain_numbers_in_si(whole):
    """What pandas reads are the numbers of the Dataset, to the last digit, with the unit in the
    heading.
    """
    read = {
        name: pd.read_csv(whole.folder / f"{name}.csv", comment="#")
        for name in ("run", "frequency-response", "soft", "a-map")
    }
    run = load(whole.folder / "run.nc")
    assert read["run"]["x at the end [m]"].tolist() == [float(run["end_x"])]
    assert read["run"]["trajectory"].tolist() == [0]
    ds, table = load(whole.folder / "frequency-response.nc"), read["frequency-response"]
    first = ds.isel(response=ds["response_branch"].values == 0)
    followed = ds["point_frequency"].values[ds["point_branch"].values == 0]
    for name, value in (
        ("frequency from [Hz]", min(first["response_frequency"].min(), followed.min())),
        ("frequency to [Hz]", max(first["response_frequency"].max(), followed.max())),
        ("largest rms of x [m]", first["response_rms"].max()),
        ("peak |x| [m]", first["response_peak"].max()),
        ("contacts in T from", first["response_contacts"].min()),
        ("to a graze [m]", first["response_margin"].min()),
        ("largest exponent [1/s]", first["response_exponent"].max()),
    ):  # fmt: skip
        assert table[name][0] == float(value), name
    assert len(table) == len(np.unique(ds["response_branch"]))
    assert read["soft"]["contact stiffness from [N/m]"].min() == pytest.approx(1e3)
    assert read["a-map"]["share"].sum() == pytest.approx(1)
    for name, frame in read.items():
        wordy = set(frame.columns[~frame.dtypes.map(pd.api.types.is_numeric_dtype)])
        assert wordy <= {"type", "status", "response"}, name


def test_progress_is_told_for_each(whole):
    last = {report.name: report for report in whole.reports}
    assert list(last) == ["one of each", "Frequency response", "soft", "A map"]
    assert all(
        (report.done, report.total, report.what, report.last) == (100, 100, "%", True)
        for report in last.values()
    )


# -- going on --------------------------------------------------------------------------------------
@pytest.fixture
def no_computing(monkeypatch):
    for name in ("simulate", "frequency_response", "bifurcation_diagram"):
        monkeypatch.setattr(
            f"{sl._HOMES[name]}.{name}", lambda *_, **__: pytest.fail("something is computed again")
        )


def test_what_is_there_is_not_computed_again(whole, copied, no_computing):
    before = times(copied)
    again = Run(copied)
    assert times(copied) == before
    assert again.outcome.tables == whole.outcome.tables
    assert again.said == []


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        (
            "count = 3 }\nstart",
            "count = 2 }\nstart",
            "the frequency changed since frequency-response.nc was written",
        ),
        ('"0 mm", "1 mm"', '"0 mm", "2 mm"', "the start changed"),
        ('force = "4 N"', 'force = "4.1 N"', "the values changed"),
    ],
)
def test_what_changed_is_computed_again(copied, old, new, told):
    again = Run(copied, STUDY.replace(old, new), only=["frequency_response"])
    assert len(again.said) == 1
    assert told in again.said[0]
    assert load(copied / "frequency-response.nc").attrs["study"] == STUDY.replace(old, new)


def test_other_code_computes_again(copied, monkeypatch):
    monkeypatch.setattr("saltus.study.identity.code_hash", lambda: "another")
    assert "the code changed" in Run(copied, only=["simulate"]).said[0]


def test_a_damaged_answer_is_computed_again(whole, copied):
    data = bytearray((copied / "soft.nc").read_bytes())
    data[len(data) // 2] ^= 255
    (copied / "soft.nc").write_bytes(bytes(data))
    states = [(row[0], row[2]) for row in status_tables(copied)[0].rows]
    assert states == [
        ("one of each", "done"),
        ("Frequency response", "done"),
        ("soft", "damaged"),
        ("A map", "done"),
    ]
    again = Run(copied)
    assert len(again.said) == 1
    assert "soft: computed again" in again.said[0]
    assert (
        load(copied / "soft.nc").drop_attrs().identical(load(whole.folder / "soft.nc").drop_attrs())
    )


def test_a_stop_keeps_what_is_computed(whole, copied, monkeypatch):
    """The questions before it, and what there is of the one that was stopped."""
    (copied / "soft.nc").unlink()
    (copied / "a-map.nc").unlink()

    def stopped(*_, **__):
        raise Interrupted(lambda: load(whole.folder / "soft.nc"))

    with monkeypatch.context() as patch:
        patch.setattr("saltus.analysis.responses.bifurcation_diagram.bifurcation_diagram", stopped)
        with pytest.raises(KeyboardInterrupt):
            Run(copied)
    assert (copied / "soft-partial.nc").exists()
    assert sorted(row[2] for row in status_tables(copied)[0].rows) == [
        "done",
        "done",
        "not yet",
        "stopped on the way",
    ]
    again = Run(copied)
    assert not (copied / "soft-partial.nc").exists()
    assert (
        load(copied / "soft.nc").drop_attrs().identical(load(whole.folder / "soft.nc").drop_attrs())
    )
    assert again.outcome.tables == whole.outcome.tables


def test_only_one_question(tmp_path, no_computing, monkeypatch):
    calls = []
    monkeypatch.setattr(
        "saltus.analysis.responses.bifurcation_diagram.bifurcation_diagram",
        lambda *_, **call: calls.append(call) or pytest.skip("reached"),
    )
    for name in ("soft", "A map", "a-map"):
        assert len(questions_of(parse(STUDY), None, Inputs(tmp_path), [name])) == 1
    assert len(questions_of(parse(STUDY), None, Inputs(tmp_path), ["bifurcation_diagram"])) == 2
    with pytest.raises(
        StudyError,
        match=r"--only sofd: this study has no such question\. Did you "
        r"mean 'soft'\?",
    ):
        questions_of(parse(STUDY), None, Inputs(tmp_path), ["sofd"])


def test_other_shards_leave_small_questions_to_the_first(tmp_path):
    text = HEAD + SIMULATE + RESPONSE
    second = Run(tmp_path / "run", text, shard=(1, 2)).outcome
    assert (second.files, second.waiting) == ([], ["Frequency response"])
    assert Run(tmp_path / "run", text, shard=(0, 2)).names[:3] == [
        "run.nc",
        "run.csv",
        "frequency-response.nc",
    ]


# -- what is refused before anything is computed ---------------------------------------------------
@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            RESPONSE.replace('"14 Hz"', '"14 N"'),
            r"\[frequency_response\.frequency\] "
            r"frequency\.first",
        ),
        (
            RESPONSE.replace('"14 Hz"', "14"),
            r"frequency\.first = 14 has no unit.*frequency\.first "
            r'= "14 Hz"',
        ),
        (
            RESPONSE.replace('"14 Hz"', '"17 Hz"'),
            r"\[frequency_response\] the values of frequency "
            r"must ascend",
        ),
        (RESPONSE.replace("x =", "y ="), r"\[frequency_response\] start lacks x"),
        (
            RESPONSE.replace('"0 mm", "1 mm"]', '"0 mm", "1 mm"]').replace('"0 m/s"', '["0 m/s"]'),
            r"lists must "
            r"have the same length",
        ),
        (
            RESPONSE.split("start")[0] + 'start = "sweep_sideways"\n',
            r"\[frequency_response\] start "
            r"= .sweep_sideways. isn't known",
        ),
        (RESPONSE.split("start")[0] + 'start = "random 5"\n', r"random starts need a box"),
        (
            RESPONSE.split("start")[0] + 'start = "random 5"\nbox = { x = ["1 mm", "2 kg"] }\n',
            r"\[frequency_response\.box\] x",
        ),
        (
            RESPONSE + 'values = { forse = "1 N" }\n',
            r"\[frequency_response\.values\] 'forse' is "
            r"unknown.*Did you mean 'force'",
        ),
        (
            DIAGRAMS.replace("vary.contact_stiffness", "vary.contact"),
            r"\[bifurcation_diagram\.vary\] "
            r"'contact' is unknown",
        ),
        (DIAGRAMS.replace('"1e3 N/m"', '"0 N/m"'), r"can't have a log scale"),
        (DIAGRAMS.replace("A map", "Soft"), r"same file names, such as soft"),
        (DIAGRAMS.replace("A map", "run") + SIMULATE, r"same file names, such as run"),
        (
            "[lyapunov]\nvalues = { frequency = 3 }\n",
            r"\[lyapunov\.values\] frequency = 3 has "
            r"no unit",
        ),
        (
            "[lyapunov]\nstart = { x = [1], v = [1, 2] }\n",
            r"\[lyapunov\] lists must have the same "
            r"length",
        ),
        (
            "[lyapunov]\nperiods = 0\n",
            r"\[lyapunov\] periods = 0 must be greater than or "
            r"equal to 1",
        ),
        ("[[lyapunov]]\n[[lyapunov]]\n", r"each of several \[\[lyapunov\]\] needs a name"),
        (
            "[bifurcation_diagram]\nvary = {}\n",
            r"\[bifurcation_diagram\] varies one parameter, "
            r"or two",
        ),
        (
            '[frequency_response]\nfrequency = { first = "2 Hz" }\n',
            r"\[frequency_response\.frequency\] "
            r"needs first, last and count",
        ),
        (
            '[frequency_response]\nfrequency = { values = ["2 Hz"], count = 3 }\n',
            r"has values one by one",
        ),
    ],
)
def test_faults_are_told_before_anything_is_computed(text, told, tmp_path, no_computing):
    with pytest.raises(SaltusError, match=told):
        Run(tmp_path / "out", HEAD + text)
    assert list((tmp_path / "out").iterdir()) == []


def test_a_frequency_response_needs_forcing(tmp_path):
    (tmp_path / "free.py").write_text(
        "import saltus as sl\n@sl.system(states='x v')\ndef rig(t, x, v, *, stiffness=4.0):\n    "
        "return v, -stiffness*x\n"
    )
    from saltus.cli.own_system import own_system

    own = own_system(str(tmp_path / "free.py"))
    with pytest.raises(StudyError, match="no forcing frequency"):
        questions_of(
            parse('[study]\nname = "a"\n[frequency_response]\nfrequency = { values = [1.0] }\n'),
            own,
            Inputs(tmp_path),
        )


def test_measured_points_are_drawn_and_kept_with_the_study(tmp_path, whole):
    (tmp_path / "shaker.csv").write_text("frequency [Hz],amplitude [mm]\n15,0.3\n")
    text = HEAD + RESPONSE + 'measured = "shaker.csv"\n'
    run = Run(tmp_path / "out", text, inputs=Inputs(tmp_path), pictures=True)
    assert (tmp_path / "out" / "inputs" / "shaker.csv").read_text() == (
        tmp_path / "shaker.csv"
    ).read_text()
    with_points, without = (
        (folder / "frequency-response.png").read_bytes() for folder in (run.folder, whole.folder)
    )
    assert with_points != without
    Run(tmp_path / "out", text, inputs=inputs_of(tmp_path / "out", text), pictures=True)
    assert (run.folder / "frequency-response.png").read_bytes() == with_points


# -- schema ----------------------------------------------------------------------------------------
def test_every_key_tells_what_it_is():
    """A description and an example for each key of each table, so that editors can show them."""
    schema = Study.model_json_schema()
    for name, table in schema["$defs"].items():
        for key, field in table["properties"].items():
            if key != "name" or "const" not in field:  # the name of a method is its own example
                assert field.get("description"), f"{name}.{key}"
                assert field.get("examples"), f"{name}.{key}"
        assert table["description"], name
    for key in (
        "poincare",
        "spectrum",
        "impacts",
        "energy",
        "lyapunov",
        "frequency_response",
        "bifurcation_diagram",
    ):
        forms = schema["properties"][key]["anyOf"]
        assert {"$ref" in forms[0], forms[1].get("type") == "array"} == {True}


def test_examples_of_the_schema_are_read():
    from saltus.study.spec import QUESTIONS
    from saltus.study.tables.toml import toml

    for key in ("frequency_response", "bifurcation_diagram"):
        table = QUESTIONS[key]
        lines = [
            f"{name} = {toml(field.examples[0])}" for name, field in table.model_fields.items()
        ]
        parse(f'[study]\nname = "a"\n[{key}]\n' + "\n".join(lines))


def test_a_result_of_another_kind_in_the_way_is_computed_over(tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    other = xr.Dataset({"x": ("time", np.zeros(2))})
    other.to_netcdf(folder / "run.nc")
    run = Run(folder, HEAD + SIMULATE)
    assert "computed again" in run.said[0]
    assert load(save(load(folder / "run.nc"), tmp_path / "copy.nc")).attrs["title"] == "one of each"


def test_a_system_without_forcing_is_looked_at_every_so_often(tmp_path):
    text = """
    [study]
    name = "wing"
    [system]
    model = "aeroelastic"
    [bifurcation_diagram]
    vary.airspeed = { first = "10 m/s", last = "14 m/s", count = 3 }
    """
    (question,) = questions_of(parse(text + 'every = "250 ms"'), None, Inputs(tmp_path))
    assert question.arguments["every"] == 0.25
    (question,) = questions_of(parse(text), None, Inputs(tmp_path))
    assert question.arguments.get("every") is None  # about once a turn


def test_a_motion_at_given_times_has_a_row_for_each(tmp_path):
    text = HEAD + '[simulate]\nstart = { x = "1 mm", v = "0 m/s" }\nat = ["20 ms", "5 ms"]\n'
    Run(tmp_path, text)
    run = load(next(tmp_path.rglob("run.nc")))
    np.testing.assert_array_equal(run.time, [0.02, 0.005])
    assert run.end_time == 0.02
    with pytest.raises(StudyError, match="not both"):
        Run(tmp_path / "both", text + "samples = 3\n")


def test_a_motion_that_ends_at_a_condition_says_so(tmp_path):
    text = HEAD + '[simulate]\nstart = { x = ["1 mm", "0 mm"], v = "0 m/s" }\nperiods = 3\n'
    Run(tmp_path / "ends", text + 'until = "x < 0.5 mm and v < 0 m/s"\n')
    ends = load(next((tmp_path / "ends").rglob("run.nc")))
    assert ends.status.values.tolist() == ["until", "until"]
    assert abs(ends.end_x[0] - 0.0005) < 1e-18
    wrong = {"x < 0.5 N": "one unit", "q < 0.5 mm": "'q' is neither", "x >": "can't be read"}
    for until, says in wrong.items():
        with pytest.raises(StudyError, match=says):
            Run(tmp_path / "wrong", f'{text}until = "{until}"\n')
    far = text + '[system.outputs]\n"far edge" = "2*x"\n'
    far = far.replace("periods = 3\n", "periods = 3\nuntil = \"'far edge' < 1 mm and v < 0 m/s\"\n")
    Run(tmp_path / "far", far)
    edge = load(next((tmp_path / "far").rglob("run.nc")))
    assert edge.status.values.tolist() == ["until", "until"]
    assert abs(edge.end_x[0] - 0.0005) < 1e-18
    with pytest.raises(StudyError, match="write 'far edge' in quotes"):
        Run(tmp_path / "wrong", far.replace("'far edge'", "far edge"))
    with pytest.raises(StudyError, match="Leave one"):
        Run(tmp_path / "wrong", text + 'until = "x > 1 m"\nkeep = 1\n')
