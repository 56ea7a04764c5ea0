"""Formulas in studies: outputs, energies, surfaces and forces; systems and curves of one's own,
without code.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import saltus as sl
from saltus.errors import SaltusError, StudyError
from saltus.results import load
from saltus.study.ask import questions_of
from saltus.study.read import parse, read
from saltus.study.run.copies import copy_of, inputs_of
from saltus.study.run.running import Resources
from saltus.study.run.study import run_study
from saltus.study.setting.inputs import Inputs
from saltus.study.spec import Study

RIG = """
[study]
name = "written out"
description = "A mass with a stop, driven by a record."
[system]
forced_at = "frequency"
mass = "3 kg"
stiffness = "2 kN/m"
damping = "6 N*s/m"
gap = "0.4 mm"
force = "4 N"
frequency = "5 Hz"
[system.units]
x = "m"
v = "m/s"
[system.terms]
contact = "stop(x - gap) if x > gap else 0"
pull = "force*drive(frequency*t)"
[system.rates]
x = "v"
v = "(pull - stiffness*x - damping*v - contact)/mass"
[system.tables.stop]
file = "stop.csv"
outside = "extend"
[system.tables.drive]
file = "drive.csv"
outside = "periodic"
kind = "spline"
"""
SIMULATE = '[simulate]\nstart = { x = "0 mm", v = "0 m/s" }\nperiods = 6\nsamples = 16\n'
ENERGY = """
[energy]
periods = 4
energy = "(mass*v**2 + stiffness*x**2)/2 + (7e3*(x - gap)**2 if x > gap else 0)"
supplied = "pull*v"
dissipated = "damping*v**2"
"""
RESPONSE = """
[frequency_response]
frequency = ["4 Hz", "5 Hz"]
start = { x = "1 mm", v = "0 m/s" }
periods = 300
[frequency_response.outputs]
"stop force" = "contact"
power = { formula = "damping*v**2", unit = "W" }
"""
SECTION = '[poincare]\nsurface = { formula = "v - 0.01" }\nperiods = 3\n'
IMPACTS = '[impacts]\nperiods = 4\nforce = { gap = "contact" }\n'
PHASE = np.linspace(0, 1, 33)
DRIVE = np.cos(2 * np.pi * PHASE) + 0.5 * np.sin(4 * np.pi * PHASE)
DRIVE[-1] = DRIVE[0]


@sl.system(states="x v", forced_at="frequency", units={"x": "m", "v": "m/s"})
def rig(
    t,
    x,
    v,
    *,
    mass="3 kg",
    stiffness="2 kN/m",
    damping="6 N*s/m",
    gap="0.4 mm",
    force="4 N",
    frequency="5 Hz",
):
    contact = sl.piecewise(
        (sl.table(x - gap, [0.0, 5e-4], [0.0, 7.0], outside="extend", name="stop"), x > gap),
        otherwise=0,
    )
    pull = force * sl.table(frequency * t, PHASE, DRIVE, "spline", outside="periodic", name="drive")
    return v, (pull - stiffness * x - damping * v - contact) / mass


def files(folder):
    folder.mkdir(exist_ok=True)
    (folder / "stop.csv").write_text("# by hand\ndepth [mm],force [kN]\n0,0\n0.5,0.007\n")
    pd.DataFrame({"phase": PHASE, "value": DRIVE}).to_csv(folder / "drive.csv", index=False)
    return folder


def run(folder, text, inputs=None):
    inputs = inputs or Inputs(files(folder.parent / "study"))
    folder.mkdir(exist_ok=True)
    return run_study(
        parse(text),
        text,
        folder,
        None,
        Resources(threads=1),
        lambda _: None,
        [].append,
        False,
        inputs=inputs,
    )


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The folder of a study that asks all that formulas can say."""
    folder = tmp_path_factory.mktemp("formulas") / "out"
    run(folder, RIG + SIMULATE + ENERGY + RESPONSE + SECTION + IMPACTS)
    return folder


def test_a_system_that_is_written_out_is_that_of_python(whole):
    made = questions_of(parse(RIG + SIMULATE), None, Inputs(whole.parent / "study"))[0].system
    assert made.fingerprint() == rig.fingerprint()
    assert made.description == "A mass with a stop, driven by a record."
    ours, theirs = (
        load(whole / "run.nc"),
        sl.simulate(rig, (0, 0), periods=6, samples=16, progress=False),
    )
    np.testing.assert_array_equal(ours.x, theirs.x)
    assert ours.sizes["contact"] > 0


def test_outputs_are_those_of_python(whole):
    ours = load(whole / "frequency-response.nc")
    outputs = {"stop force": lambda x, gap: sl.piecewise((14e3 * (x - gap), x > gap), otherwise=0),
               "power": (lambda v, damping: damping * v**2, "W")}  # fmt: skip
    theirs = sl.frequency_response(
        rig, [4.0, 5.0], start=(1e-3, 0), periods=300, outputs=outputs, progress=False
    )
    assert ours.output.values.tolist() == ["x", "v", "stop force", "power"]
    assert ours.output_units.values.tolist() == ["m", "m/s", "", "W"]
    np.testing.assert_allclose(ours.output_maximum, theirs.output_maximum, rtol=1e-9)
    assert "stop force maximum" in (whole / "frequency-response-responses.csv").read_text()


def test_an_energy_balance_of_a_system_of_ones_own_closes(whole):
    assert float(load(whole / "energy-balance.nc").imbalance) < 1e-12


def test_a_surface_and_a_force_are_formulas(whole):
    section = load(whole / "poincare-section.nc")
    assert section.sizes["crossing"] > 0
    np.testing.assert_allclose(section.v, 0.01, rtol=1e-10)
    impacts = load(whole / "impact-statistics.nc")
    assert float(impacts.impulse_mean.max()) > 0


def test_the_files_of_curves_are_kept_and_changing_one_changes_the_answers(whole, tmp_path):
    text = RIG + SIMULATE
    run(tmp_path / "out", text)
    assert sorted(file.name for file in (tmp_path / "out" / "inputs").iterdir()) == [
        "drive.csv",
        "stop.csv",
    ]
    assert "stop.csv: SHA-256" in (tmp_path / "out" / "run.csv").read_text()
    first = load(tmp_path / "out" / "run.nc")
    study, text = read(copy_of(tmp_path / "out"))
    run_study(
        study,
        text,
        tmp_path / "out",
        None,
        Resources(threads=1),
        lambda _: None,
        [].append,
        False,
        inputs=inputs_of(tmp_path / "out", text),
    )
    (tmp_path / "study" / "stop.csv").write_text("depth [mm],force [kN]\n0,0\n0.5,0.02\n")
    run(tmp_path / "out", text, Inputs(tmp_path / "study"))
    assert not np.array_equal(first.x, load(tmp_path / "out" / "run.nc").x)


def test_a_formula_takes_part_in_the_identity(whole):
    def identity(text):
        return questions_of(parse(text), None, Inputs(whole.parent / "study"))[-1].identity()

    base = RIG + RESPONSE
    assert identity(base) == identity(base)
    for old, new in (('"contact"', '"2*contact"'), ("stop(x - gap) if", "0.5*stop(x - gap) if")):
        assert identity(base) != identity(base.replace(old, new))


def test_guards_have_the_names_that_the_study_gives_them(tmp_path):
    text = (
        RIG
        + '[system.guards]\n"the stop" = "gap < x"\n'
        + SECTION.replace('{ formula = "v - 0.01" }', '"the stop"')
    )
    (question,) = questions_of(parse(text), None, Inputs(files(tmp_path)))
    assert [guard.name for guard in question.system.guards] == ["the stop"]


def test_a_motion_without_a_start_begins_at_rest(tmp_path):
    (question,) = questions_of(
        parse(RIG + "[simulate]\nperiods = 6\n"), None, Inputs(files(tmp_path))
    )
    assert question.arguments["start"] is None, "the analysis begins at rest then"


def test_units_of_rates_are_checked_unless_the_study_says_no(tmp_path):
    text = """
[study]
name = "forgotten"
[system]
mass = "3 kg"
k = "2 N/m"
c = "6 N*s/m"
units = { x = "m", v = "m/s" }
rates = { x = "v", v = "-k*x - c*v/mass" }
[simulate]
t_end = "1 s"
"""
    with pytest.raises(
        StudyError,
        match=r"\[system\] forgotten.*\[system\] check_units = false "
        r"leaves units unchecked",
    ):
        questions_of(parse(text), None, Inputs(files(tmp_path)))
    (question,) = questions_of(
        parse(text.replace("[system]", "[system]\ncheck_units = false")), None, Inputs(tmp_path)
    )
    assert question.system.name == "forgotten"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (RIG.replace("- damping*v", "- dampin*v") + SIMULATE, "[system] 'damping' stands in no "
            "rate. Did you mean 'dampin'?"),
        (RIG.replace('gap = "0.4 mm"\n', "") + SIMULATE, "'gap' is no state, parameter, term or "
                                                         "table"),
        (RIG.replace('force = "4 N"', "force = 4").replace('v = "m/s"',
            'v = "m/s"\nforce = "N"') + SIMULATE, "force = 4 has no unit"),
        (RIG.replace('x = "v"', 'x = "v^2"') + SIMULATE, "a power is written x**2"),
        (RIG.replace("drive(frequency*t)", "drive(2.5*frequency*t)") + SIMULATE, "doesn't repeat "
            "after the forcing period"),
        (RIG.replace('x = "v"', 'x = "mass*v"') + SIMULATE, "[system] written out"),
        (RIG.replace('"stop.csv"', '"../stop.csv"') + SIMULATE, "outside the study's folder"),
        (RIG.replace('"stop.csv"', '"words.csv"') + SIMULATE, "line 3: what stands in the column "
            "'second' is no finite number. Correct the line"),
        (RIG.replace('"stop.csv"', '"down.csv"') + SIMULATE, "[system.tables.stop] down.csv: "
            "points must ascend"),
        (RIG.replace('"stop.csv"', '"bare.csv"') + SIMULATE, "begins with numbers. Its first line "
            "names the columns"),
        (RIG.replace("[system.tables.stop]", "[system.tables.sin]") + SIMULATE, "'sin' can't be "
            "the name of a term or a table"),
        (RIG + '[system.guards]\nstop = "x > 2*gap"\n' + SIMULATE, "[system] written out: the "
            "boundary 'stop' means no boundary"),
        (RIG + '[system.guards]\nstop = "x - gap"\n' + SIMULATE, "the boundary 'stop' must be one "
            "comparison, such as x > gap"),
        ('[study]\nname="b"\n[system]\nmodel="delangre"\nguards.a="x '
         '> 0"\n' + SIMULATE, "guards: this "
            "is for equations of your own"),
        (RIG.replace("[system]", '[system]\nmodel = "chain"') + SIMULATE, "[system] a model and "
            "rates: these are several systems"),
        (RIG + SIMULATE.replace("[simulate]", "[simulate]\nperiod = 3"), "has no key 'period'"),
        (RIG + RESPONSE.replace('"contact"', '"contact + q"'), "[frequency_response.outputs] the "
            "output 'stop force' of written out"),
        (RIG + RESPONSE.replace('unit = "W"', 'unit = "N"'), "[frequency_response.outputs] the "
            "output 'power' is said to be in N"),
        (RIG + RESPONSE.replace('"contact"', "3"), '[frequency_response.outputs.stop force] must '
                                                   'be a formula, such as "k*x"'),
        (RIG + RESPONSE.replace("formula = ", "formla = "), "no key 'formla'. Did you mean "
            "'formula'?"),
        (RIG.replace('x = "v"', 'x = ""') + SIMULATE, "a formula is text of 1 to 1000 characters"),
        (RIG + ENERGY.replace('supplied = "pull*v"\n', ""), '[energy] lacks supplied. Write '
            'supplied = "..."'),
        (RIG + ENERGY.replace("pull*v", "pull*"), "[energy] the formula 'pull*' can't be read"),
        (RIG + ENERGY.replace("pull*v", "pull*w"), "asks for 'w'"),
        (RIG + IMPACTS.replace("gap =", "gab ="), "[impacts.force] 'gab' is no boundary of written "
                                                  "out. Did you mean 'gap'?"),
        (RIG + SECTION.replace("v - 0.01", "__import__('os').system('ls')"), "has no meaning in a "
            "formula"),
        (RIG.replace("contact = ", 'long = "' + "1+" * 600 + '1"\ncontact = ') + SIMULATE,
            "a text of "
            "1201 characters"),
    ],
)  # fmt: skip
def test_faults_are_told_before_anything_is_computed(text, told, tmp_path):
    folder = files(tmp_path)
    (folder / "words.csv").write_text("depth [mm],force [kN]\n0,0\n1,secret\n")
    (folder / "down.csv").write_text("depth [mm],force [kN]\n1,0\n0,1\n")
    (folder / "bare.csv").write_text("0,0\n1,1\n")
    with pytest.raises(SaltusError) as caught:
        questions_of(parse(text), None, Inputs(folder))
    assert told in str(caught.value)
    assert "secret" not in str(caught.value)


def test_the_schema_takes_outputs_as_text_and_as_tables():
    outputs = Study.model_json_schema()["$defs"]["FrequencyResponse"]["properties"]["outputs"][
        "additionalProperties"
    ]
    assert outputs == {"anyOf": [{"type": "string"}, {"$ref": "#/$defs/Output"}]}


def test_formulas_of_a_model_may_use_terms_and_tables(tmp_path):
    text = """
[study]
name = "model"
[system]
model = "delangre"
case = "b"
force = "4 N"
frequency = "15 Hz"
terms = { depth = "max(x - upper_gap, 0)" }
tables = { stop = { file = "stop.csv", outside = "extend" } }
[bifurcation_diagram]
vary = { force = ["3 N", "4 N"] }
start = { x = "1 mm", v = "0 m/s" }
outputs = { "measured force" = "stop(depth)" }
"""
    question = questions_of(parse(text), None, Inputs(files(tmp_path)))[0]
    assert list(question.arguments["outputs"]) == ["measured force"]
    with pytest.raises(StudyError, match="this is for equations of your own"):
        questions_of(
            parse(text.replace("terms =", 'forced_at = "frequency"\nterms =')),
            None,
            Inputs(tmp_path),
        )
