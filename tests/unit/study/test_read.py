"""Study files: what may stand in them, and what a message says about what may not."""

from __future__ import annotations

import json

import pytest

from saltus.errors import StudyError
from saltus.study.read import parse, read
from saltus.study.spec import Study
from saltus.study.tables.methods import METHODS

HEAD = '[study]\nname = "a study"\n'
WHOLE = HEAD + '[simulate]\nstart = { x = "0 mm" }\nperiods = 3\n'


def refusal(text: str) -> str:
    with pytest.raises(StudyError) as caught:
        parse(text, "my.toml")
    return str(caught.value)


def test_smallest_study():
    study = parse(WHOLE)
    assert study.method is None
    assert study.simulate.start == {"x": "0 mm"}
    assert study.compare is None


def test_values_keep_their_text_and_their_bits():
    study = parse(
        WHOLE + '[system]\nmodel = "delangre"\nforce = "4 N"\ndamping_ratio = '
        '0.03\n[method]\nname = "ODE45"\nrtol = 1e-4\n'
    )
    assert study.system.values == {"force": "4 N", "damping_ratio": 0.03}
    assert study.method == METHODS["ODE45"](name="ODE45", rtol=1e-4, atol=1e-6, events="locate")


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("x = 3\nx = 4", ["line 2", "'x = 4'", "stands in the file already"]),
        ("[a]\n[b]\n[a]", ["line 3", "stands in the file already"]),
        ("force = 4 N  # newton", ["line 1", 'Write force = "4 N".']),
        ("start = {x = 1, x = 2}", ["line 1", "stands in the file already"]),
        ("a = [", ["line 1", "isn't TOML"]),
    ],
)
def test_not_toml(text, parts):
    message = refusal(text)
    assert message.startswith("my.toml, ")
    assert all(part in message for part in parts), message


@pytest.mark.parametrize(
    ("text", "part"),
    [
        (HEAD + "nme = 3", "[study] has no key 'nme'. Did you mean 'name'?"),
        (WHOLE + "sampels = 3", "[simulate] has no key 'sampels'. Did you mean 'samples'?"),
        (HEAD + "[simulat]", "the file has no table 'simulat'. Did you mean 'simulate'?"),
        (
            HEAD,
            "a study asks something: it has a table [simulate], [stroboscope], [settled], "
            "[poincare], [spectrum], [impacts], [energy], [attractors], [sensitivity], [scatter], "
            "[fit], [lyapunov], ",
        ),
        (WHOLE.replace("periods", "# "), "[simulate] give the length once"),
        (WHOLE + 't_end = "2 s"', "[simulate] give the length once"),
        (
            WHOLE.replace("3", "3.0"),
            "[simulate] periods = 3.0 must be a whole number. For example: periods = 60",
        ),
        (WHOLE.replace("3", "true"), "[simulate] periods = true must be a whole number."),
        (WHOLE.replace("3", "0"), "[simulate] periods = 0 must be greater than or equal to 1."),
        (
            WHOLE + "[system]\nforce = true",
            "[system] force = true must be a plain number, or text with a unit",
        ),
        (WHOLE + "[system]\nforce = nan", "[system] force = nan must be a finite number."),
        (
            WHOLE + '[method]\nname = "ode45"',
            "[method] name = \"ode45\" is no method. Did you mean 'ODE45'?",
        ),
        (WHOLE + "[method]\nrtol = 1e-3", "[method] needs 'name'."),
        (
            WHOLE + '[method]\nname = "ODE45"\ntol = 1',
            "[method] has no key 'tol'. Did you mean 'rtol'?",
        ),
        (WHOLE + '[method]\nname = "ODE45"\nrtol = "1"', '[method] rtol = "1" must be a number.'),
        (WHOLE + '[method]\nname = "ODE45"\nevents = "off"', "must be 'locate' or 'ignore'"),
        (
            WHOLE + '[compare]\nexact = "a.csv"',
            "[compare] needs 'printed'. For example: printed = \"table2.csv\"",
        ),
        (
            WHOLE + '[compare]\nprinted = "a.csv"\nreference = { name = "Taylor", ordr = 3 }',
            "Did you mean 'order'?",
        ),
    ],
)
def test_not_a_study(text, part):
    assert part in refusal(text)


def test_every_fault_is_named():
    message = refusal(HEAD + "nme = 3\n[simulate]\nsampels = 3\nkep = 2")
    assert [line.split("]")[0] for line in message.splitlines()[1:]] == [
        "  - [study",
        "  - [simulate",
        "  - [simulate",
    ]


def test_missing_file(tmp_path):
    with pytest.raises(StudyError, match=r"none\.toml can't be read: No such file"):
        read(tmp_path / "none.toml")


def test_not_text(tmp_path):
    (tmp_path / "a.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(StudyError, match="isn't UTF-8 text"):
        read(tmp_path / "a.toml")


def test_schema_tells_editors_the_keys():
    schema = Study.model_json_schema()
    json.dumps(schema)
    assert set(schema["properties"]) == {
        "study", "system", "method", "simulate", "sensitivity", "fit", "scatter", "compare",
        "stroboscope", "settled", "poincare", "spectrum", "impacts", "energy", "lyapunov",
        "frequency_response", "bifurcation_diagram", "equilibria", "periodic_orbits", "branches",
        "bifurcation_curve", "event_sensitivity", "backbone", "basins", "attractors",
    }  # fmt: skip
    assert schema["$defs"]["Simulate"]["additionalProperties"] is False
    assert schema["$defs"]["SystemTable"]["additionalProperties"] != {}, (
        "values are numbers or text"
    )
