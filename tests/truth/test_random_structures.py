"""Random structures with springs, dampers, preloads and drives of all kinds, moved by modes,
against exponentials of their physical matrices.
"""

from __future__ import annotations

from itertools import takewhile

import numpy as np
import pytest

import saltus as sl
from oracles.structures_by_exponentials import Exponentials, random_structure
from saltus.flow.maps import Stroboscope
from saltus.system.linearity import linear_pieces

SEED = 20261134
#: Contacts of a structure that are compared at most.
MOST = 100
#: Growth of a small difference up to which they are.
GROWN = 1e4
#: The exponentials' own rounding, of thousands of steps; it grows as small differences do. The time
#: of a slow contact is off by that over its speed. In the two of 400 structures that were off by
#: more than 1e-12, Taylor and Modal agreed ten times better.
ROUNDING = 1e-11


def check(seed, method=None):
    """Compare a random structure; return how many contacts agreed."""
    made, given, period, t_end = random_structure(np.random.default_rng(seed))
    method, rest = method or sl.Modal(), np.zeros(len(made.states))
    exact = Exponentials(given)
    found, end, whole = exact.run(rest, t_end, MOST)
    run = sl.simulate(made, t_end=t_end, progress=False, time_errors="local", method=method)
    assert str(run.status.values) == "ok"
    times, names, ways = (run[f"contact_{one}"].values for one in ("time", "guard", "direction"))
    same = list(takewhile(lambda one: one[3] < GROWN, found))
    assert len(times) >= len(same)
    speeds, grown = np.abs(run.contact_velocity.values), 1.0
    gaps = linear_pieces(made).gaps(dict(made.values)).matrix
    rows = {guard.name: row for guard, row in zip(made.guards, gaps, strict=True)}
    for at, (time, stop, begins, growth) in enumerate(same):
        grown = max(grown, growth, speeds.max() / speeds[at])
        assert abs(times[at] - time) < ROUNDING * grown * period, (seed, at)
        of = given.stops[stop]
        # the gap of a single mode may be that of its coordinate, upside down
        turned = np.sign(rows[str(names[at])][: len(of.row)] @ of.row)
        assert (names[at], ways[at] * turned) == (of.name, of.side if begins else -of.side)
    if len(same) == len(found) < MOST and np.abs(whole).max() < GROWN:
        assert len(times) == len(found)
        ended = np.array([run[f"end_{name}"].item() for name in made.states])
        grown = max(grown, np.abs(whole).max())
        assert np.abs(ended - end).max() < ROUNDING * grown * np.abs(end).max()
    if made.forced_at is not None:
        found, end, whole = exact.run(rest, period, MOST)
        if len(found) < MOST and max(one[3] for one in [*found, (0, 0, 0, 0)]) < GROWN:
            ended, tangent = Stroboscope(made, method).tangent(rest[None], 1)
            assert np.abs(ended[0] - end).max() < 1e-9 * np.abs(end).max()
            assert np.abs(tangent[0] - whole).max() < 1e-8 * np.abs(whole).max()
    return len(same)


def test_contacts_ends_and_derivatives_are_those_of_matrix_exponentials():
    assert sum(check(seed) for seed in range(SEED, SEED + 9)) > 300


@pytest.mark.nightly
def test_so_are_those_of_hundreds_of_structures():
    assert sum(check(seed) for seed in range(SEED + 9, SEED + 400)) > 5000
