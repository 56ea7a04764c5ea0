"""[system.outputs]: outputs of written and published systems in every answer, in files and
tables.
"""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import saltus as sl
from saltus.errors import SaltusError
from saltus.results import load
from saltus.study.ask import questions_of
from saltus.study.read import parse
from saltus.study.run.running import Resources
from saltus.study.run.study import run_study
from saltus.study.setting.inputs import Inputs

WRITTEN = """
[study]
name = "outputs"
[system]
k = "1 kN/m"
mass = "2 kg"
c = "3 N*s/m"
gap = "1 mm"
stop = "40 kN/m"
force = "5 N"
frequency = "3 Hz"
forced_at = "frequency"
units = { x = "m", v = "m/s" }
[system.rates]
x = "v"
v = "(force*cos(2*pi*frequency*t) - k*x - c*v - contact)/mass"
[system.terms]
contact = "stop*(x - gap) if x > gap else 0"
[system.outputs]
"stop force" = "contact"
accel = { formula = "(force*cos(2*pi*frequency*t) - k*x - c*v - contact)/mass", unit = "m/s^2" }
"""
SIMULATE = """
[simulate]
start = { x = "0 mm", v = "0 m/s" }
periods = 10
"""
OTHERS = """
[spectrum]
start = { x = "0 mm", v = "0 m/s" }
states = ["accel"]
periods = 20
[poincare]
start = { x = "0 mm", v = "0 m/s" }
surface = { "stop force" = "5 N" }
periods = 10
[impacts]
start = { x = "0 mm", v = "0 m/s" }
force = { gap = "stop force" }
periods = 10
[frequency_response]
frequency = ["2 Hz", "4 Hz"]
"""


def run(folder, text, own=None):
    folder.mkdir(exist_ok=True)
    say = lambda _: None  # noqa: E731
    return run_study(
        parse(text), text, folder, own, Resources(threads=1), say, [].append, False,
        inputs=Inputs(folder.parent),
    )  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("outputs") / "out"
    run(folder, WRITTEN + SIMULATE + OTHERS)
    return folder


def test_the_files_hold_the_outputs(folder):
    motion = load(folder / "run.nc")
    assert json.loads(motion.attrs["outputs"]) == ["stop force", "accel"]
    force = np.maximum(40e3 * (motion["x"].values - 1e-3), 0.0)
    np.testing.assert_allclose(motion["stop force"], force, atol=1e-12)
    assert motion["stop force"].attrs["units"] == "N"
    section = load(folder / "poincare-section.nc")
    np.testing.assert_allclose(section["stop force"], 5.0, rtol=1e-10)
    impacts = load(folder / "impact-statistics.nc")
    assert (impacts["contact_impulse"].values[:-1] > 0).all()
    responses = load(folder / "frequency-response.nc")
    assert responses["output"].values.tolist() == ["x", "v", "stop force", "accel"]


def test_the_tables_tell_of_outputs(folder):
    rows = pd.read_csv(folder / "run.csv", comment="#")
    assert "stop force at the end [N]" in rows
    assert "amplitude of accel [m/s^2]" in pd.read_csv(folder / "spectrum.csv", comment="#")
    responses = pd.read_csv(folder / "frequency-response-responses.csv", comment="#")
    assert "stop force peak [N]" in responses


def test_a_published_system_may_have_outputs():
    text = (
        '[study]\nname = "a"\n[system]\nmodel = "delangre"\ncase = "b"\n[system.outputs]\n'
        '"drive" = { formula = "force*cos(2*pi*frequency*t)", unit = "N" }\n' + SIMULATE
    )
    (question,) = questions_of(parse(text), None, Inputs(Path(".")))
    assert question.system.outputs.names == ("drive",)


def test_the_sensors_of_a_structure_are_in_its_study(tmp_path):
    stiffness = 1e3 * np.array([[2, -1], [-1, 1.0]])
    pair = sl.structure(
        np.eye(2), stiffness, modes=2, damping_ratio=0.05, frequency="4 Hz",
        forces=[sl.Force("x1", "2 N")], sensors={"tip": "x2", "tip speed": sl.velocity("x2")},
    )  # fmt: skip
    states = ", ".join(f"{name} = {value}" for name, value in [
        ("q1", '"0 kg^0.5*m"'), ("q2", '"0 kg^0.5*m"'),
        ("q1_rate", '"0 kg^0.5*m/s"'), ("q2_rate", '"0 kg^0.5*m/s"')])  # fmt: skip
    text = (
        f'[study]\nname = "pair"\n[system]\n[simulate]\nstart = {{ {states} }}\nperiods = 3\n'
        f'[poincare]\nstart = {{ {states} }}\nsurface = {{ tip = "0.1 mm" }}\nperiods = 3\n'
    )
    run(tmp_path / "out", text, pair)
    rows = pd.read_csv(tmp_path / "out" / "run.csv", comment="#")
    assert "tip at the end [m]" in rows
    assert not any(name.startswith("q1") for name in rows)
    section = load(tmp_path / "out" / "poincare-section.nc")
    np.testing.assert_allclose(section["tip"], 1e-4, rtol=1e-10)


STRUCTURE = """
[study]
name = "a frame"
[system.structure]
mass = "frame.npz"
modes = 2
[[system.structure.contacts]]
at = "w_2"
stiffness = "5 kN/m"
gap = "1 mm"
[simulate]
t_end = "1 s"
start = { q1 = "1 kg^0.5*m", q2 = "0 kg^0.5*m", q1_rate = "0 kg^0.5*m/s", q2_rate = "0 kg^0.5*m/s" }
[system.structure.sensors]
"""


@pytest.fixture
def frame(tmp_path):
    stiffness = 900.0 * np.array([[2, -1], [-1, 1.0]])
    np.savez(tmp_path / "frame.npz", M=np.eye(2), K=stiffness, names=["w_1", "w_2"])
    return tmp_path, stiffness


def test_a_structure_of_a_study_has_sensors(frame):
    folder, stiffness = frame
    written = {
        "tip": "w_2", "stretch": "w_2 - w_1", "speed": "velocity(w_2)",
        "slip": "velocity( w_2 - w_1 )", "tip acceleration": "acceleration(w_2)",
        "force": "contact_force(stop)",
    }  # fmt: skip
    text = STRUCTURE + "".join(f'"{name}" = "{one}"\n' for name, one in written.items())
    (question,) = questions_of(parse(text), None, Inputs(folder))
    made = sl.structure(
        np.eye(2), stiffness, modes=2, names="w_1 w_2",
        contacts=[sl.Contact("w_2", stiffness="5 kN/m", gap="1 mm")],
        sensors={
            "tip": "w_2", "stretch": ("w_2", "w_1"), "speed": sl.velocity("w_2"),
            "slip": sl.velocity("w_2", "w_1"), "tip acceleration": sl.acceleration("w_2"),
            "force": sl.contact_force("w_2"),
        },
    )  # fmt: skip
    assert question.system.outputs.formulas == made.outputs.formulas
    assert question.system.outputs.units == made.outputs.units


@pytest.mark.parametrize("text", ["speed(w_2)", "w_2 - w_1 - w_2", "contact_force(w_1 - w_2)",
    "w_7", "acceleration(w_7)", "contact_force(wall)"])  # fmt: skip
def test_a_sensor_that_cant_be_read_is_said(frame, text):
    with pytest.raises(SaltusError, match=r"is no sensor|no degree of freedom|no contact at"):
        questions_of(parse(STRUCTURE + f'tip = "{text}"\n'), None, Inputs(frame[0]))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('[system.outputs]\nx = "v"\n' + SIMULATE, "system.outputs.*a state of this name"),
        ('[system.outputs]\na = "y"\n' + SIMULATE, "asks for 'y'"),
        ('[system.outputs]\na = { formula = "x", unit = "N" }\n' + SIMULATE, "is in m"),
        (SIMULATE + '[poincare]\nsurface = { y = "1 mm" }\nperiods = 1\n', "'y' is unknown"),
        (SIMULATE + '[poincare]\nsurface = "accl turns"\nperiods = 1\n', "accel turns"),
        (SIMULATE + '[poincare]\nsurface = { accel = "1 m" }\nperiods = 1\n', "accel"),
        (SIMULATE + '[spectrum]\nstates = ["acel"]\nperiods = 1\n', "Did you mean 'accel'"),
    ],
)
def test_what_a_study_gets_wrong_is_said(text, words):
    own = text.startswith("[system.outputs]")
    before = WRITTEN.partition("[system.outputs]")[0] if own else WRITTEN
    with pytest.raises(SaltusError, match=words):
        questions_of(parse(before + text), None, Inputs(Path(".")))


def test_another_output_is_another_result():
    from saltus.study.identity import identity

    plain = sl.models.delangre("a")
    method = sl.Taylor()
    first = identity(plain, method, {})
    with_output = identity(plain.with_outputs({"a": lambda x: x}), method, {})
    other = identity(plain.with_outputs({"a": lambda x: 2 * x}), method, {})
    assert first != with_output != other
