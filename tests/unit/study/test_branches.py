"""[branches], [backbone] and [periodic_orbits] in a study: tables, pictures, errors."""

from __future__ import annotations

import csv

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import saltus as sl
from saltus.errors import SaltusError
from saltus.study.read import parse
from saltus.study.run.running import Resources
from saltus.study.run.study import run_study

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


@pytest.mark.slow
def test_harmonic_balance_has_the_fold_of_the_exact_branch(tmp_path):
    text = STUDY[: STUDY.index("[system]")] + (
        '[system]\nmodel = "soft_stop"\n[branches]\n'
        'vary.frequency = ["1 rad/s", "1.8 rad/s"]\nlongest = 1\n'
    )
    folds = []
    for name, by in (("exact", ""), ("balanced", "by = { harmonics = 15 }\n")):
        (file,) = (one for one in run(text + by, tmp_path / name).files if one.suffix == ".nc")
        with sl.load(file) as found:
            folds.append(found.event_frequency.values[found.event_kind.values == "fold"])
            assert ("point_error" in found) == (name == "balanced")
    assert [len(one) for one in folds] == [1, 1]
    assert 0 < abs(folds[0] - folds[1]) < 4e-5


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


BACKBONE = """
[study]
name = "Backbone"
[system]
model = "delangre"
case = "a"
[backbone]
amplitude = ["0.1 mm", "2 mm"]
values = { force = "0 N", damping_ratio = 0 }
"""
ORBITS = """
[study]
name = "Orbits"
[system]
model = "delangre"
case = "b"
force = "4 N"
frequency = "15 Hz"
[periodic_orbits]
start = "random 200"
box = { x = ["-5 mm", "5 mm"], v = ["-1 m/s", "1 m/s"] }
periods = 1
"""
LIMIT_CYCLES = """
[study]
name = "Cycles"
[system]
mu = 1.0
[system.rates]
x = "v"
v = "mu*(1 - x**2)*v - x"
[periodic_orbits]
start = "random 8"
box = { x = [-3, 3], v = [-3, 3] }
period = ["2 s", "20 s"]
"""


def rows_of(outcome):
    (table,) = (file for file in outcome.files if file.suffix == ".csv")
    with table.open() as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def test_a_backbone_ends_at_the_frequency_of_an_energy_integral(tmp_path):
    outcome = run(BACKBONE, tmp_path / "out")
    rows = rows_of(outcome)
    assert float(rows[-1]["peak |x| [m]"]) == pytest.approx(2e-3, rel=1e-10)
    assert float(rows[-1]["frequency [Hz]"]) == pytest.approx(11.42066832049569, rel=1e-10)
    assert any(file.suffix == ".png" for file in outcome.files)


def test_a_backbone_in_quadrature_names_its_force(tmp_path):
    text = BACKBONE.replace(
        'values = { force = "0 N", damping_ratio = 0 }', 'phase = "quadrature"\nforce = "force"'
    )
    rows = rows_of(run(text, tmp_path / "out"))
    assert float(rows[-1]["peak |x| [m]"]) == pytest.approx(2e-3, rel=1e-10)
    with pytest.raises(SaltusError, match="push"):
        run(text.replace('force = "force"', 'force = "push"'), tmp_path / "other")


def test_periodic_orbits_are_tabulated_and_drawn(tmp_path):
    outcome = run(ORBITS, tmp_path / "out")
    rows = rows_of(outcome)
    assert [row["stability"] for row in rows] == ["saddle", "inverse saddle", "stable focus"]
    outside = [float(row["largest |multiplier|"]) > 1 for row in rows]
    assert outside == [True, True, False]
    assert any(file.suffix == ".png" for file in outcome.files)


def test_limit_cycles_are_tabulated_with_their_period(tmp_path):
    """Van der Pol's oscillator, its period by SciPy."""
    (row,) = rows_of(run(LIMIT_CYCLES, tmp_path / "out"))
    assert row["stability"] == "stable node"

    def peak(_, y):
        return y[1]

    peak.direction = -1
    own = solve_ivp(
        lambda _, y: [y[1], (1 - y[0] ** 2) * y[1] - y[0]],
        (0, 60), [2.0, 0.0], "DOP853", events=peak, rtol=1e-11, atol=1e-12,
    )  # fmt: skip
    assert float(row["period [s]"]) == pytest.approx(np.diff(own.t_events[0])[-1], rel=1e-9)


@pytest.mark.parametrize(
    ("text", "old", "new", "words"),
    [
        (BACKBONE, '["0.1 mm", "2 mm"]', "[0.1, 2]", "no unit"),
        (BACKBONE, "amplitude =", "amplitud =", "amplitude"),
        (BACKBONE, "damping_ratio", "damping_ration", "damping_ratio"),
        (BACKBONE, "values =", 'state = "y"\nvalues =', "'y' is unknown to delangre. Known: x, v"),
        (ORBITS, "periods =", "perods =", "periods"),
        (ORBITS, "periods = 1", 'period = "1 s"', "is forced"),
        (LIMIT_CYCLES, '"2 s", "20 s"', "2, 20", "no unit"),
        (ORBITS, '"random 200"', '"random many"', "random"),
    ],
)
def test_mistakes_in_backbones_and_orbits(text, old, new, words, tmp_path):
    assert old in text
    with pytest.raises(SaltusError, match=words):
        run(text.replace(old, new), tmp_path / "out")


CURVE = """[bifurcation_curve]
event = "fold"
near = "17.8 Hz"
vary = { frequency = ["17 Hz", "18.5 Hz"], force = ["3.5 N", "4.5 N"] }
"""
MAP = """over = "map"
[bifurcation_diagram]
name = "map"
vary.force = { first = "3.5 N", last = "4.5 N", count = 2 }
vary.frequency = { first = "17 Hz", last = "18.5 Hz", count = 2 }
"""


def test_a_fold_of_the_branches_is_followed_over_two_parameters(tmp_path):
    slopes = '[event_sensitivity]\nevent = "fold"\nnear = "17.8 Hz"\nto = ["force"]\n'
    outcome = run(STUDY + CURVE + MAP + slopes, tmp_path / "out")
    (path,) = (one for one in outcome.files if one.name == "bifurcation-curve.csv")
    with path.open() as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    force, at = ([float(row[key]) for row in rows] for key in ("force [N]", "frequency [Hz]"))
    assert min(abs(f - 17.81941952) for f, n in zip(at, force, strict=True) if n == 4.0) < 1e-7
    assert min(at) >= 17
    assert max(at) <= 18.5
    (path,) = (one for one in outcome.files if one.name == "event-sensitivity.csv")
    with path.open() as file:
        (row,) = csv.DictReader(line for line in file if not line.startswith("#"))
    near = sorted(zip(force, at, strict=True), key=lambda one: abs(one[0] - 4.0))[:5]
    slope = np.polyfit(*np.transpose(near), 2)
    assert float(row["derivative [SI]"]) == pytest.approx(2 * slope[0] * 4.0 + slope[1], rel=1e-3)
    names = {file.name for file in outcome.files}
    assert names >= {"bifurcation-curve.png", "bifurcation-curve-map.png", "map-sizes.png"}


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("near =", "neer =", "near"),
        ('"fold"', '"folds"', "fold"),
        ('"17.8 Hz"', "17.8", "no unit"),
        ("near =", 'branches = "man"\nnear =', "no .branches. are called"),
        ("near =", 'over = "map"\nnear =', "no .bifurcation_diagram. over force and frequency is"),
    ],
)
def test_mistakes_in_curves(old, new, words, tmp_path):
    with pytest.raises(SaltusError, match=words):
        run(STUDY + CURVE.replace(old, new), tmp_path / "out")
