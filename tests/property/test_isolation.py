"""Root isolation against exact rational arithmetic: polynomials with chosen roots, the first
crossing is where it must be.
"""

from __future__ import annotations

import itertools
from fractions import Fraction

from hypothesis import given, settings
from hypothesis import strategies as st

import saltus as sl
from conformance.systems import contacts, quartic

SIXTEENTHS = st.integers(1, 31).map(lambda n: Fraction(n, 16))


def _start(roots, lead):
    """Start of `quartic` and its snap for lead * prod(t - root), exact in doubles for
    these roots.
    """
    c = [Fraction(lead)]
    for root in roots:
        c = [a - root * b for a, b in zip([*c, 0], [0, *c], strict=True)]
    c = [0] * (5 - len(c)) + c  # highest power first
    return [float(c[4]), float(c[3]), float(2 * c[2]), float(6 * c[1])], float(24 * c[0])


@settings(max_examples=100)
@given(
    roots=st.lists(SIXTEENTHS, min_size=1, max_size=4, unique=True),
    outside=st.sampled_from([(), (-1,), (3,), (-2, 5)]),
    lead=st.sampled_from([1, -1, 64, Fraction(-1, 1024)]),
    end=st.sampled_from([1.03, 1.55, 2.0, 2.125]),
)
def test_simple_roots(roots, outside, lead, end):
    """One to four different roots at sixteenths: exactly these crossings, their directions
    alternate, whatever the length of the step.
    """
    chosen = [*roots, *outside[: 4 - len(roots)]]
    start, snap = _start(chosen, lead)
    run = sl.simulate(quartic, start, t_end=end, samples=1, values={"snap": snap})
    inside = sorted(float(root) for root in chosen if 0 < root < end)
    found = contacts(run)
    assert [round(c.time, 9) for c in found] == inside
    assert all(a.direction == -b.direction for a, b in itertools.pairwise(found))
    assert int(run.mode_violations) == 0
    assert str(run.status.values) == "ok"


@settings(max_examples=80)
@given(
    double=SIXTEENTHS,
    others=st.lists(SIXTEENTHS, max_size=2, unique=True),
    lead=st.sampled_from([1, -1]),
    end=st.sampled_from([2.0, 1.7]),
)
def test_a_double_root_is_on_record(double, others, lead, end):
    """A touch among crossings: the crossings are all there; the touch is an exact graze, or the
    status says that it is undecided.
    """
    if double in others or double >= end:
        return
    start, snap = _start([double, double, *others], lead)
    run = sl.simulate(quartic, start, t_end=end, samples=1, values={"snap": snap})
    near = [c for c in contacts(run) if abs(c.time - float(double)) < 1e-5]
    far = [c.time for c in contacts(run) if abs(c.time - float(double)) >= 1e-5]
    assert [round(time, 9) for time in far] == sorted(float(r) for r in others if r < end)
    assert near
    assert [c.kind for c in near] == ["graze"] or str(run.status.values) == "graze_unresolved"
    assert int(run.mode_violations) == 0
