"""A user names guards by comparisons, written in any way; whatever means none of the boundaries, or
one twice, is refused.
"""

import pytest

from saltus.contact import freeplay
from saltus.errors import TraceError
from saltus.language import max
from saltus.system import System, system


def pair(t, x1, x2, v1, v2, *, k=1e3, gap=5e-4, wall=1e-3):
    between = freeplay(x2 - x1, stiffness=k, gap=gap)
    return v1, v2, between - k * x1, -between - max(k * (x2 - wall), 0)


def named(**guards):
    return system(states="x1 x2 v1 v2", guards=guards)(pair)


def names(of):
    return [guard.name for guard in of.guards]


def test_a_comparison_names_its_boundary_however_it_is_written():
    assert names(named()) == ["x2 - x1 = -gap", "x2 - x1 = gap", "k*(x2 - wall) = 0"]
    ways = named(
        ahead=lambda x1, x2, gap: 2 * gap < (x2 - x1) * 2,
        behind=lambda x1, x2, gap: x1 > x2 + gap,
        stop=lambda x2, wall: x2 >= wall,
    )
    assert names(ways) == ["behind", "ahead", "stop"]
    assert [guard.gap for guard in ways.guards] == [guard.gap for guard in named().guards]
    assert names(named(stop=lambda k, x2, wall: k * (x2 - wall) > 0)) == [
        *names(named())[:2],
        "stop",
    ]


def test_names_stay_with_copies_and_with_the_data():
    one = named(stop=lambda x2, wall: x2 > wall)
    assert names(one.with_values(gap=1e-4)) == names(System.from_dict(one.to_dict())) == names(one)
    assert one.fingerprint() != named().fingerprint()  # results hold the names


def test_a_guard_inside_a_gap_is_named_too():
    def nested(t, x, v, *, gap=1.0):
        return v, -max(abs(x) - gap, 0)

    of = system(
        states="x v", guards={"middle": lambda x: x < 0, "either side": lambda x, gap: abs(x) > gap}
    )(nested)
    assert names(of) == ["middle", "either side"]


@pytest.mark.parametrize(
    ("guards", "told"),
    [
        ({"stop": lambda x2, wall: x2 > 2 * wall}, "means no boundary.*They have: x2 - x1 = -gap"),
        ({"stop": lambda x2, wall: x2 - wall}, "must be one comparison"),
        ({"stop": lambda x1, x2, gap: (x2 - x1 > gap) & (x1 > 0)}, "one comparison.*not several"),
        ({"stop": lambda x2, wal: x2 > wal}, "asks for 'wal'.*Did you mean 'wall'"),
        ({"stop": "x2 > wall"}, "must be a function"),
        ({"x2": lambda x2, wall: x2 > wall}, "name of a state"),
        ({"x1 turns": lambda x2, wall: x2 > wall}, "turning points"),
        ({"x2 - x1 = gap": lambda x2, wall: x2 > wall}, "another boundary"),
        ({"a": lambda x2, wall: x2 > wall, "b": lambda x2, wall: wall > x2}, "both 'a' and 'b'"),
        ({"\x1b[2J": lambda x2, wall: x2 > wall}, "without control characters"),
    ],
)
def test_what_is_no_name_of_a_guard_is_refused(guards, told):
    with pytest.raises(TraceError, match=told):
        named(**guards)


def test_a_mapping_is_asked_for():
    with pytest.raises(TraceError, match="guards must be a mapping"):
        system(states="x v", guards=["stop"])
