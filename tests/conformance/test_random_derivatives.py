"""Derivatives of random systems through all kinds of contacts, beside differences of their motions.

``python -m oracles.derivative_check COUNT SEED`` runs as many as one likes.
"""

from __future__ import annotations

import pytest

from oracles import derivative_check


@pytest.mark.parametrize(
    ("seed", "which"),
    [("7.24", "Modal"), ("7.20", "Taylor"), ("7.30", "Taylor")],
    ids=[
        "rigid stop by modes",
        "record and static friction",
        "memory, clay and a drive that jumps",
    ],
)
def test_derivatives_are_those_of_differences(seed, which):
    that = derivative_check.case(seed)
    verdict, wrong, judged = derivative_check.judged(that, which)
    assert verdict == "same", (verdict, wrong, that.reproduction(which))
    assert judged > 100


@pytest.mark.parametrize(
    ("of", "seed", "which"),
    [
        ("orbits", "1.0", "Modal"),
        ("orbits", "1.42", "Taylor"),
        ("histories", "1.7", "Taylor"),
        pytest.param("events", "1.57", "Modal", marks=pytest.mark.slow),
    ],
    ids=["a moving wall and kicks", "friction and preload", "a start in sliding", "stops by modes"],
)
def test_derivatives_of_orbits_and_in_fits_are_those_of_differences(of, seed, which):
    that = derivative_check.case(seed)
    verdict, wrong, judged = derivative_check.judged(that, which, of)
    assert verdict == "same", (verdict, wrong, that.reproduction(which))
    assert judged > 5


def test_a_largest_velocity_where_a_drive_jumps_moves_with_the_drive():
    source = (
        "def equation(t, x, v, *, f=1.3, pull=5.0, k=9.0):\n"
        "    return v, pull*sl.square(2*sl.pi*f*t) - k*x\n"
        "system = sl.system(states='x v', forced_at='f')(equation)\n"
    )
    that = derivative_check.Case("a drive that jumps", source, (0.1, 0.0), 1.1, ("f", "pull"))
    assert derivative_check.judged(that, "Taylor")[:2] == ("same", [])


@pytest.mark.nightly
@pytest.mark.parametrize("which", ["Taylor", "Modal"])
def test_a_hundred_systems(which):
    for i in range(100):
        that = derivative_check.case(f"8.{i}")
        verdict, wrong, _ = derivative_check.judged(that, which)
        assert verdict in ("same", "undecidable"), (i, verdict, wrong, that.reproduction(which))
