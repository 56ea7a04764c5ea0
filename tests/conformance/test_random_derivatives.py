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


@pytest.mark.nightly
@pytest.mark.parametrize("which", ["Taylor", "Modal"])
def test_a_hundred_systems(which):
    for i in range(100):
        that = derivative_check.case(f"8.{i}")
        verdict, wrong, _ = derivative_check.judged(that, which)
        assert verdict in ("same", "undecidable"), (i, verdict, wrong, that.reproduction(which))
