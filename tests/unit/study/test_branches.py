"""[branches] in a study: its table, its picture, its errors."""

from __future__ import annotations

import csv

import pytest

from saltus.errors import SaltusError
from saltus.study.run.running import Resources
from saltus.study.run.study import run_study
from saltus.study.tables.read import parse

STUDY = """
[study]
name = "Branches"
[system]
model = "delangre"
case = "b"
force = "4 N"
[branches]
vary.frequency = ["12 Hz", "18 Hz"]
start = { x = "5 mm", v = "0 m/s" }
at = 1
longest = 1
"""


def run(text, folder):
    folder.mkdir()
    return run_study(
        parse(text), text, folder, None, Resources(threads=1), lambda _: None, lambda _: None
    )


def test_branches_are_tabulated_and_drawn(tmp_path):
    outcome = run(STUDY, tmp_path / "out")
    (table,) = (file for file in outcome.files if file.suffix == ".csv")
    with table.open() as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    assert [row["period"] for row in rows] == ["T"] * len(rows)
    assert sum(int(row["bifurcations"]) for row in rows) >= 1
    assert any(file.suffix == ".png" for file in outcome.files)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('["12 Hz", "18 Hz"]', "[12, 18]", "no unit"),
        ('["12 Hz", "18 Hz"]', '["18 Hz", "12 Hz"]', "must ascend"),
        ("vary.frequency", "vary.frequenzy", "frequency"),
        ("longest = 1", 'switch = ["folds"]', "switch"),
        ("longest = 1", "longst = 1", "longest"),
    ],
)
def test_mistakes_are_answered_by_a_sentence(old, new, words, tmp_path):
    with pytest.raises(SaltusError, match=words):
        run(STUDY.replace(old, new), tmp_path / "out")
