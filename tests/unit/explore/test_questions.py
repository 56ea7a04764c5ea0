"""Questions from JSON: what is no question is refused in a sentence that names the field."""

import json
import time

import pytest

from saltus.explore.questions import (
    LONGEST,
    MapQuestion,
    MotionQuestion,
    QuestionError,
    read,
)

MAP = {"ask": "map", "id": 3, "axes": {"x": [-1, "1 mm"], "v": [0, 1]}, "size": [16, 4000]}


def test_a_question_is_read_with_its_defaults():
    asked = read('{"ask": "motion", "id": 1, "start": {"x": "1 mm", "v": 0}, "method": null}')
    assert asked == MotionQuestion(id=1, start={"x": "1 mm", "v": 0.0})
    asked = read(json.dumps(MAP))
    assert isinstance(asked, MapQuestion)
    assert asked.axes == {"x": (-1.0, "1 mm"), "v": (0.0, 1.0)}
    assert asked.size == (16, 4000)


@pytest.mark.parametrize(
    ("change", "field", "words"),
    [
        ({"id": -1}, "id", "whole number"),
        ({"id": True}, "id", "whole number"),
        ({"id": 2**60}, "id", "whole number"),
        ({"size": [10**8, 10**8]}, "size.0", "from 16 to 4000"),
        ({"size": [160]}, "size", "two whole numbers"),
        ({"size": [160, 2.5]}, "size.1", "whole number"),
        ({"axes": {"x": [0, 1]}}, "axes", "two states"),
        ({"axes": {"x": [0, 1], "v": [0, None]}}, "axes.v.1", "a number or text"),
        ({"axes": {"x": [0, 1], "v": [0, 10**400]}}, "axes.v.1", "a finite number"),
        ({"values": [1]}, "values", "an object"),
        ({"values": {"force": {}}}, "values.force", "a number or text"),
        ({"values": {"force": ""}}, "values.force", "a number or text"),
        ({"coarse": 1}, "coarse", "true or false"),
        ({"method": 3}, "method", "text"),
        ({"colour": 3}, "colour", "has no field 'colour'"),
        ({"ask": "maps"}, "ask", "Did you mean 'map'?"),
    ],
)
def test_a_wrong_field_is_named(change, field, words):
    with pytest.raises(QuestionError, match=r"^[^\n]*$") as refused:
        read(json.dumps(MAP | change))
    assert refused.value.field == field
    assert words in str(refused.value)
    assert refused.value.id == (3 if "id" not in change else None)


def test_a_missing_field_is_named():
    with pytest.raises(QuestionError, match="motion needs start"):
        read('{"ask": "motion", "id": 1}')


@pytest.mark.parametrize(
    "text",
    [
        "", "{", "[]", "null", '"motion"', "{}", '{"ask": 3}', '{"ask": ["map"]}',
        '{"ask": "motion", "id": 1, "start": [NaN, 0]}', '{"ask": "motion", "id": Infinity}',
        "[" * 50_000, '{"ask":' * 5000, "1" * 60_000, "\x00", "\ud800",
    ],
)  # fmt: skip
def test_what_is_no_json_is_refused(text):
    with pytest.raises(QuestionError):
        read(text)


def test_a_long_question_is_refused_before_it_is_read():
    begun = time.thread_time()
    with pytest.raises(QuestionError, match=str(LONGEST)):
        read("[" * 10**7)
    assert time.thread_time() - begun < 0.1
