"""Tables written as TOML are read back to the last bit: keys in order, numbers, and the study."""

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

import saltus as sl
from saltus.errors import StudyError
from saltus.study.read import parse
from saltus.study.tables.write import LINE, with_unit, with_units, write
from saltus.units import to_si

ROOT = Path(__file__).parents[3]
STUDIES = sorted([*ROOT.glob("examples/*/study.toml"), *ROOT.glob("replications/*/fig*.toml")])
PLAIN = some.text(some.characters(exclude_categories=("Cc", "Cs", "Cf", "Zl", "Zp")), max_size=60)
NUMBERS = some.floats(allow_nan=False) | some.integers(-(2**63), 2**63 - 1) | some.booleans()
VALUES = some.recursive(
    PLAIN | NUMBERS,
    lambda inner: some.lists(inner, max_size=5) | some.dictionaries(PLAIN, inner, max_size=5),
    max_leaves=20,
)


def in_order(value):
    """A value with the order of its keys, and the kinds and signs of its numbers."""
    if isinstance(value, dict):
        return [(name, in_order(one)) for name, one in value.items()]
    if isinstance(value, list):
        return [in_order(one) for one in value]
    return (type(value), value, isinstance(value, float) and math.copysign(1.0, value))


@settings(max_examples=60, deadline=None)
@given(some.dictionaries(PLAIN, VALUES, max_size=6))
def test_reading_is_the_inverse_of_writing(tables):
    assert in_order(tomllib.loads(write(tables))) == in_order(tables)


@given(some.floats(allow_nan=False, allow_infinity=False), some.data())
def test_a_quantity_keeps_every_bit(value, data):
    unit = data.draw(some.sampled_from(["m", "m/s", "N/m", "Hz", "kg", "N s/m", "N/m^1.5", "1"]))
    written = with_unit(value, unit)
    assert isinstance(written, str) == (unit != "1")
    assert to_si(written, unit, "q") == value


@pytest.mark.parametrize("name", ["delangre", "hertz_stop", "gear_pair"])
def test_the_values_of_a_model_come_back(name):
    system = getattr(sl.models, name)()
    rows = write({"system": with_units(system.values, system.units)})
    read = tomllib.loads(rows)["system"]
    assert {
        name: to_si(value, system.units.get(name, ""), name) for name, value in read.items()
    } == dict(system.values)


@pytest.mark.parametrize("path", STUDIES, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_a_study_stays_the_same_study(path):
    study = parse(path.read_text(encoding="utf-8"))
    text = write(study.model_dump(exclude_unset=True))
    assert parse(text) == study
    assert parse(write(tomllib.loads(path.read_text(encoding="utf-8")))) == study


def test_it_reads_like_one_written_by_hand():
    tables = {
        "study": {"name": "Rig", "source": None},
        "basins": {
            "axes": {"x": {"first": "-5 mm", "last": "5 mm", "count": 400}},
            "map": [{"name": "a", "at": np.array([1.0])}, {"name": "b c"}],
        },
    }
    assert write(tables) == (
        '[study]\nname = "Rig"\n\n'
        '[basins.axes]\nx = { first = "-5 mm", last = "5 mm", count = 400 }\n\n'
        '[[basins.map]]\nname = "a"\nat = [1.0]\n\n[[basins.map]]\nname = "b c"\n'
    )
    long = write({"simulate": {"at": [f"{i} ms" for i in range(200)], "keep": 1}})
    assert max(map(len, long.splitlines())) <= LINE


@pytest.mark.parametrize(
    ("tables", "place"),
    [
        ({"a": {"b": 1j}}, "a.b"),
        ({"a": [print]}, "a"),
        ({"a": "\x1b[31m"}, "a"),
        ({"a": "\ud800"}, "a"),
        ({"a": {3: 1}}, "a"),
    ],
)
def test_what_a_study_cannot_hold_is_refused(tables, place):
    with pytest.raises(StudyError, match=rf"\[{place}\]"):
        write(tables)
