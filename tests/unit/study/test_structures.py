"""[system.structure]: what a study file writes is what Python writes."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
import scipy.io

import saltus as sl
from saltus.errors import StudyError
from saltus.flow.methods import default_method
from saltus.study.ask import ask
from saltus.study.read import parse
from saltus.study.setting.inputs import Inputs
from saltus.study.setting.setting import setting_of

M, K = np.diag([1.0, 2.0, 3.0]), 900.0 * (2 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1))
NAMES = ["w_1", "w_2", "u_1"]
TIMES, VALUES = np.linspace(0, 1, 5), np.array([0.0, 2.0, -1.0, 3.0, 0.0])
HEAD = """
[study]
name = "a frame"

[simulate]
t_end = "1 s"
"""


@pytest.fixture
def folder(tmp_path):
    np.savez(tmp_path / "frame.npz", M=M, K=K, names=NAMES)
    scipy.io.mmwrite(tmp_path / "M.mtx", M)
    scipy.io.mmwrite(tmp_path / "K.mtx", K)
    np.savetxt(tmp_path / "quake.csv", np.column_stack([TIMES, VALUES]), delimiter=",",
        header="time [s],acceleration [m/s^2]", comments="")  # fmt: skip
    return tmp_path


def system_in(folder, text):
    return setting_of(parse(HEAD + text), None, Inputs(folder)).base


def test_it_is_the_structure_that_python_makes(folder):
    written = system_in(
        folder,
        """
[system]
stop_gap = "2 mm"
structure.mass = "frame.npz"
structure.modes = 2
structure.damping_ratio = ["1 %", "2 %"]
structure.frequency = "3 Hz"
structure.base = { direction = "w", amplitude = "2*quake(t)" }
tables.quake = { file = "quake.csv", kind = "spline" }

[[system.structure.forces]]
at = "u_1"
amplitude = "3 N"
phase = "90 deg"
harmonic = 2

[[system.structure.contacts]]
at = "w_2"
to = "u_1"
stiffness = "5 kN/m"
gap = "1 mm"
side = "both"
damping = "2 N*s/m"

[[system.structure.contacts]]
name = "wall"
at = "w_1"
gap = "3 mm"
restitution = 0
friction = 0.3
sliding = "u_1"
""",
    )
    record = sl.recorded(TIMES, VALUES, name="quake")
    made = sl.structure(
        M, K, names=NAMES, modes=2, damping_ratio=[0.01, 0.02], frequency="3 Hz", name="a frame",
        base=sl.Base("w", lambda t: 2 * record(t)),
        forces=[sl.Force("u_1", "3 N", "90 deg", 2)],
        contacts=[
            sl.Contact("w_2", "5 kN/m", "2 mm", "u_1", "both", "2 N*s/m"),
            sl.Contact("w_1", gap="3 mm", restitution=0, friction=0.3, sliding="u_1", name="wall"),
        ],
    )  # fmt: skip
    assert written.fingerprint() == made.fingerprint()
    assert dict(written.values) == dict(made.values)
    assert dict(written.units) == dict(made.units)
    assert [one.name for one in written.guards] == [one.name for one in made.guards]
    assert written.description == made.description


def test_the_method_that_serves_it_moves_it(folder):
    size = 4
    chain = 900.0 * (2 * np.eye(size) - np.eye(size, k=1) - np.eye(size, k=-1))
    np.savez(folder / "chain.npz", M=np.eye(size), K=chain, names=["w_1", "w_2", "w_3", "w_4"])
    modes = """
[system.structure]
mass = "chain.npz"
modes = 4
damping_ratio = "1 %"
base = { direction = "w", amplitude = "2*quake(t)" }

[system.tables]
quake = { file = "quake.csv", kind = "spline" }
"""
    setting = setting_of(parse(HEAD + modes), None, Inputs(folder))
    assert setting.method(None, "method") == default_method(setting.base) == sl.Modal()
    named = parse(HEAD + modes + '[method]\nname = "ODE45"\n')
    assert setting_of(named, None, Inputs(folder)).method(None, "method") == sl.ODE45()


def test_one_file_a_matrix(folder):
    written = system_in(
        folder,
        """
[system.structure]
mass = "M.mtx"
stiffness = "K.mtx"
frequency = "2 Hz"
contacts = { at = "x3", stiffness = "1 kN/m", gap = "1 mm" }
forces = { at = "x1", amplitude = "4*square(2*pi*frequency*t)" }
""",
    )
    made = sl.structure(
        M, K, frequency="2 Hz", contacts=[sl.Contact("x3", "1 kN/m", "1 mm")],
        forces=[sl.Force("x1", lambda t, frequency: 4 * sl.square(2 * sl.pi * frequency * t))],
    )  # fmt: skip
    assert written.fingerprint() == made.fingerprint()
    assert written.forced_at == "frequency"


def test_a_sweep(folder):
    written = system_in(
        folder,
        '[system]\nstructure = { mass = "frame.npz", base = { direction = [1, 1, 0], amplitude = '
        '"3*sweep(t, 2, 9, 4)" } }',
    )
    made = sl.structure(M, K, names=NAMES,
        base=sl.Base([1, 1, 0], lambda t: 3 * sl.sweep(2, 9, "4 Hz/s")(t)))  # fmt: skip
    for t in (0.3, 1.7, 3.0):
        assert np.allclose(written.rhs(t, np.zeros(6)), made.rhs(t, np.zeros(6)), atol=1e-12)


CONTACT = 'contacts = {{ at = "w_2", {} }}\n'
CROSSED = """
[[system.structure.contacts]]
at = "w_2"
gap = "-2 mm"
restitution = 0

[[system.structure.contacts]]
at = "w_2"
gap = "1 mm"
restitution = 0
side = "lower"
"""


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ('mass = "gone.npz"', "gone.npz can't be read"),
        ('mass = "../frame.npz"', "outside the study's folder"),
        ('mass = "quake.csv"', "no file of matrices"),
        ("modes = 2", "mass"),
        ('mass = "frame.npz"\nmodez = 2', "modes"),
        ('mass = "frame.npz"\nmodes = 5', "at most 3"),
        (CONTACT.format('stiffness = 5, gap = "1 mm"'), r"stiffness = 5 has no unit.*5 N/m"),
        (CONTACT.format('stiffness = "5 N/m", gap = 1'), "gap = 1 has no unit"),
        (CONTACT.format('stiffness = "5 N/m"'), "needs gap"),
        (CONTACT.format('stiffness = "5 N/m", gap = "1 N"'), "wrong unit"),
        (CONTACT.format('stiffness = "5 N/m", gap = "1 mm", rebound = 1'), "rebound"),
        (CONTACT.format('gap = "1 mm"'), "Give one of the two"),
        (CONTACT.format('gap = "1 mm", restitution = 2'), r"outside \[0, 1\]"),
        ('forces = { at = "w_9", amplitude = "2 N" }', "w_9"),
        ('forces = { at = "w_2", amplitude = 2 }', "amplitude = 2 has no unit"),
        ('forces = { at = "w_2", amplitude = "2 N" }', "give frequency"),
        ('forces = { at = "w_2", amplitude = "2 N" }\nfrequency = 2', "frequency = 2 has no unit"),
        ('base = { direction = "w", amplitude = "quke(t)" }', "quke"),
        ('base = { direction = "w", amplitude = "quake(w_1)" }', "the time t, frequency"),
        ('base = { direction = "z", amplitude = "t" }', "names no degree of freedom"),
        ("damping_ratio = [0.01, 0.02]", "one number or 3 of them"),
        ('sensors = { a = "w_1 - w_1" }', "'a' is the difference of 'w_1' and itself"),
        (CROSSED, "overlap by 1 mm: nothing fits between"),
    ],
)
def test_refusals(keys, message, folder):
    first = "" if keys.startswith(("mass", "modes")) else 'mass = "frame.npz"\n'
    with pytest.raises(StudyError, match=message):
        system_in(folder, f"[system.structure]\n{first}{keys}\n[system.tables]\n"
            'quake = { file = "quake.csv" }\n')  # fmt: skip


def test_it_is_the_only_system(folder):
    text = '[system]\nmodel = "delangre"\nstructure.mass = "frame.npz"\n'
    with pytest.raises(StudyError, match="a model and structure: these are several systems"):
        system_in(folder, text)


def test_the_command_line_doubts_in_sentences(folder):
    """Without the place in the code, which no author of a study knows."""
    np.savez(folder / "swapped.npz", M=K, K=1e-3 * M, names=NAMES)
    text = '[system.structure]\nmass = "swapped.npz"\n'
    (folder / "study.toml").write_text(HEAD.replace("1 s", "1 ms") + text)
    out = subprocess.run(
        [sys.executable, "-m", "saltus", "run", folder / "study.toml", "--out", folder / "found"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    doubts = [line for line in out.stderr.splitlines() if "natural frequency" in line]
    assert len(doubts) == 1
    assert doubts[0].startswith("saltus: the highest natural frequency of this structure is")
    assert "Warning" not in out.stderr


def test_a_surface_of_a_formula_is_told_as_it_was_written(folder):
    text = """
[poincare]
t_end = "1 s"
surface = { formula = "tip - 0.001" }
start = { tip = "2 mm" }

[system.structure]
mass = "frame.npz"
modes = 2
sensors = { tip = "w_2" }
"""
    (answer,) = ask(HEAD.split("[simulate]")[0] + text, inputs=Inputs(folder))
    assert answer.dataset.attrs["surface"] == "tip - 0.001 = 0"


@pytest.mark.parametrize(
    ("key", "said"),
    [
        ("power = 9\n", r"\[system\.structure\.contacts 1\] power = 9 must be"),
        ('preload = "3 m"\n', r"^\[system\.structure\.contacts\] preload = '3 m' has the "),
    ],
)
def test_a_wrong_quantity_of_a_part_is_called_by_its_key(folder, key, said):
    text = f"""
[system]
structure.mass = "frame.npz"
structure.modes = 2
[[system.structure.contacts]]
at = "w_2"
stiffness = "5 kN/m"
gap = "1 mm"
{key}"""
    with pytest.raises(StudyError, match=said) as caught:
        system_in(folder, text)
    assert "_stiffness" not in str(caught.value)


def test_a_drive_that_holds_an_unknown_name_lists_no_tables_where_there_are_none(folder):
    text = """
[system]
structure.mass = "frame.npz"
structure.modes = 2
structure.forces = { at = "u_1", amplitude = "9*cos(w*t)" }
"""
    with pytest.raises(StudyError, match=r"terms and tables only\.$"):
        system_in(folder, text)
