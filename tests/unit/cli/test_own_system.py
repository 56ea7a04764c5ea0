"""A system of one's own from a Python file: found, or a message that says what to do."""

from __future__ import annotations

import pytest

from saltus.cli.own_system import own_system
from saltus.errors import ParameterError

RIG = """
from saltus.system import system

@system(states="x v", forced_at=None)
def {name}(t, x, v, *, stiffness=4.0):
    return v, -stiffness*x
"""


@pytest.fixture
def file(tmp_path):
    def write(text: str):
        path = tmp_path / "my_rig.py"
        path.write_text(text)
        return path

    return write


def test_by_name_and_alone(file):
    path = file(RIG.format(name="rig"))
    assert own_system(f"{path}:rig").states == ("x", "v")
    assert own_system(str(path)).values == {"stiffness": 4.0}


def test_it_may_import_its_neighbours(file, tmp_path):
    (tmp_path / "my_constants.py").write_text("SPRING = 9.0\n")
    path = file(
        "from my_constants import SPRING\n" + RIG.format(name="rig").replace("4.0", "SPRING")
    )
    assert own_system(f"{path}:rig").values == {"stiffness": 9.0}


@pytest.mark.parametrize(
    ("text", "name", "part"),
    [
        (RIG.format(name="rig"), ":rigg", "Did you mean 'rig'?"),
        ("x = 1", ":rig", "holds no system"),
        (RIG.format(name="one") + RIG.format(name="two"), "", "Say which"),
        ("x = 1\ny = 1/0", ":rig", "line 2: ZeroDivisionError"),
        ("x = (", ":rig", "line 1: SyntaxError"),
        (RIG.format(name="rig").replace("-stiffness*x", "-x if x > 0 else x"), ":rig", "piecewise"),
    ],
)
def test_refusals(file, text, name, part):
    with pytest.raises(ParameterError) as caught:
        own_system(f"{file(text)}{name}")
    assert part in str(caught.value), str(caught.value)


def test_missing_file():
    with pytest.raises(ParameterError, match="there is no Python file"):
        own_system("nowhere.py:rig")
