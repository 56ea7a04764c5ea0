"""A branch is a sequence of pieces: joined in one place, with events of one class."""

import ast
from pathlib import Path

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.branches.arclength import Arc, both_sides

ROOM = Path(sl.__file__).parent / "analysis" / "branches"


def arc(end, *places):
    """A curve of one unknown."""
    points = [np.array([place]) for place in places]
    steps = [abs(place - places[0]) for place in places]
    return Arc(points, [np.array([1.0])] * len(points), list(points), steps, end)


def test_two_ways_are_one_curve_through_their_start():
    (ahead, back), ends = both_sides([arc("range", 0.0, 1.0, 2.0), arc("lost", 0.0, -1.0)])
    whole = ahead.behind(back)
    assert ends == ("lost", "range")
    assert np.ravel(whole.z).tolist() == [-1.0, 0.0, 1.0, 2.0]
    assert whole.length == [-1.0, 0.0, 1.0, 2.0]


@pytest.mark.parametrize("closed", [0, 1])
def test_a_way_that_closes_is_all_of_the_curve(closed):
    ways = [arc("stopped", 0.0, 1.0), arc("stopped", 0.0, -1.0)]
    ways[closed].end = "closed"
    assert both_sides(ways) == ([ways[closed]], ("closed", "closed"))


def test_one_way_begins_on_another_branch():
    way = arc("points", 0.0, 1.0)
    assert both_sides([way]) == ([way], ("branch", "points"))


def test_an_orbit_with_impacts_stands_once_wherever_its_branch_was_begun():
    """The closed form of its graze lies at the force 0.1; behind it the contact sequence is another
    piece.
    """
    stop = sl.models.impact_oscillator(frequency="1 rad/s")
    for start in ((0.0, 0.0), (0.9, 0.5)):
        found = sl.branches(stop, {"force": (0.05, 0.3)}, start, at=2, progress=False)
        assert found.sizes["branch"] == 1
        columns = [found.point_force, found.point_x[:, 0], found.point_v[:, 0]]
        step = np.abs(np.diff(np.stack(columns, axis=1), axis=0)).max(axis=1)
        assert step.min() > 1e-7
        assert (np.diff(found.point_arclength) >= 0).all()
        graze = int(np.flatnonzero(found.event_kind.values == "graze")[0])
        behind = int(found.event_point[graze])
        contacts = found.point_contacts.values
        assert sorted(contacts[behind : behind + 2]) == [0, 1]


def classes():
    """Classes of the room."""
    for file in ROOM.glob("*.py"):
        for node in ast.parse(file.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef):
                yield node.name, file


def test_there_is_one_class_of_events():
    assert [name for name, _ in classes() if name.endswith("Event")] == ["Event"]


def test_no_class_of_branch_narrows_what_it_inherits():
    assert not [
        file.name
        for file in ROOM.glob("*.py")
        if "type: ignore[assignment]" in file.read_text(encoding="utf-8")
    ]
