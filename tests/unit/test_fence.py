"""What comes from outside is looked at before anything reads it: files, texts, TOML, cells."""

import os
import sys
import tomllib

import pytest

from saltus import fence
from saltus.fence import RefusedError

posix = pytest.mark.skipif(
    sys.platform == "win32", reason="pipes and devices in the file system are POSIX"
)


def test_a_file_is_its_bytes(tmp_path):
    (tmp_path / "a").write_bytes(b"\r\n\x00")
    assert fence.content(tmp_path / "a", 3) == b"\r\n\x00"
    with pytest.raises(RefusedError, match="larger than"):
        fence.content(tmp_path / "a", 2)


@posix
def test_what_is_no_file_is_refused_and_never_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to("pipe")
    for path, kind in (
        (tmp_path / "pipe", "a pipe"),
        (tmp_path / "link", "a pipe"),
        (tmp_path, "a folder"),
        ("/dev/zero", "a device"),
    ):
        with pytest.raises(
            RefusedError, match=f"it is .*{kind}" if kind != "a device" else "a device"
        ):
            fence.content(path, 100)
    for path in (tmp_path / "none", "a\0b"):
        with pytest.raises(RefusedError, match="can't be read"):
            fence.content(path, 100)


def test_text_has_no_mark_and_no_control_characters():
    assert fence.text(b"\xef\xbb\xbfa\tb\r\n\xc3\xa4") == "a\tb\r\nä"
    for data, told in (
        (b"\xff\xfea", "isn't UTF-8"),
        (b"a\nb\x1b[0m", r"line 2 holds the control character U\+001B"),
        (b"\x00", "U[+]0000"),
    ):
        with pytest.raises(RefusedError, match=told):
            fence.text(data)


def test_toml_of_a_sensible_shape_passes():
    source = (
        'a.b.c = [1.5, 2.5]\n"x.y" = "1. 2. 3."  # '
        + "." * 300
        + f"\nlong = [{', '.join(['1.25'] * 500)}]\n[t.u]\nn = 9223372036854775807\n"
    )
    assert fence.toml(source) == tomllib.loads(source)


@pytest.mark.parametrize(
    ("source", "told"),
    [
        ("a = 1" + "0" * 5000, "more digits"),
        ("a = 9223372036854775808", "whole number in 'a'"),
        ("a = -9223372036854775809", "whole number in 'a'"),
        ("a = " + "[" * 100_000 + "]" * 100_000, "nested deeper"),
        ("a = " + "[" * 30 + "]" * 30, "nested deeper"),
        ("a" + ".a" * 50_000 + " = 1", "more than 100 parts"),
        ("a" + " . a" * 101 + " = 1", "more than 100 parts"),
        ('"#"' + '."a"' * 101 + " = 1", "more than 100 parts"),
        ("[" + "1." * 101 + "1]", "more than 100 parts"),
        ("x = { " + "a." * 101 + "a = 1 }", "more than 100 parts"),
        (r'a = "\u0000"', "control character in 'a'"),
        (r'a = ["\u001b]0;owned\u0007"]', "control character in 'a'"),
        (r'"\u0007" = 1', "holds the key"),
        ("a" * 101 + " = 1", "holds the key"),
    ],
)
def test_toml_that_hurts_is_refused(source, told):
    with pytest.raises(RefusedError, match=told):
        fence.toml(source)


def test_toml_that_is_none_says_so_as_before():
    with pytest.raises(tomllib.TOMLDecodeError):
        fence.toml("a = ")


@pytest.mark.parametrize(
    "cell", ["=cmd|' /C calc'!A0", "+1+cmd|' /C calc'!A0", "-1+1", "@SUM(A1)", "\t=1"]
)
def test_a_formula_becomes_text(cell):
    assert fence.csv_cell(cell) == f"'{cell}"


@pytest.mark.parametrize(
    "cell", ["-1.5e-3", "-7.7e-3 mm", "+4", "-", "x = 1", "-inf", -1.0, 3, "-2 N·m/rad"]
)
def test_a_number_stays(cell):
    assert fence.csv_cell(cell) == cell


def test_a_terminal_obeys_nothing(capsys):
    from saltus.cli import screen
    from saltus.results.table import TextTable

    screen.say("a\x1b]0;owned\x07b")
    screen.fail("c\x1b[31m")
    screen.show(TextTable("t\x1bitle", ("co\x9blumn",), (("\u202ecell",),), ("no\x08te",)))
    out, err = capsys.readouterr()
    assert not any(fence.has_control(text) for text in (out, err))
    assert "a]0;ownedb" in out
