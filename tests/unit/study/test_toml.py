"""Study files write values as TOML, and arguments of Python functions as keys."""

import tomllib

import pytest

from saltus.errors import ParameterError, StudyError
from saltus.sentences import PYTHON, Given, Word, said
from saltus.study.spec import QUESTIONS
from saltus.study.tables.toml import FILE, fault, toml


@pytest.mark.parametrize(
    ("text", "python", "file"),
    [
        (lambda say: f"give {say.key('t_end')}", "give t_end=", "give t_end"),
        (lambda say: say.key(t_end="10 s"), 't_end="10 s"', 't_end = "10 s"'),
        (lambda say: say.key(start={"x": 0.0}), 'start={"x": 0.0}', "start = { x = 0.0 }"),
        (lambda say: say.key(box={"x": ("-1 m", "1 m")}), 'box={"x": ("-1 m", "1 m")}',
         'box = { x = ["-1 m", "1 m"] }'),
        (lambda say: say.key(f=("2 Hz", "30 Hz", 200)), 'f=("2 Hz", "30 Hz", 200)',
         'f = { first = "2 Hz", last = "30 Hz", count = 200 }'),
        (lambda say: say.key(k=("1 N/m", "9 N/m", 5, "log")), 'k=("1 N/m", "9 N/m", 5, "log")',
         'k = { first = "1 N/m", last = "9 N/m", count = 5, scale = "log" }'),
        (lambda say: say.key(vary={"k": (Word("low"), Word("high"))}), 'vary={"k": (low, high)}',
         "vary = { k = [low, high] }"),
        (lambda say: say.key(start=Given("box")), "start='box'", 'start = "box"'),
        (lambda say: say.method("Taylor"), "sl.Taylor()", 'name = "Taylor"'),
        (lambda say: say.method("ODE45", events="locate"), 'sl.ODE45(..., events="locate")',
         'name = "ODE45", events = "locate"'),
        (lambda say: say.system(), "@sl.system", "[system]"),
        (lambda say: say.system(check_units=False), "sl.system(..., check_units=False)",
         "[system] check_units = false"),
        (lambda say: say.verb("poincare", "system, start"), "sl.poincare(system, start)",
         "[poincare]"),
        (lambda say: say.verb("energy_balance"), "sl.energy_balance", "[energy]"),
        (lambda say: say.verb("attractors"), "sl.attractors", "[attractors]"),
        (lambda say: f"{say.sl}piecewise((k, x > g), otherwise=0)",
         "sl.piecewise((k, x > g), otherwise=0)", "piecewise((k, x > g), otherwise=0)"),
        ("values={'f': [}", "values={'f': [}", "values={'f': [}"),
    ],
)  # fmt: skip
def test_a_sentence_is_said_of_python_and_of_a_file(text, python, file):
    assert QUESTIONS
    assert (said(text, PYTHON), said(text, FILE)) == (python, file)


def test_a_fault_names_its_table_once():
    error = ParameterError("give ", lambda say: say.key("t_end"))
    inner = fault("simulate", ParameterError("trajectory 3: ", error))
    assert str(inner) == "[simulate] trajectory 3: give t_end"
    assert fault("study", inner) is inner
    assert isinstance(inner, StudyError)


@pytest.mark.parametrize(
    "value", [[1, 2, 3], {"a b": [1, 2.5, "x\n\"y'"], "c": {"d": True}}, [], -1e-300, ["µ", "°"]]
)
def test_toml_is_read_back(value):
    assert tomllib.loads(f"key = {toml(value)}")["key"] == value
