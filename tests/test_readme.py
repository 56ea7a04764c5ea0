"""The README is a program: its code runs, its commands are the ones that CI runs, its study can be
read.
"""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import matplotlib
import pytest

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(
    r"^(?:<!-- (?P<marker>.*?) -->\n)?```(?P<language>\w+)\n(?P<text>.*?)^```$",
    README,
    re.DOTALL | re.MULTILINE,
)
PROGRAMS = [text for _, language, text in BLOCKS if language == "python"]


@pytest.mark.parametrize("program", PROGRAMS, ids=range(len(PROGRAMS)))
def test_program_runs(program, tmp_path, monkeypatch):
    matplotlib.use("Agg")
    monkeypatch.chdir(tmp_path)
    exec(compile(program, "a program of the README", "exec"), {"__name__": "readme"})


def test_first_example_fits_the_first_screen():
    assert len(PROGRAMS[0].splitlines()) <= 12


def test_set_up_commands():
    commands = {marker: text.strip() for marker, _, text in BLOCKS if marker.startswith("ci: ")}
    assert commands == {
        "ci: main command": "pip install . && saltus demo",
        "ci: test command": 'pip install -e ".[test]" && pytest',
    }


def test_ci_finds_the_test_command():
    script = (ROOT / ".ci" / "run").read_text()
    finder = next(line for line in script.splitlines() if line.startswith("readme_block()"))
    found = subprocess.run(
        ["bash", "-c", f"{finder}\nreadme_block 'test command'"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert found == 'pip install -e ".[test]" && pytest\n'


def test_study_can_be_read():
    from saltus.study.read import parse

    (text,) = (text for _, language, text in BLOCKS if language == "toml")
    assert parse(text).simulate.periods == 500


def test_links_lead_somewhere():
    links = re.findall(r"\]\((?!https?:)([^)#]+)", README)
    assert links
    assert [target for target in links if not (ROOT / target).exists()] == []
