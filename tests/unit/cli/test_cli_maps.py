"""Studies of basins on the command line: run, status, resume, plot; what can go wrong is told in a
sentence, with the right exit code.
"""

from __future__ import annotations

import json
import shutil
import socket

import matplotlib.image
import numpy as np
import pytest
from typer.testing import CliRunner

from saltus.analysis.basins import pipeline
from saltus.cli.commands import app
from saltus.results import load
from saltus.results.store.store import Store
from small_maps import small_maps
from small_study import small_study

#: 256 starts in eight chunks.
STUDY = small_study(16)
MOTION = """
[study]
name = "a motion"
[system]
model = "delangre"
case = "b"
[simulate]
start = { x = "0 mm", v = "0 m/s" }
periods = 3
"""


@pytest.fixture(autouse=True, scope="module")
def small():
    with small_maps(32):
        yield


def saltus(*arguments):
    """The result of a command; faults that should have been caught surface as exceptions."""
    return CliRunner().invoke(app, [str(one) for one in arguments], catch_exceptions=False)


def refused(result, told):
    assert result.exit_code == 2, result.output
    assert result.output.startswith("saltus: ")
    assert told in result.output
    assert "Traceback" not in result.output


@pytest.fixture(scope="module")
def finished(small, tmp_path_factory):
    """The output folder of a study that was run, with the result of the command."""
    place = tmp_path_factory.mktemp("cli")
    (place / "small.toml").write_text(STUDY)
    result = saltus("run", place / "small.toml", "--out", place / "out", "--threads", 1)
    assert result.exit_code == 0, result.output
    return place / "out", result


@pytest.fixture
def empty_pictures(finished, monkeypatch):
    """Frames instead of pictures, where nobody looks at them: drawing takes longer than the rest of
    such a study.
    """
    import matplotlib.pyplot as plt

    from saltus import plot

    monkeypatch.setattr(plot, "basins", lambda *_, **__: plt.figure(figsize=(2, 2)).add_subplot())
    monkeypatch.setattr(plot, "gallery", lambda *_, **__: plt.figure(figsize=(2, 2)))


@pytest.fixture
def study(tmp_path):
    """A function that writes a study file."""

    def write(text=STUDY):
        (tmp_path / "a.toml").write_text(text)
        return tmp_path / "a.toml"

    return write


@pytest.fixture
def stopped(finished, tmp_path):
    """The same folder, as if it had been stopped after five of eight chunks: no results yet."""
    folder = tmp_path / "stopped"
    shutil.copytree(finished[0], folder)
    for index in (2, 3, 7):
        (folder / "stores" / "basins" / "chunks" / f"{index}.chunk").unlink()
    for file in folder.glob("basins*"):
        file.unlink()
    return folder


# -- run -------------------------------------------------------------------------------------------
def test_run_prints_a_table_and_writes_files_that_open(finished):
    folder, result = finished
    assert "share of starts" in result.stdout
    for row in ("0  T ", "1  2T ", "2  2T ", "3  5T "):
        assert any(line.startswith(row) for line in result.stdout.splitlines()), row
    assert (
        "256 starts: other attractors with a basin below 1.2 % of where they lie may be missed."
        in result.stdout
    )
    for name in ("basins.nc", "basins.csv", "basins.png", "basins-attractors.png"):
        assert f"wrote {folder / name}" in result.stdout.replace("\n", "")
    ds = load(folder / "basins.nc")
    assert ds.basin.shape == (16, 16)
    assert ds.sizes["attractor"] == 4
    assert "2T" in (folder / "basins.csv").read_text()
    for name in ("basins.png", "basins-attractors.png"):
        picture = matplotlib.image.imread(folder / name)
        assert min(picture.shape[:2]) > 200
        assert np.ptp(picture) > 0.5
    assert (folder / "study.toml").read_text() == STUDY


@pytest.mark.usefixtures("empty_pictures")
def test_progress_in_json(study, tmp_path):
    """Every line of standard error is JSON, the last one says that all is done; nothing but tables
    on standard output.
    """
    result = saltus("run", study(), "--out", tmp_path / "out", "--progress", "json", "--threads", 1)
    # notes: what is being compiled
    lines = [line for line in map(json.loads, result.stderr.splitlines()) if "note" not in line]
    assert lines
    assert all(
        set(line) == {"question", "done", "total", "seconds", "seconds_left"} for line in lines
    )
    assert {(line["question"], line["total"]) for line in lines} == {("small", 8)}
    assert [line["done"] for line in lines] == sorted(line["done"] for line in lines)
    assert lines[-1]["done"] == 8
    assert lines[-1]["seconds_left"] == 0.0
    assert not result.stdout.startswith("{")


@pytest.mark.usefixtures("empty_pictures")
def test_progress_in_json_of_a_finished_map(finished):
    result = saltus("resume", finished[0], "--progress", "json", "--threads", 1)
    assert json.loads(result.stderr.splitlines()[-1])["done"] == 8


@pytest.mark.usefixtures("empty_pictures")
def test_progress_none_is_quiet(study, tmp_path):
    result = saltus("run", study(), "--out", tmp_path / "out", "--progress", "none", "--threads", 1)
    assert result.stderr == ""
    assert "share of starts" in result.stdout


@pytest.mark.usefixtures("empty_pictures")
def test_shards(study, tmp_path, finished):
    file, out = study(), tmp_path / "out"
    first = saltus(
        "run", file, "--out", out, "--shard", "1/2", "--progress", "none", "--threads", 1
    )
    assert first.exit_code == 0
    assert (
        f"small: other shards aren't done yet. When they are: saltus resume {out}"
    ) in first.stdout
    assert "4 of 8" in saltus("status", out).stdout
    second = saltus(
        "run", file, "--out", out, "--shard", "0/2", "--progress", "none", "--threads", 1
    )
    assert "share of starts" in second.stdout
    np.testing.assert_array_equal(
        load(out / "basins.nc").basin, load(finished[0] / "basins.nc").basin
    )


# -- status ----------------------------------------------------------------------------------------
def test_status_before_during_and_after(finished, stopped, tmp_path):
    refused(
        saltus("status", tmp_path / "nowhere"),
        "holds no store and no study. Give the output folder of a study",
    )
    assert "5 of 8" in saltus("status", stopped).stdout
    assert "62 %" in saltus("status", stopped).stdout
    after = saltus("status", finished[0])
    assert after.exit_code == 0
    assert "8 of 8" in after.stdout
    assert "100 %" in after.stdout
    assert "8 of 8" in saltus("status", finished[0] / "stores" / "basins").stdout


def test_status_of_a_store_without_chunks(finished, tmp_path):
    folder = tmp_path / "empty"
    shutil.copytree(finished[0], folder)
    for record in (folder / "stores" / "basins" / "chunks").iterdir():
        record.unlink()
    text = saltus("status", folder).stdout
    assert "0 of 8" in text
    assert "never" in text


def test_status_shows_damage_and_who_is_at_work(stopped):
    (stopped / "stores" / "basins" / "chunks" / "0.chunk").write_bytes(b"short")
    with Store.open(stopped / "stores" / "basins").lock():
        (row,) = [
            line
            for line in saltus("status", stopped).stdout.splitlines()
            if line.startswith("small")
        ]
    assert row.split()[:7] == ["small", "5", "of", "8", "62", "%", "1"]
    assert "process" in row


def test_status_of_a_damaged_head(stopped):
    head = stopped / "stores" / "basins" / "store.json"
    head.write_bytes(head.read_bytes()[:-20])
    result = saltus("status", stopped)
    assert result.exit_code == 0
    assert "is damaged. Go on with the study that made it" in " ".join(result.output.split())


# -- resume ----------------------------------------------------------------------------------------
@pytest.mark.usefixtures("empty_pictures")
def test_resume_of_a_stopped_study(stopped, finished):
    result = saltus("resume", stopped, "--progress", "json", "--threads", 1)
    assert result.exit_code == 0
    last = json.loads(result.stderr.splitlines()[-1])
    assert (last["done"], last["total"]) == (8, 8)
    assert (
        load(stopped / "basins.nc")
        .drop_attrs()
        .identical(load(finished[0] / "basins.nc").drop_attrs())
    )
    assert "8 of 8" in saltus("status", stopped).stdout


@pytest.mark.usefixtures("empty_pictures")
def test_resume_of_a_finished_study(finished, tmp_path):
    folder = tmp_path / "again"
    shutil.copytree(finished[0], folder)
    before = load(folder / "basins.nc")
    result = saltus("resume", folder, "--threads", 1, "--progress", "none")
    assert result.exit_code == 0
    assert "share of starts" in result.stdout
    assert load(folder / "basins.nc").drop_attrs().identical(before.drop_attrs())


def test_resume_where_nothing_is(tmp_path, finished):
    refused(saltus("resume", tmp_path / "nowhere"), "holds no study.toml")
    (tmp_path / "empty").mkdir()
    refused(saltus("resume", tmp_path / "empty"), "holds no study.toml")
    refused(saltus("resume", finished[0] / "stores"), "holds no study.toml")


def test_resume_of_a_study_of_motions(tmp_path):
    (tmp_path / "study.toml").write_text(MOTION)
    assert "not yet" in saltus("status", tmp_path).stdout
    assert saltus("resume", tmp_path).exit_code == 0
    written = (tmp_path / "run.nc").stat().st_mtime_ns
    assert "done" in saltus("status", tmp_path).stdout
    assert saltus("resume", tmp_path).exit_code == 0
    assert (tmp_path / "run.nc").stat().st_mtime_ns == written


def test_resume_with_a_damaged_copy_of_the_study(stopped):
    (stopped / "study.toml").write_text(STUDY[:100])
    result = saltus("resume", stopped)
    assert result.exit_code == 2
    assert str(stopped / "study.toml") in result.output.replace("\n", "")


def test_run_with_another_study_is_refused(stopped, study):
    result = saltus("run", study(STUDY.replace('"4 N"', '"5 N"')), "--out", stopped, "--threads", 1)
    refused(result, "was made from something else: values was")
    assert "5 of 8" in saltus("status", stopped).stdout


def test_a_second_process_is_refused(stopped):
    """It's told who works there, and the exit code is that of a refusal."""
    with Store.open(stopped / "stores" / "basins").lock():
        refused(
            saltus("resume", stopped, "--threads", 1, "--progress", "none"),
            "is being written by process",
        )


# -- plot ------------------------------------------------------------------------------------------
def test_plot_of_a_map(finished, tmp_path):
    result = saltus("plot", finished[0] / "basins.nc", "-o", tmp_path / "map.png")
    assert result.exit_code == 0
    assert min(matplotlib.image.imread(tmp_path / "map.png").shape[:2]) > 200


@pytest.mark.parametrize("kind", ["history", "phase", "agreement"])
def test_plot_of_a_map_as_something_else(finished, tmp_path, kind):
    refused(
        saltus("plot", finished[0] / "basins.nc", "--kind", kind, "-o", tmp_path / "map.png"),
        "basins",
    )


@pytest.mark.parametrize("kind", ["basins", "agreement"])
def test_plot_of_a_motion_as_a_map(study, tmp_path, kind):
    assert saltus("run", study(MOTION), "--out", tmp_path / "out").exit_code == 0
    refused(saltus("plot", tmp_path / "out" / "run.nc", "--kind", kind), kind)


# -- what may be written wrong ---------------------------------------------------------------------
@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        (
            "[basins]",
            "[basins]\nperiod = 3",
            "[basins] has no key 'period'. Did you mean 'periods'?",
        ),
        ("axes.v", "axes.w", "[basins.axes] 'w' is unknown to delangre. Known: x, v."),
        ('"-5 mm"', "-5", "[basins.axes] x.first = -5 has no unit."),
        (
            "\n[basins]",
            '\n[[basins.map]]\nname = "a"\n[[basins.map]]\nname = "a"\n[basins]',
            "two maps have the same name",
        ),
        (
            "\n[basins]",
            '\n[[basins.map]]\nname = "a"\ncompare = "b"\n[basins]',
            "map 'a' is compared with 'b', which is no other map",
        ),
        (STUDY[STUDY.index("[basins]") :], "", "a study asks something"),
    ],
)
def test_faults_of_the_file(study, tmp_path, old, new, told):
    assert old in STUDY
    refused(saltus("run", study(STUDY.replace(old, new)), "--out", tmp_path / "out"), told)
    assert not (tmp_path / "out" / "stores").exists()


@pytest.mark.parametrize("shard", ["2/2", "x", "1", "1/0", "-1/2"])
def test_nonsense_for_a_shard(study, tmp_path, finished, shard):
    refused(
        saltus("run", study(), "--out", tmp_path / "out", "--shard", shard),
        "write K/N with K from 0 to N - 1, such as 0/4.",
    )
    refused(saltus("resume", finished[0], "--shard", shard), "write K/N")
    assert not (tmp_path / "out" / "stores").exists()


@pytest.mark.parametrize("option", [("--threads", "0"), ("--workers", "0"), ("--progress", "loud")])
def test_options_out_of_range(study, tmp_path, option):
    result = saltus("run", study(), "--out", tmp_path / "out", *option)
    assert result.exit_code == 2
    assert option[0] in result.output


@pytest.fixture
def dead_port():
    """The address of a port on which nobody listens."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        port = one.getsockname()[1]
    return f"tcp://127.0.0.1:{port}"


def test_a_dead_scheduler_is_told_before_a_client_waits_for_it(stopped, dead_port, monkeypatch):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(distributed, "Client", lambda *_, **__: pytest.fail("it waits"))
    refused(
        saltus("resume", stopped, "--scheduler", dead_port, "--progress", "none"),
        f"the scheduler {dead_port} doesn't answer",
    )


@pytest.mark.parametrize("address", ["nonsense", "foo://bar:1"])
def test_nonsense_for_a_scheduler(stopped, address):
    pytest.importorskip("distributed")
    refused(
        saltus("resume", stopped, "--scheduler", address, "--progress", "none"),
        f"the scheduler {address} doesn't answer",
    )


def test_a_scheduler_is_asked_for_before_anything_is_computed(study, tmp_path, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(
        pipeline.BasinPlan, "scout", lambda *_: pytest.fail("attractors are looked for")
    )
    refused(
        saltus(
            "run",
            study(),
            "--out",
            tmp_path / "out",
            "--scheduler",
            "nonsense",
            "--progress",
            "none",
        ),
        "doesn't answer",
    )


def test_a_cluster_without_dask(stopped, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    with socket.create_server(("127.0.0.1", 0)) as listening:
        address = f"tcp://127.0.0.1:{listening.getsockname()[1]}"
        refused(
            saltus("resume", stopped, "--scheduler", address, "--progress", "none"),
            'Install "saltus[cluster]"',
        )


def test_options_of_basins_for_a_study_of_motions(study, tmp_path):
    assert (
        saltus("run", study(MOTION), "--out", tmp_path / "out", "--shard", "nonsense").exit_code
        == 2
    )
