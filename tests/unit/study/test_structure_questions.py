"""Every question of a study file about a structure: answered from rest, with its sensor, and
written to files.
"""

from __future__ import annotations

import csv

import numpy as np
import pytest

import saltus as sl
from saltus.study.read import parse
from saltus.study.run.running import Resources
from saltus.study.run.study import run_study
from saltus.study.setting.inputs import Inputs

STIFFNESS = 1e4 * np.array([[2.0, -1.0], [-1.0, 2.0]])
HEAD = """
[study]
name = "a frame"
[system]
stop_gap = "1 mm"
structure.mass = "frame.npz"
structure.modes = 2
structure.damping_ratio = "2 %"
structure.frequency = "13 Hz"
structure.sensors.tip = "x2"
structure.sensors."tip speed" = "velocity(x2)"
structure.sensors."stop force" = "contact_force(stop)"
structure.forces = { at = "x1", amplitude = "9 N" }
structure.contacts = { at = "x2", stiffness = "100 kN/m", gap = "1 mm" }
"""
#: Tables, each with a variable of its result that has a row or a name for the sensor.
TABLES = {
    "simulate": ("periods = 20", "tip"),
    "stroboscope": ("periods = 50\nkeep = 5", "tip"),
    "settled": ("periods = 200", "tip_peak"),
    "periodic_orbits": ("periods = 1", "orbit_peak"),
    "poincare": ('surface = "tip turns"\nperiods = 5\ntransient = 50', "tip"),
    "spectrum": ("periods = 16\ntransient = 50", "tip_amplitude"),
    "impacts": ("periods = 20\ntransient = 50", "contact_peak_force"),
    "lyapunov": ("periods = 64\ntransient = 200", "lyapunov_exponent"),
    "attractors": ("periods = 400", "output"),
    "frequency_response": (
        'frequency = { first = "12 Hz", last = "14 Hz", count = 3 }', "output",
    ),
    "bifurcation_diagram": (
        'vary = { force = { first = "8 N", last = "9 N", count = 2 } }', "sample_tip",
    ),
    "branches": ('vary = { frequency = ["12.9 Hz", "13.1 Hz"] }\nat = 1', "output"),
    "backbone": (
        'amplitude = ["1e-4 kg^0.5*m", "5e-4 kg^0.5*m"]\nphase = "quadrature"', "output",
    ),
    "basins": (
        'axes.tip = { first = "-1 mm", last = "1 mm", count = 3 }\n'
        'axes."tip speed" = { first = "-0.1 m/s", last = "0.1 m/s", count = 3 }', "output",
    ),
}  # fmt: skip


@pytest.fixture
def folder(tmp_path):
    np.savez(tmp_path / "frame.npz", M=np.eye(2), K=STIFFNESS, names=["x1", "x2"])
    return tmp_path


def answered(folder, table, text):
    text, out = f"{HEAD}[{table}]\n{text}\n", folder / "out"
    out.mkdir()
    outcome = run_study(
        parse(text), text, out, None, Resources(threads=1), lambda _: None, lambda _: None,
        inputs=Inputs(folder),
    )  # fmt: skip
    (results,) = (one for one in outcome.files if one.suffix == ".nc")
    return outcome, sl.load(results)


@pytest.mark.parametrize("table", TABLES)
def test_it_is_answered_from_rest_with_the_sensor(folder, table):
    text, variable = TABLES[table]
    outcome, found = answered(folder, table, text)
    assert variable in found.variables
    if variable == "output":
        assert "tip" in found["output"].values.tolist()
    assert any(one.suffix == ".csv" for one in outcome.files)


def test_attractors_are_those_of_python(folder):
    outcome, found = answered(folder, "attractors", TABLES["attractors"][0])
    stiff = sl.structure(
        np.eye(2), STIFFNESS, modes=2, damping_ratio="2 %", frequency="13 Hz",
        sensors={"tip": "x2"}, forces=[sl.Force("x1", "9 N")],
        contacts=[sl.Contact("x2", stiffness="100 kN/m", gap="1 mm")],
    )  # fmt: skip
    again = sl.attractors(stiff, periods=400, progress=False)
    peak = again["attractor_output_peak"].sel(output="tip")
    assert found["attractor_output_peak"].sel(output="tip").values == pytest.approx(peak, rel=1e-9)
    (table,) = (file for file in outcome.files if file.suffix == ".csv")
    with table.open() as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    assert len(rows) == again.sizes["attractor"]


def test_a_box_is_over_sensors(folder):
    box = 'start = "random 6"\nperiods = 1\nbox = { tip = ["-2 mm", "2 mm"] }'
    _, found = answered(folder, "periodic_orbits", box)
    assert found.attrs["starts"] == 6
    (folder / "more").mkdir()
    (folder / "more" / "frame.npz").write_bytes((folder / "frame.npz").read_bytes())
    with pytest.raises(sl.SaltusError, match=r"'tp' is unknown to a frame\. Did you mean 'tip'"):
        answered(folder / "more", "periodic_orbits", box.replace("tip", "tp"))


def test_settled_is_that_of_python(folder):
    _, found = answered(folder, "settled", "periods = 200\nlast = 8")
    pushed = sl.structure(
        np.eye(2), STIFFNESS, modes=2, damping_ratio="2 %", frequency="13 Hz",
        sensors={"tip": "x2"}, forces=[sl.Force("x1", "9 N")],
        contacts=[sl.Contact("x2", stiffness="100 kN/m", gap="1 mm")],
    )  # fmt: skip
    again = sl.settled(sl.simulate(pushed, periods=200, progress=False))
    assert found["response_period"] == again["response_period"]
    assert float(found["tip_peak"]) == pytest.approx(float(again["tip_peak"]), rel=1e-6)


@pytest.mark.parametrize(
    ("table", "text", "said"),
    [
        ("settled", "", r"\[settled\] lacks periods\. Write periods = 400\."),
        ("settled", "periods = 20\nlast = 30", r"\[settled\] compares 30 last periods of 20\."),
        ("stroboscope", "periods = 2\nstart = { q1 = 1 }", "start"),
    ],
)
def test_what_is_refused(folder, table, text, said):
    with pytest.raises(sl.SaltusError, match=said):
        answered(folder, table, text)
