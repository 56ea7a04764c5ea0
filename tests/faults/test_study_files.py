"""Study files from anywhere: what they may read, what is kept of them, and that no text of theirs
ends in a traceback from inside.
"""

import contextlib
import os
import random
import shutil
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from faults.mutated_studies import ROOT, SEEDS, mutated
from saltus.cli.commands import app
from saltus.errors import SaltusError, StudyError
from saltus.study.ask import questions_of
from saltus.study.read import parse, read
from saltus.study.run.copies import keep_copy
from saltus.study.setting.inputs import Input, Inputs

posix = pytest.mark.skipif(sys.platform == "win32", reason="pipes and links are POSIX")
HEAD = (
    '[study]\nname = "one start"\n[system]\nmodel = "delangre"\ncase = "b"\nforce = "4 '
    'N"\nfrequency = "15 Hz"\n'
)
MOTION = HEAD + '[simulate]\nstart = { x = "1 mm", v = "0 m/s" }\nperiods = 5\n'
#: Contacts of this motion that nobody printed.
PRINTED = "event_number,time_s\n1,0.02\n"


def saltus(*arguments):
    return CliRunner().invoke(app, [str(one) for one in arguments])


def refused(result, *told):
    assert result.exit_code == 2, result.output
    for part in told:
        assert part in result.output.replace("\n", " "), result.output
    assert "Traceback" not in result.output


@pytest.fixture
def study(tmp_path):
    """Writes a study, and files beside it."""

    def write(text, **files):
        (tmp_path / "here").mkdir(exist_ok=True)
        for name, content in files.items():
            path = tmp_path / "here" / name.replace("__", "/")
            path.parent.mkdir(exist_ok=True)
            path.with_suffix(".csv").write_text(content)
        (tmp_path / "here" / "study.toml").write_text(text)
        return tmp_path / "here" / "study.toml"

    return write


# -- what a study reads ----------------------------------------------------------------------------
@pytest.mark.parametrize(
    "name", ["/etc/passwd", "../secret.csv", "a/../../secret.csv", "link.csv", "out/secret.csv"]
)
def test_a_study_reads_nothing_outside_its_folder(study, tmp_path, name):
    """Absolute, by .., through a link to a file, through a link to a folder."""
    (tmp_path / "secret.csv").write_text("event_number,time_s\n1,hunter2\n")
    file = study(MOTION + f'[compare]\nprinted = "{name}"\n')
    (file.parent / "link.csv").symlink_to(tmp_path / "secret.csv")
    (file.parent / "out").symlink_to(tmp_path)
    result = saltus("run", file, "--out", tmp_path / "result")
    refused(result, "outside the study's folder", "--inputs FOLDER")
    assert "hunter2" not in result.output
    assert not (tmp_path / "result").exists()


def test_a_folder_that_the_user_allows_is_read(study, tmp_path):
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "t.csv").write_text(PRINTED.replace("1,", "0,"))
    for name in ("../data/t.csv", str(tmp_path / "data" / "t.csv"), "t.csv"):
        file = study(MOTION + f'[compare]\nprinted = "{name}"\n')
        refused(
            saltus("run", file, "--out", tmp_path / "result", "--inputs", tmp_path / "data"),
            "line 2",
            "no whole number from 1",
        )
    refused(
        saltus("run", file, "--out", tmp_path / "result", "--inputs", tmp_path / "nowhere"),
        "there is no such folder",
    )


@posix
def test_what_is_no_file_is_refused_at_once(study, tmp_path):
    file = study(MOTION + '[compare]\nprinted = "pipe.csv"\n')
    os.mkfifo(file.parent / "pipe.csv")
    os.mkfifo(file.parent / "study.pipe")
    refused(saltus("run", file, "--out", tmp_path / "result"), "a pipe, a device or a socket")
    refused(
        saltus("run", file.parent / "study.pipe", "--out", tmp_path / "result"),
        "a pipe, a device or a socket",
    )
    refused(
        saltus("run", "/dev/zero", "--out", tmp_path / "result"), "a pipe, a device or a socket"
    )
    refused(saltus("run", file.parent, "--out", tmp_path / "result"), "it is a folder")
    (file.parent / "pipe.csv").unlink()
    with (file.parent / "pipe.csv").open("wb") as large:
        large.truncate(11_000_000)
    refused(saltus("run", file, "--out", tmp_path / "result"), "larger than 10 MB")
    file.write_text(MOTION + "# " + "x" * 1_000_000)
    refused(saltus("run", file, "--out", tmp_path / "result"), "larger than 1 MB")
    assert not (tmp_path / "result" / "inputs").exists(), "nothing is copied before it is checked"


# -- what is kept of it ----------------------------------------------------------------------------
@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A study with two inputs of one name, CRLF and a mark before the text, run once."""
    here = tmp_path_factory.mktemp("study")
    for folder, time in (("a", "0.02"), ("b", "0.03")):
        (here / folder).mkdir()
        (here / folder / "t.csv").write_text(PRINTED.replace("0.02", time))
    text = (MOTION + '[compare]\nprinted = "a/t.csv"\nexact = "b/t.csv"\n').replace("\n", "\r\n")
    (here / "study.toml").write_bytes(b"\xef\xbb\xbf" + text.encode())
    assert saltus("run", here / "study.toml", "--out", here / "out").exit_code == 0
    return here


@pytest.fixture
def out(finished, tmp_path):
    """Its output folder, to be changed; the study itself isn't there any more."""
    return shutil.copytree(finished / "out", tmp_path / "out")


def test_inputs_of_one_name_stay_two(out):
    before = (out / "run.csv").read_text()
    assert saltus("resume", out).exit_code == 0
    assert (out / "run.csv").read_text() == before
    assert sorted(file.read_text() for file in (out / "inputs").iterdir()) == [
        PRINTED,
        PRINTED.replace("0.02", "0.03"),
    ]


def test_the_answer_holds_the_hash_of_each_input(finished, out):
    import hashlib

    table = (out / "run.csv").read_text()
    for name in ("a/t.csv", "b/t.csv"):
        assert (
            f"# {name}: SHA-256 {hashlib.sha256((finished / name).read_bytes()).hexdigest()}\n"
        ) in table


def test_the_copy_is_the_study_to_the_byte(finished, out):
    assert (out / "study.toml").read_bytes() == (finished / "study.toml").read_bytes()


@pytest.mark.parametrize("name", ["study.toml", "inputs/t.csv", "inputs/t-2.csv", "study.seal"])
def test_what_changed_since_it_was_written_is_told(out, name):
    """The copy of the study still is a study, the tables still are tables, and neither is what was
    asked.
    """
    file = out / name
    changed = (
        file.read_bytes().replace(b"4 N", b"5 N").replace(b"0.0", b"0.1").replace(b'"sha', b'"hsa')
    )
    assert changed != file.read_bytes()
    file.write_bytes(changed)
    refused(saltus("resume", out), "changed since it was written")
    if name == "study.toml":
        told = saltus("status", out)
        assert told.exit_code == 0
        assert "changed or damaged" in told.stdout
    answers = {one.name: one.stat().st_mtime_ns for one in out.glob("*.nc")}
    assert answers, "and nothing was computed over"


def test_a_link_that_leaves_the_folder_is_not_written_through(out, tmp_path):
    (tmp_path / "victim").write_text("precious")
    for name in ("run.nc", "run.csv", "study.seal"):
        shutil.copy(out / name, tmp_path / name)
        (out / name).unlink()
        (out / name).symlink_to(tmp_path / "victim")
        result = saltus("resume", out)
        assert result.exit_code == 2, (name, result.output)
        assert (tmp_path / "victim").read_text() == "precious"
        (out / name).unlink()
        shutil.copy(tmp_path / name, out / name)
    shutil.rmtree(out / "inputs")
    (tmp_path / "elsewhere").mkdir()
    (out / "inputs").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(SaltusError, match="link that leaves"):
        keep_copy(out, "text", [Input("t.csv", Path("t.csv"), b"")])
    assert list((tmp_path / "elsewhere").iterdir()) == []


# -- names -----------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('"one start"', r'"a\u0000b"', "control character in 'name'"),
        ('"one start"', r'"a\u001b]0;owned\u0007"', "control character in 'name'"),
        ('"one start"', r'"x\n=cmd|calc,1"', "must be one line of plain text"),
        ('"one start"', r'" "', "must be one line of plain text"),
        ('"one start"', '"' + "x" * 5000 + '"', "a text of 5000 characters"),
        (
            "periods = 5",
            "periods = 1000000000000000000",
            "must be less than or equal to 1000000000000",
        ),
        ("periods = 5", "periods = 9223372036854775808", "2^63"),
        (
            "periods = 5",
            "periods = 5\nsamples = 10000000000",
            "must be less than or equal to 2147483647",
        ),
        (
            "[simulate]",
            f'[lyapunov]\nname = "{"a" * 150}"\n[simulate]',
            "gives a file name of 150 characters",
        ),
        ('"4 N"', '"' + "(" * 3000 + '"', "a text of 3000 characters in 'force'"),
    ],
)
def test_names_and_numbers_out_of_bounds(old, new, told):
    assert old in MOTION
    with pytest.raises(StudyError) as caught:
        parse(MOTION.replace(old, new))
    assert told in str(caught.value)
    assert len(str(caught.value)) < 400


# -- mutated studies -------------------------------------------------------------------------------
@pytest.mark.parametrize("seed", [7, pytest.param(None, marks=pytest.mark.nightly)])
def test_a_mutated_study_is_read_or_refused_in_words(seed):
    """Reader and check against the system, 2000 times; one that is valid goes no further, so that
    nothing is compiled.
    """
    seed = random.randrange(2**31) if seed is None else seed
    draw, outcomes, longest = random.Random(seed), {"valid": 0, "refused": 0}, 0
    for trial in range(2000):
        text = mutated(draw.choice(SEEDS), draw)
        try:
            questions_of(parse(text), None, Inputs(ROOT / "replications" / "saunders2021"))
            outcomes["valid"] += 1
        except SaltusError as error:
            outcomes["refused"] += 1
            longest = max(longest, len(str(error)))
        except Exception as error:
            raise AssertionError(
                f"seed {seed}, trial {trial}: {error!r} from\n{text[:3000]}"
            ) from error
    assert min(outcomes.values()) > 100, outcomes
    assert longest < 3000, "a message repeats no long value"


def test_the_reader_takes_any_bytes(tmp_path):
    draw, file = random.Random(5), tmp_path / "study.toml"
    for _ in range(300):
        data = bytearray(MOTION.encode())
        for _ in range(draw.choice([1, 3, 20])):
            data[draw.randrange(len(data))] = draw.randrange(256)
        file.write_bytes(data)
        with contextlib.suppress(SaltusError):
            read(file)
