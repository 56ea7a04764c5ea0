"""Units in studies: what has a dimension shows its unit, and one frequency is never taken for
another.
"""

from __future__ import annotations

import math

import pytest

from saltus import models
from saltus.errors import StudyError
from saltus.study.read import parse
from saltus.study.setting import quantities

RIG = models.delangre("b")


def simulate_table(text: str):
    return parse(f'[study]\nname = "a"\n[simulate]\nperiods = 3\n{text}').simulate


def test_text_becomes_si():
    assert quantities.parameters(
        RIG, {"upper_gap": "0.4 mm", "damping_ratio": 0.03, "frequency": "900 rpm"}
    ) == {
        "upper_gap": 0.4e-3,
        "damping_ratio": 0.03,
        "frequency": 15.0,
    }


def test_angular_frequency_is_converted():
    found = quantities.parameters(RIG, {"frequency": "94.2 rad/s"})["frequency"]
    assert math.isclose(found, 94.2 / (2 * math.pi), rel_tol=1e-15)


def test_bare_number_for_a_dimension_is_refused():
    with pytest.raises(
        StudyError,
        match=r"\[system\] force = 4 has no unit\. Write it with one, "
        r'for example force = "4 N"\.',
    ):
        quantities.parameters(RIG, {"force": 4.0})


def test_wrong_unit_is_refused():
    with pytest.raises(StudyError, match=r"\[system\] force"):
        quantities.parameters(RIG, {"force": "4 mm"})


def test_unknown_parameter_gets_the_nearest():
    with pytest.raises(
        StudyError,
        match=r"\[system\] 'forze' is unknown to delangre\. Did you "
        r"mean 'force'\?",
    ):
        quantities.parameters(RIG, {"forze": "4 N"})


def test_start_of_a_batch():
    table = simulate_table('start = { x = ["1 mm", "2 mm"], v = "0 m/s" }')
    assert quantities.is_batch(table.start, table.values)
    assert quantities.start(RIG, table.start) == {"x": [1e-3, 2e-3], "v": 0.0}


def test_single_start():
    assert not quantities.is_batch(simulate_table('start = { x = "1 mm", v = "0 m/s" }').start)


@pytest.mark.parametrize(
    ("start", "part"),
    [
        ({"x": "0 mm"}, "start lacks v"),
        ({"x": "0 mm", "v": "0 m/s", "y": "0 m"}, "'y' is unknown"),
        ({"x": 0.0, "v": "0 m/s"}, 'for example x = "0 m"'),
        ({"x": ["1 mm", 2.0], "v": "0 m/s"}, "has no unit"),
    ],
)
def test_start_refusals(start, part):
    with pytest.raises(StudyError) as caught:
        quantities.start(RIG, start)
    assert part in str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        'start = { x = ["1 mm", "2 mm"], v = ["0 m/s"] }',
        'start = { x = [], v = "0 m/s" }',
        'start = { x = ["1 mm", "2 mm"], v = "0 m/s" }\nvalues = { frequency = ["15 Hz"] }',
    ],
)
def test_lists_of_different_lengths(text):
    with pytest.raises(StudyError, match="same length"):
        quantities.is_batch(simulate_table(text).start, simulate_table(text).values)


def test_varied_values():
    assert quantities.varied(RIG, {"frequency": ["14 Hz", "900 rpm"]}) == {
        "frequency": [14.0, 15.0]
    }
    with pytest.raises(StudyError, match=r"\[simulate\.values\] 'frequenzy' is unknown"):
        quantities.varied(RIG, {"frequenzy": ["14 Hz"]})
