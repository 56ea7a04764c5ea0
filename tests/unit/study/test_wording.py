"""A message on arguments of a Python function is said of keys of a study; what it quotes stays as
it is.
"""

import tomllib

import pytest

from saltus.study.tables.wording import in_toml, toml


@pytest.mark.parametrize(
    ("python", "study"),
    [
        ('give t_end=, such as t_end="10 s".', 'give t_end, such as t_end = "10 s".'),
        ("Write start={'x': 0.0, 'v': 0.0}.", "Write start = { x = 0.0, v = 0.0 }."),
        ('box={"x": ("-1 m", "1 m")}.', 'box = { x = ["-1 m", "1 m"] }.'),
        ("such as f=('2 Hz', '30 Hz', 200).", 'such as f = { first = "2 Hz", last = "30 Hz", count '
                                              '= 200 }.'),
        ('k=("1 N/m", "9 N/m", 5, "log")', 'k = { first = "1 N/m", last = "9 N/m", count = 5, '
                                           'scale = "log" }'),
        ('Use sl.Taylor() or sl.ODE45(..., events="locate").', 'Use name = "Taylor" or name = '
            '"ODE45", events = "locate".'),
        ("sl.system(..., check_units=False) leaves", "[system] check_units = false leaves"),
        ("declare forced_at= in @sl.system.", "declare forced_at in [system]."),
        ("Take sl.poincare, or sl.energy_balance.", "Take [poincare], or [energy]."),
        ("sl.piecewise needs otherwise=: sl.piecewise((k*(x - g), x > g), "
         "otherwise=0)", "piecewise "
            "needs otherwise=: "
         "piecewise((k*(x - g), x > g), otherwise=0)"),
        ("the formula 'a=3 if sl.x>=2' isn't read, and 'b=1' isn't.", "the formula 'a=3 if "
            "sl.x>=2' isn't read, and 'b=1' isn't."),
        ("values={'f': [}", "values={'f': [}"),
        ("x = 3 must be >= 2, T = 0.1 s, 2*pi*f*t", "x = 3 must be >= 2, T = 0.1 s, 2*pi*f*t"),
    ],
)  # fmt: skip
def test_python_becomes_toml(python, study):
    assert in_toml(python) == study
    assert in_toml(study) == study


@pytest.mark.parametrize(
    "value", [[1, 2, 3], {"a b": [1, 2.5, "x\n\"y'"], "c": {"d": True}}, [], -1e-300, ["µ", "°"]]
)
def test_toml_is_read_back(value):
    assert tomllib.loads(f"key = {toml(value)}")["key"] == value
