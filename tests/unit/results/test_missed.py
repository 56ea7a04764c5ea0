"""What few starts may have missed is said where a result says what it found."""

import re

import numpy as np

import saltus as sl
from saltus.analysis.solve.tolerances import LONGEST


@sl.system(states="x v")
def wells(t, x, v, *, damping=0.25):
    """Two wells, at -1 and 1."""
    return v, -damping * v + x - x**3


def test_starts_say_how_small_a_basin_they_may_have_missed():
    start = np.random.default_rng(0).uniform(-2, 2, (64, 2))
    found = sl.attractors(wells, start)
    assert found.attrs["smallest_basin_seen"] == 3 / 64
    said = r"missed   64 starts: other attractors with a basin below 4\.7 % of where they lie may"
    assert re.search(said, sl.describe(found))
    assert "1 start: other attractors may be missed" in sl.describe(sl.attractors(wells, (1.5, 0)))


def test_maps_and_shares_say_it_too(few_scouts):
    found = sl.basins(wells, x=(-2, 2, 10), v=(-1, 1, 10))
    shares = sl.basin_fractions(wells, x=(-2, 2), v=(-1, 1), samples=100)
    for one in (found, shares):
        assert "missed   100 starts: other attractors with a basin below 3 %" in sl.describe(one)


def test_responses_say_it_of_each_value():
    duffing = sl.models.delangre("a", force="4 N")
    found = sl.frequency_response(duffing, ["30 Hz"], [(0.0, 0.0), (1e-4, 0.0)])
    assert "2 starts at each: other attractors may be missed" in sl.describe(found)


@sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
def turned(t, x, v, *, w=1.0, rate=1 / 101):
    """Turns by 1/101 of a circle in each forcing period: every orbit has 101 of them, but for a
    damping that no run of this length sees.
    """
    return rate * w * v, -rate * w * x - 1e-12 * w * v


def test_one_sentence_says_that_longer_orbits_have_no_type():
    sentence = f"An orbit is recognised up to {LONGEST} periods, which no argument raises"
    found = sl.attractors(turned, [(1.0, 0.0)], periods=200)
    assert found.basin.values.tolist() == [-2]
    assert sentence in sl.describe(found)
    assert sentence not in sl.describe(sl.attractors(wells, (1.5, 0.0)))
