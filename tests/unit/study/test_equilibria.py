"""[equilibria] in a study: its table against closed forms, errors."""

from __future__ import annotations

import csv

import pytest

from saltus.errors import SaltusError
from saltus.study.read import parse
from saltus.study.run.running import Resources
from saltus.study.run.study import run_study

STUDY = """
[study]
name = "Rest"
[system]
mass = "2 kg"
damping = "3 N s/m"
stiffness = "8 N/m"
cubic = "2 N/m^3"
[system.units]
x = "m"
v = "m/s"
[system.rates]
x = "v"
v = "(stiffness*x - cubic*x**3 - damping*v)/mass"
[equilibria]
box = { x = ["-5 m", "5 m"], v = ["-1 m/s", "1 m/s"] }
starts = 32
"""


def rows_of(text, folder):
    folder.mkdir()
    outcome = run_study(
        parse(text), text, folder, None, Resources(threads=1), lambda _: None, lambda _: None
    )
    (table,) = (file for file in outcome.files if file.suffix == ".csv")
    with table.open() as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def test_a_buckled_beam_rests_at_its_three_equilibria(tmp_path):
    """x = 0 and +-sqrt(stiffness/cubic); 2 s^2 + 3 s + k = 0 with k = -8 and 16 [N/m]."""
    rows = rows_of(STUDY, tmp_path / "out")
    assert [float(row["x [m]"]) for row in rows] == pytest.approx([-2, 0, 2], abs=1e-12)
    assert [row["stable"] for row in rows] == ["yes", "no", "yes"]
    assert [row["type"] for row in rows] == ["focus", "saddle", "focus"]
    growth = [float(row["largest growth [1/s]"]) for row in rows]
    assert growth == pytest.approx([-0.75, (-3 + 73**0.5) / 4, -0.75], rel=1e-9)


def test_a_start_takes_the_place_of_a_box(tmp_path):
    old = STUDY[STUDY.index("box =") :]
    text = STUDY.replace(old, 'start = { x = ["1.9 m", "2.1 m"], v = "0 m/s" }\n')
    assert "2" in [row["x [m]"][:1] for row in rows_of(text, tmp_path / "out")]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('["-5 m", "5 m"]', "[-5, 5]", "no unit"),
        ("starts = 32", "stars = 32", "stars"),
        ("starts = 32", 'start = { x = "1 m", v = "0 m/s" }', "leave out one"),
        ("cubic*x**3", "cubic*x**3*cos(t*stiffness/damping)", "depends on time"),
        ("x = [", "y = [", "y"),
    ],
)
def test_mistakes_in_equilibria(old, new, words, tmp_path):
    assert old in STUDY
    with pytest.raises(SaltusError, match=words):
        rows_of(STUDY.replace(old, new), tmp_path / "out")
