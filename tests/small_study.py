"""A study of basins small enough for tests: the rig at 16 Hz, four attractors; cut to any size."""

from pathlib import Path

from saltus.study.answers.basins import BasinMap
from saltus.study.ask import questions_of
from saltus.study.setting.inputs import Inputs
from saltus.study.spec import Study


def maps_of(study: Study) -> list[BasinMap]:
    """The maps that a study asks for."""
    return [one for one in questions_of(study, None, Inputs(Path())) if isinstance(one, BasinMap)]


def small_study(first: int, second: int | None = None) -> str:
    """Its text, with so many starts along x and v."""
    return f"""
[study]
name = "small"
[system]
model = "delangre"
case = "b"
force = "4 N"
frequency = "16 Hz"
[basins]
axes.x = {{ first = "-5 mm", last = "5 mm", count = {first} }}
axes.v = {{ first = "-1 m/s", last = "1 m/s", count = {second or first} }}
"""
